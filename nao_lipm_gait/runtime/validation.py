"""Sensor validation: one pass over each IMU and joint message whose stamp is known.

A message passes these checks in this order:

1. fields: all joints there, every number finite and inside its range; else the message is refused;
2. stuck sensors: the same numbers again and again while the robot moves;
3. spikes: a change that the robot cannot make from one sample to the next, or that a gyro does not
   confirm with its next one. The accelerometer's value of the same sample is not used either;
4. joints that do not follow their targets, until they have proved themselves: `JointCheck`;
   after that, motors that give no torque: `MotorWatch`.

While joints cannot be read, are stuck, show a spike or are wrong, the walk continues on the
positions that were commanded one feedback delay earlier. They are known well enough for a short
time.
"""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nao_lipm_gait.runtime.diagnostics import SENSORS, Diagnostics
from nao_lipm_gait.runtime.inputs import ImuInput, JointInput
from nao_lipm_gait.runtime.joint_check import JointCheck
from nao_lipm_gait.runtime.motor_watch import NEWER, OLDER, MotorWatch
from nao_lipm_gait.runtime.stamps import LONGEST_GAP
from robot_core.errors import NaoGaitError
from robot_core.log import Level
from robot_core.message_checks import read_array, repeated, some, stamp_of
from robot_core.robot import RobotDescription
from robot_core.types import GRAVITY, FloatArray, JointTargets

MOST_JOINTS = 1000
"""Names in a message."""
JOINT_MARGIN = 0.5
"""[rad] A position further beyond the joint limits than this is a broken reading."""
ANGLE_ABSURD = 1000.0
"""[rad] No angle in any unit."""
ACCELERATION_ABSURD = 1000.0
"""[m/s^2] Beyond the range of any accelerometer of a robot."""
ROTATION_ABSURD = 200.0
"""[rad/s] Beyond the range of any gyro of a robot."""

JOINT_REPEATS = 6
"""Equal joint samples in a row that no walking robot produces."""
IMU_REPEATS = 10
"""Equal IMU samples in a row that no working IMU produces: it has noise."""
IMU_STUCK_MOTION = 0.02
"""[rad] by which a joint must move while the IMU repeats itself, before the IMU counts as stuck."""
STUCK = 0.06
"""[rad] between commanded and measured position of joints that count as stuck."""

SPEED_SHARE = 3.0
"""Fastest plausible change of a joint, as a share of its speed limit. Joints that are pushed and
measured in encoder steps reach 1.6."""
ROTATION_STEP, ROTATION_ACCELERATION = 1.2, 120.0
"""[rad/s, rad/s^2] Largest change of the gyro between two samples that needs no confirmation by the
next one: 1.2 rad/s each 10 ms, more if samples between them were lost. The fastest walks reach 1.1,
pushes 0.8."""
ROTATION_AXES = np.array((1.0, 1.0, 2.0))
"""Factors of both about x, y and z: in a turn a landing foot changes a T1's yaw rate by 1.8."""
ROTATION_STEP_MAX = 4.0
"""[rad/s] Largest plausible change, which the next sample may confirm. A robot that falls reaches
2.6."""
ROTATION_FAST, FAST_TIME = 10.0, 300_000_000
"""[rad/s, ns] Samples above, or beyond a step of `ROTATION_STEP_MAX`, that are no spike are of no
robot: the IMU is not used until it has been slower for this time. Walks reach 20 in deg/s."""
FORCE_RANGE, FORCE_TIME, FORCE_RIGHT = (3.0, 30.0), 0.5, 1.0
"""[m/s^2, s, s] Mean size of the specific force, also of a robot that falls; time of that mean, and
time for which it must have been right: what is wrong from the start is found in the stand."""
SPIKE_SAMPLES = 3
"""Samples in a row that are replaced by the last plausible one at most; the next one is real."""
COMMAND_AGE = 300_000_000
"""[ns] Older commands do not tell where a joint is now."""


@dataclass(frozen=True, slots=True)
class ImuSample:
    """A validated IMU message [ns, (3,) rad/s, (3,) m/s^2] in the torso frame."""

    stamp: int
    angular_velocity: FloatArray
    linear_acceleration: FloatArray


