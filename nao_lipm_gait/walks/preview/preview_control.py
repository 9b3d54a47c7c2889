"""ZMP preview control of a cart on a table (Kajita et al., ICRA 2003).

The model: the state of one horizontal axis is (x, dx/dt, d2x/dt2) of the cart, which is the CoM
[m, m/s, m/s^2]. Its jerk u [m/s^3] is constant over a control period, and

    x(k+1) = A x(k) + b u(k)
    p(k) = c x(k) = x - (h / g) d2x/dt2        the ZMP [m]

The controller minimises

    sum of Q e(k)^2 + R (change of the jerk)^2,     e = ZMP - desired ZMP,    Q = 1 and R = 1 / w^2

with the desired ZMP known N periods ahead (Katayama et al., Int. J. Control 41(3), 1985):

    u(k) = -G_e sum of e(i) - G_x x(k) - sum over j = 1..N of G_p(j) p_desired(k + j)
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from robot_core.errors import NaoGaitError
from robot_core.types import GRAVITY, FloatArray

PRECISION = 1e-12
"""Relative change at which the Riccati recursion ends."""
ROUNDS_MAX = 20_000


class CartTable(NamedTuple):
    """The discrete model, in floats.

    Attributes:
        dt: Control period [s].
        height_by_gravity: h / g [s^2].
    """

    dt: float
    height_by_gravity: float

    def advance(self, x: float, v: float, a: float, jerk: float) -> tuple[float, float, float]:
        """The state one period later.

        Args:
            x: Position of the CoM [m].
            v: Its velocity [m/s].
            a: Its acceleration [m/s^2].
            jerk: Its jerk over the period [m/s^3].

        Returns:
            Position, velocity and acceleration.
        """
        dt = self.dt
        return (
            x + dt * (v + dt * (a / 2.0 + dt * jerk / 6.0)),
            v + dt * (a + dt * jerk / 2.0),
            a + dt * jerk,
        )

    def zmp(self, x: float, a: float) -> float:
        """The ZMP [m] for the position x [m] and the acceleration a [m/s^2] of the CoM."""
        return x - self.height_by_gravity * a

    def matrices(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """A (3, 3), b (3, 1) and c (1, 3)."""
        dt = self.dt
        a = np.array(((1.0, dt, dt * dt / 2.0), (0.0, 1.0, dt), (0.0, 0.0, 1.0)))
        b = np.array(((dt**3 / 6.0,), (dt * dt / 2.0,), (dt,)))
        c = np.array(((1.0, 0.0, -self.height_by_gravity),))
        return a, b, c


def cart_table(height: float, dt: float) -> CartTable:
    """The model for a table height [m] and a control period [s]."""
    return CartTable(dt, height / GRAVITY)


@dataclass(frozen=True, slots=True, eq=False)
class PreviewGains:
    """Gains of the controller, for both axes.

    Attributes:
        of_error_sum: G_e [1/s^3].
        of_state: G_x [1/s^3, 1/s^2, 1/s].
        of_preview: G_p (N,) [1/s^3], the nearest period first.
    """

    table: CartTable
    of_error_sum: float
    of_state: tuple[float, float, float]
    of_preview: FloatArray


def riccati(a: FloatArray, b: FloatArray, q: FloatArray, r: float) -> FloatArray:
    """Solves the discrete Riccati equation of a system with one input by recursion from P = q.

    P = q + A'PA - A'Pb (r + b'Pb)^-1 b'PA

    Args:
        a: System matrix (n, n).
        b: Input matrix (n, 1).
        q: Weight of the state (n, n).
        r: Weight of the input.

    Returns:
        P (n, n).

    Raises:
        NaoGaitError: The recursion does not converge.
    """
    p = q
    for _ in range(ROUNDS_MAX):
        pa, pb = p @ a, p @ b
        following = q + a.T @ pa - (a.T @ pb) @ (b.T @ pa) / (r + float((b.T @ pb)[0, 0]))
        if np.abs(following - p).max() <= PRECISION * np.abs(following).max():
            return following
        p = following
    allowed = "weights for which the Riccati recursion converges"
    raise NaoGaitError("preview control, jerk weight", r, allowed)


@lru_cache(maxsize=16)
def preview_gains(height: float, dt: float, horizon: int, weight: float) -> PreviewGains:
    """The optimal gains.

    Args:
        height: Table height h [m].
        dt: Control period [s].
        horizon: Number of preview periods N.
        weight: Jerk that costs as much as one metre of ZMP error, w [1/s^3].

    Returns:
        The gains.

    Raises:
        NaoGaitError: The Riccati recursion does not converge for this weight.
    """
    table = cart_table(height, dt)
    a, b, c = table.matrices()
    # The state of the servo is the ZMP error and the changes of the cart's state.
    b_1 = np.vstack((c @ b, b))
    a_1 = np.hstack((np.array(((1.0,), (0.0,), (0.0,), (0.0,))), np.vstack((c @ a, a))))
    q, r = np.diag((1.0, 0.0, 0.0, 0.0)), weight**-2
    p = riccati(a_1, b_1, q, r)
    denominator = r + float((b_1.T @ p @ b_1)[0, 0])
    gain = (b_1.T @ p @ a_1 / denominator)[0]
    closed = a_1 - b_1 @ gain[None, :]
    preview = np.empty(horizon)
    ahead = p[:, 0]  # cost of an error that is still j - 1 periods ahead
    for j in range(horizon):
        preview[j] = -(b_1[:, 0] @ ahead) / denominator
        ahead = closed.T @ ahead
    preview.flags.writeable = False
    x, v, acceleration = gain[1:].tolist()
    return PreviewGains(table, float(gain[0]), (x, v, acceleration), preview)


@dataclass(slots=True)
class PreviewAxis:
    """The cart along one axis, and the sum of its ZMP errors.

    Attributes:
        x: Position of the CoM [m].
        v: Its velocity [m/s].
        a: Its acceleration [m/s^2].
        error_sum: Sum of the ZMP errors over all periods so far [m].
    """

    x: float = 0.0
    v: float = 0.0
    a: float = 0.0
    error_sum: float = 0.0

    def step(self, desired: float, ahead: FloatArray, gains: PreviewGains) -> None:
        """Advance by one period.

        All positions are taken relative to the cart: beyond the horizon the ZMP counts as below the
        cart, and a walk is the same everywhere.

        Args:
            desired: Desired ZMP now [m].
            ahead: Desired ZMP (N,) of the periods after it [m].
            gains: Gains of the controller.
        """
        self.error_sum += gains.table.zmp(self.x, self.a) - desired
        _, on_v, on_a = gains.of_state
        jerk = -(
            gains.of_error_sum * self.error_sum
            + on_v * self.v
            + on_a * self.a
            + float(gains.of_preview @ (ahead - self.x))
        )
        self.x, self.v, self.a = gains.table.advance(self.x, self.v, self.a, jerk)
