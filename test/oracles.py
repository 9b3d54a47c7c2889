"""The paper's own forms of what the package solves in closed form."""

from math import asinh, cosh, sinh, sqrt

import numpy as np


def iterated_support_change(
    x0: float, k: float, next_x0: float, next_k: float, stride: float
) -> tuple[float, float]:
    """(t_e, t_b-bar) [s] of eqs (4)-(6) by guessing and refining t_e, as section 2.2 says.

    Distances are mirrored (positive towards the swing leg); the next pendulum's are measured from
    its own origin back towards the running one.
    """
    low, high = 0.0, 2.0
    for _ in range(200):
        guess = 0.5 * (low + high)
        begin = -asinh(x0 * k * sinh(k * guess) / (next_x0 * next_k)) / next_k  # (6)
        covered = x0 * cosh(k * guess) + next_x0 * cosh(next_k * begin)
        if covered < stride:
            low = guess
        else:
            high = guess
    return guess, begin


def linear_system(
    x: float, v: float, k: float, time: float, next_begin: float, step_size: float
) -> dict[str, float]:
    """Eq (9) in x with r-bar_x = 0 and x-bar_0 = 0, t = 0 being now: solved for r, x0, v0, v-bar_0.

    x, v: CoM relative to Q; time: t_e; next_begin: t_b-bar; step_size: s-bar.
    """
    c, s = cosh(k * time), sinh(k * time)
    next_c, next_s = cosh(k * next_begin), sinh(k * next_begin)
    matrix = np.array(
        [
            [1.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, 1.0, 0.0],
            [0.0, k * s, c, -next_c],
            [1.0, c, s / k, -next_s / k],
        ]
    )
    r, x0, v0, next_v0 = np.linalg.solve(matrix, [x, v, 0.0, step_size])
    return {"r": r, "x0": x0, "v0": v0, "next_v0": next_v0}


def linear_system_for_step_size(
    x: float, v: float, k: float, time: float, next_begin: float, origin: float
) -> float:
    """The same system with r given: solved for x0, v0, v-bar_0 and the step size."""
    c, s = cosh(k * time), sinh(k * time)
    next_c, next_s = cosh(k * next_begin), sinh(k * next_begin)
    matrix = np.array(
        [
            [1.0, 0.0, 0.0, 0.0],
            [0.0, 1.0, 0.0, 0.0],
            [k * s, c, -next_c, 0.0],
            [c, s / k, -next_s / k, -1.0],
        ]
    )
    return float(np.linalg.solve(matrix, [x - origin, v, 0.0, -origin])[3])


def natural_frequency(height: float) -> float:
    return sqrt(9.81 / height)
