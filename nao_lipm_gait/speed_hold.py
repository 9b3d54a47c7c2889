"""Speeds kept as commanded: what the odometry constantly lacks is asked for on top.

A robot whose joints are bent by a few tenths of a degree leans, and its pendulum answers with steps
a little shorter or longer than planned: some cm/s, nearly the same at every speed. So the error is
learned as an offset of the velocity, and only where the walk has had time to follow the command.
"""

from nao_lipm_gait.signals import Pose2, VelocityCommand

RESPONSE_TIME = 0.3
"""[s] of each of two lags in which odometry follows a command: the steps, and its own smoothing."""
STEADY = 0.02
"""[m/s] up to which a command and its lagged self count as the same."""
ERROR_MAX = 0.05
"""[m/s] of the error that is believed at most: a push is no error of the walk."""
OFFSET_MAX = 0.04
"""[m/s] that the hold may add to each axis."""
RESERVE = 0.25
"""Share of the step limits below which it adds less: the longest steps are no place to hurry."""


class SpeedHold:
    """Learns the error of the walked speed and takes it out of the command."""

    def __init__(self) -> None:
        self._offset = [0.0, 0.0]
        self.begin()

    def begin(self) -> None:
        """A walk begins; what was learned belongs to the robot and stays."""
        self._steps = [0.0, 0.0]
        self._expected = [0.0, 0.0]

    @property
    def offset(self) -> tuple[float, float]:
        """[m/s] that is added in x and y."""
        return self._offset[0], self._offset[1]

    def steered(
        self, command: VelocityCommand, walked: Pose2, reserve: float, time: float, dt: float
    ) -> VelocityCommand:
        """The command with what the robot lacks of it; a turn without a way is left alone.

        walked: velocity by odometry; reserve: share of the step limits that the walk has left;
        time [s]: in which an error is learned, 0 leaves every command as it is.
        """
        if time <= 0.0 or command.is_zero:
            self.begin()
            return command
        asked = command.x, command.y
        share = min(1.0, dt / RESPONSE_TIME)
        for i in (0, 1):
            self._steps[i] += share * (asked[i] - self._steps[i])
            self._expected[i] += share * (self._steps[i] - self._expected[i])
        steady = all(abs(asked[i] - self._expected[i]) < STEADY for i in (0, 1))
        possible = min(max(reserve / RESERVE, 0.0), 1.0)
        given = [0.0, 0.0]
        for i in (0, 1):
            if asked[i] == 0.0 and command.yaw != 0.0:
                continue
            error = _within(asked[i] - walked[i], ERROR_MAX)
            lengthens = asked[i] * self._offset[i] >= 0.0
            # What cannot be given is not learned either.
            if steady and not (lengthens and possible < 1.0 and error * self._offset[i] > 0.0):
                self._offset[i] = _within(self._offset[i] + dt / time * error, OFFSET_MAX)
            given[i] = self._offset[i] * (possible if lengthens else 1.0)
        return VelocityCommand(asked[0] + given[0], asked[1] + given[1], command.yaw)


def _within(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)
