"""The behaviour of the node `player`: sockets and topics around `PlayerBehavior`."""

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Twist
from rclpy.node import Node
from std_msgs.msg import String

from nao_soccer.behavior.mind import Decision
from nao_soccer.behavior.player_behavior import Identity, PlayerBehavior
from nao_soccer.behavior.situation import Body
from nao_soccer.referee.protocol import CONTROL_PORT, RETURN_PORT
from nao_soccer.referee.rules import TEAM_NUMBERS
from nao_soccer.ros.status_message import status_message
from nao_soccer.team.message import PORT_BASE
from nao_soccer.team.udp import LOCAL, UdpLink
from robot_core.errors import NaoGaitError
from robot_core.field import TEAMS, Field, Goals
from robot_core.robot import RobotDescription
from robot_core.ros.parameters import declare, node_parameter, of_type
from robot_core.ros.topics import Inputs
from robot_core.types import GaitState, VelocityCommand

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
    TEAM, NUMBER, PLAYERS, TEAM_NUMBER, REFEREE, ROLES, ADDRESS, TEAM_PORT, CONTROL, RETURN
)  # fmt: skip

PERIOD = 50_000_000
"""[ns] between two decisions."""
RETURN_PERIOD = 500_000_000
"""[ns] between two return messages."""


class BehaviorPart:
    """Decides by the world state, and commands the gait.

    Args:
        node: The node `player`.
        inputs: Its subscriptions.
        robot: The robot.
        field: The field.
        goals: The goals.

    Raises:
        NaoGaitError: A parameter cannot be used, or a port is not free.
    """

    def __init__(
        self, node: Node, inputs: Inputs, robot: RobotDescription, field: Field, goals: Goals
    ) -> None:
        team = of_type(declare(node, TEAM), str)
        number = of_type(declare(node, TEAM_NUMBER), int) or TEAM_NUMBERS[team]
        identity = Identity(
            number,
            of_type(declare(node, NUMBER), int),
            of_type(declare(node, PLAYERS), int),
            waits=of_type(declare(node, REFEREE), bool),
            roles=of_type(declare(node, ROLES), bool),
        )
        address = of_type(declare(node, ADDRESS), str)
        team_port = of_type(declare(node, TEAM_PORT), int) or PORT_BASE + number
        control, back = (of_type(declare(node, each), int) for each in (CONTROL, RETURN))
        self._behavior = PlayerBehavior(identity, robot, field, goals)
        self._team = UdpLink(team_port, address)
        self._referee = UdpLink(control, address, target_port=back)
        self._body = Body()
        self._motion = ""
        self._decided: int | None = None
        self._returned = 0
        self._inputs = inputs
        self._cmd_vel = node.create_publisher(Twist, "cmd_vel", 10)
        self._motions = node.create_publisher(String, "gait/motion", 10)
        self._report = node.create_publisher(DiagnosticArray, "behavior", 10)

    def close(self) -> None:
        """Close the sockets."""
        self._team.close()
        self._referee.close()

    @property
    def body(self) -> Body:
        """The body, by the last state of the gait."""
        return self._body

    @property
    def behavior(self) -> PlayerBehavior:
        """What decides."""
        return self._behavior

    def see_state(self, state: GaitState) -> None:
        """Take the state of the gait."""
        self._body = Body(state)

    def due(self, now: int) -> bool:
        """Whether it is time for a decision; `now` [ns] of the robot's clock."""
        return self._decided is None or not 0 <= now - self._decided < PERIOD

    def hear(self, now: int) -> None:
        """Take what team mates and referee have sent; `now` [ns] of the robot's clock."""
        time = now * 1e-9
        for link, take in (
            (self._referee, self._behavior.hear_referee),
            (self._team, self._behavior.hear_mate),
        ):
            for data, sender in link.received():
                try:
                    take(data, time)
                except NaoGaitError as error:
                    text = f"{sender}: {error}; ignored"
                    self._inputs.warn(f"{sender} {error.field}", text)

    def act(self, decision: Decision, now: int) -> None:
        """Command the gait, tell team mates and referee; `now` [ns] of the robot's clock."""
        self._decided = now
        action = decision.action
        self._cmd_vel.publish(_twist(action.walk))
        if action.motion and action.motion != self._motion:
            self._motions.publish(String(data=action.motion))
        self._motion = action.motion
        data = self._behavior.team_message(now * 1e-9)
        if data is not None:
            self._team.send(data)
        if not 0 <= now - self._returned < RETURN_PERIOD:
            self._returned = now
            self._referee.send(self._behavior.return_message())
            self._report.publish(self._diagnostics(now, decision))

    def _diagnostics(self, now: int, decision: Decision) -> DiagnosticArray:
        behavior = self._behavior
        plan = "none" if decision.plan is None else decision.plan.name
        values = {
            "role": behavior.role.value,
            "phase": behavior.game.phase.value,
            "plan": plan,
            "messages": str(behavior.link.sent),
        }
        for depth, each in enumerate(decision.path):
            values[f"option_{depth}"] = str(each)
        remark = behavior.remark
        if remark:
            self._inputs.warn(remark.partition(" for ")[0], remark)
        text = remark or f"{behavior.role.value}: {decision.path[-1]}"
        return status_message(now, "behavior", text, values, warns=bool(remark))


def _twist(walk: VelocityCommand) -> Twist:
    message = Twist()
    message.linear.x, message.linear.y = float(walk.x), float(walk.y)
    message.angular.z = float(walk.yaw)
    return message
