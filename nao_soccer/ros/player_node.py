"""The player as a ROS 2 node: messages and packets in; commands, reports and packets out."""

from functools import partial

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PointStamped, PoseArray, PoseStamped, PoseWithCovarianceStamped, Twist
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Bool, Empty, Float32, String

from nao_soccer.behavior.mind import Decision
from nao_soccer.behavior.situation import Body
from nao_soccer.player import Identity, Player
from nao_soccer.referee.protocol import CONTROL_PORT, RETURN_PORT
from nao_soccer.referee.rules import TEAM_NUMBERS
from nao_soccer.ros import player_messages as convert
from nao_soccer.ros.status_message import status_message
from nao_soccer.team.message import PORT_BASE
from nao_soccer.team.udp import LOCAL, UdpLink
from nao_soccer.vision.settings import settings_of_scene
from nao_soccer.world.settings import WorldSettings
from nao_soccer.world.state import WorldState
from robot_core.errors import NaoGaitError, is_number
from robot_core.field import TEAMS
from robot_core.head_goals import Follow, Goal, LookAt, Search
from robot_core.ros.messages import to_time, with_prefix
from robot_core.ros.parameters import (
    FRAME_PREFIX,
    ROBOT,
    URDF,
    declare,
    load_parameter_file,
    load_robot_parameter,
    node_parameter,
    warn_of_unknown_overrides,
)
from robot_core.ros.topics import LATCHED, Inputs, transform_broadcaster, watch_senders
from robot_core.types import DOWN, GETTING_UP, Pose2, state_of

SCENE = node_parameter("scene", "pitch", "field and goals: a shipped scene or a YAML file")
START = node_parameter(
    "start", "", "pose at the start in the field of the own team, as x y yaw; empty = not known"
)
SEED = node_parameter("seed", 0, "seed of the particles", "", 0, 2**31 - 1)
TEAM = node_parameter("team", "red", "the robot's team", choices=TEAMS)
NUMBER = node_parameter("number", 1, "number of the player", minimum=1, maximum=20)
PLAYERS = node_parameter("players", 2, "players of the team, who share its messages", "", 1, 20)
TEAM_NUMBER = node_parameter(
    "team_number", 0, "number of the team in messages; 0 = 1 for red, 2 for blue", "", 0, 255
)
REFEREE = node_parameter("referee", True, "stand until a referee is heard; false = play at once")
ROLES = node_parameter("roles", True, "agree with team mates who goes to the ball")
ADDRESS = node_parameter("address", LOCAL, "UDP address to listen on and to broadcast to")
TEAM_PORT = node_parameter(
    "team_port", 0, f"UDP port of team messages; 0 = {PORT_BASE} + number of the team", "", 0, 65535
)
CONTROL = node_parameter("control_port", CONTROL_PORT, "UDP port of the referee", "", 1024, 65535)
RETURN = node_parameter("return_port", RETURN_PORT, "UDP port of return messages", "", 1024, 65535)
NODE_PARAMETERS = (
    URDF, ROBOT, SCENE, START, SEED, FRAME_PREFIX,
    TEAM, NUMBER, PLAYERS, TEAM_NUMBER, REFEREE, ROLES, ADDRESS, TEAM_PORT, CONTROL, RETURN,
)  # fmt: skip

PERIOD = 50_000_000
"""[ns] between two decisions."""
REPORT_PERIOD = 100_000_000
"""[ns] between two messages with pose and ball."""
RETURN_PERIOD = 500_000_000
"""[ns] between two return messages and reports of the behaviour."""
SEARCH_PERIOD = 1_000_000_000
"""[ns] after which the head is told again to search: the gait may have been started again."""


