"""Brings the IMU sample and the joint sample of one instant together."""

from collections import deque
from math import cos, sin

import numpy as np

from nao_lipm_gait.estimation.state_estimator import GAP_MAX
from nao_lipm_gait.runtime.validation import ImuSample, JointSample
from robot_core.errors import NaoGaitError
from robot_core.types import GRAVITY, FloatArray, SensorFrame

MAX_IMU_AGE = 50_000_000
"""[ns] An IMU sample further than this from the joint sample is not used for it."""
PATIENCE = 10
"""Joint samples in a row without an IMU sample of their stamp, after which they no longer wait."""
REPEATS = 2
"""Repeats of a joint sample until it is used without its IMU sample. The first repeat may have
overtaken an IMU sample that is repeated too."""
OVERTAKEN = 100_000_000
"""[ns] An IMU sample this little behind the newest one was overtaken; more is a new time base."""
UPRIGHT = (0.0, 0.0)
_NO_ROTATION = np.zeros(3)


class FrameSync:
    """Makes one frame of each joint sample, with the IMU sample of the same stamp.

    A joint sample that arrives before its IMU sample waits for it, until the next joint sample at
    most. If the two stamps never agree, the nearest IMU sample is used at once. If none is near
    enough, the frame is blind: no rotation, and the acceleration of a body at rest. A robot in
    lockstep does not send a next joint sample before it has its answer; it repeats this one.

    Methods that may return a blind frame take the last known roll and pitch of the torso [rad], and
    raise NaoGaitError if there has never been an IMU sample; the frame is dropped then.

    Args:
        period: Control period [ns].

    Attributes:
        imu_behind: Time [ns] from the newest IMU sample to the joints, if one arrived since the
            last blind frame; below 0 the IMU is ahead.
        blind_since: Stamp of the first of the blind frames in a row [ns].
    """

    def __init__(self, period: int) -> None:
        self.imu_behind: int | None = None
        self.blind_since: int | None = None
        self._imu: deque[ImuSample] = deque(maxlen=32)
        self._waiting: JointSample | None = None
        self._misses = 0
        self._repeats = 0
        self._has_imu = self._imu_arrived = False
        self._last: JointSample | None = None
        self._period = period
        self._complete: ImuSample | None = None
        """IMU sample of the last frame that had one of its own stamp."""
        self._turned = np.zeros(3)
        """(3,) [rad] What the frames since then took for the rotation."""

    def restart(self, stamp: int) -> None:
        """Begin a new time base at `stamp` [ns]; its own IMU sample may have arrived before."""
        self._imu = deque((s for s in self._imu if s.stamp <= stamp), maxlen=self._imu.maxlen)
        self._waiting = None
        self._last = self._complete = None
        self.blind_since = None

    def add_imu(self, sample: ImuSample) -> SensorFrame | None:
        """Keep an IMU sample; return the frame that waited for it, if any."""
        if self._imu and sample.stamp < self._imu[-1].stamp - OVERTAKEN:
            self._imu.clear()  # a new time base
        self._imu.append(sample)
        self._has_imu = self._imu_arrived = True
        if self._last is not None and self._last.stamp == sample.stamp:
            self._misses = 0  # it comes after its joint sample, which should have waited
        joints = self._waiting
        if joints is None or joints.stamp != sample.stamp:
            return None
        self._waiting = None
        self._misses = 0
        return self._join(joints, sample, UPRIGHT)

    def add_joints(
        self, joints: JointSample, tilt: tuple[float, float] = UPRIGHT
    ) -> tuple[SensorFrame, ...]:
        """Keep a joint sample; return the frames that are complete now, the oldest first.

        Where there is no IMU sample, the torso's `tilt`, roll and pitch [rad], stands in for it.
        """
        overdue, self._waiting = self._waiting, None
        self._repeats = 0
        if overdue is not None and overdue.stamp >= joints.stamp:
            overdue = None  # a new time base
        same = next((s for s in reversed(self._imu) if s.stamp == joints.stamp), None)
        frames = []
        if overdue is not None:
            self._misses += 1
            frames.append(self._join(overdue, self._nearest(overdue.stamp), tilt))
        if same is not None:
            self._misses = 0
            frames.append(self._join(joints, same, tilt))
        elif self._misses >= PATIENCE:
            frames.append(self._join(joints, self._nearest(joints.stamp), tilt))
        else:
            self._waiting = joints
        return tuple(frames)

    def repeat(self, stamp: int, tilt: tuple[float, float] = UPRIGHT) -> SensorFrame | None:
        """The frame that waits under this stamp [ns], once it was repeated REPEATS times."""
        joints = self._waiting
        if joints is None or joints.stamp != stamp:
            return None
        self._repeats += 1
        return None if self._repeats < REPEATS else self.overdue(tilt)

    def overdue(self, tilt: tuple[float, float] = UPRIGHT) -> SensorFrame | None:
        """The frame that waits for its IMU sample, which has not arrived in time; None without."""
        joints = self._waiting
        if joints is None:
            return None
        frame = self._join(joints, self._nearest(joints.stamp), tilt)
        self._waiting = None
        self._misses += 1
        return frame

    def _nearest(self, stamp: int) -> ImuSample | None:
        """The IMU sample that is next to `stamp` [ns]; None if none is near enough."""
        if not self._has_imu:
            raise NaoGaitError("imu/data", "nothing received", "one message for each joint state")
        sample = min(self._imu, key=lambda s: abs(s.stamp - stamp), default=None)
        return None if sample is None or abs(stamp - sample.stamp) > MAX_IMU_AGE else sample

    def _join(
        self, joints: JointSample, imu: ImuSample | None, tilt: tuple[float, float]
    ) -> SensorFrame:
        last, self._last = self._last, joints
        elapsed = 0.0 if last is None else (joints.stamp - last.stamp) * 1e-9
        if imu is None:
            self.blind_since = joints.stamp if self.blind_since is None else self.blind_since
            arrived, self._imu_arrived = self._imu_arrived, False
            self.imu_behind = joints.stamp - self._imu[-1].stamp if arrived and self._imu else None
            rotation, force = _NO_ROTATION, _force_at_rest(*tilt)
        else:
            self.blind_since = None
            rotation, force = imu.angular_velocity, imu.linear_acceleration
        mean_angular_velocity = None
        if imu is not None and imu.stamp == joints.stamp:
            mean_angular_velocity = self._mean_angular_velocity(imu, elapsed)
            self._complete, self._turned = imu, np.zeros(3)
        elif self._complete is not None:
            self._turned = self._turned + elapsed * rotation
        return SensorFrame(
            stamp=joints.stamp,
            joint_position=joints.position,
            angular_velocity=rotation,
            linear_acceleration=force,
            mean_angular_velocity=mean_angular_velocity,
        )

    def _mean_angular_velocity(self, imu: ImuSample, elapsed: float) -> FloatArray | None:
        """Mean angular velocity (3,) [rad/s] in `elapsed` [s]; None if it is that of `imu`.

        Each sample stands for the control period before it, those that were lost are interpolated.
        What incomplete frames took for the rotation until now is made up for.
        """
        complete = self._complete
        if complete is None or elapsed <= 0.0:
            return None
        since = imu.stamp - complete.stamp
        periods = round(since / self._period)
        if periods < 2 or since > 1e9 * GAP_MAX:
            return None
        known = [s for s in self._imu if complete.stamp <= s.stamp <= imu.stamp]
        known.sort(key=lambda sample: sample.stamp)
        stamps = [s.stamp - complete.stamp for s in known]
        rates = np.array([s.angular_velocity for s in known])
        ends = since * np.arange(1, periods + 1) / periods
        mean = [np.interp(ends, stamps, rates[:, axis]).mean() for axis in range(3)]
        rotation: FloatArray = since * 1e-9 * np.array(mean) - self._turned
        return rotation / elapsed


def _force_at_rest(roll: float, pitch: float) -> FloatArray:
    """Specific force (3,) [m/s^2] that a resting torso with this tilt [rad] measures."""
    level = cos(pitch)
    return GRAVITY * np.array((-sin(pitch), level * sin(roll), level * cos(roll)))
