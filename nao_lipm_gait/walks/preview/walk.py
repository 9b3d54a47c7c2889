"""The walk with ZMP preview control: footsteps first, then a CoM that fits them.

Cadence, step sizes, feet, start and stop are those of the ZMP walk. The CoM is not a formula of the
half stride: a cart on a table follows the ZMP of the coming footsteps, so it starts to move before
they are made. The footsteps ahead are planned again at the beginning of each half stride. Like the
ZMP walk, this walk does not use the measured CoM.
"""

import numpy as np

from nao_lipm_gait.walks.base import BodyTargets
from nao_lipm_gait.walks.preview.preview_control import PreviewAxis, PreviewGains, preview_gains
from nao_lipm_gait.walks.zmp.parameters import ZmpParameters
from nao_lipm_gait.walks.zmp.walk import HalfStride, Phase, ZmpWalk
from robot_core.geometry import compose, relative
from robot_core.types import STANDSTILL, FloatArray, Pose2, VelocityCommand

Point = tuple[float, float]

PREVIEW_TIME = 0.8
"""[s] Preview horizon of the desired ZMP."""
JERK_WEIGHT = 10000.0
"""[1/s^3] CoM jerk that costs as much as one metre of ZMP error."""


class PreviewWalk(ZmpWalk):
    """Omnidirectional walk whose CoM comes from preview control of the ZMP.

    Args:
        parameters: Parameters of the gait; `feedback_delay` is fixed from here on.
        control_period: Time between two ticks [s].
    """

    _gains: PreviewGains
    _desired: FloatArray  # (2, n) ZMP in odom [m], from the first tick of this half stride on

    def __init__(self, parameters: ZmpParameters, control_period: float):
        self._axes = (PreviewAxis(), PreviewAxis())
        super().__init__(parameters, control_period)

    def stand_at(self, q_in_odom: Pose2) -> None:
        """Reset to a stand: both feet side by side, the CoM at rest between them."""
        self._axes = (PreviewAxis(q_in_odom[0]), PreviewAxis(q_in_odom[1]))
        super().stand_at(q_in_odom)
        self._look_ahead(STANDSTILL)

    def start(self, command: VelocityCommand, inward: float = 0.0) -> None:
        """Shift the weight, so that the foot that leads the motion makes the first step."""
        super().start(command, inward)
        self._look_ahead(command)

    def plan(self, command: VelocityCommand, *, sent: bool = True) -> BodyTargets:
        """Targets of this tick; the cart then moves on by one period."""
        desired, tick, gains = self._desired, self._tick, self._gains
        targets = super().plan(command, sent=sent)
        horizon = len(gains.of_preview)
        for axis, zmp in zip(self._axes, desired, strict=True):
            axis.step(float(zmp[tick]), zmp[tick + 1 : tick + 1 + horizon], gains)
        return targets

    def _next_half_stride(self, command: VelocityCommand) -> None:
        super()._next_half_stride(command)
        self._look_ahead(command)

    def _look_ahead(self, command: VelocityCommand) -> None:
        """The desired ZMP of this half stride and, under this command, of the next ones."""
        half, stride, q_in_odom = self._half_stride, self._stride, self._q_in_odom
        horizon = self._horizon
        p = half.parameters
        self._gains = preview_gains(p.pendulum_height, self._dt, horizon, JERK_WEIGHT)
        parts = [zmp_of_half_stride(half, q_in_odom)]
        missing = horizon
        while missing > 0:
            if half.phase is Phase.REST:  # it lasts beyond the horizon
                parts.append(np.repeat(parts[-1][:, -1:], missing, axis=1))
                break
            q_in_odom = compose(q_in_odom, half.step_size)
            half, stride = self._successor(half, stride, command)
            parts.append(zmp_of_half_stride(half, q_in_odom))
            missing -= half.ticks
        self._desired = np.hstack(parts)

    @property
    def _horizon(self) -> int:
        """Number of preview periods N."""
        return max(1, round(PREVIEW_TIME / self._dt))

    @property
    def _standing_ticks(self) -> int:
        """Long enough for the CoM to start, or to stop, as the preview control plans it."""
        return max(self._ticks, self._horizon)

    def _com(self) -> Point:
        x_axis, y_axis = self._axes
        x, y, _ = relative((x_axis.x, y_axis.x, 0.0), self._q_in_odom)
        return x, y

    @property
    def origin_in_q(self) -> Point:
        """Desired ZMP, x and y in Q [m]."""
        x, y = self._desired[:, self._tick].tolist()
        x, y, _ = relative((x, y, 0.0), self._q_in_odom)
        return x, y


def zmp_of_half_stride(half: HalfStride, q_in_odom: Pose2) -> FloatArray:
    """The desired ZMP (2, ticks) over a half stride, x and y in odom [m].

    It is below the standing foot. While both feet stand it moves there from half-way between the
    feet, and at the end from there to half-way to the next foot.
    """
    here = _below(half, half.support, half.standing, q_in_odom)
    before = _halfway(_below(half, -half.support, half.swing_start, q_in_odom), here)
    if half.phase is not Phase.STEP:
        return np.repeat(np.array(before)[:, None], half.ticks, axis=1)
    after = _halfway(here, _below(half, -half.support, half.swing_end, q_in_odom))
    both = 0.5 * half.parameters.zmp_double_support
    times, knots = np.arange(half.ticks) / half.ticks, (0.0, both, 1.0 - both, 1.0)
    ways = zip(before, here, after, strict=True)
    return np.array([np.interp(times, knots, (a, b, b, c)) for a, b, c in ways])


def _below(half: HalfStride, side: int, sole_in_q: Pose2, q_in_odom: Pose2) -> Point:
    """The desired ZMP below a sole, in odom [m]."""
    p = half.parameters
    offset = (p.foot_reference_x, side * (p.zmp_offset_y - 0.5 * p.foot_spacing), 0.0)
    x, y, _ = compose(q_in_odom, compose(sole_in_q, offset))
    return x, y


def _halfway(a: Point, b: Point) -> Point:
    return 0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])
