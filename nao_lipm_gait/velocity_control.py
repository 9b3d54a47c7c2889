"""What becomes of a velocity command before it is walked: deadband, heading, speed, mean.

Heading and speed are held by small corrections from the odometry.
"""

from math import copysign, remainder, tau

from robot_core.types import Pose2, VelocityCommand

SETTLING_TIME = 0.5
"""Time [s] after the last commanded turn in which its steps still turn the robot."""
YAW_RATE_MAX = 0.3
"""Largest yaw rate [rad/s] that the heading hold commands."""
INTEGRAL_TIME = 4.0
"""Time [s] in which a constant heading error doubles the commanded yaw rate."""


DEADBAND = VelocityCommand(1e-3, 1e-3, 5e-4)
"""Velocities [m/s, m/s, rad/s] below which an axis is not commanded, which no walk holds."""


def outside_deadband(command: VelocityCommand) -> VelocityCommand:
    """The command with 0 on each axis that is inside the deadband."""
    x, y, yaw = command
    least_x, least_y, least_yaw = DEADBAND
    moves_x, moves_y, turns = abs(x) >= least_x, abs(y) >= least_y, abs(yaw) >= least_yaw
    if (moves_x or x == 0.0) and (moves_y or y == 0.0) and (turns or yaw == 0.0):
        return command
    return VelocityCommand(x if moves_x else 0.0, y if moves_y else 0.0, yaw if turns else 0.0)


class StepMean:
    """Mean of the command over the running step, for walks that read it once a step.

    A command that changes within a step would otherwise count with the value of one moment only.
    """

    def __init__(self) -> None:
        self._step: int | None = None
        self._begin()

    def _begin(self) -> None:
        self._x = self._y = self._yaw = 0.0
        self._ticks = 0

    def update(self, command: VelocityCommand, step_count: int) -> VelocityCommand:
        """The mean since the step began; standstill counts at once.

        Args:
            command: The command of this tick.
            step_count: Number of the running step.
        """
        stands = command.is_zero
        if stands or step_count != self._step:
            self._step = step_count
            self._begin()
        if stands:
            return command
        self._x += command.x
        self._y += command.y
        self._yaw += command.yaw
        self._ticks += 1
        share = 1.0 / self._ticks
        return VelocityCommand(share * self._x, share * self._y, share * self._yaw)


class HeadingHold:
    """Keeps straight walks straight: holds the heading while no turn is commanded.

    A PI controller: feet that slip the same way in each step turn the robot at a constant rate,
    against which a gain alone would leave an error of that rate divided by the gain.
    """

    def __init__(self) -> None:
        self._since_turn = SETTLING_TIME
        self.release()

    def release(self) -> None:
        """Forget the heading; hold the one at which the robot next walks straight."""
        self._heading: float | None = None
        self._integral = 0.0

    @property
    def holds(self) -> bool:
        """Whether a heading is held."""
        return self._heading is not None

    def correct(
        self, command: VelocityCommand, heading: float, gain: float, dt: float
    ) -> VelocityCommand:
        """The command with the yaw rate that turns the robot back to the held heading.

        Args:
            command: Commanded velocity.
            heading: Heading [rad] by odometry.
            gain: Yaw rate per heading error [1/s]; 0 leaves the command unchanged.
            dt: Time [s] since the last tick.
        """
        self._since_turn = 0.0 if command.yaw != 0.0 else self._since_turn + dt
        if gain <= 0.0 or command.yaw != 0.0 or command.is_zero:
            self.release()
            return command
        if self._heading is None:
            if self._since_turn < SETTLING_TIME:
                return command
            self._heading = heading
        error = remainder(self._heading - heading, tau)
        rate = gain * (error + self._integral)
        limited = min(max(rate, -YAW_RATE_MAX), YAW_RATE_MAX)
        if limited == rate:
            self._integral += error * dt / INTEGRAL_TIME
        return VelocityCommand(command.x, command.y, limited)


RESPONSE_TIME = 0.3
"""Time constant [s] of each of two lags from command to odometry: the steps and its smoothing."""
STEADY_DIFFERENCE = 0.02
"""Largest difference [m/s] between a command and its lagged value in a steady walk."""
ERROR_MAX = 0.05
"""Largest speed error [m/s] that is learned from: a push is no error of the walk."""
OFFSET_MAX = 0.04
"""Largest correction [m/s] per axis."""
STEADY_TURN_DIFFERENCE, TURN_ERROR_MAX, TURN_OFFSET_MAX = 0.15, 0.3, 0.15
"""The same for a turn on the spot [rad/s]; each step turns the robot faster in its middle."""
RESERVE_MIN = 0.04
"""Share of the step limits below which the correction fades: at the limits it must not grow."""


