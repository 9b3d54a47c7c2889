"""The 3D linear inverted pendulum mode: one axis at a time, relative to the pendulum origin.

Positions x [m] and velocities v [m/s] are of the CoM relative to the origin of the pendulum, along
one horizontal axis; k = sqrt(g / h) [1/s].
"""

from math import acosh, asinh, cosh, sinh, sqrt

from nao_lipm_gait.types import GRAVITY


def natural_frequency(height: float) -> float:
    """K [1/s] of a pendulum of the given height [m]."""
    return sqrt(GRAVITY / height)


def advance(x: float, v: float, k: float, t: float) -> tuple[float, float]:
    """Position and velocity after t [s]: eqs (1) and (2)."""
    c = cosh(k * t)
    s = sinh(k * t)
    return x * c + v * s / k, x * k * s + v * c


def orbital_energy(x: float, v: float, k: float) -> float:
    """x^2 - (v/k)^2 [m^2], constant along the motion.

    It is the square of (x0) where the pendulum turns back (v = 0 there), eq (19) without its root.
    Negative where the CoM has the energy to pass over the origin and never turns back.
    """
    return x * x - (v / k) ** 2


def divergent_component(x: float, v: float, k: float) -> float:
    """Xi = x + v/k [m]; it grows as e^(k t)."""
    return x + v / k


def redetermined(x: float, v: float, k: float) -> tuple[float, float] | None:
    """(x0, t) of the pendulum that passes through x and v: eqs (19) and (20).

    x0 [m] has the sign of x: the paper prints the root's positive branch only, which fits one of
    the two support legs. None where the radicand of (19) is not positive: the pendulum passes
    over its origin and has no turning point.
    """
    radicand = orbital_energy(x, v, k)
    if radicand <= 0.0:
        return None
    x0 = sqrt(radicand) if x > 0.0 else -sqrt(radicand)
    return x0, asinh(v / (k * x0)) / k


def half_step_duration(width: float, distance: float, k: float) -> float:
    """Time [s] from the turning point at `width` to `distance` from the origin: eq (3) for t."""
    return acosh(max(1.0, distance / width)) / k
