"""How ball and robots moved in a match: poses of all bodies, dense enough to watch them walk."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from robot_core.types import FloatArray

PERIOD = 0.04
"""[s] between two moments."""
POSE = 7
"""Numbers before the joint angles of a body: position, quaternion."""


class BodyState(NamedTuple):
    """One robot at one moment.

    Attributes:
        position: (3,) [m] of the torso in the world.
        quaternion: (4,) x y z w, torso to world.
        joints: (n,) [rad], in the order of the robot's joints.
    """

    position: FloatArray
    quaternion: FloatArray
    joints: FloatArray


class MotionTrack:
    """The moments of a match, of which the first is at any time."""

    def __init__(self) -> None:
        self._times: list[float] = []
        self._balls: list[Sequence[float]] = []
        self._bodies: list[list[FloatArray]] = []

    def __len__(self) -> int:
        return len(self._times)

    def add(self, time: float, ball: Sequence[float], bodies: Sequence[BodyState]) -> None:
        """Keep a moment: time [s], ball x, y, z [m], the robots in the order of the scene."""
        self._times.append(time)
        self._balls.append(ball)
        self._bodies.append([np.concatenate(each, dtype=np.float32) for each in bodies])

    @property
    def time(self) -> FloatArray:
        """(t,) [s]."""
        return np.array(self._times)

    @property
    def ball(self) -> FloatArray:
        """(t, 3) [m] in the world."""
        return np.array(self._balls, dtype=float).reshape(-1, 3)

    def body(self, robot: int) -> FloatArray:
        """(t, 7 + n): position [m], quaternion x y z w and joint angles [rad] of a robot."""
        return np.array([each[robot] for each in self._bodies], dtype=float)
