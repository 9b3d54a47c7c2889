"""Step duration: when the support changes, eqs (3)-(6) of the paper in closed form.

Everything here is lateral and mirrored: `x` is the distance of the CoM from the pendulum origin,
positive towards the swing leg, so both support legs look the same.

The paper finds t_e by iteration. For two pendulums of equal height it can be solved. E = x^2 -
(v / k)^2 is the orbital energy of the running pendulum, w the wanted width of the next one. Both
are known before the support change. With the distance D between the two origins, r-bar_y + s-bar_y
- r_y in the paper, eqs (4) and (5) become

    p^2 - (v_e / k)^2 = E,   (D - p)^2 - (v_e / k)^2 = w^2   =>   p = (D + (E - w^2) / D) / 2

for the distance p at which the CoM leaves the running pendulum. test/oracles.py has the iteration.
"""

from math import log, sqrt
from typing import final

from nao_lipm_gait.walks.lipm.extensions.turning import STRAIGHT, TurnOfView
from nao_lipm_gait.walks.pendulum import advance, divergent_component, orbital_energy

REACH_MIN = 0.008
"""Smallest divergent component of a CoM that still swings towards the other leg [m]."""


@final
class SupportChange:
    """The end of the running single support.

    Attributes:
        time: Time until then, t_e from now [s].
        position: CoM from the running origin then, x(t_e) [m].
        velocity: Its velocity then [m/s].
        feasible: Whether eqs (4) and (5) have a solution within the allowed time.
    """

    __slots__ = ("feasible", "position", "time", "velocity")

    def __init__(self, time: float, position: float, velocity: float, feasible: bool):
        self.time = time
        self.position = position
        self.velocity = velocity
        self.feasible = feasible


def plan_support_change(
    x: float,
    v: float,
    k: float,
    stride: float,
    next_width: float,
    earliest: float,
    latest: float,
    view: TurnOfView = STRAIGHT,
) -> SupportChange:
    """The support change that gives the next pendulum its wanted width.

    A turning step changes (5) to (D - e - p)^2 - ((v_e + f) / k)^2 = w^2, with e and f from `view`;
    the small term in v_e f is taken from the straight solution.

    Args:
        x: CoM from the running origin [m].
        v: Its velocity [m/s].
        k: Natural frequency [1/s].
        stride: Distance D of the two origins [m].
        next_width: Wanted |(x_0)_y| of the next pendulum, w [m].
        earliest: Earliest time from now [s].
        latest: Latest time from now [s].
        view: Extension: what a turn of the step changes.

    Returns:
        The support change; outside the allowed time, the nearest allowed one.
    """
    energy = orbital_energy(x, v, k)  # (19), squared
    reach = divergent_component(x, v, k)
    feasible = reach > REACH_MIN
    nearer, faster = view.nearer, view.faster
    stride -= nearer
    position = 0.5 * (stride + (energy - next_width * next_width) / stride)  # (4), (5)
    if faster != 0.0:
        leaving = k * sqrt(max(position * position - energy, 0.0))
        extra = (2.0 * leaving + faster) * faster / (k * k)
        position -= 0.5 * extra / stride
    radicand = position * position - energy
    if radicand < 0.0:
        # The CoM turns back before it gets there: change at the turning point, v = 0.
        feasible = False
        radicand = 0.0
        position = sqrt(energy)
    leaving_reach = position + sqrt(radicand)
    if leaving_reach <= 0.0:
        time = earliest
        feasible = False
    else:
        time = log(leaving_reach / max(reach, REACH_MIN)) / k  # the reach grows by e^(k t)
    if not earliest <= time <= latest:
        feasible = False
        time = min(max(time, earliest), latest)
    position, velocity = advance(x, v, k, time)
    return SupportChange(time, position, velocity, feasible)
