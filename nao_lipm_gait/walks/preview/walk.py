"""ZMP preview control after Kajita et al.: the footsteps first, then a CoM that fits them.

Cadence, step sizes, feet, start and stop are those of the ZMP walk. The CoM is no formula of the
half stride: a cart on a table follows the ZMP that the next footsteps ask for, and so begins
to move before they are made. What lies ahead is planned anew at the beginning of each half stride.
Like the ZMP walk it looks at no CoM.
"""

import numpy as np

from nao_lipm_gait.geometry import compose, relative
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.types import STANDSTILL, FloatArray, Pose2, VelocityCommand
from nao_lipm_gait.walks.base import BodyTargets
from nao_lipm_gait.walks.preview.preview_control import PreviewAxis, PreviewGains, preview_gains
from nao_lipm_gait.walks.preview.zmp_reference import zmp_of_half_stride
from nao_lipm_gait.walks.zmp.walk import Phase, ZmpWalk


class PreviewWalk(ZmpWalk):
    """Omnidirectional walk whose CoM is made by preview control of the ZMP."""

    _gains: PreviewGains
    _wanted: FloatArray
    """(2, n) the ZMP [m] in odom, from the first tick of this half stride on."""

    def __init__(self, parameters: GaitParameters, control_period: float):
        self._axes = (PreviewAxis(), PreviewAxis())
        super().__init__(parameters, control_period)

    def stand_at(self, q_in_odom: Pose2) -> None:
        self._axes = (PreviewAxis(q_in_odom[0]), PreviewAxis(q_in_odom[1]))
        super().stand_at(q_in_odom)
        self._look_ahead(STANDSTILL)

    def start(self, command: VelocityCommand) -> None:
        super().start(command)
        self._look_ahead(command)

    def plan(self, command: VelocityCommand) -> BodyTargets:
        wanted, tick, gains = self._wanted, self._tick, self._gains
        targets = super().plan(command)
        horizon = len(gains.of_preview)
        for axis, zmp in zip(self._axes, wanted, strict=True):
            axis.step(float(zmp[tick]), zmp[tick + 1 : tick + 1 + horizon], gains)
        return targets

    def _next_half_stride(self, command: VelocityCommand) -> None:
        super()._next_half_stride(command)
        self._look_ahead(command)

    def _look_ahead(self, command: VelocityCommand) -> None:
        """The ZMP of this half stride and, under this command, of those after it."""
        half, stride, q_in_odom = self._half_stride, self._stride, self._q_in_odom
        horizon = self._horizon
        p = half.parameters
        self._gains = preview_gains(p.pendulum_height, self._dt, horizon, p.preview_jerk)
        parts = [zmp_of_half_stride(half, q_in_odom)]
        missing = horizon
        while missing > 0:
            if half.phase is Phase.REST:  # for as long as one looks
                parts.append(np.repeat(parts[-1][:, -1:], missing, axis=1))
                break
            q_in_odom = compose(q_in_odom, half.step_size)
            half, stride = self._successor(half, stride, command)
            parts.append(zmp_of_half_stride(half, q_in_odom))
            missing -= half.ticks
        self._wanted = np.hstack(parts)

    @property
    def _horizon(self) -> int:
        """N: periods of preview."""
        return max(1, round(self._p.preview_time / self._dt))

    @property
    def _standing_ticks(self) -> int:
        """Long enough for the CoM to begin, or to end, as the preview wants it."""
        return max(self._ticks, self._horizon)

    def _com(self) -> tuple[float, float]:
        x_axis, y_axis = self._axes
        x, y, _ = relative((x_axis.x, y_axis.x, 0.0), self._q_in_odom)
        return x, y

    @property
    def origin_in_q(self) -> tuple[float, float]:
        wanted_x, wanted_y = self._wanted[:, self._tick].tolist()
        x, y, _ = relative((wanted_x, wanted_y, 0.0), self._q_in_odom)
        return x, y
