"""The 3D linear inverted pendulum mode, along one horizontal axis: eqs (1)-(3) and (19).

x [m] and v [m/s] are the position and the velocity of the CoM relative to the pendulum origin;
k = sqrt(g / h) [1/s] for a pendulum of height h.
"""

from math import acosh, cosh, sinh, sqrt

from robot_core.types import GRAVITY


def natural_frequency(height: float) -> float:
    """The k = sqrt(g / h) [1/s] for a pendulum height h [m]."""
    return sqrt(GRAVITY / height)


def advance(x: float, v: float, k: float, t: float) -> tuple[float, float]:
    """Position [m] and velocity [m/s] after t [s].

    Args:
        x: Position now [m].
        v: Velocity now [m/s].
        k: Natural frequency [1/s].
        t: Time [s]; negative values go back in time.

    Returns:
        x(t) of eq (1) and its derivative of eq (2).
    """
    c = cosh(k * t)
    s = sinh(k * t)
    return x * c + v * s / k, x * k * s + v * c


def orbital_energy(x: float, v: float, k: float) -> float:
    """The invariant x^2 - (v / k)^2 [m^2] of the motion.

    It equals (x_0)^2, the radicand of eq (19): x_0 is the position where the pendulum turns back.
    It is negative if the CoM passes over the origin and never turns back.
    """
    return x * x - (v / k) ** 2


def divergent_component(x: float, v: float, k: float) -> float:
    """The xi = x + v / k [m]; it grows as e^(k t)."""
    return x + v / k


def half_step_duration(width: float, distance: float, k: float) -> float:
    """Time [s] from the turning point at `width` [m] to `distance` [m]: eq (3) solved for t."""
    return acosh(max(1.0, distance / width)) / k