class PlayerNode(Node):
    """One player with its topics and sockets; it decides in the time of the odometry's stamps."""

    def __init__(self) -> None:
        super().__init__("player", automatically_declare_parameters_from_overrides=True)
        robot = load_robot_parameter(self)
        scene = load_parameter_file(self, SCENE, settings_of_scene)
        start = load_parameter_file(self, START, _pose)
        seed = declare(self, SEED)
        number, color = declare(self, TEAM_NUMBER), declare(self, TEAM)
        number = number or TEAM_NUMBERS[color]
        identity = Identity(
            number,
            declare(self, NUMBER),
            declare(self, PLAYERS),
            waits=declare(self, REFEREE),
            roles=declare(self, ROLES),
            color=color,
        )
        self._player = Player(identity, robot, WorldSettings.on(scene, seed), start)
        self._radius = scene.ball_radius
        self._prefix: str = declare(self, FRAME_PREFIX)
        address = declare(self, ADDRESS)
        team_port = declare(self, TEAM_PORT) or PORT_BASE + number
        control, back = (declare(self, each) for each in (CONTROL, RETURN))
        self._team = UdpLink(team_port, address)
        self._referee = UdpLink(control, address, target_port=back)
        self._controller = ""  # address of the GameController, of its last message
        self._body = Body()
        self._now = 0.0
        self._motion = ""
        self._head: type[Goal] | None = None
        self._decisions, self._reports = _Timer(PERIOD), _Timer(REPORT_PERIOD)
        self._returns, self._searches = _Timer(RETURN_PERIOD), _Timer(SEARCH_PERIOD)
        self._inputs = Inputs(self, burst=1)
        self._make_publishers()
        sensors = qos_profile_sensor_data
        subscribe = self._inputs.subscribe
        subscribe(Odometry, "odom", self._on_odometry, sensors)
        subscribe(PointCloud2, "vision/percepts", self._on_percepts, sensors)
        subscribe(String, "gait/support", self._on_support, LATCHED)
        for place in ("", "/"):  # of this robot, or of the world
            subscribe(Empty, f"{place}whistle", self._on_whistle)
            subscribe(String, f"{place}gesture", self._on_gesture)
        warn_of_unknown_overrides(self, (p.name for p in NODE_PARAMETERS))
        watch_senders(self)
        self.get_logger().info(f"{robot.name}, player {identity.player} of team {number}")

    def destroy_node(self) -> None:
        """Close the sockets too."""
        self._team.close()
        self._referee.close()
        super().destroy_node()

    def _make_publishers(self) -> None:
        make = self.create_publisher
        self._transforms = transform_broadcaster(self)
        self._odometry: tuple[int, Pose2, str] | None = None
        self._pose = make(PoseWithCovarianceStamped, "pose", 10)
        self._valid = make(Bool, "pose_valid", 10)
        self._particles = make(PoseArray, "particles", 2)
        self._ball = make(Odometry, "ball", 10)
        self._look_at = make(PointStamped, "gait/look_at", 10)
        self._follow = make(PointStamped, "gait/follow", 10)
        self._head_mode = make(String, "gait/head_mode", 10)
        self._lift = make(Float32, "gait/lift", 10)
        self._kick = make(PoseStamped, "gait/kick", 10)
        self._cmd_vel = make(Twist, "cmd_vel", 10)
        self._motions = make(String, "gait/motion", 10)
        self._report = make(DiagnosticArray, "behavior", 10)

    # -- messages ----------------------------------------------------------------------------------

    def _on_odometry(self, message: Odometry) -> None:
        stamp, pose = convert.odometry(message)
        self._odometry = stamp, pose, message.header.frame_id.removeprefix(self._prefix)
        try:
            self._player.world.add_odometry(stamp, pose)
        finally:
            if self._decisions.due(stamp):
                self._decide(stamp)

    def _on_percepts(self, message: PointCloud2) -> None:
        message.header.frame_id = message.header.frame_id.removeprefix(self._prefix)
        self._player.world.add_percepts(convert.percepts(message))

    def _on_support(self, message: String) -> None:
        state = state_of(message.data)
        if state is None:
            raise NaoGaitError("gait/support", message.data, "a state of the gait and a foot")
        self._player.world.set_upright(state not in DOWN and state is not GETTING_UP)
        self._body = Body(state)

    def _on_whistle(self, _message: Empty) -> None:
        self._player.hear_whistle(self._now)

    def _on_gesture(self, message: String) -> None:
        self._player.hear_gesture(message.data, self._now)

    def _hear(self, time: float) -> None:
        """Take what team mates and referee have sent; `time` [s] of the robot's clock."""
        for link, take in (
            (self._referee, self._player.hear_referee),
            (self._team, self._player.hear_mate),
        ):
            for data, sender in link.received():
                try:
                    take(data, time)
                    if link is self._referee:
                        self._controller = sender
                except NaoGaitError as error:
                    text = f"{sender}: {error}; ignored"
                    self._inputs.warn(f"{sender} {error.field}", text)

    # -- deciding ----------------------------------------------------------------------------------

    def _decide(self, now: int) -> None:
        self._now = now * 1e-9
        self._hear(self._now)
        decision = self._player.decide(self._body, now)
        if decision is None:
            self._decisions.reset()
            return
        self._act(decision, now)
        self._turn_head(self._player.look(decision), now)
        if self._reports.due(now):
            self._publish(decision.world)

    def _act(self, decision: Decision, now: int) -> None:
        """Command the gait; tell team mates and referee."""
        action = decision.action
        walk = Twist()
        walk.linear.x, walk.linear.y = float(action.walk.x), float(action.walk.y)
        walk.angular.z = float(action.walk.yaw)
        self._cmd_vel.publish(walk)
        self._lift.publish(Float32(data=float(action.lift)))
        if action.kick is not None:
            goal = convert.kick(now, action.kick)
            self._kick.publish(with_prefix(self._prefix, goal))
        if action.motion and action.motion != self._motion:
            self._motions.publish(String(data=action.motion))
        self._motion = action.motion
        data = self._player.team_message(now * 1e-9)
        if data is not None:
            self._team.send(data)
        if self._returns.due(now):
            if self._controller:  # the rules want this to go to the GameController alone
                self._referee.send_to(self._player.return_message(), self._controller)
            self._report.publish(self._diagnostics(now, decision))

    def _turn_head(self, goal: Goal | None, now: int) -> None:
        if isinstance(goal, LookAt | Follow):
            point = PointStamped()
            point.header.stamp, point.header.frame_id = to_time(now), goal.frame.value
            point.point.x, point.point.y, point.point.z = goal.point
            (self._follow if isinstance(goal, Follow) else self._look_at).publish(
                with_prefix(self._prefix, point)
            )
        elif isinstance(goal, Search):
            if self._head is not Search:
                self._searches.reset()
            if self._searches.due(now):
                self._head_mode.publish(String(data="search"))
        elif self._head is not None:
            self._head_mode.publish(String(data="free"))
        self._head = None if goal is None else type(goal)

    # -- reports -----------------------------------------------------------------------------------

    def _publish(self, state: WorldState) -> None:
        framed = partial(with_prefix, self._prefix)
        self._pose.publish(framed(convert.pose(state.stamp, state.own)))
        self._valid.publish(Bool(data=state.own.valid))
        if self._transforms is not None and self._odometry is not None and state.own.valid:
            stamp, odometry, odom = self._odometry
            if stamp == state.stamp:
                transforms = convert.map_transforms(stamp, state.own.pose, odometry, odom)
                self._transforms.sendTransform([framed(each) for each in transforms])
        if state.ball is not None:
            self._ball.publish(framed(convert.ball(state.stamp, state.ball, self._radius)))
        if self._particles.get_subscription_count():
            poses = self._player.world.localization.particles
            self._particles.publish(framed(convert.particles(state.stamp, poses)))

    def _diagnostics(self, now: int, decision: Decision) -> DiagnosticArray:
        player = self._player
        values = {
            "role": player.role.value,
            "phase": player.game.phase.value,
            "game_phase": player.game.game_phase.value,
            "competition": player.game.competition.value,
            "messages": str(player.link.sent),
        }
        first = decision.plan
        for name, plan in (("plan", first), ("second_plan", first and first.runner_up)):
            values[name] = "none" if plan is None else plan.name
            if plan is not None:
                values[f"{name}_direction"] = f"{plan.direction:.3f}"
                values[f"{name}_seconds"] = f"{plan.seconds:.2f}"
        for depth, each in enumerate(decision.path):
            values[f"option_{depth}"] = str(each)
        remark = player.remark
        if remark:
            self._inputs.warn(remark.partition(" for ")[0], remark)
        text = remark or f"{player.role.value}: {decision.path[-1]}"
        return status_message(now, "behavior", text, values, warns=bool(remark))


class _Timer:
    """Says when a period [ns] has passed since it last did, or the clock has begun again."""

    def __init__(self, period: int) -> None:
        self._period = period
        self._last: int | None = None

    def due(self, now: int) -> bool:
        due = self._last is None or not 0 <= now - self._last < self._period
        if due:
            self._last = now
        return due

    def reset(self) -> None:
        """It is due at the next time."""
        self._last = None


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
