"""When to alter the support leg: eqs (3)-(6), in closed form.

Everything here is lateral and mirrored: `x` is the distance of the CoM from the pendulum origin,
positive towards the swing leg, so that both support legs look the same. The paper finds t_e by
iteration; two pendulums of equal height let it be solved: with the orbital energies
E = x^2 - (v/k)^2 of the running pendulum and w^2 of the next one (w = its wanted width), both
known before the exchange, eqs (4) and (5) become

    p^2 - (v_e/k)^2 = E,   (D - p)^2 - (v_e/k)^2 = w^2   =>   p = (D + (E - w^2) / D) / 2

for the distance p at which the CoM leaves the running pendulum, D being the distance between the
two origins. test/oracles.py holds the paper's iteration.

Two extensions of the paper for a CoM that was pushed: `origin_shift_for` leans the pendulum on the
outer part of the sole when the CoM would take too long to come back, and `stride_that_catches`
moves the next origin to where it turns the CoM back at its wanted width.
"""

from math import atanh, exp, log, sqrt
from typing import NamedTuple

from nao_lipm_gait.walks.pendulum import advance, divergent_component, orbital_energy

REACH_MIN = 0.008
"""[m] Smallest divergent component taken for a CoM that still swings towards the other leg."""


class SupportChange(NamedTuple):
    """The end of the running single support phase."""

    time: float
    """[s] from now."""
    position: float
    """[m] CoM from the running origin, towards the swing leg: x(t_e)."""
    velocity: float
    """[m/s] towards the swing leg."""
    feasible: bool
    """False where eqs (4) and (5) had no solution inside the allowed time."""


class TurnOfView(NamedTuple):
    """What a turning step changes where Q-bar takes over: it sees motion in x as motion in y."""

    nearer: float = 0.0
    """[m] by which the CoM is nearer to the next origin."""
    faster: float = 0.0
    """[m/s] by which it is faster towards it."""


STRAIGHT = TurnOfView()


def turn_of_view(swing: int, tan_yaw: float, x_from_next: float, vx: float) -> TurnOfView:
    """For a step that turns by the yaw angle; swing: side of the swing leg; x_from_next [m], vx
    [m/s]: the CoM ahead of the next origin and its speed in Q at the exchange.
    """
    return TurnOfView(-swing * tan_yaw * x_from_next, -swing * tan_yaw * vx)


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
    """The support change that hands the CoM over to the next pendulum with its wanted width.

    x, v: mirrored lateral state [m, m/s]; stride: D [m]; next_width: wanted |(x0)_y| of the next
    pendulum [m]; earliest, latest: bounds on the time from now [s]; view: of a turning step.

    In a turn (5) reads (D - e - p)^2 - ((v_e + f) / k)^2 = w^2 with the two values of the view; the
    small term in v_e f is taken from the straight solution.
    """
    energy = orbital_energy(x, v, k)
    reach = divergent_component(x, v, k)
    feasible = reach > REACH_MIN
    nearer, faster = view.nearer, view.faster
    stride -= nearer
    position = 0.5 * (stride + (energy - next_width * next_width) / stride)
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
        time = log(leaving_reach / max(reach, REACH_MIN)) / k
    if not earliest <= time <= latest:
        feasible = False
        time = min(max(time, earliest), latest)
    position, velocity = advance(x, v, k, time)
    return SupportChange(time, position, velocity, feasible)


def origin_shift_for(
    x: float, v: float, k: float, stride: float, next_width: float, time: float, shift_max: float
) -> float:
    """How far [m] the origin has to move outwards for a support change within `time` [s] from now.

    The analogue of r_x for y. The divergent component xi grows by e^(k t), so it has to be
    L e^(-k t) now to be L at the exchange; L is that of the undisturbed exchange, half-way between
    the origins, which move apart by the shift. Arguments as for `plan_support_change`.
    """
    half = 0.5 * stride
    leaving_reach = half + sqrt(max(half * half - next_width * next_width, 0.0))
    shrink = exp(-k * time)
    shift = (leaving_reach * shrink - divergent_component(x, v, k)) / (1.0 - shrink)
    return min(max(shift, 0.0), shift_max)


def turning_time(x: float, v: float, k: float) -> float:
    """Time [s] until the CoM stops moving outwards; 0 if it does not, or never stops."""
    return atanh(-v / (k * x)) / k if x > 0.0 and -k * x < v < 0.0 else 0.0


def stride_that_catches(position: float, velocity: float, k: float, next_width: float) -> float:
    """D [m] for which a CoM that leaves at `position` with `velocity` turns back at `next_width`.

    (D - p)^2 - (v/k)^2 = w^2, the second of the two equations above, solved for D.
    """
    return position + sqrt(next_width * next_width + (velocity / k) ** 2)