class SpeedHold:
    """Learns the steady error of the walked speed and compensates it in the command.

    A robot whose joints are bent by a few tenths of a degree leans, and its pendulum answers with
    steps that are a little shorter or longer than planned: some cm/s, nearly the same at every
    speed. The error is therefore learned as an offset of the velocity, and only while the walk has
    had time to follow the command.

    A turn falls short by a few percent to either side alike, so its offset is learned along the
    direction of the turn. In curves it is neither learned nor used: their odometry is less certain.
    """

    def __init__(self) -> None:
        self._x = _AxisHold(STEADY_DIFFERENCE, ERROR_MAX, OFFSET_MAX)
        self._y = _AxisHold(STEADY_DIFFERENCE, ERROR_MAX, OFFSET_MAX)
        self._turn = _AxisHold(STEADY_TURN_DIFFERENCE, TURN_ERROR_MAX, TURN_OFFSET_MAX)

    def begin(self) -> None:
        """Begin a walk; the learned offset stays."""
        self._x.begin()
        self._y.begin()
        self._turn.begin()

    def correct(
        self, command: VelocityCommand, walked: Pose2, reserve: float, time: float, dt: float
    ) -> VelocityCommand:
        """The command with the learned correction.

        A turn on the spot is corrected in its rate alone, a curve in its speed alone.

        Args:
            command: Commanded velocity.
            walked: Velocity by odometry [m/s, m/s, rad/s].
            reserve: Share of the step limits that the walk does not use.
            time: Time constant [s] of the learning; 0 leaves the command unchanged.
            dt: Time [s] since the last tick.
        """
        wanted_x, wanted_y, yaw = command.x, command.y, command.yaw
        if time <= 0.0 or (wanted_x == 0.0 and wanted_y == 0.0 and yaw == 0.0):
            self.begin()
            return command
        x, y, turn, share = self._x, self._y, self._turn, min(1.0, dt / RESPONSE_TIME)
        # Every axis is updated, whatever the results of the others.
        steady = x.follow(wanted_x, share) & y.follow(wanted_y, share)
        turn_steady = turn.follow(abs(yaw), share)
        room = min(max(reserve / RESERVE_MIN, 0.0), 1.0)
        step = dt / time if steady else 0.0
        turns = yaw != 0.0
        if wanted_x == 0.0 and wanted_y == 0.0:
            side = copysign(1.0, yaw)
            turn_step = step if turn_steady else 0.0
            rate = turn.correct(side * yaw, side * walked[2], room, turn_step)
            return VelocityCommand(0.0, 0.0, side * rate)
        return VelocityCommand(
            wanted_x if turns and wanted_x == 0.0 else x.correct(wanted_x, walked[0], room, step),
            wanted_y if turns and wanted_y == 0.0 else y.correct(wanted_y, walked[1], room, step),
            yaw,
        )


class _AxisHold:
    """Speed hold of one axis; all values in m/s, or rad/s.

    Args:
        difference: Largest difference between the command and its lagged value in a steady walk.
        error_max: Largest speed error that is learned from.
        offset_max: Largest correction.
    """

    __slots__ = ("_difference", "_error_max", "_expected", "_offset_max", "_steps", "offset")

    def __init__(self, difference: float, error_max: float, offset_max: float) -> None:
        self._difference, self._error_max, self._offset_max = difference, error_max, offset_max
        self.offset = 0.0
        self.begin()

    def begin(self) -> None:
        """Begin with a speed of 0."""
        self._steps = self._expected = 0.0

    def follow(self, wanted: float, share: float) -> bool:
        """Update the expected speed; returns whether the walk has had time to reach the command.

        Args:
            wanted: Commanded speed.
            share: Time since the last tick as a share of `RESPONSE_TIME`.
        """
        self._steps += share * (wanted - self._steps)
        self._expected += share * (self._steps - self._expected)
        return abs(wanted - self._expected) < self._difference

    def correct(self, wanted: float, walked: float, room: float, step: float) -> float:
        """The corrected speed.

        Args:
            wanted: Commanded speed.
            walked: Speed by odometry.
            room: Share of the correction for which the steps have room.
            step: Share of the error to learn in this tick.
        """
        lengthens = wanted * self.offset >= 0.0
        if step > 0.0:
            error = min(max(wanted - walked, -self._error_max), self._error_max)
            # A correction for which there is no room must not grow.
            if not (lengthens and room < 1.0 and error * self.offset > 0.0):
                offset = self.offset + step * error
                self.offset = min(max(offset, -self._offset_max), self._offset_max)
        return wanted + self.offset * (room if lengthens else 1.0)
