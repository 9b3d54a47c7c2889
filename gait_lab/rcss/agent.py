"""One robot on the server: its gait between the percepts and the motors, without ROS."""

from typing import Any

from gait_lab.rcss.player import ServerPlayer
from nao_lipm_gait.gait import Gait
from rcss_bridge import codec
from rcss_bridge.body import CYCLE, Body
from rcss_bridge.codec import Percepts
from rcss_bridge.joints import ServerRobot
from rcss_bridge.landing import Landing
from robot_core.robot import load_robot
from robot_core.types import DOWN, Pose2, VelocityCommand

DELAY = 0.03
"""[s] from a percept to the effect of its answer, which acts a cycle later. With 0.02 to 0.04 a K1
walks the same, with 0.05 it falls."""
SERVER: dict[str, Any] = {
    "gyro_pitch_gain": 0.0, "gyro_roll_gain": 0.0, "tilt_pitch_gain": 0.3, "swing_lift": 0.015,
    "yaw_gyro": True,
}  # fmt: skip
"""Parameters of the gait in cycles of 20 ms, whose answers act a cycle later, on a floor that is
flat and hard: with the gyro gains for 10 ms a K1 swings in pitch at 40 cm/s and falls, and in roll
in walks to the side, whose steps then last 0.16 to 0.6 s. With a lift of 21 mm of a NAO it falls in
fast turns."""
OWN: dict[str, dict[str, Any]] = {
    "booster_k1": {
        "foot_spacing": 0.1168, "pendulum_offset_y": 0.0487, "pendulum_width": 0.0385,
        "step_turn_max": 1.4, "step_side_share": 0.65,
    },
}  # fmt: skip
"""Parameters of one robot: the stance of T1's preset, in which a K1 slips less in turns; a leading
foot that takes 0.8 of a side step brings it to a halt above that foot, and it falls."""
BEAM_MODES = ("BeforeKickOff", "Goal_Left", "Goal_Right")
"""Play modes in which the server takes `beam`."""


class Agent:
    """Answers the messages of one player.

    Args:
        server_robot: The robot by the server's names.
        team: Name of its team.
        start: x, y [m], yaw [rad] in the field of its team, where it begins; None = where the
            server puts it.
        preset: Gait preset.
        number: Of the player.
        field: The server's field, on which it plays soccer; empty = it walks as it is told.
        exact: It plays with percepts without errors, misses and delay.

    Attributes:
        player: What plays soccer; None = nobody.
    """

    def __init__(
        self,
        server_robot: ServerRobot,
        team: str,
        start: Pose2 | None = None,
        preset: str = "default",
        *,
        number: int = 2,
        field: str = "",
        exact: bool = False,
    ) -> None:
        robot = load_robot(server_robot.robot)
        settings = SERVER | OWN.get(server_robot.robot, {})
        self.gait = Gait(robot, preset, CYCLE, feedback_delay=DELAY, get_up=True, **settings)
        self.landing = Landing(robot)
        self.percepts: Percepts | None = None
        self.falls = 0
        self._body = Body(server_robot, robot)
        self._team, self._start = team, start
        self._down = False
        self._put: Pose2 | None = None
        self.player: ServerPlayer | None = None
        if field:
            self.player = ServerPlayer(robot, self.gait, team, number, field, exact=exact)

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
                if player is not None:
                    player.dropped(self._put)
                self._put = None
            targets = self.gait.step(frame, command if player is None else player.command)
            down = self.gait.state in DOWN
            self.falls += down and not self._down
            self._down = down
            if player is not None:
                player.update(percepts, frame)
        speech = None if player is None else player.speech
        return codec.actions(self._body.motors(targets), beam, speech)
