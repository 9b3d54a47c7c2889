"""What is believed of a sensor message: as read, or held, or where the joints were told to be.

Where the joints should be, by what they were told: for moments in which they cannot be read.

Single wrong numbers of a sensor: what cannot have changed so much is not believed at once.

Sensors that go on sending and no longer measure.

A living IMU has noise, and the joints of a walking robot move: the same numbers again and again,
while other things change, come from a sensor that is stuck.

From the numbers of a message to checked values. Plain data in and out, no ROS types.

Everything that is refused raises NaoGaitError with topic and field, value and what is allowed.
"""

import math
from collections import Counter, deque
from collections.abc import Sequence

import numpy as np

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.robot import RobotDescription
from nao_lipm_gait.runtime.diagnostics import SENSORS, Level, Remarks
from nao_lipm_gait.runtime.frame_sync import ImuSample
from nao_lipm_gait.runtime.inputs import ImuInput, JointInput
from nao_lipm_gait.types import FloatArray, JointTargets, VelocityCommand

SPEED_ABSURD = 10.0
"""[m/s] No command for a small humanoid: a wrong unit or a broken sender."""
TURN_ABSURD = 100.0
"""[rad/s]"""
JOINT_MARGIN = 0.5
"""[rad] A joint that reads further beyond its limits than this is a broken reading."""
JOINT_SPEED_ABSURD = 200.0
"""[rad/s]"""
ACCELERATION_ABSURD = 1000.0
"""[m/s^2] Beyond any accelerometer of a robot."""
ROTATION_ABSURD = 200.0
"""[rad/s] Beyond any gyro of a robot."""

_NANOSECONDS = 1_000_000_000


def stamp_of(sec: int, nanosec: int, field: str) -> int:
    """[ns] from the two parts of a ROS stamp."""
    if nanosec >= _NANOSECONDS:
        raise NaoGaitError(f"{field}.nanosec", nanosec, "0 to 999999999")
    if sec < 0:
        raise NaoGaitError(f"{field}.sec", sec, "0 or more")
    return sec * _NANOSECONDS + nanosec


def finite(value: float, field: str, limit: float, unit: str) -> float:
    """`value`, if it is finite and not beyond `limit` in size."""
    if not math.isfinite(value) or abs(value) > limit:
        raise NaoGaitError(field, value, f"a finite number from {-limit:g} to {limit:g} {unit}")
    return value


def read_velocity(
    linear: Sequence[float], angular: Sequence[float], topic: str = "cmd_vel"
) -> VelocityCommand:
    """The planar part of a twist; linear and angular are x, y, z in [m/s] and [rad/s].

    The other three components are ignored, but must be finite: a sender with a NaN anywhere is
    broken.
    """
    for axis, value in zip("xyz", linear, strict=True):
        finite(value, f"{topic} linear.{axis}", SPEED_ABSURD, "m/s")
    for axis, value in zip("xyz", angular, strict=True):
        finite(value, f"{topic} angular.{axis}", TURN_ABSURD, "rad/s")
    return VelocityCommand(x=linear[0], y=linear[1], yaw=angular[2])


def read_vector(values: Sequence[float], field: str, limit: float, unit: str) -> FloatArray:
    """(3,) finite numbers of at most `limit`."""
    for axis, value in zip("xyz", values, strict=True):
        finite(value, f"{field}.{axis}", limit, unit)
    return np.array(values, dtype=float)


def check_orientation(quaternion: Sequence[float], covariance_0: float, topic: str) -> None:
    """Complain about an IMU that claims an orientation and gives none. x, y, z, w.

    REP-145: orientation_covariance[0] = -1 says that there is no orientation.
    """
    if covariance_0 == -1.0:
        return
    norm = math.sqrt(sum(value * value for value in quaternion))
    if not math.isfinite(norm) or abs(norm - 1.0) > 0.1:
        raise NaoGaitError(
            f"{topic} orientation",
            tuple(round(value, 6) for value in quaternion),
            "a unit quaternion, or orientation_covariance[0] = -1 for none",
        )


def some(names: Sequence[str]) -> str:
    """The first few of names that came from outside, none of them longer than a line."""
    shown = ", ".join(name[:40] for name in names[:5])
    return shown if len(names) <= 5 else f"{shown} and {len(names) - 5} more"