@dataclass(frozen=True, slots=True)
class JointSample:
    """A validated joint state [ns, (n,) rad], in the order of the robot's joints."""

    stamp: int
    position: FloatArray


class JointReader:
    """Reads joints by name into the order of the robot's joints, which must all be there."""

    def __init__(self, robot: RobotDescription) -> None:
        self._order = robot.joint_names
        self._coupled = robot.coupled_joints
        self._lower = robot.lower - JOINT_MARGIN
        self._upper = robot.upper + JOINT_MARGIN
        self._names: list[str] | None = None
        self._indices = np.zeros(0, dtype=np.intp)
        self.refused: FloatArray | None = None
        """Position (n,) [rad] of the last message, if an angle is outside its range."""

    def read(self, message: JointInput) -> FloatArray:
        """Position (n,) [rad] of a message; NaoGaitError names the field that is refused."""
        self.refused = None
        indices = self._indices_of(message.names)
        count = len(message.names)
        if len(message.position) != count:
            got = f"{len(message.position)} values"
            raise NaoGaitError("joint_states position", got, f"{count}, one for each name")
        q = np.asarray(message.position, dtype=float)[indices]
        inside = (q >= self._lower) & (q <= self._upper)  # false for NaN as well
        if not inside.all():
            self.refused = q if np.abs(q).max() < ANGLE_ABSURD else None
            bad = int(np.argmin(inside))
            raise NaoGaitError(
                f"joint_states position[{self._order[bad]}]",
                float(q[bad]),
                f"a finite number from {self._lower[bad]:.3g} to {self._upper[bad]:.3g} rad",
            )
        return q

    def effort(self, message: JointInput) -> FloatArray | None:
        """Motor torques (n,) [N m] of the message that was read last; None if it has none."""
        if len(message.effort) != len(message.position):
            return None
        return np.asarray(message.effort, dtype=float)[self._indices]

    def _indices_of(self, names: Sequence[str]) -> np.ndarray:
        if names == self._names:  # the usual case: the same sender as before
            return self._indices
        if len(names) > MOST_JOINTS:
            raise NaoGaitError("joint_states name", f"{len(names)} names", f"{MOST_JOINTS} at most")
        place = {name: index for index, name in enumerate(names)}
        if len(place) != len(names):
            twice = f"{repeated(names)} more than once"
            raise NaoGaitError("joint_states name", twice, "each joint once")
        for leader, follower in self._coupled:
            if leader in place:  # one motor turns both, and some drivers name only one of them
                place.setdefault(follower, place[leader])
        missing = [name for name in self._order if name not in place]
        if missing:
            allowed = f"all {len(self._order)} joints of the robot, in any order"
            raise NaoGaitError("joint_states name", f"no {some(missing)}", allowed)
        self._indices = np.array([place[name] for name in self._order], dtype=np.intp)
        self._names = list(names)
        return self._indices


