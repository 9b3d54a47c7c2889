"""The wanted ZMP over the half strides that lie ahead, in odom."""

import numpy as np

from nao_lipm_gait.geometry import compose
from nao_lipm_gait.types import FloatArray, Pose2
from nao_lipm_gait.walks.zmp.walk import HalfStride, Phase

Point = tuple[float, float]


def zmp_of_half_stride(half: HalfStride, q_in_odom: Pose2) -> FloatArray:
    """(2, ticks) x and y [m] in odom: under the standing foot; while both stand, on the way there
    from half-way between the feet, or in the end from there to half-way to the next.
    """
    here = _under(half, half.support, half.standing, q_in_odom)
    before = _halfway(_under(half, -half.support, half.swing_start, q_in_odom), here)
    if half.phase is not Phase.STEP:
        return np.repeat(np.array(before)[:, None], half.ticks, axis=1)
    after = _halfway(here, _under(half, -half.support, half.swing_end, q_in_odom))
    both = 0.5 * half.parameters.zmp_double_support
    times, knots = np.arange(half.ticks) / half.ticks, (0.0, both, 1.0 - both, 1.0)
    ways = zip(before, here, after, strict=True)
    return np.array([np.interp(times, knots, (a, b, b, c)) for a, b, c in ways])


def _under(half: HalfStride, side: int, sole_in_q: Pose2, q_in_odom: Pose2) -> Point:
    """Where the ZMP shall be in this sole."""
    p = half.parameters
    offset = (p.foot_reference_x, side * (p.zmp_offset_y - 0.5 * p.foot_spacing), 0.0)
    x, y, _ = compose(q_in_odom, compose(sole_in_q, offset))
    return x, y


def _halfway(a: Point, b: Point) -> Point:
    return 0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])
