"""Joints and torso orientation over time: where a camera was when its image was exposed."""

from bisect import bisect_left
from collections import deque
from typing import NamedTuple

import numpy as np

from robot_core.errors import NaoGaitError
from robot_core.types import FloatArray

LENGTH = 200
"""Entries that are kept: 2 s at 100 Hz, several times the largest delay of an image."""
GAP_MAX = 60_000_000
"""[ns] Longest gap between two entries to interpolate over."""


class BodyPose(NamedTuple):
    """The body at one instant.

    Attributes:
        joint_position: (n,) [rad].
        torso_position: (3,) [m] in base_footprint.
        torso_rotation: (3, 3), torso to base_footprint.
    """

    joint_position: FloatArray
    torso_position: FloatArray
    torso_rotation: FloatArray


class PoseHistory:
    """Values by time; between two entries at most `gap` [ns] apart they are interpolated linearly.

    Args:
        name: What is stored, for error messages.
        length: Number of entries that are kept.
        gap: [ns]
    """

    def __init__(self, name: str, length: int = LENGTH, gap: int = GAP_MAX) -> None:
        self._name = name
        self._gap = gap
        self._stamps: deque[int] = deque(maxlen=length)
        self._values: deque[FloatArray] = deque(maxlen=length)

    def add(self, stamp: int, value: FloatArray) -> None:
        """Append a value (n,) at a stamp [ns]; one older than the last begins a new history."""
        if self._stamps and stamp <= self._stamps[-1]:
            if stamp == self._stamps[-1]:
                return
            self._stamps.clear()
            self._values.clear()
        self._stamps.append(stamp)
        self._values.append(value)

    @property
    def newest(self) -> int | None:
        """Stamp [ns] of the last entry; None without one."""
        return self._stamps[-1] if self._stamps else None

    def at(self, stamp: int) -> FloatArray:
        """The value (n,) at a time [ns].

        Raises:
            NaoGaitError: There is no entry around that time.
        """
        index = bisect_left(self._stamps, stamp)
        if index < len(self._stamps) and self._stamps[index] == stamp:
            return self._values[index]
        if 0 < index < len(self._stamps):
            before, after = self._stamps[index - 1], self._stamps[index]
            if after - before <= self._gap:
                share = (stamp - before) / (after - before)
                return self._values[index - 1] + share * (
                    self._values[index] - self._values[index - 1]
                )
        known = "none yet"
        if self._stamps:
            known = f"{self._stamps[0] * 1e-9:.3f} to {self._stamps[-1] * 1e-9:.3f} s, without gaps"
        raise NaoGaitError(f"{self._name} at the time of the image", f"{stamp * 1e-9:.3f} s", known)


class BodyHistory:
    """Joints and torso pose over time."""

    def __init__(self) -> None:
        self._joints = PoseHistory("joint_states")
        self._torso = PoseHistory("gait/torso_pose")

    def add_joints(self, stamp: int, position: FloatArray) -> None:
        """Joint angles (n,) [rad] at a time [ns]."""
        self._joints.add(stamp, position)

    def add_torso(self, stamp: int, position: FloatArray, rotation: FloatArray) -> None:
        """Torso in base_footprint at a time [ns]: (3,) [m] and (3, 3)."""
        self._torso.add(stamp, np.concatenate((position, rotation.ravel())))

    def covers(self, stamp: int) -> bool:
        """Both are known up to this time [ns]."""
        ends = self._joints.newest, self._torso.newest
        return all(end is not None and end >= stamp for end in ends)

    def at(self, stamp: int) -> BodyPose:
        """The body at a time [ns]; NaoGaitError if it is not known."""
        torso = self._torso.at(stamp)
        # Elements of two rotations that differ by a tick's motion may be interpolated.
        return BodyPose(self._joints.at(stamp), torso[:3], torso[3:].reshape(3, 3))