class StepFilter:
    """Replaces values that changed more than they can from one sample to the next.

    Args:
        confirmable: A larger change counts as soon as two samples in a row agree on it, up to this
            one; 0 for none.

    Attributes:
        kept: (n,) The last values that were not replaced; None before the first.
    """

    def __init__(self, confirmable: float = 0.0) -> None:
        self._confirmable = confirmable
        self._last: FloatArray | None = None
        self._measured: FloatArray | None = None
        self.kept: FloatArray | None = None
        self._replaced: FloatArray = np.zeros(0, dtype=int)
        """(n,) Samples in a row for which each value was replaced."""

    def restart(self, values: FloatArray | None) -> None:
        """Forget the past; continue from `values` (n,), or from the next sample if None."""
        self._last = self._measured = self.kept = values
        if values is not None:
            self._replaced = np.zeros(values.shape, dtype=int)

    def apply(
        self, values: FloatArray, step: FloatArray | float, substitute: FloatArray | None = None
    ) -> tuple[FloatArray, np.ndarray]:
        """Filter one sample (n,).

        Args:
            values: As measured.
            step: Largest plausible change, (n,) or one for all.
            substitute: (n,) What to use instead, for as long as needed; None = the last output, for
                at most SPIKE_SAMPLES samples.

        Returns:
            The filtered values (n,), and the indices of those that were replaced.
        """
        last = self._last
        if last is None:
            self.restart(values)
            return values, np.zeros(0, dtype=int)
        before, self._measured = self._measured, values
        implausible = np.abs(values - last) > step
        if substitute is not None and implausible.any() and self.kept is not None:
            # A substitute may be far from the truth: a few samples may return to before it.
            returned = np.abs(values - self.kept) <= step
            implausible &= ~(returned & (self._replaced <= SPIKE_SAMPLES))
        if not implausible.any():
            if self._replaced.any():
                self._replaced[:] = 0
            self._last = self.kept = values
            return values, np.zeros(0, dtype=int)
        replace = implausible
        if substitute is None:
            replace = implausible & (self._replaced < SPIKE_SAMPLES)
        if self._confirmable > 0.0 and before is not None:
            agree = np.abs(values - before) <= step
            replace &= ~(agree & (np.abs(values - last) <= self._confirmable))
        self._replaced = np.where(replace, self._replaced + 1, 0)
        filtered = np.where(replace, last if substitute is None else substitute, values)
        self._last = filtered
        self.kept = values if self.kept is None else np.where(replace, self.kept, values)
        return filtered, np.flatnonzero(replace)


class CommandHistory:
    """The targets of the last moments, by the stamp of the frame that they answered."""

    def __init__(self) -> None:
        self._sent: deque[JointTargets] = deque(maxlen=64)

    def clear(self) -> None:
        """Forget all targets."""
        self._sent.clear()

    def add(self, targets: JointTargets) -> None:
        """Keep targets that were sent."""
        while self._sent and targets.stamp <= self._sent[-1].stamp:
            self._sent.pop()  # a late frame is answered again, or the time base has changed
        self._sent.append(targets)

    def position_at(self, stamp: int, delay: int) -> FloatArray | None:
        """Where the joints (n,) [rad] should be at `stamp` [ns], `delay` [ns] after the command.

        None if there is no command that recent, or it took the torque off.
        """
        for targets in reversed(self._sent):
            age = stamp - delay - targets.stamp
            if age >= 0:
                return targets.pose if age < COMMAND_AGE and targets.stiffness > 0.0 else None
        return None

    def positions_between(self, first: int, last: int) -> list[FloatArray]:
        """Where the joints (n,) [rad] should be from the stamp `first` to `last` [ns], by the load.

        Without one, motors turn them as far as what they were commanded beyond the pose.
        """
        found = []
        for targets in reversed(self._sent):
            if targets.stamp < first:
                break
            if targets.stamp <= last:
                found.append(targets.pose)
                if targets.lead is not None:
                    found.append(targets.position)
        return found


