"""Joint limits, with the ankle's: how far it rolls depends on how far it is pitched."""

import operator

from nao_lipm_gait.robot_description import LegJoints, RobotDescription
from nao_lipm_gait.signals import FloatArray


class JointLimits:
    """Cuts joint targets at what the joints can do."""

    def __init__(self, robot: RobotDescription):
        self._lower: list[float] = robot.lower.tolist()
        self._upper: list[float] = robot.upper.tolist()
        self._ankles = [
            _AnkleLimit(robot, leg, robot.ankle_limits[side])
            for side, leg in (("left", robot.left_leg), ("right", robot.right_leg))
            if side in robot.ankle_limits
        ]

    def cut(self, position: FloatArray) -> int:
        """Cut (n,) [rad] in place; the number of joints that were beyond a limit."""
        values = position.tolist()
        cut = list(map(min, map(max, values, self._lower), self._upper))
        for ankle in self._ankles:
            ankle.cut(cut)
        if cut == values:
            return 0
        position[:] = cut
        return sum(map(operator.ne, cut, values))


class _AnkleLimit:
    """Ankle roll range by ankle pitch, linear between the rows of a table."""

    def __init__(
        self, robot: RobotDescription, leg: LegJoints, rows: tuple[tuple[float, ...], ...]
    ):
        self._pitch = robot.index(leg.ankle_pitch)
        self._roll = robot.index(leg.ankle_roll)
        self._rows = rows
        self._pieces = tuple(zip(rows, rows[1:], strict=False))

    def cut(self, position: list[float]) -> None:
        lower, upper = self._range(position[self._pitch])
        position[self._roll] = min(max(position[self._roll], lower), upper)

    def _range(self, pitch: float) -> tuple[float, float]:
        rows = self._rows
        if pitch <= rows[0][0]:
            return rows[0][1], rows[0][2]
        for (p0, low0, high0), (p1, low1, high1) in self._pieces:
            if pitch <= p1:
                share = (pitch - p0) / (p1 - p0)
                return low0 + share * (low1 - low0), high0 + share * (high1 - high0)
        return rows[-1][1], rows[-1][2]
