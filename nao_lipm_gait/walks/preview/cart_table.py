"""The cart on a table of Kajita et al. (ICRA 2003): the jerk of the CoM in, the ZMP out.

The state of one horizontal axis is (x, dx/dt, d2x/dt2) of the cart, which is the CoM [m, m/s,
m/s^2]; its jerk u [m/s^3] is constant over a control period, and

    x(k+1) = A x(k) + b u(k)
    p(k) = c x(k) = x - (h / g) d2x/dt2        the ZMP [m]
"""

from typing import NamedTuple

import numpy as np

from nao_lipm_gait.types import GRAVITY, FloatArray


class CartTable(NamedTuple):
    """The discrete model, in floats: one axis is three numbers and one tick a few products."""

    dt: float
    """[s]"""
    height_by_gravity: float
    """h / g [s^2]"""

    def advance(self, x: float, v: float, a: float, jerk: float) -> tuple[float, float, float]:
        """The state one period later."""
        dt = self.dt
        return (
            x + dt * (v + dt * (a / 2.0 + dt * jerk / 6.0)),
            v + dt * (a + dt * jerk / 2.0),
            a + dt * jerk,
        )

    def zmp(self, x: float, a: float) -> float:
        """[m]"""
        return x - self.height_by_gravity * a

    def matrices(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """A (3, 3), b (3, 1) and c (1, 3)."""
        dt = self.dt
        a = np.array(((1.0, dt, dt * dt / 2.0), (0.0, 1.0, dt), (0.0, 0.0, 1.0)))
        b = np.array(((dt**3 / 6.0,), (dt * dt / 2.0,), (dt,)))
        c = np.array(((1.0, 0.0, -self.height_by_gravity),))
        return a, b, c


def cart_table(height: float, dt: float) -> CartTable:
    """The table of this height [m] at this control period [s]."""
    return CartTable(dt, height / GRAVITY)