class SensorValidation:
    """Turns sensor messages into samples that the gait can use.

    Args:
        robot: The robot that is measured.
        period: Control period [s].
        say: Takes what was found.

    Attributes:
        joints: Whether they follow their targets.
        motors: Whether those of the legs give torque.
        unread_since: Stamp of the first of the joint states in a row that were substituted at least
            in part [ns]; None while joints are read.
    """

    def __init__(self, robot: RobotDescription, period: float, say: Diagnostics) -> None:
        self._say = say
        self.joints = JointCheck(robot, period)
        self.motors = MotorWatch(robot, period)
        self._reader = JointReader(robot)
        self._names = robot.joint_names
        self._period = period
        self._fastest = SPEED_SHARE * np.asarray(robot.velocity_limit, dtype=float)
        self._joint_steps = StepFilter()
        self._gyro_steps = StepFilter(ROTATION_STEP_MAX)
        self._acceleration: FloatArray | None = None
        self._imu_at = 0
        self._spike: tuple[np.ndarray, FloatArray, str] | None = None
        self._fast_samples = 0
        self._fast_at: int | None = None
        self._force, self._force_right = GRAVITY, 0.0
        self._commands = CommandHistory()
        self._joints_at: int | None = None
        self._compared_at: int | None = None
        self._forget_repeats(None)
        self.unread_since: int | None = None

    def _forget_repeats(self, position: FloatArray | None) -> None:
        self._imu_values: tuple[object, object] | None = None
        self._imu_repeats = self._joint_repeats = 0
        self._measured = position
        self._measured_before_repeats: FloatArray | None = None
        self._joints_stuck = False

    def restart(self, joints: JointSample, steady: bool) -> None:
        """Begin a new time base with `joints`; the gyro of a `steady` robot is still good."""
        self._forget_repeats(joints.position)
        self._commands.clear()
        self.joints.restart()
        self.motors.restart()
        self.unread_since = None
        self._joints_at = self._compared_at = joints.stamp
        self._joint_steps.restart(joints.position)
        if not steady:
            self._gyro_steps.restart(None)

    def forget_wrong_joints(self) -> None:
        """What was found wrong with the joints was that they follow another gait."""
        if self.joints.trouble:
            self.joints.restart()
            self._say.end("wrong joints", "the leg joints follow the targets of another gait")

    def forget_motors(self) -> None:
        """The robot lies, or a motion moves it: its legs are judged anew in the next walk."""
        if self.motors.trouble:
            self.motors.restart()

    def sent(self, targets: JointTargets) -> None:
        """Keep targets that were sent; they stand in for joints that cannot be read."""
        self._commands.add(targets)

    # -- IMU ---------------------------------------------------------------------------------------

    def imu(self, message: ImuInput, *, upright: bool = True) -> ImuSample:
        """Validate an IMU message; NaoGaitError if it cannot be used, or the IMU is stuck.

        A robot that has fallen, or is in a motion, may turn as fast as it likes.
        """
        stamp = stamp_of(message.sec, message.nanosec, "imu/data header.stamp")
        for field, covariance in (
            ("angular_velocity", message.angular_velocity_covariance),
            ("linear_acceleration", message.linear_acceleration_covariance),
        ):
            if covariance == -1.0:
                raise NaoGaitError(
                    f"imu/data {field}_covariance[0]", -1.0, "0 or more: this gait needs the field"
                )
        rotation, force = message.angular_velocity, message.linear_acceleration
        rate = read_array(
            rotation, "imu/data angular_velocity", (3,), ROTATION_ABSURD, "rad/s", "xyz"
        )
        acceleration = read_array(
            force, "imu/data linear_acceleration", (3,), ACCELERATION_ABSURD, "m/s^2", "xyz"
        )
        measured = rate
        elapsed, self._imu_at = (stamp - self._imu_at) * 1e-9, stamp
        self._check_units(stamp, rate, acceleration, elapsed, upright=upright)
        if abs(elapsed) > LONGEST_GAP * 1e-9:
            self._gyro_steps.restart(None)
        step = max(ROTATION_STEP, ROTATION_ACCELERATION * elapsed)
        limit = np.minimum(step * ROTATION_AXES, ROTATION_STEP_MAX)
        rate, replaced = self._gyro_steps.apply(measured, limit)
        if not len(replaced) or self._acceleration is None:
            self._acceleration = acceleration
        self._settle_spike(measured, limit)
        if len(replaced):
            axis = int(replaced[0])
            text = (
                f"imu/data angular_velocity.{'xyz'[axis]}: got {measured[axis]:.3g} after "
                f"{rate[axis]:.3g}; allowed: steps of {limit[axis]:.3g} rad/s; "
                "the last sample is used"
            )
            self._spike = replaced, measured, text
            acceleration = self._acceleration
        self._check_orientation(message)
        if self._imu_is_stuck(rotation, force):
            raise NaoGaitError(
                "imu/data", "the same numbers while joints move", "an IMU that is not stuck"
            )
        return ImuSample(stamp, rate, acceleration)

    def _settle_spike(self, measured: FloatArray, limit: FloatArray) -> None:
        """Report values that were replaced, unless the next sample (3,) [rad/s] confirms them."""
        if self._spike is None:
            return
        (axes, spike, text), self._spike = self._spike, None
        if (np.abs(measured - spike) > limit)[axes].any():
            self._say.event(SENSORS, Level.WARN, "gyro spike", text)

    def _check_units(
        self, stamp: int, rate: FloatArray, acceleration: FloatArray, elapsed: float,
        *, upright: bool,
    ) -> None:  # fmt: skip
        """Refuse an IMU whose units have changed: no robot moves like that.

        Raises:
            NaoGaitError: It cannot be used now.
        """
        size, kept = np.abs(rate), self._gyro_steps.kept
        step = size if kept is None else np.minimum(size, np.abs(rate - kept))
        fast = bool(size.max() > ROTATION_FAST or step.max() > ROTATION_STEP_MAX)
        self._fast_samples = self._fast_samples + 1 if fast else 0
        again = self.gyro_jumps and self._fast_samples > 1
        if again or (upright and self._fast_samples > SPIKE_SAMPLES):
            self._fast_at = stamp
        if self.gyro_jumps and not 0 <= stamp - (self._fast_at or 0) < FAST_TIME:
            self._fast_at = None
            self._gyro_steps.restart(None)
        if self.gyro_jumps:
            allowed = (
                f"at most {ROTATION_FAST:g} rad/s, in steps of {ROTATION_STEP_MAX:g} rad/s; deg/s "
                "instead of rad/s?"
            )
            raise NaoGaitError("imu/data angular_velocity", f"{_size(rate):.3g} rad/s", allowed)
        share = elapsed / FORCE_TIME if 0.0 < elapsed < FORCE_TIME else 0.0
        self._force += share * (_size(acceleration) - self._force)
        low, high = FORCE_RANGE
        if low <= self._force <= high:
            self._force_right += share * FORCE_TIME
        elif self._force_right >= FORCE_RIGHT:
            unit = "g instead of m/s^2?" if self._force < low else "unit or scale?"
            raise NaoGaitError(
                "imu/data linear_acceleration", f"{self._force:.3g} m/s^2 on average",
                f"{low:g} to {high:g} m/s^2; {unit}",
            )  # fmt: skip

    @property
    def gyro_jumps(self) -> bool:
        """The gyro has measured what no robot does: it has to prove itself again."""
        return self._fast_at is not None

    def _check_orientation(self, message: ImuInput) -> None:
        """Report an orientation that is claimed and not there; the gait estimates its own."""
        if message.orientation_covariance == -1.0:
            return
        norm = math.sqrt(sum(value * value for value in message.orientation))
        if not math.isfinite(norm) or abs(norm - 1.0) > 0.1:
            error = NaoGaitError(
                "imu/data orientation",
                tuple(round(value, 6) for value in message.orientation),
                "a unit quaternion, or orientation_covariance[0] = -1 for none",
            )
            text = f"{error}; the gait does not use it and walks on"
            self._say.event(SENSORS, Level.WARN, error.field, text)

    def _imu_is_stuck(self, rotation: tuple[float, ...], force: tuple[float, ...]) -> bool:
        values = (rotation, force)
        if values != self._imu_values:
            self._imu_values, self._imu_repeats = values, 0
            self._measured_before_repeats = self._measured
            return False
        self._imu_repeats += 1
        now, before = self._measured, self._measured_before_repeats
        if self._imu_repeats < IMU_REPEATS or now is None or before is None:
            return False
        # Joints that are stuck as well show no motion, although the robot moves.
        return self._joints_stuck or float(np.max(np.abs(now - before))) > IMU_STUCK_MOTION

    # -- joints ------------------------------------------------------------------------------------

    def read_joints(self, message: JointInput, stamp: int) -> JointSample:
        """Check the fields of a joint state that does not follow the last one; keep nothing."""
        return JointSample(stamp, self._reader.read(message))

    def next_joints(
        self, message: JointInput, stamp: int, *, delay: int, walking: bool, driven: bool = False
    ) -> JointSample:
        """Validate the joint state that follows the last one.

        Positions that cannot be used are replaced by those that were commanded `delay` [ns] before.
        The joints of a robot that is `walking` must move, and those of one that is `driven`, in a
        stand or a walk, must follow their targets.

        Raises:
            NaoGaitError: If the joints cannot be read and no command tells where they are.
        """
        commanded = self._commands.position_at(stamp, delay)
        try:
            position = self._reader.read(message)
        except NaoGaitError as error:
            if commanded is None:
                raise
            self._say.rejected["joint_states"] += 1
            refused = self._reader.refused
            if refused is not None and self.joints.begins:
                self._are_wrong(stamp, refused, commanded if driven else None, walking)
            return self._substituted(stamp, commanded, str(error), error.field)
        if self._are_stuck(position, commanded, walking) and commanded is not None:
            trouble = "joint_states position: stuck while the robot walks"
            return self._substituted(stamp, commanded, trouble, trouble)
        elapsed = (stamp - (self._joints_at or 0)) * 1e-9
        ticks = max(1, round(elapsed / self._period))
        wrong = self._are_wrong(stamp, position, commanded if driven else None, walking)
        position = self._without_spikes(stamp, position, commanded)
        target = commanded if driven and walking else None
        self._watch_motors(message, position, target, stamp - delay, ticks)
        self._joints_at = stamp
        return JointSample(stamp, commanded if wrong and commanded is not None else position)

    def _are_wrong(
        self, stamp: int, position: FloatArray, commanded: FloatArray | None, walking: bool
    ) -> bool:
        check = self.joints
        ticks = max(1, round((stamp - (self._compared_at or 0)) * 1e-9 / self._period))
        self._compared_at = stamp
        if check.done:
            return False
        if commanded is None:
            check.interrupt()
            return False
        check.update(position, commanded, walking=walking, ticks=ticks)
        if not check.trouble:
            self._say.end("wrong joints", "the leg joints follow their targets")
            return False
        self._say.begin(SENSORS, Level.ERROR, "wrong joints", check.trouble)
        return True

    def _watch_motors(
        self, message: JointInput, position: FloatArray, target: FloatArray | None, due: int,
        ticks: int,
    ) -> None:  # fmt: skip
        """Compare joints (n,) [rad] with the target of the stamp `due` [ns]; None: not now."""
        motors = self.motors
        if motors.trouble:
            self._say.begin(SENSORS, Level.ERROR, "motor", motors.trouble)
            return
        self._say.end("motor", "the leg motors are judged again")
        effort = None if target is None else self._reader.effort(message)
        if target is None or effort is None:
            motors.interrupt()
            return
        step = round(self._period * 1e9)
        first, last = due - OLDER * step, due + NEWER * step

        def around() -> list[FloatArray]:
            return [target, *self._commands.positions_between(first, last)]

        motors.update(position, effort, target, around, ticks)

    def _are_stuck(
        self, position: FloatArray, commanded: FloatArray | None, walking: bool
    ) -> bool:
        same = self._measured is not None and bool((position == self._measured).all())
        self._joint_repeats = self._joint_repeats + 1 if same else 0
        self._measured = position
        # Found while walking, and kept until the joints move: also in the stand that follows.
        self._joints_stuck = self._joint_repeats >= JOINT_REPEATS and (
            self._joints_stuck
            or (
                walking
                and commanded is not None
                and bool(np.abs(commanded - position).max() >= STUCK)
            )
        )
        return self._joints_stuck

    def _substituted(
        self, stamp: int, commanded: FloatArray, trouble: str, key: str
    ) -> JointSample:
        self.unread_since = stamp if self.unread_since is None else self.unread_since
        text = f"{trouble}; using the commanded joint positions"
        self._say.event(SENSORS, Level.WARN, key, text, burst=5)
        return JointSample(stamp, commanded)

    def _without_spikes(
        self, stamp: int, position: FloatArray, commanded: FloatArray | None
    ) -> FloatArray:
        elapsed = (stamp - (self._joints_at or 0)) * 1e-9
        filtered, replaced = self._joint_steps.apply(position, self._fastest * elapsed, commanded)
        if not len(replaced):
            self.unread_since = None
            return filtered
        self.unread_since = stamp if self.unread_since is None else self.unread_since
        joint = int(replaced[0])
        text = (
            f"joint_states position[{self._names[joint]}]: got {position[joint]:.3g}; allowed: "
            f"changes of {self._fastest[joint]:.3g} rad/s; {filtered[joint]:.3g} is used"
        )
        self._say.event(SENSORS, Level.WARN, "joint spike", text)
        return filtered


def _size(vector: FloatArray) -> float:
    return math.hypot(*vector.tolist())