def repeated(names: Sequence[str]) -> str:
    """The names that occur more than once."""
    return some([name for name, count in Counter(names).items() if count > 1])


class JointReader:
    """Reads joints by name into the order of the robot's joint arrays."""

    def __init__(self, robot: RobotDescription, topic: str) -> None:
        self._topic = topic
        self._order = robot.joint_names
        self._lower = robot.lower - JOINT_MARGIN
        self._upper = robot.upper + JOINT_MARGIN
        self._names: list[str] | None = None
        self._indices = np.zeros(0, dtype=np.intp)

    def read(
        self, names: Sequence[str], position: Sequence[float], velocity: Sequence[float]
    ) -> tuple[FloatArray, FloatArray | None]:
        """Position (n,) [rad] and velocity (n,) [rad/s], None where the message has no velocity.

        The names may come in any order and with extra joints among them.
        """
        indices = self._indices_of(names)
        count = len(names)
        if len(position) != count:
            raise NaoGaitError(
                f"{self._topic} position", f"{len(position)} values", f"{count}, one for each name"
            )
        if len(velocity) not in (0, count):
            raise NaoGaitError(
                f"{self._topic} velocity",
                f"{len(velocity)} values",
                f"{count}, one for each name, or none",
            )
        q = np.asarray(position, dtype=float)[indices]
        # A NaN fails the comparison too.
        inside = (q >= self._lower) & (q <= self._upper)
        if not inside.all():
            bad = int(np.argmin(inside))
            raise NaoGaitError(
                f"{self._topic} position[{self._order[bad]}]",
                float(q[bad]),
                f"a finite number from {self._lower[bad]:.3g} to {self._upper[bad]:.3g} rad",
            )
        if len(velocity) == 0:
            return q, None
        qd = np.asarray(velocity, dtype=float)[indices]
        slow = np.abs(qd) <= JOINT_SPEED_ABSURD
        if not slow.all():
            bad = int(np.argmin(slow))
            raise NaoGaitError(
                f"{self._topic} velocity[{self._order[bad]}]",
                float(qd[bad]),
                f"a finite number of at most {JOINT_SPEED_ABSURD:g} rad/s",
            )
        return q, qd

    def _indices_of(self, names: Sequence[str]) -> np.ndarray:
        if names == self._names:  # the usual case: the same sender as before
            return self._indices
        field = f"{self._topic} name"
        place = {name: index for index, name in enumerate(names)}
        if len(place) != len(names):
            raise NaoGaitError(field, f"{repeated(names)} more than once", "each joint once")
        missing = [name for name in self._order if name not in place]
        if missing:
            raise NaoGaitError(
                field,
                f"no {', '.join(missing)}",
                f"all {len(self._order)} joints of the robot, in any order",
            )
        self._indices = np.array([place[name] for name in self._order], dtype=np.intp)
        self._names = list(names)
        return self._indices


JOINT_REPEATS = 6
"""Equal joint samples in a row that no walking robot gives."""
IMU_REPEATS = 10
"""Equal IMU samples in a row, while joints move, that no living IMU gives."""
MOVED = 0.02
"""[rad] by which a joint moves while the IMU says the same."""


class FrozenSensors:
    """Watches the values, not the stamps."""

    def __init__(self) -> None:
        self._imu: tuple[object, object] | None = None
        self._imu_repeats = 0
        self._pose_then: FloatArray | None = None
        self._pose: FloatArray | None = None
        self._joint_repeats = 0

    def begin_anew(self) -> None:
        self.__init__()  # type: ignore[misc]

    def see_imu(self, rotation: tuple[float, ...], force: tuple[float, ...]) -> None:
        """One IMU sample."""
        values = (rotation, force)
        if values == self._imu:
            self._imu_repeats += 1
        else:
            self._imu, self._imu_repeats, self._pose_then = values, 0, self._pose

    def see_joints(self, position: FloatArray) -> None:
        """One joint sample (n,) [rad]."""
        same = self._pose is not None and bool((position == self._pose).all())
        self._joint_repeats = self._joint_repeats + 1 if same else 0
        self._pose = position

    @property
    def joints(self) -> bool:
        """Nothing moves: a robot at rest, or joints that are stuck."""
        return self._joint_repeats >= JOINT_REPEATS

    @property
    def imu(self) -> bool:
        """The IMU is stuck."""
        if self._imu_repeats < IMU_REPEATS or self._pose is None or self._pose_then is None:
            return False
        return float(np.max(np.abs(self._pose - self._pose_then))) > MOVED


