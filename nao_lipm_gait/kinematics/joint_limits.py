"""Joint limits, with the ankle's: how far it rolls depends on how far it is pitched."""

import numpy as np

from nao_lipm_gait.robot_description import LegJoints, RobotDescription
from nao_lipm_gait.signals import FloatArray


class JointLimits:
    """Cuts joint targets at what the joints can do."""

    def __init__(self, robot: RobotDescription):
        self._lower = np.array(robot.lower, dtype=float)
        self._upper = np.array(robot.upper, dtype=float)
        self._ankles = [
            _AnkleLimit(robot, leg, robot.ankle_limits[side])
            for side, leg in (("left", robot.left_leg), ("right", robot.right_leg))
            if side in robot.ankle_limits
        ]

    def cut(self, position: FloatArray) -> int:
        """Cut (n,) [rad] in place; the number of joints that were beyond a limit."""
        beyond = np.count_nonzero((position < self._lower) | (position > self._upper))
        np.maximum(position, self._lower, out=position)
        np.minimum(position, self._upper, out=position)
        return int(beyond) + sum(ankle.cut(position) for ankle in self._ankles)


class _AnkleLimit:
    """Ankle roll range by ankle pitch, linear between the rows of a table."""

    def __init__(
        self, robot: RobotDescription, leg: LegJoints, rows: tuple[tuple[float, ...], ...]
    ):
        self._pitch = robot.index(leg.ankle_pitch)
        self._roll = robot.index(leg.ankle_roll)
        self._rows = rows

    def cut(self, position: FloatArray) -> int:
        lower, upper = self._range(float(position[self._pitch]))
        roll = float(position[self._roll])
        if lower <= roll <= upper:
            return 0
        position[self._roll] = min(max(roll, lower), upper)
        return 1

    def _range(self, pitch: float) -> tuple[float, float]:
        rows = self._rows
        if pitch <= rows[0][0]:
            return rows[0][1], rows[0][2]
        for (p0, low0, high0), (p1, low1, high1) in zip(rows, rows[1:], strict=False):
            if pitch <= p1:
                share = (pitch - p0) / (p1 - p0)
                return low0 + share * (low1 - low0), high0 + share * (high1 - high0)
        return rows[-1][1], rows[-1][2]
