"""The referee as a ROS 2 node: ground truth in; orders, `game_state` and control messages out.

The node follows the simulated time of the bridge, which is that of the ball's stamps.
"""

from functools import partial
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PointStamped
from nav_msgs.msg import Odometry
from rclpy.client import Client
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from rclpy.task import Future
from std_srvs.srv import Trigger

from nao_soccer.referee.attendance import MatchClock, RollCall, players_of_scene
from nao_soccer.referee.protocol import (
    CONTROL_PORT,
    RETURN_PORT,
    VERSIONS,
    ControlMessage,
    decode_return,
)
from nao_soccer.referee.rules import (
    TEAM_NUMBERS,
    PutBall,
    PutRobot,
    Referee,
    RobotPlace,
    Rules,
)
from nao_soccer.ros.status_message import status_message
from nao_soccer.team.udp import LOCAL, UdpLink
from nao_soccer.vision.settings import settings_of_scene
from robot_core.errors import NaoGaitError
from robot_core.ros.messages import stamp_in, to_time
from robot_core.ros.parameters import (
    declare,
    load_from,
    node_parameter,
    of_type,
    warn_of_unknown_overrides,
)
from robot_core.ros.topics import Inputs
from robot_core.types import Point3

SCENE = node_parameter("scene", "pitch_small", "field and robots: a shipped scene or a YAML file")
MINUTES = node_parameter("minutes", 2.0, "simulated minutes of a half", "min", 0.05, 60.0)
KICK_OFF = node_parameter("kick_off", "red", "team that kicks off first", choices=("red", "blue"))
KEEPERS = node_parameter("goalkeepers", False, "player 1 of each team is its goalkeeper")
ADDRESS = node_parameter("control_address", LOCAL, "where control messages are sent")
PORT = node_parameter(
    "control_port", CONTROL_PORT, "UDP port of control messages", minimum=1024, maximum=65535
)
BACK = node_parameter(
    "return_port", RETURN_PORT, "UDP port of return messages", minimum=1024, maximum=65535
)
VERSION = node_parameter(
    "protocol", 18, "version of the control message", minimum=min(VERSIONS), maximum=max(VERSIONS)
)
WAIT = node_parameter("wait", 0.0, "simulated time before the match begins", "s", 0.0, 600.0)
NODE_PARAMETERS = (
    SCENE, MINUTES, KICK_OFF, KEEPERS, ADDRESS, PORT, BACK, VERSION, WAIT
)  # fmt: skip

PERIOD = 100_000_000
"""[ns] between two looks."""
MESSAGE_PERIOD = 500_000_000
"""[ns] between two messages, as of the GameController."""
STANDING_SHARE = 0.6
"""Share of its largest height so far above which a torso is said to stand."""


