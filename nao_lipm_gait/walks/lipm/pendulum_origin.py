"""Pendulum origin and step size in x: eqs (7)-(9) of the paper in closed form.

With the optimal next origin (r-bar_x = 0) and the CoM exactly over it in mid-step (x-bar_0 = 0),
the four equations of the linear system (9) reduce to one line in r_x and s-bar_x:

    r_x (1 - C + T k S) = s-bar_x - x (C - T k S) - v (S / k - T C)

with C = cosh(k t_e), S = sinh(k t_e) and T = tanh(k t_b-bar) / k of the next pendulum, which the
lateral motion determines. t = 0 is now. test/oracles.py has the linear system.
"""

from math import copysign, cosh, inf, sinh
from typing import final


@final
class OriginPlan:
    """A pendulum origin and the step size that belongs to it.

    Attributes:
        r_x: Pendulum origin in Q [m].
        s_x: Step size s-bar_x that keeps the speed with this origin [m].
        limited: Whether r_x could not be chosen freely, so that s_x is not the wanted step size.
    """

    __slots__ = ("limited", "r_x", "s_x")

    def __init__(self, r_x: float, s_x: float, limited: bool):
        self.r_x = r_x
        self.s_x = s_x
        self.limited = limited


def plan_pendulum_origin(
    x: float,
    v: float,
    k: float,
    t_e: float,
    next_tanh: float,
    s_x: float,
    r_min: float,
    r_max: float,
    held_r_x: float | None = None,
) -> OriginPlan:
    """The r_x for the wanted step size; where r_x is at its limit, the step size for that r_x.

    Args:
        x: CoM in Q [m].
        v: Its velocity [m/s].
        k: Natural frequency [1/s].
        t_e: Time until the support change [s].
        next_tanh: tanh(k t_b-bar) of the next pendulum; negative.
        s_x: Wanted step size [m].
        r_min: Limit of r_x towards the heel [m].
        r_max: Limit of r_x towards the toes [m].
        held_r_x: An r_x that can no longer change [m]; None to choose it.

    Returns:
        Origin and step size.
    """
    c = cosh(k * t_e)
    s = sinh(k * t_e)
    lever = 1.0 - c + next_tanh * s
    drift = x * (c - next_tanh * s) + v * (s - next_tanh * c) / k
    if held_r_x is not None:
        return OriginPlan(held_r_x, held_r_x * lever + drift, True)
    # (9) for r_x; without time left no origin has an effect.
    r_x = (s_x - drift) / lever if lever < 0.0 else copysign(inf, drift - s_x)
    if r_min <= r_x <= r_max:
        return OriginPlan(r_x, s_x, False)
    r_x = min(max(r_x, r_min), r_max)
    return OriginPlan(r_x, r_x * lever + drift, True)  # (9) for s-bar_x
