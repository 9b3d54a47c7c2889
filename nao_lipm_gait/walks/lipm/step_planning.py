"""Where to put the pendulum origin and the next foot in x: eqs (7)-(9), in closed form.

With the optimal next origin (r-bar_x = 0) and the CoM exactly over it in mid-step
(x-bar_0 = 0), the four equations of the linear system (9) reduce to one line in r_x and s_x:

    r_x (1 - C + T k S) = s_x - x (C - T k S) - v (S/k - T C)

with C = cosh(k t), S = sinh(k t) over the time t left, and T = tanh(k t_b-bar) / k of the next
pendulum, which the lateral motion has fixed. test/oracles.py holds the paper's linear system.

Where r_x cannot be what it should, the paper makes the step as long as keeps the speed. `capture`
is an extension: it blends towards the step that brings the wanted speed back at once. A walk that
passes its origins with v0 has the divergent component x + v/k = (v0/k) e^(-k t_b) ahead of the next
origin at the exchange, t_b before it passes that one. The step that corrects leaves just that much.
"""

from math import copysign, cosh, inf, sinh, sqrt
from typing import NamedTuple


class SagittalPlan(NamedTuple):
    """The origin of the running pendulum and the step size that belong together."""

    origin: float
    """r_x [m] relative to Q."""
    step_size: float
    """s-bar_x [m]."""
    correction: float
    """[m] that the CoM asks for beyond the wanted step size, before the legs limit it."""


def plan_sagittal(
    x: float,
    v: float,
    k: float,
    time: float,
    next_phase_tanh: float,
    step_size: float,
    origin_min: float,
    origin_max: float,
    step_min: float,
    step_max: float,
    held_origin: float | None = None,
    capture: float = 0.0,
    capture_back: float = 0.0,
    passing: float = 0.0,
) -> SagittalPlan:
    """r_x for the wanted step size; where r_x hits its cap, the step size for the capped r_x.

    x [m], v [m/s]: CoM relative to Q; time [s]: left in this single support phase;
    next_phase_tanh: tanh(k t_b-bar) of the next pendulum, negative; step_size: wanted s-bar_x [m];
    origin_min, origin_max: caps on r_x [m], towards heel and toes; step_min, step_max: what the
    legs can do [m]; held_origin: an r_x that may no longer move (the end of a step has no time left
    to use it), the step size follows; capture: 0 = the step that keeps the speed, 1 = the step that
    corrects it at once, capture_back: the same for one that reaches further back; passing: v0/k [m]
    of the wanted walk where its CoM passes an origin.
    """
    c = cosh(k * time)
    s = sinh(k * time)
    lever = 1.0 - c + next_phase_tanh * s
    drift = x * (c - next_phase_tanh * s) + v * (s - next_phase_tanh * c) / k
    if held_origin is not None:
        origin = held_origin
    elif lever < 0.0:
        origin = (step_size - drift) / lever
    else:  # no time left, in which no origin moves anything
        origin = copysign(inf, drift - step_size)
    capped = min(max(origin, origin_min), origin_max)
    correction = 0.0
    if held_origin is not None or capped != origin:
        origin = capped
        keeping = origin * lever + drift
        if capture > 0.0 or capture_back > 0.0:
            reach = origin + (x - origin) * (c + s) + v * (s + c) / k
            # (1 - tanh) / (1 + tanh) = e^(-2 k t_b)
            left_behind = passing * sqrt((1.0 + next_phase_tanh) / (1.0 - next_phase_tanh))
            further = reach - left_behind - keeping
            keeping += (capture if further > 0.0 else capture_back) * further
        wanted, step_size = step_size, min(max(keeping, step_min), step_max)
        correction = keeping - wanted
    return SagittalPlan(origin, step_size, correction)
