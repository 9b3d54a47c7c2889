"""The odometry as a history: how the robot moved between the times of two images."""

import math
from typing import NamedTuple

import numpy as np

from nao_soccer.vision.pose_history import PoseHistory
from robot_core.errors import NaoGaitError
from robot_core.geometry import relative
from robot_core.types import FloatArray, Pose2

SPEED_MAX = 2.0
"""[m/s] A faster movement is a jump of the odometry."""
TURN_MAX = 10.0
"""[rad/s] A faster turn is a jump of the odometry."""
SLACK = 0.02
"""[s] Time that is added to that between two entries, for stamps that jitter."""
GAP_MAX = 1_000_000_000
"""[ns] Longest gap between two entries over which the motion is known."""
LENGTH = 300
"""Entries that are kept: 3 s at 100 Hz."""


class Displacement(NamedTuple):
    """How the robot moved between two times.

    Attributes:
        offset: Pose of base_footprint at the end in base_footprint at the start.
        covariance: (3, 3) of the offset [m, m, rad].
    """

    offset: Pose2
    covariance: FloatArray


class OdometryHistory:
    """Poses of base_footprint in odom by time; noise by the way until then, per m^0.5."""

    def __init__(self, way_noise: float, heading_noise: float) -> None:
        self._way_variance, self._heading_variance = way_noise**2, heading_noise**2
        self._history = PoseHistory("odom", LENGTH, GAP_MAX)
        self._last: FloatArray | None = None
        self._stamp: int | None = None

    @property
    def newest(self) -> int | None:
        """Stamp [ns] of the last entry; None without one."""
        return self._stamp

    def add(self, stamp: int, pose: Pose2) -> None:
        """Append a pose at a stamp [ns].

        Raises:
            NaoGaitError: The pose is not finite and was left out; or it jumps or its clock started
                anew, and a new history begins with it.
        """
        if not all(map(math.isfinite, pose)):
            raise NaoGaitError("odom pose", pose, "finite numbers")
        last, before = self._last, self._stamp
        if last is None or before is None:
            self._begin(stamp, pose)
            return
        if stamp == before:
            return
        if stamp < before:
            self._begin(stamp, pose)
            allowed = f"over {before * 1e-9:.3f} s"
            raise NaoGaitError("odom header.stamp", f"{stamp * 1e-9:.3f} s", allowed)
        if stamp - before > GAP_MAX:
            self._begin(stamp, pose)
            allowed = f"at most {GAP_MAX * 1e-9:g} s after the last one"
            raise NaoGaitError("odom", f"{(stamp - before) * 1e-9:.3f} s without", allowed)
        dx, dy, turn = relative(pose, (last[0], last[1], last[2]))
        turn = math.remainder(turn, math.tau)
        way, time = math.hypot(dx, dy), (stamp - before) * 1e-9 + SLACK
        if way > SPEED_MAX * time or abs(turn) > TURN_MAX * time:
            self._begin(stamp, pose)
            raise NaoGaitError(
                "odom pose",
                f"{way:.2f} m and {abs(turn):.2f} rad further after {time - SLACK:.3f} s",
                f"at most {SPEED_MAX:g} m/s and {TURN_MAX:g} rad/s",
            )
        self._append(stamp, (pose[0], pose[1], last[2] + turn, last[3] + way))

    def _begin(self, stamp: int, pose: Pose2) -> None:
        self._history = PoseHistory("odom", LENGTH, GAP_MAX)
        self._append(stamp, (*pose, 0.0))

    def _append(self, stamp: int, value: tuple[float, ...]) -> None:
        self._last, self._stamp = np.array(value), stamp
        self._history.add(stamp, self._last)

    def motion(self, since: int, until: int) -> Displacement:
        """How the robot moved from one time [ns] to another.

        Raises:
            NaoGaitError: The history does not hold one of the times.
        """
        a, b = self._history.at(since).tolist(), self._history.at(until).tolist()
        offset = relative((b[0], b[1], b[2]), (a[0], a[1], a[2]))
        way = abs(b[3] - a[3])
        place, yaw = self._way_variance * way, self._heading_variance * way
        # The heading error, on average half of the last one, displaces the end.
        dx, dy = offset[0], offset[1]
        covariance = np.array(
            (
                (place + dy * dy * yaw / 3.0, -dx * dy * yaw / 3.0, -dy * yaw / 2.0),
                (-dx * dy * yaw / 3.0, place + dx * dx * yaw / 3.0, dx * yaw / 2.0),
                (-dy * yaw / 2.0, dx * yaw / 2.0, yaw),
            )
        )
        return Displacement(offset, covariance)
