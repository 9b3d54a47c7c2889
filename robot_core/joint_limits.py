"""Joint limits in angle and speed; the range of the ankle roll may depend on the ankle pitch."""

import itertools

import numpy as np

from robot_core.robot import LegJoints, RobotDescription
from robot_core.types import FloatArray

SPEED_SHARE = 4.0
"""Fastest target as a share of the joint's speed limit. The robot itself stops at the limit; a walk
asks for up to twice as much for single ticks. Only a robot that falls is asked for more."""


class JointLimits:
    """Limits joint targets.

    Args:
        robot: The robot, with its limits.
    """

    def __init__(self, robot: RobotDescription):
        lower, upper = robot.lower.tolist(), robot.upper.tolist()
        self._bounds: list[tuple[int, float, float]] = list(zip(itertools.count(), lower, upper))
        self._speed = SPEED_SHARE * np.asarray(robot.velocity_limit, dtype=float)
        self._speeds: list[float] = self._speed.tolist()
        self._ankles = [
            _AnkleLimit(robot, leg, robot.ankle_limits[side])
            for side, leg in (("left", robot.left_leg), ("right", robot.right_leg))
            if side in robot.ankle_limits
        ]

    def cut(self, position: FloatArray) -> int:
        """Limit joint targets (n,) [rad] in place; returns how many were beyond a limit."""
        beyond = 0
        values: list[float] = position.tolist()
        for joint, lower, upper in self._bounds:
            value = values[joint]
            if not lower <= value <= upper:
                values[joint] = position[joint] = min(max(value, lower), upper)
                beyond += 1
        for ankle in self._ankles:
            beyond += ankle.cut(position, values)
        return beyond

    def slow_down(self, position: FloatArray, before: FloatArray, dt: float) -> None:
        """Limit the change of targets (n,) [rad] since `before` (n,), dt [s] ago, in place."""
        # Mostly nothing is too fast; plain floats tell this sooner than arrays.
        for value, last, speed in zip(
            position.tolist(), before.tolist(), self._speeds, strict=True
        ):
            if abs(value - last) > speed * dt:
                stride = self._speed * dt
                position[:] = before + np.clip(position - before, -stride, stride)
                return


class _AnkleLimit:
    """Range of the ankle roll over the ankle pitch, linear between the rows of a table."""

    def __init__(
        self, robot: RobotDescription, leg: LegJoints, rows: tuple[tuple[float, ...], ...]
    ):
        self._pitch = robot.index(leg.ankle_pitch)
        self._roll = robot.index(leg.ankle_roll)
        self._rows = rows
        self._pieces = tuple(itertools.pairwise(rows))

    def cut(self, position: FloatArray, values: list[float]) -> int:
        """Limit the ankle roll; `values` are the elements of `position` as floats."""
        lower, upper = self._range(values[self._pitch])
        roll = values[self._roll]
        if lower <= roll <= upper:
            return 0
        position[self._roll] = min(max(roll, lower), upper)
        return 1

    def _range(self, pitch: float) -> tuple[float, float]:
        rows = self._rows
        if pitch <= rows[0][0]:
            return rows[0][1], rows[0][2]
        for (p0, low0, high0), (p1, low1, high1) in self._pieces:
            if pitch <= p1:
                share = (pitch - p0) / (p1 - p0)
                return low0 + share * (low1 - low0), high0 + share * (high1 - high0)
        return rows[-1][1], rows[-1][2]
