"""The preview controller: gains of the servo that minimises

    sum of Q e(k)^2 + R (change of the jerk)^2,     e = ZMP - wanted ZMP,    Q = 1 and R = 1 / w^2

knowing the wanted ZMP N periods ahead (Katayama et al., Int. J. Control 41(3), 1985; Kajita et al.,
ICRA 2003):

    u(k) = -G_e sum of e(i) - G_x x(k) - sum over j = 1..N of G_p(j) p_wanted(k + j)
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.types import FloatArray
from nao_lipm_gait.walks.preview.cart_table import CartTable, cart_table

PRECISION = 1e-12
"""Relative change at which the Riccati recursion has ended."""
ROUNDS = 20_000


@dataclass(frozen=True, slots=True, eq=False)
class PreviewGains:
    """Gains of one table, for both axes."""

    table: CartTable
    of_error_sum: float
    """G_e [1/s^3]"""
    of_state: tuple[float, float, float]
    """G_x [1/s^3, 1/s^2, 1/s]"""
    of_preview: FloatArray
    """(N,) G_p [1/s^3], the nearest period first."""


def riccati(a: FloatArray, b: FloatArray, q: FloatArray, r: float) -> FloatArray:
    """P (n, n) = q + a'Pa - a'Pb (r + b'Pb)^-1 b'Pa, for one input: b (n, 1).

    Its own recursion, from P = q until it stands still. NaoGaitError if it does not.
    """
    p = q
    for _ in range(ROUNDS):
        pa, pb = p @ a, p @ b
        following = q + a.T @ pa - (a.T @ pb) @ (b.T @ pa) / (r + float((b.T @ pb)[0, 0]))
        if np.abs(following - p).max() <= PRECISION * np.abs(following).max():
            return following
        p = following
    raise NaoGaitError("preview_jerk", r, "weights for which the Riccati recursion converges")


@lru_cache(maxsize=16)
def preview_gains(height: float, dt: float, horizon: int, weight: float) -> PreviewGains:
    """Gains for a table of this height [m], control period [s], periods of preview N, and the
    jerk w [1/s^3] per metre of ZMP error that costs the same.
    """
    table = cart_table(height, dt)
    a, b, c = table.matrices()
    # The error and the changes of the state: a servo without a constant error.
    b_1 = np.vstack((c @ b, b))
    a_1 = np.hstack((np.array(((1.0,), (0.0,), (0.0,), (0.0,))), np.vstack((c @ a, a))))
    q, r = np.diag((1.0, 0.0, 0.0, 0.0)), weight**-2
    p = riccati(a_1, b_1, q, r)
    denominator = r + float((b_1.T @ p @ b_1)[0, 0])
    gain = (b_1.T @ p @ a_1 / denominator)[0]
    closed = a_1 - b_1 @ gain[None, :]
    preview = np.empty(horizon)
    ahead = p[:, 0]  # what an error costs that is still j - 1 periods away
    for j in range(horizon):
        preview[j] = -(b_1[:, 0] @ ahead) / denominator
        ahead = closed.T @ ahead
    preview.flags.writeable = False
    x, v, acceleration = gain[1:].tolist()
    return PreviewGains(table, float(gain[0]), (x, v, acceleration), preview)


@dataclass(slots=True)
class PreviewAxis:
    """The cart along one axis, and the sum of the ZMP's errors so far."""

    x: float = 0.0
    """[m]"""
    v: float = 0.0
    a: float = 0.0
    error_sum: float = 0.0
    """[m]"""

    def step(self, wanted: float, ahead: FloatArray, gains: PreviewGains) -> None:
        """One period: `wanted` ZMP now, and (N,) the ones after it [m].

        All is counted from the cart, so that what lies beyond the horizon is taken for under it and
        a walk is the same everywhere.
        """
        self.error_sum += gains.table.zmp(self.x, self.a) - wanted
        _, on_v, on_a = gains.of_state
        jerk = -(
            gains.of_error_sum * self.error_sum
            + on_v * self.v
            + on_a * self.a
            + float(gains.of_preview @ (ahead - self.x))
        )
        self.x, self.v, self.a = gains.table.advance(self.x, self.v, self.a, jerk)
