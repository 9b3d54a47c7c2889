"""One robot on the server: its gait between the percepts and the motors, without ROS."""

from gait_lab.rcss.player import ServerPlayer
from nao_lipm_gait.gait import Gait
from nao_lipm_gait.presets import DEFAULT
from rcss_bridge import codec
from rcss_bridge.body import CYCLE, Body
from rcss_bridge.codec import Percepts
from rcss_bridge.joints import ServerRobot
from rcss_bridge.landing import Landing
from robot_core.robot import load_robot
from robot_core.types import DOWN, GETTING_UP, Pose2, VelocityCommand

BEFORE_KICK_OFF = "BeforeKickOff"
BEAM_MODES = (BEFORE_KICK_OFF, "Goal_Left", "Goal_Right")
"""Play modes in which the server takes `beam`."""


class Agent:
    """Answers the messages of one player.

    Args:
        server_robot: The robot by the server's names.
        team: Name of its team.
        start: x, y [m], yaw [rad] in the field of its team, where it begins; None = where the
            server puts it.
        preset: Gait preset; the default one is that of this robot on the server.
        number: Of the player.
        field: The server's field, on which it plays soccer; empty = it walks as it is told.
        exact: It plays with percepts without errors, misses and delay.
        seed: Of these errors.

    Attributes:
        robot: Its description.
        player: What plays soccer; None = nobody.
        falls: How often it has fallen.
        get_ups: How often it has got up again.
    """

    def __init__(
        self,
        server_robot: ServerRobot,
        team: str,
        start: Pose2 | None = None,
        preset: str = DEFAULT,
        *,
        number: int = 2,
        field: str = "",
        exact: bool = False,
        seed: int = 0,
    ) -> None:
        self.robot = robot = load_robot(server_robot.robot)
        if preset == DEFAULT:
            preset = f"{robot.name}_rcss"
        self.gait = Gait(robot, preset, CYCLE)
        self.landing = Landing(robot)
        self.percepts: Percepts | None = None
        self.falls = self.get_ups = 0
        self._body = Body(server_robot, robot)
        self._team, self._start = team, start
        self._down = False
        self._put: Pose2 | None = None
        self.player: ServerPlayer | None = None
        if field:
            self.player = ServerPlayer(
                robot, self.gait, team, number, field, exact=exact, seed=seed
            )

    def beam(self, pose: Pose2) -> None:
        """Be put at a pose in the own half as soon as the play mode allows it."""
        self._start = pose

    @property
    def state(self) -> str:
        """What it does, in a word."""
        return "landing" if self.landing.active else self.gait.state.value

    @property
    def stands(self) -> bool:
        """It has landed, and is neither down nor on its way there."""
        return not (self.landing.active or self._down)

    def cycle(self, message: bytes, command: VelocityCommand) -> bytes:
        """Answer a message of the server.

        Args:
            message: Of this cycle.
            command: Velocity at which to walk; who plays soccer decides that itself.

        Returns:
            The actions.

        Raises:
            NaoGaitError: The message cannot be used; the robot is to get no answer then.
        """
        self.percepts = percepts = codec.percepts(message)
        frame = self._body.frame(percepts)
        player = self.player
        if player is not None:
            player.watch(percepts)
            self._start = player.start or self._start
        beam = None
        if self._start is not None and percepts.game.mode in BEAM_MODES:
            x, y, yaw = self._start
            right = percepts.game.right == self._team
            beam = (x, -y if right else y, yaw)  # the server mirrors x, and turns, but not y
            self._put, self._start = self._start, None
            self.landing.drop()
        was_landing = self.landing.active
        targets = self.landing.update(frame)
        if targets is None:
            if was_landing:
                self.gait.reset()
                self._down = False  # the referee has put it on its feet
                if player is not None:
                    player.dropped(self._put)
                self._put = None
            targets = self.gait.step(frame, command if player is None else player.command)
            down = self.gait.state in (*DOWN, GETTING_UP)
            self.falls += down and not self._down
            self.get_ups += self._down and not down
            self._down = down
            if player is not None:
                player.update(percepts, frame)
        speech = None if player is None else player.speech
        return codec.actions(self._body.motors(targets), beam, speech)
