"""Speeds kept as commanded: what the odometry constantly lacks is asked for on top.

A robot whose joints are bent by a few tenths of a degree leans, and its pendulum answers with steps
a little shorter or longer than planned: some cm/s, nearly the same at every speed. So the error is
learned as an offset of the velocity, and only where the walk has had time to follow the command.

Straight walks kept straight: while no turn is commanded, the heading is held by small turns.
"""

from math import remainder, tau

from nao_lipm_gait.types import Pose2, VelocityCommand

SETTLING_TIME = 0.5
"""[s] after the last commanded turn for which its steps still turn the robot."""
RATE_MAX = 0.3
"""[rad/s] that the hold may add."""


class HeadingHold:
    """Remembers the heading at which turning ended, and steers back to it."""

    def __init__(self) -> None:
        self.release()

    def release(self) -> None:
        """Take the next heading as the wanted one."""
        self._wanted: float | None = None
        self._straight_time = 0.0

    @property
    def holds(self) -> bool:
        """Whether there is a heading to be held."""
        return self._wanted is not None

    def steered(
        self, command: VelocityCommand, heading: float, gain: float, dt: float
    ) -> VelocityCommand:
        """The command with the turn [rad/s] that brings the heading [rad] back.

        gain [1/s]: turning rate per error; 0 leaves every command as it is.
        """
        if gain <= 0.0 or command.yaw != 0.0 or command.is_zero:
            self.release()
            return command
        self._straight_time += dt
        if self._wanted is None:
            if self._straight_time < SETTLING_TIME:
                return command
            self._wanted = heading
        rate = gain * remainder(self._wanted - heading, tau)
        return VelocityCommand(command.x, command.y, min(max(rate, -RATE_MAX), RATE_MAX))


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
        self._x = _Axis()
        self._y = _Axis()

    def begin(self) -> None:
        """A walk begins; what was learned belongs to the robot and stays."""
        self._x.begin()
        self._y.begin()

    @property
    def offset(self) -> tuple[float, float]:
        """[m/s] that is added in x and y."""
        return self._x.offset, self._y.offset

    def steered(
        self, command: VelocityCommand, walked: Pose2, reserve: float, time: float, dt: float
    ) -> VelocityCommand:
        """The command with what the robot lacks of it; a turn without a way is left alone.

        walked: velocity by odometry; reserve: share of the step limits that the walk has left;
        time [s]: in which an error is learned, 0 leaves every command as it is.
        """
        asked_x, asked_y, yaw = command.x, command.y, command.yaw
        if time <= 0.0 or (asked_x == 0.0 and asked_y == 0.0 and yaw == 0.0):
            self.begin()
            return command
        x, y, share = self._x, self._y, min(1.0, dt / RESPONSE_TIME)
        # Both follow, whatever the one says.
        steady = x.is_steady(asked_x, share) & y.is_steady(asked_y, share)
        possible = min(max(reserve / RESERVE, 0.0), 1.0)
        step = dt / time if steady else 0.0
        turns = yaw != 0.0
        return VelocityCommand(
            asked_x if turns and asked_x == 0.0 else x.steered(asked_x, walked[0], possible, step),
            asked_y if turns and asked_y == 0.0 else y.steered(asked_y, walked[1], possible, step),
            yaw,
        )


class _Axis:
    """One direction of the velocity."""

    __slots__ = ("_expected", "_steps", "offset")

    def __init__(self) -> None:
        self.offset = 0.0
        """[m/s] that is learned."""
        self.begin()

    def begin(self) -> None:
        self._steps = self._expected = 0.0

    def is_steady(self, asked: float, share: float) -> bool:
        """The walk has had time to follow the command [m/s]; share: of a lag that passes now."""
        self._steps += share * (asked - self._steps)
        self._expected += share * (self._steps - self._expected)
        return abs(asked - self._expected) < STEADY

    def steered(self, asked: float, walked: float, possible: float, step: float) -> float:
        """[m/s]; possible: share of the offset that the steps have room for; step: to learn now."""
        lengthens = asked * self.offset >= 0.0
        if step > 0.0:
            error = min(max(asked - walked, -ERROR_MAX), ERROR_MAX)
            # What cannot be given is not learned either.
            if not (lengthens and possible < 1.0 and error * self.offset > 0.0):
                self.offset = min(max(self.offset + step * error, -OFFSET_MAX), OFFSET_MAX)
        return asked + self.offset * (possible if lengthens else 1.0)
