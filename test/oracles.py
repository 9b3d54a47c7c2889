"""The paper's own forms of what the package computes in closed form."""

from math import asinh, cosh, sinh, sqrt

import numpy as np


def iterated_support_change(
    x0: float, k: float, next_x0: float, next_k: float, stride: float
) -> tuple[float, float]:
    """Eqs (4)-(6), solved by guessing and refining t_e as in section 2.2.

    Distances are mirrored: positive towards the swing leg. Those of the next pendulum are measured
    from its own origin back towards the running one.

    Args:
        x0: (x_0)_y [m].
        k: Natural frequency [1/s].
        next_x0: (x-bar_0)_y [m].
        next_k: Natural frequency of the next pendulum [1/s].
        stride: Distance of the two origins [m].

    Returns:
        t_e and t_b-bar [s].
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


def redetermined(x: float, v: float, k: float) -> tuple[float, float] | None:
    """((x_0)_y' [m], t_i' [s]) of the pendulum through x [m] and v [m/s]: eqs (19) and (20).

    x_0 has the sign of x; the paper prints the positive root, which fits one of the two legs. None
    where the radicand is not positive: the CoM passes over the origin and never turns back.
    """
    radicand = x * x - (v / k) ** 2
    if radicand <= 0.0:
        return None
    x0 = sqrt(radicand) if x > 0.0 else -sqrt(radicand)
    return x0, asinh(v / (k * x0)) / k


def linear_system(
    x: float, v: float, k: float, time: float, next_begin: float, step_size: float
) -> dict[str, float]:
    """Eq (9) in x with r-bar_x = 0, x-bar_0 = 0 and t = 0 now: solved for r, x0, v0 and v-bar_0.

    Args:
        x: CoM relative to Q [m].
        v: Its velocity [m/s].
        k: Natural frequency [1/s].
        time: t_e [s].
        next_begin: t_b-bar [s].
        step_size: Step size s-bar [m].

    Returns:
        The four unknowns by name.
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
    """Eq (9) with r given: solved for the step size.

    Args:
        x: CoM relative to Q [m].
        v: Its velocity [m/s].
        k: Natural frequency [1/s].
        time: t_e [s].
        next_begin: t_b-bar [s].
        origin: r [m].

    Returns:
        s-bar [m].
    """
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
