"""The player as a ROS 2 node: what was seen becomes a world state, and that an action."""

from functools import partial
from typing import Any

from geometry_msgs.msg import PointStamped, PolygonStamped, PoseArray, PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Bool, String

from nao_soccer.player import Player
from nao_soccer.ros import behavior_part
from nao_soccer.ros import player_messages as convert
from nao_soccer.ros.behavior_part import BehaviorPart
from nao_soccer.vision.settings import settings_of_scene
from nao_soccer.world.settings import WorldSettings
from nao_soccer.world.state import WorldState
from robot_core.errors import NaoGaitError, is_number
from robot_core.field import Goals
from robot_core.head_goals import Follow, Goal, LookAt, Search
from robot_core.robot import load_robot
from robot_core.ros.messages import BASE_FOOTPRINT, stamp_in, to_time
from robot_core.ros.parameters import (
    declare,
    load_parameter_file,
    node_parameter,
    of_type,
    warn_of_unknown_overrides,
)
from robot_core.ros.topics import LATCHED, Inputs
from robot_core.types import DOWN, GETTING_UP, Pose2, state_of

URDF = node_parameter("urdf", "nao_h21_v33", "robot model: a shipped name or a URDF file")
SCENE = node_parameter("scene", "pitch", "field and goals: a shipped scene or a YAML file")
START = node_parameter(
    "start", "", "pose at the start in the field of the own team, as x y yaw; empty = not known"
)
SEED = node_parameter("seed", 0, "seed of the particles", "", 0, 2**31 - 1)
NODE_PARAMETERS = (URDF, SCENE, START, SEED, *behavior_part.NODE_PARAMETERS)

REPORT_PERIOD = 100_000_000
"""[ns] between two messages with pose and ball."""
SEARCH_PERIOD = 1_000_000_000
"""[ns] after which the head is told again to search: the gait may have been started again."""


class PlayerNode(Node):
    """World model and behaviour of one robot."""

    def __init__(self) -> None:
        super().__init__("player", automatically_declare_parameters_from_overrides=True)
        robot = load_parameter_file(self, URDF, load_robot)
        settings = load_parameter_file(self, SCENE, settings_of_scene)
        start = load_parameter_file(self, START, _pose)
        seed = of_type(declare(self, SEED), int)
        goals = settings.goals or Goals()
        self._radius = settings.ball_radius
        self._player = Player(
            WorldSettings(
                field=settings.field, goals=settings.goals, poles=settings.poles, seed=seed
            ),
            start,
        )
        self._inputs = Inputs(self, burst=1)
        self._behavior = BehaviorPart(self, self._inputs, robot, settings.field, goals)
        self._images = convert.PerceptBuffer()
        self._reported = 0
        self._head: type[Goal] | None = None
        self._searched = 0
        self._make_publishers()
        self._make_subscriptions()
        warn_of_unknown_overrides(self, (p.name for p in NODE_PARAMETERS))
        me = self._behavior.behavior.identity
        self.get_logger().info(f"{robot.name}, player {me.player} of team {me.team}")

    def destroy_node(self) -> None:
        """Close the sockets too."""
        self._behavior.close()
        super().destroy_node()

    def _make_publishers(self) -> None:
        make = self.create_publisher
        self._pose = make(PoseWithCovarianceStamped, "pose", 10)
        self._valid = make(Bool, "pose_valid", 10)
        self._particles = make(PoseArray, "particles", 2)
        self._ball = make(Odometry, "ball", 10)
        self._look_at = make(PointStamped, "gait/look_at", 10)
        self._follow = make(PointStamped, "gait/follow", 10)
        self._head_mode = make(String, "gait/head_mode", 10)

    def _make_subscriptions(self) -> None:
        sensors = qos_profile_sensor_data
        for kind, topic, receive, qos in (
            (Odometry, "odom", self._on_odometry, sensors),
            (PointCloud2, "vision/lines", partial(self._on_part, "lines"), sensors),
            (PointCloud2, "vision/percepts", partial(self._on_part, "objects"), sensors),
            (PolygonStamped, "vision/view", partial(self._on_part, "view"), sensors),
            (String, "gait/support", self._on_support, LATCHED),
        ):
            self._inputs.subscribe(kind, topic, receive, qos)

    # -- messages ----------------------------------------------------------------------------------

    def _on_odometry(self, message: Odometry) -> None:
        stamp, pose = convert.odometry(message)
        try:
            self._player.world.add_odometry(stamp, pose)
        finally:
            if self._behavior.due(stamp):
                self._decide(stamp)

    def _on_part(self, name: str, message: Any) -> None:
        frame = message.header.frame_id
        if frame != BASE_FOOTPRINT:
            raise NaoGaitError(f"vision/{name} header.frame_id", frame, BASE_FOOTPRINT)
        stamp = stamp_in(message.header, f"vision/{name}")
        percepts = self._images.add(name, stamp, message)
        if percepts is not None:
            self._player.world.add_percepts(percepts)

    def _on_support(self, message: String) -> None:
        state = state_of(message.data)
        if state is None:
            raise NaoGaitError("gait/support", message.data, "a state of the gait and a foot")
        self._player.world.set_upright(state not in DOWN and state is not GETTING_UP)
        self._behavior.see_state(state)

    # -- deciding ----------------------------------------------------------------------------------

    def _decide(self, now: int) -> None:
        part = self._behavior
        part.hear(now)
        decision = self._player.decide(part.behavior, part.body, now)
        if decision is None:
            return
        part.act(decision, now)
        self._turn_head(self._player.look(decision.world, decision.action.head), now)
        if not 0 <= now - self._reported < REPORT_PERIOD:
            self._reported = now
            self._publish(decision.world)

    def _turn_head(self, goal: Goal | None, now: int) -> None:
        if isinstance(goal, LookAt | Follow):
            point = PointStamped()
            point.header.stamp, point.header.frame_id = to_time(now), goal.frame.value
            point.point.x, point.point.y, point.point.z = goal.point
            (self._follow if isinstance(goal, Follow) else self._look_at).publish(point)
        elif isinstance(goal, Search):
            if self._head is not Search or not 0 <= now - self._searched < SEARCH_PERIOD:
                self._searched = now
                self._head_mode.publish(String(data="search"))
        elif self._head is not None:
            self._head_mode.publish(String(data="free"))
        self._head = None if goal is None else type(goal)

    def _publish(self, state: WorldState) -> None:
        self._pose.publish(convert.pose(state.stamp, state.own))
        self._valid.publish(Bool(data=state.own.valid))
        if state.ball is not None:
            self._ball.publish(convert.ball(state.stamp, state.ball, self._radius))
        if self._particles.get_subscription_count():
            poses = self._player.world.localization.particles
            self._particles.publish(convert.particles(state.stamp, poses))


def _pose(text: str) -> Pose2 | None:
    """X y yaw from a parameter; None if it is empty."""
    if not text.strip():
        return None
    try:
        x, y, yaw = (float(each) for each in text.replace(",", " ").split())
    except ValueError as error:
        raise NaoGaitError("start", text, "three numbers: x y yaw, in m and rad") from error
    if not all(is_number(each) and abs(each) <= 50.0 for each in (x, y, yaw)):
        raise NaoGaitError("start", text, "three numbers from -50 to 50")
    return x, y, yaw
