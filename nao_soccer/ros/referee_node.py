"""The referee as a ROS 2 node: ground truth in; orders, `game_state` and control messages out.

The node follows the simulated time of the bridge, which is that of the ball's stamps.
"""

import math
from functools import partial
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PointStamped, PoseStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from std_msgs.msg import Empty, String
from std_srvs.srv import Trigger

from nao_soccer.game_state import Phase
from nao_soccer.player import READY_GESTURE
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
from nao_soccer.team.message import PORT_BASE
from nao_soccer.team.udp import LOCAL, UdpLink
from nao_soccer.vision.settings import settings_of_scene
from robot_core.errors import NaoGaitError
from robot_core.ros.messages import set_planar, stamp_in, to_time
from robot_core.ros.parameters import (
    declare,
    load_from,
    node_parameter,
    warn_of_unknown_overrides,
)
from robot_core.ros.topics import Inputs, watch_senders
from robot_core.types import Point3

SCENE = node_parameter("scene", "pitch_small", "field and robots: a shipped scene or a YAML file")
MINUTES = node_parameter("minutes", 2.0, "simulated minutes of a half", "min", 0.05, 60.0)
KICK_OFF = node_parameter("kick_off", "red", "team that kicks off first", choices=("red", "blue"))
KEEPERS = node_parameter(
    "goalkeepers", False, "player 1 is the goalkeeper in teams of less than three, too"
)
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
TEAM_PORT = node_parameter(
    "team_port",
    0,
    f"UDP port of red's team messages, which are counted, blue's is the next one; "
    f"0 = {PORT_BASE} + number of the team",
    "",
    0,
    65534,
)
WAIT = node_parameter("wait", 0.0, "simulated time before the match begins", "s", 0.0, 600.0)
NODE_PARAMETERS = (
    SCENE, MINUTES, KICK_OFF, KEEPERS, ADDRESS, PORT, BACK, VERSION, TEAM_PORT, WAIT
)  # fmt: skip

PERIOD = 100_000_000
"""[ns] between two looks."""
MESSAGE_PERIOD = 500_000_000
"""[ns] between two messages, as of the GameController."""
PUT_TIME = 1_000_000_000
"""[ns] after which a robot is where it was put, or is ordered again."""
PUT_ERROR = 0.5
"""[m] from there."""
STANDING_SHARE = 0.6
"""Share of its largest height so far above which a torso is said to stand."""