SPEED_SHARE = 3.0
"""Of a joint's speed limit. Joints that are pushed, measured in steps of an encoder, reach 1.6."""
ROTATION_STEP = 4.0
"""[rad/s] from one gyro sample to the next. Pushes and falls reach 2."""
PATIENCE = 3
"""Samples in a row that are held; a fourth is believed: it is how things are now. Where there is
something better to believe, it is believed for as long as it takes."""


class StepFilter:
    """Holds the last believed values where new ones are further away than `step`."""

    def __init__(self) -> None:
        self._last: FloatArray | None = None
        self._held: FloatArray = np.zeros(0, dtype=int)

    def begin_anew(self) -> None:
        self._last = None

    def see(
        self, values: FloatArray, step: FloatArray | float, instead: FloatArray | None = None
    ) -> tuple[FloatArray, np.ndarray]:
        """The believed values (n,), and the indices of those that are held.

        Args:
            step: (n,) or one for all, the largest believable change.
            instead: (n,) what to believe in place of what is not believable; None = the last.
        """
        last = self._last
        if last is None or last.shape != values.shape:
            self._last, self._held = values, np.zeros(values.shape, dtype=int)
            return values, np.zeros(0, dtype=int)
        wild = np.abs(values - last) > step
        if not wild.any():
            if self._held.any():
                self._held[:] = 0
            self._last = values
            return values, np.zeros(0, dtype=int)
        hold = wild if instead is not None else wild & (self._held < PATIENCE)
        self._held = np.where(hold, self._held + 1, 0)
        believed = np.where(hold, last if instead is None else instead, values)
        self._last = believed
        return believed, np.flatnonzero(hold)


class SpikeFilter:
    """Joints and gyro, each by how fast they can change."""

    def __init__(self, robot: RobotDescription) -> None:
        self._speed = SPEED_SHARE * np.asarray(robot.velocity_limit, dtype=float)
        self._names = robot.joint_names
        self._joints = StepFilter()
        self._gyro = StepFilter()

    def begin_anew(self) -> None:
        self._joints.begin_anew()
        self._gyro.begin_anew()

    def joints(
        self, position: FloatArray, elapsed: float, told: FloatArray | None = None
    ) -> tuple[FloatArray, str | None]:
        """(n,) [rad] as believed, `elapsed` [s] after the last; a word about what is held.

        told: (n,) where the joints were told to be, None where they are not.
        """
        believed, held = self._joints.see(position, self._speed * elapsed, told)
        if not len(held):
            return believed, None
        worst = int(held[0])
        return believed, (
            f"joint_states position[{self._names[worst]}]: got {position[worst]:.3g} after "
            f"{believed[worst]:.3g}; allowed: {self._speed[worst]:.3g} rad/s; not believed"
        )

    def rotation(self, rate: FloatArray) -> tuple[FloatArray, str | None]:
        """(3,) [rad/s] as believed; a word about what is held."""
        believed, held = self._gyro.see(rate, ROTATION_STEP)
        if not len(held):
            return believed, None
        axis = int(held[0])
        return believed, (
            f"imu/data angular_velocity.{'xyz'[axis]}: got {rate[axis]:.3g} after "
            f"{believed[axis]:.3g}; allowed: steps of {ROTATION_STEP:g} rad/s; held for a moment"
        )


OLDEST = 300_000_000
"""[ns] Targets that are older say nothing about now."""


class JointBelief:
    """Keeps the targets of the last moments by the stamp that they answered."""

    def __init__(self) -> None:
        self._told: deque[JointTargets] = deque(maxlen=64)

    def begin_anew(self) -> None:
        self._told.clear()

    def told(self, targets: JointTargets) -> None:
        """Targets that were sent."""
        if self._told and targets.stamp <= self._told[-1].stamp:
            self._told.clear()  # another time
        self._told.append(targets)

    def at(self, stamp: int, delay: int) -> FloatArray | None:
        """(n,) [rad] at `stamp` [ns], if targets need `delay` [ns] to show in the sensors.

        None where nothing was told, or the joints are limp.
        """
        for targets in reversed(self._told):
            age = stamp - delay - targets.stamp
            if age >= 0:
                return targets.position if age < OLDEST and targets.stiffness > 0.0 else None
        return None


