"""Bring the IMU sample and the joint sample of one instant together."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.types import FloatArray, SensorFrame

MAX_IMU_AGE = 50_000_000
"""[ns] An IMU sample further than this from the joint sample says nothing about it."""
_PATIENCE = 10
"""Joint samples in a row without an IMU sample of their stamp, until we stop to wait for it."""
INSISTS = 2
"""Times that a joint sample is repeated, until its robot is served without the IMU sample. The
first may have overtaken an IMU sample that is repeated too."""
OVERTAKEN = 100_000_000
"""[ns] An IMU sample this little behind the newest one was overtaken; more is a new time."""
_NO_ROTATION = np.zeros(3)


@dataclass(frozen=True, slots=True)
class ImuSample:
    stamp: int
    """[ns]"""
    angular_velocity: FloatArray
    """(3,) [rad/s]"""
    linear_acceleration: FloatArray
    """(3,) [m/s^2]"""


@dataclass(frozen=True, slots=True)
class JointSample:
    stamp: int
    """[ns]"""
    position: FloatArray
    """(n,) [rad]"""
    velocity: FloatArray | None
    """(n,) [rad/s]; None = not given, taken from the positions."""


class FrameSync:
    """Joint samples drive; each leaves with the IMU sample of its own stamp.

    A joint sample that overtook its IMU sample waits for it, until the next joint sample at most.
    A robot whose two stamps never agree is served at once with the nearest IMU sample. Without one
    near enough the frame is blind: it does not turn, and feels what a body at rest would feel.
    A robot in lockstep sends no next joint sample before it has its answer: it repeats this one.
    """

    def __init__(self, at_rest: Callable[[], FloatArray] | None = None) -> None:
        """at_rest: (3,) specific force [m/s^2] in the torso frame of a body that rests as it is
        believed to be now; None = no blind frames, a missing IMU sample is an error.
        """
        self._at_rest = at_rest
        self.imu_behind: int | None = None
        """[ns] the newest IMU sample is behind the joints, if it came since the last blind frame;
        below 0 it is ahead."""
        self.blind_since: int | None = None
        """Stamp of the first of the blind frames in a row [ns]."""
        self._imu: deque[ImuSample] = deque(maxlen=32)
        self._waiting: JointSample | None = None
        self._misses = 0
        self._insists = 0
        self._has_imu = self._imu_came = False
        self._last: tuple[int, FloatArray] | None = None

    def begin_at(self, stamp: int) -> None:
        """Forget all but the IMU samples up to this stamp [ns]: the one of it may be there."""
        self._imu = deque((s for s in self._imu if s.stamp <= stamp), maxlen=self._imu.maxlen)
        self._waiting = None
        self._last = None
        self.blind_since = None

    def add_imu(self, sample: ImuSample) -> SensorFrame | None:
        """The frame that waited for this sample, if one did."""
        if self._imu and sample.stamp < self._imu[-1].stamp - OVERTAKEN:
            self._imu.clear()  # time went back
        self._imu.append(sample)
        self._has_imu = self._imu_came = True
        joints = self._waiting
        if joints is None or joints.stamp != sample.stamp:
            return None
        self._waiting = None
        self._misses = 0
        return self._join(joints, sample)

    def add_joints(self, joints: JointSample) -> tuple[SensorFrame, ...]:
        """The frames that are complete now, the oldest first.

        Raises NaoGaitError when there never was an IMU sample; the frame is dropped.
        """
        overdue, self._waiting = self._waiting, None
        self._insists = 0
        if overdue is not None and overdue.stamp >= joints.stamp:
            overdue = None  # time went back
        same = next((s for s in reversed(self._imu) if s.stamp == joints.stamp), None)
        frames = []
        if overdue is not None:
            self._misses += 1
            frames.append(self._join(overdue, self._nearest(overdue.stamp)))
        if same is not None:
            self._misses = 0
            frames.append(self._join(joints, same))
        elif self._misses >= _PATIENCE:
            frames.append(self._join(joints, self._nearest(joints.stamp)))
        else:
            self._waiting = joints
        return tuple(frames)

    def insist(self, stamp: int) -> SensorFrame | None:
        """A joint sample that came again: its frame, if it waits, after INSISTS times.

        Raises NaoGaitError like `add_joints`.
        """
        joints = self._waiting
        if joints is None or joints.stamp != stamp:
            return None
        self._insists += 1
        if self._insists < INSISTS:
            return None
        frame = self._join(joints, self._nearest(stamp))
        self._waiting = None
        self._misses += 1
        return frame

    def _nearest(self, stamp: int) -> ImuSample | None:
        sample = min(self._imu, key=lambda s: abs(s.stamp - stamp), default=None)
        if sample is None:
            if self._has_imu and self._at_rest is not None:
                return None  # all there was is of another time
            raise NaoGaitError("imu/data", "nothing received", "one message for each joint state")
        age = stamp - sample.stamp
        if abs(age) > MAX_IMU_AGE:
            if self._at_rest is not None:
                return None
            raise NaoGaitError(
                "imu/data header.stamp",
                f"{abs(age) * 1e-9:.3f} s {'before' if age > 0 else 'after'} the joint state",
                f"at most {MAX_IMU_AGE * 1e-9:g} s",
            )
        return sample

    def _join(self, joints: JointSample, imu: ImuSample | None) -> SensorFrame:
        velocity = joints.velocity
        if velocity is None:
            velocity = np.zeros_like(joints.position)
            if self._last is not None and joints.stamp > self._last[0]:
                elapsed = (joints.stamp - self._last[0]) * 1e-9
                velocity = (joints.position - self._last[1]) / elapsed
        self._last = (joints.stamp, joints.position)
        if imu is None:
            self.blind_since = joints.stamp if self.blind_since is None else self.blind_since
            came, self._imu_came = self._imu_came, False
            self.imu_behind = joints.stamp - self._imu[-1].stamp if came and self._imu else None
            rotation, force = _NO_ROTATION, self._rest()
        else:
            self.blind_since = None
            rotation, force = imu.angular_velocity, imu.linear_acceleration
        return SensorFrame(
            stamp=joints.stamp,
            joint_position=joints.position,
            joint_velocity=velocity,
            angular_velocity=rotation,
            linear_acceleration=force,
        )

    def _rest(self) -> FloatArray:
        return np.zeros(3) if self._at_rest is None else self._at_rest()