class RefereeNode(Node):
    """Keeps the rules of one match."""

    def __init__(self) -> None:
        super().__init__("referee", automatically_declare_parameters_from_overrides=True)
        scene = declare(self, SCENE)
        settings = load_from(SCENE, settings_of_scene, scene)
        players = load_from(SCENE, players_of_scene, scene)
        half = 60.0 * declare(self, MINUTES)
        keepers = declare(self, KEEPERS)
        self._referee = Referee(
            settings.field,
            settings.goals,
            players,
            Rules(half=half),
            settings.ball_radius,
            {"red": 1, "blue": 1} if keepers else None,
            declare(self, KICK_OFF),
        )
        self._version: int = declare(self, VERSION)
        address = declare(self, ADDRESS)
        self._match_clock = MatchClock(round(1e9 * declare(self, WAIT)))
        port, back = declare(self, PORT), declare(self, BACK)
        self._control = UdpLink(port, address)
        # Robots answer to the address from which they hear the referee: on this machine, this one.
        self._returns = UdpLink(back, "127.0.0.1" if address == LOCAL else "0.0.0.0")
        first = declare(self, TEAM_PORT)
        self._teams_heard = {}
        for index, (team, team_number) in enumerate(TEAM_NUMBERS.items()):
            team_port = first + index if first else PORT_BASE + team_number
            self._teams_heard[team] = UdpLink(team_port, address if address == LOCAL else "0.0.0.0")
        self._robots: dict[str, RobotPlace] = {}
        self._heights: dict[str, float] = {}
        self._roll_call = RollCall((TEAM_NUMBERS[team], each) for team, each in players.values())
        self._looked = self._told = -MESSAGE_PERIOD
        self._goals = 0
        self._inputs = Inputs(self, burst=1)
        self._state = self.create_publisher(DiagnosticArray, "game_state", 10)
        self._put = self.create_publisher(PointStamped, "put_ball", 10)
        self._put_robots = {
            name: self.create_publisher(PoseStamped, f"{name}/put_robot", 10) for name in players
        }
        self._puts: dict[str, tuple[int, PutRobot]] = {}
        self._whistle = self.create_publisher(Empty, "/whistle", 10)
        self._gesture = self.create_publisher(String, "/gesture", 10)
        self.create_service(Trigger, "~/whistle", self._on_whistle)
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
        watch_senders(self)
        names = ", ".join(players)
        self.get_logger().info(f"{scene}: {names}; control messages to {address}:{port}")

    def destroy_node(self) -> None:
        """Close the sockets too."""
        self._control.close()
        self._returns.close()
        for link in self._teams_heard.values():
            link.close()
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
        self._check_puts(now)
        before = self._referee.phase
        for order in self._referee.update(time * 1e-9, ball, self._robots):
            if isinstance(order, PutBall):
                self._put_ball(now, order)
            elif isinstance(order, PutRobot):
                self._put_robot(now, order)
        for goal in self._referee.goals_scored[self._goals :]:
            score = self._referee.score
            self.get_logger().info(
                f"goal for {goal.team} by {goal.player or 'nobody known'} at {goal.time:.1f} s: "
                f"{score['red']} : {score['blue']}"
            )
        self._goals = len(self._referee.goals_scored)
        self._signal(before, self._referee.phase)
        if self._referee.phase is not before or time - self._told >= MESSAGE_PERIOD:
            self._told = time
            message = self._referee.message(self._version)
            self._control.send(message.encode())
            self._state.publish(self._game_state(now, time, message))

    def _on_whistle(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """A person blows the whistle."""
        self._whistle.publish(Empty())
        response.success, response.message = True, "whistled"
        return response

    def _signal(self, before: Phase, after: Phase) -> None:
        """Whistle and gesture, which tell of a new phase before the message does."""
        if (before, after) == (Phase.SET, Phase.PLAYING):
            self._whistle.publish(Empty())
        elif (before, after) == (Phase.STANDBY, Phase.READY):
            self._gesture.publish(String(data=READY_GESTURE))

    def _put_robot(self, now: int, order: PutRobot) -> None:
        message = PoseStamped()
        message.header.stamp = to_time(now)
        message.header.frame_id = "world"
        set_planar(message.pose.position, message.pose.orientation, order.pose)
        self._put_robots[order.name].publish(message)
        self._puts[order.name] = now, order

    def _check_puts(self, now: int) -> None:
        """Order again what the bridge could not do: something was there, or it did not hear."""
        for name, (since, order) in list(self._puts.items()):
            if 0 <= now - since < PUT_TIME:
                continue
            del self._puts[name]
            robot = self._robots.get(name)
            if robot is None or math.dist(robot.position, order.pose[:2]) > PUT_ERROR:
                self._inputs.warn(f"put {name}", f"{name} cannot be put to its place yet")
                self._referee.not_put_back(name)

    def _put_ball(self, now: int, order: PutBall) -> None:
        message = PointStamped()
        message.header.stamp = to_time(now)
        message.header.frame_id = "world"
        message.point.x, message.point.y = order.position
        self._put.publish(message)

    def _hear(self, time: int) -> None:
        for team, link in self._teams_heard.items():
            self._referee.messages[team] += sum(1 for _ in link.received())
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
                penalty = referee.penalty(name)
                state = f"penalized: {penalty.value}" if referee.penalized(name) else "plays"
                values[f"robot/{name}"] = f"{state}, {referee.falls[name]} falls"
        text = f"{message.phase.value}, red {score['red']} : {score['blue']} blue"
        return status_message(now, "referee", text, values)