class RefereeNode(Node):
    """Keeps the rules of one match."""

    def __init__(self) -> None:
        super().__init__("referee", automatically_declare_parameters_from_overrides=True)
        scene = of_type(declare(self, SCENE), str)
        settings = load_from(SCENE, settings_of_scene, scene)
        players = load_from(SCENE, players_of_scene, scene)
        half = 60.0 * of_type(declare(self, MINUTES), float)
        keepers = of_type(declare(self, KEEPERS), bool)
        self._referee = Referee(
            settings.field,
            settings.goals,
            players,
            Rules(half=half),
            settings.ball_radius,
            {"red": 1, "blue": 1} if keepers else None,
            of_type(declare(self, KICK_OFF), str),
        )
        self._version = of_type(declare(self, VERSION), int)
        address = of_type(declare(self, ADDRESS), str)
        self._match_clock = MatchClock(round(1e9 * of_type(declare(self, WAIT), float)))
        port, back = of_type(declare(self, PORT), int), of_type(declare(self, BACK), int)
        self._control = UdpLink(port, address)
        self._returns = UdpLink(back, address if address == LOCAL else "0.0.0.0")
        self._robots: dict[str, RobotPlace] = {}
        self._heights: dict[str, float] = {}
        self._roll_call = RollCall((TEAM_NUMBERS[team], each) for team, each in players.values())
        self._looked = self._told = -MESSAGE_PERIOD
        self._goals = 0
        self._inputs = Inputs(self, burst=1)
        self._state = self.create_publisher(DiagnosticArray, "game_state", 10)
        self._put = self.create_publisher(PointStamped, "put_ball", 10)
        self._resets: dict[str, Client] = {
            name: self.create_client(Trigger, f"{name}/sim_bridge/reset") for name in players
        }
        self._teams = {team: [n for n, each in players.items() if each[0] == team]
                       for team in ("red", "blue")}  # fmt: skip
        for name in players:
            self._inputs.subscribe(
                Odometry, f"{name}/ground_truth/odom", partial(self._on_robot, name),
                qos_profile_sensor_data,
            )  # fmt: skip
        self._inputs.subscribe(
            PointStamped, "ground_truth/ball", self._on_ball, qos_profile_sensor_data
        )
        warn_of_unknown_overrides(self, (p.name for p in NODE_PARAMETERS))
        names = ", ".join(players)
        self.get_logger().info(f"{scene}: {names}; control messages to {address}:{port}")

    def destroy_node(self) -> None:
        """Close the sockets too."""
        self._control.close()
        self._returns.close()
        super().destroy_node()

    # -- ground truth ------------------------------------------------------------------------------

    def _on_robot(self, name: str, message: Odometry) -> None:
        place = message.pose.pose.position
        turn = message.pose.pose.orientation
        # The z axis of the torso, of which the vertical part is 1 while it is upright.
        vertical = 1.0 - 2.0 * (turn.x * turn.x + turn.y * turn.y)
        tallest = self._heights[name] = max(self._heights.get(name, 0.0), place.z)
        upright = vertical > 0.5 and place.z > STANDING_SHARE * tallest
        self._robots[name] = RobotPlace((place.x, place.y), upright)

    def _on_ball(self, message: PointStamped) -> None:
        now = stamp_in(message.header, "ground_truth/ball")
        time = self._match_clock.at(now)
        if time < 0 or time - self._looked < PERIOD:
            return
        self._looked = time
        self._look(now, time, (message.point.x, message.point.y, message.point.z))

    # -- the match ---------------------------------------------------------------------------------

    def _look(self, now: int, time: int, ball: Point3) -> None:
        """Keep the rules at a time [ns] of the match; `now` [ns] is that of the simulation."""
        self._hear(time)
        before = self._referee.phase
        for order in self._referee.update(time * 1e-9, ball, self._robots):
            if isinstance(order, PutBall):
                self._put_ball(now, order)
            elif isinstance(order, PutRobot):
                self._put_robot(order.name)
        for goal in self._referee.goals_scored[self._goals :]:
            score = self._referee.score
            self.get_logger().info(
                f"goal for {goal.team} by {goal.player or 'nobody known'} at {goal.time:.1f} s: "
                f"{score['red']} : {score['blue']}"
            )
        self._goals = len(self._referee.goals_scored)
        if self._referee.phase is not before or time - self._told >= MESSAGE_PERIOD:
            self._told = time
            message = self._referee.message(self._version)
            self._control.send(message.encode())
            self._state.publish(self._game_state(now, time, message))

    def _put_robot(self, name: str) -> None:
        reset = self._resets[name]
        if not reset.service_is_ready():  # its request would be lost, and kept for ever
            text = f"{name} cannot be put back: no service {reset.srv_name}"
            self._inputs.warn(f"reset of {name}", text)
            self._referee.not_put_back(name)
            return
        future = reset.call_async(Trigger.Request())
        future.add_done_callback(partial(self._on_put_back, name))

    def _on_put_back(self, name: str, future: Future) -> None:
        answer = future.result()
        if answer is not None and answer.success:
            self.get_logger().info(f"{name} is put back to its start")
            return
        self._referee.not_put_back(name)
        text = "no answer" if answer is None else answer.message
        self._inputs.warn(f"reset of {name}", f"{name} cannot be put back yet: {text}")

    def _put_ball(self, now: int, order: PutBall) -> None:
        message = PointStamped()
        message.header.stamp = to_time(now)
        message.header.frame_id = "world"
        message.point.x, message.point.y = order.position
        self._put.publish(message)

    def _hear(self, time: int) -> None:
        for data, sender in self._returns.received():
            try:
                message = decode_return(data)
            except NaoGaitError as error:
                self._inputs.warn(sender, f"{sender}: {error}; ignored")
                continue
            self._roll_call.note(message.team, message.player, time)

    def _game_state(self, now: int, time: int, message: ControlMessage) -> DiagnosticArray:
        referee = self._referee
        score = referee.score
        values: dict[str, Any] = {
            "time": f"{time * 1e-9:.2f}",
            "state": message.phase.value,
            "set_play": message.set_play.value,
            "kicking_team": "" if message.kicking_team is None else message.kicking_team,
            "first_half": message.first_half,
            "seconds_remaining": message.seconds_remaining,
            "secondary_time": message.secondary_time,
            "red": score["red"],
            "blue": score["blue"],
            "over": referee.over,
            "robots_heard": self._roll_call.count(time),
        }
        for goal in range(len(referee.goals_scored)):
            each = referee.goals_scored[goal]
            values[f"goal_{goal + 1}"] = (
                f"{each.time:.2f} {each.team} {each.player or '-'} {each.own}"
            )
        for team in ("red", "blue"):
            for name in self._teams[team]:
                penalty = "penalized" if referee.penalized(name) else "plays"
                values[f"robot/{name}"] = f"{penalty}, {referee.falls[name]} falls"
        text = f"{message.phase.value}, red {score['red']} : {score['blue']} blue"
        return status_message(now, "referee", text, values)
