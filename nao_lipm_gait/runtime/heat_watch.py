"""What the gait does about hot motors: it warns, walks slower if `hot_speed` says so, sits down."""

from math import inf

from nao_lipm_gait.runtime.diagnostics import WALK, Diagnostics
from robot_core.log import Level
from robot_core.robot import RobotDescription
from robot_core.types import VelocityCommand

HOT, COOL = 70.0, 65.0
"""[deg C] of a motor: from the first on it is hot, until it is below the second. A NAO takes torque
from its motors from about 75 deg C on."""
SIT = 78.0
"""[deg C] of a leg motor at which the robot sits down, before the motor can no longer carry it."""
AGE = 10.0
"""[s] after which a temperature is forgotten. Robots send them once per second."""


class HeatWatch:
    """Temperatures of the motors by joint.

    Args:
        robot: Its leg motors matter most.
        diagnostics: Where hot motors are reported.
        slower: Factor on the commanded velocity while a motor is hot; 1 = unchanged.

    Attributes:
        hot: A motor is hot.
        leg_too_hot: A leg has become so hot that the robot has to sit down, which `take_leg` notes
            as done. Once, until the leg has cooled down.
    """

    def __init__(self, robot: RobotDescription, diagnostics: Diagnostics, slower: float) -> None:
        self._legs = {*robot.left_leg.names, *robot.right_leg.names}
        self._joints = set(robot.joint_names)
        self._diagnostics = diagnostics
        self._slower = slower
        self._found: dict[str, tuple[float, float]] = {}
        self._oldest = inf
        self._leg_is_hot = False
        self._leg_text = ""
        self.hot = self.leg_too_hot = False

    def receive(self, joint: str, degrees: float, now: float) -> None:
        """Keep a temperature.

        Args:
            joint: Its joint; others than the robot's are ignored.
            degrees: [deg C]
            now: [s] of the sensors' time.
        """
        if joint not in self._joints:
            return
        self._found[joint] = degrees, now
        self._diagnostics.end("temperatures", "temperatures of the motors arrive again")
        self._judge(now)

    def take_leg(self) -> str:
        """The leg that is too hot, for the log; the robot sits down."""
        self.leg_too_hot = False
        return self._leg_text

    def update(self, now: float) -> None:
        """Forget old temperatures; to be called in each tick.

        Args:
            now: [s] of the sensors' time.
        """
        if now - self._oldest >= AGE:
            self._judge(now)

    def restart(self, now: float) -> None:
        """Another clock begins at `now` [s]: what is known counts as received then."""
        self._found = {joint: (degrees, now) for joint, (degrees, _) in self._found.items()}
        self._oldest = now if self._found else inf

    def _judge(self, now: float) -> None:
        """Decide by the temperatures that are not old."""
        self._found = {each: kept for each, kept in self._found.items() if now - kept[1] < AGE}
        self._oldest = min((at for _, at in self._found.values()), default=inf)
        if not self._found:
            self.hot = self.leg_too_hot = self._leg_is_hot = False
            text = f"no temperature of a motor for {AGE:g} s: it is not known whether one is hot"
            self._diagnostics.begin(WALK, Level.WARN, "temperatures", text)
            self._diagnostics.end("heat", "the last temperature, of a hot motor, is too old")
            return
        hottest = max(self._found, key=lambda each: self._found[each][0])
        most = self._found[hottest][0]
        self.hot = most >= (COOL if self.hot else HOT)
        if self.hot:
            text = f"{hottest} is hot: {most:.0f} deg C"
            if self._slower < 1.0:
                text += f"; walking at {100.0 * self._slower:.0f} % of the commanded velocity"
            self._diagnostics.begin(WALK, Level.WARN, "heat", text)
        else:
            self._diagnostics.end("heat", "the motors have cooled down")
        self._judge_legs()

    def _judge_legs(self) -> None:
        degrees, leg = max(
            ((degrees, each) for each, (degrees, _) in self._found.items() if each in self._legs),
            default=(0.0, ""),
        )
        before, self._leg_is_hot = self._leg_is_hot, degrees >= (COOL if self._leg_is_hot else SIT)
        if self._leg_is_hot:
            self._leg_text = f"{leg} at {degrees:.0f} deg C"
        self.leg_too_hot = self._leg_is_hot and (self.leg_too_hot or not before)

    def limited(self, command: VelocityCommand) -> VelocityCommand:
        """The command, slower while a motor is hot."""
        if not self.hot or self._slower >= 1.0:
            return command
        x, y, yaw = command
        return VelocityCommand(self._slower * x, self._slower * y, self._slower * yaw)