STUCK = 0.06
"""[rad] by which stuck joints are not where they were told to be."""


class SensorValidation:
    """Reads the values of IMU and joints; stamps are not looked at in here."""

    def __init__(self, robot: RobotDescription, remarks: Remarks) -> None:
        self._remarks = remarks
        self._reader = JointReader(robot, "joint_states")
        self._frozen = FrozenSensors()
        self._spikes = SpikeFilter(robot)
        self._joints = JointBelief()
        self._stuck = False
        self.unread_since: int | None = None
        """Stamp of the first of the joint states in a row that could not be read [ns]."""

    def begin_anew(self, steady: bool) -> None:
        """A new time; steady: the robot is where it was."""
        self._frozen.begin_anew()
        self._joints.begin_anew()
        self._stuck = False
        self.unread_since = None
        if not steady:
            self._spikes.begin_anew()

    def told(self, targets: JointTargets) -> None:
        """Targets that were sent."""
        self._joints.told(targets)

    def imu(self, message: ImuInput) -> ImuSample:
        """Raises NaoGaitError for what cannot be used."""
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
        rate = read_vector(rotation, "imu/data angular_velocity", ROTATION_ABSURD, "rad/s")
        pull = read_vector(force, "imu/data linear_acceleration", ACCELERATION_ABSURD, "m/s^2")
        rate, spike = self._spikes.rotation(rate)
        if spike is not None:
            self._remarks.tell(SENSORS, Level.WARN, "gyro spike", spike)
        try:
            check_orientation(message.orientation, message.orientation_covariance, "imu/data")
        except NaoGaitError as error:
            # Not used by the gait, which estimates its own; but someone should know.
            text = f"{error}; the orientation is not used, walking goes on"
            self._remarks.tell(SENSORS, Level.WARN, error.field, text)
        self._frozen.see_imu(rotation, force)
        if self._frozen.imu:
            raise NaoGaitError(
                "imu/data", "the same numbers while joints move", "an IMU that is not stuck"
            )
        return ImuSample(stamp, rate, pull)

    def joints(
        self, stamp: int, message: JointInput, *, delay: int, is_next: bool, on_the_way: bool
    ) -> tuple[FloatArray, FloatArray | None, bool]:
        """Position and velocity; true where they cannot be read, but are those that were told.

        delay: [ns] that targets need to show in the sensors. is_next: the stamp follows the last
        one. on_the_way: the robot walks, so its joints move. Raises NaoGaitError where the joints
        cannot be read and nobody can tell where they are.
        """
        told = self._joints.at(stamp, delay) if is_next else None
        try:
            position, velocity = self._reader.read(
                message.names, message.position, message.velocity
            )
        except NaoGaitError as error:
            if told is None:
                raise
            self._remarks.rejected["joint_states"] += 1
            trouble, key = str(error), error.field
        else:
            self._frozen.see_joints(position)
            # Found on the way, and until they move: also in the stand that the walk ends in.
            self._stuck = self._frozen.joints and (
                self._stuck
                or (on_the_way and told is not None and np.abs(told - position).max() >= STUCK)
            )
            if told is None or not self._stuck:
                return position, velocity, False
            trouble = key = "joint_states position: stuck while the robot walks"
        self.unread_since = self.unread_since or stamp
        text = f"{trouble}; the joints are taken to be where they were told to be"
        self._remarks.tell(SENSORS, Level.WARN, key, text, burst=5)
        return told, None, True

    def without_spikes(
        self, stamp: int, position: FloatArray, *, delay: int, elapsed: float, unread: bool
    ) -> FloatArray:
        """(n,) [rad] what is believed of a position (n,), `elapsed` [s] after the last.

        unread: the position is one that was told.
        """
        position, spike = self._spikes.joints(position, elapsed, self._joints.at(stamp, delay))
        if spike is not None:
            self.unread_since = self.unread_since or stamp
            self._remarks.tell(SENSORS, Level.WARN, "joint spike", spike)
        elif not unread:
            self.unread_since = None
        return position
