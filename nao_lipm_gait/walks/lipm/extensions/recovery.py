"""Extension of the paper: steps that recover from a push.

The paper moves the support change and the pendulum origin in x. For a CoM that these cannot catch:

- `outward_origin_shift` moves r_y outwards inside the sole, so that a late CoM returns in time;
- `catching_stride` moves the next origin sideways to where it turns the CoM back at its width;
- `capture_shift` lengthens the step in x beyond the one that keeps the speed;
- a step that would get too long ends sooner, see `SingleSupport`.

Lateral values are mirrored as in `support_change`: positive towards the swing leg.
"""

from math import atanh, cosh, exp, sinh, sqrt

from nao_lipm_gait.walks.pendulum import divergent_component


def outward_origin_shift(
    x: float, v: float, k: float, stride: float, next_width: float, time: float, shift_max: float
) -> float:
    """How far r_y has to move outwards for a support change within `time`.

    The divergent component xi grows by e^(k t). To be L at the support change it has to be
    L e^(-k t) now. L is that of the undisturbed change, half-way between the origins, which the
    shift moves apart.

    Args:
        x: CoM from the running origin [m].
        v: Its velocity [m/s].
        k: Natural frequency [1/s].
        stride: Distance D of the two origins [m].
        next_width: Wanted width of the next pendulum [m].
        time: Time left [s].
        shift_max: Largest shift [m].

    Returns:
        The shift [m], from 0 to `shift_max`.
    """
    half = 0.5 * stride
    leaving_reach = half + sqrt(max(half * half - next_width * next_width, 0.0))
    shrink = exp(-k * time)
    shift = (leaving_reach * shrink - divergent_component(x, v, k)) / (1.0 - shrink)
    return min(max(shift, 0.0), shift_max)


def catching_stride(position: float, velocity: float, k: float, next_width: float) -> float:
    """The distance D of the origins for which the next pendulum turns the CoM at `next_width`.

    (D - p)^2 - (v / k)^2 = w^2, the second equation of `support_change`, solved for D.

    Args:
        position: CoM from the running origin at the support change [m].
        velocity: Its velocity then [m/s].
        k: Natural frequency [1/s].
        next_width: Wanted width w of the next pendulum [m].

    Returns:
        D [m].
    """
    return position + sqrt(next_width * next_width + (velocity / k) ** 2)


def turning_time(x: float, v: float, k: float) -> float:
    """Time [s] until the CoM at x [m], v [m/s] stops moving outwards; 0 if it never does."""
    return atanh(-v / (k * x)) / k if x > 0.0 and -k * x < v < 0.0 else 0.0


def capture_shift(
    x: float,
    v: float,
    k: float,
    t_e: float,
    next_tanh: float,
    r_x: float,
    keeping: float,
    passing: float,
) -> float:
    """Step length that corrects the speed at once, minus the one that keeps it.

    A walk that passes its origins with v_0 has the divergent component (v_0 / k) e^(-k t_b) ahead
    of the next origin at the support change, t_b before it passes that origin. The step that
    corrects the speed leaves just that much.

    Args:
        x: CoM in Q now [m].
        v: Its velocity [m/s].
        k: Natural frequency [1/s].
        t_e: Time until the support change [s].
        next_tanh: tanh(k t_b-bar) of the next pendulum.
        r_x: Pendulum origin in Q [m].
        keeping: Step size that keeps the speed [m].
        passing: v_0 / k of the wanted walk [m].

    Returns:
        The difference in step size [m].
    """
    c, s = cosh(k * t_e), sinh(k * t_e)
    reach = r_x + (x - r_x) * (c + s) + v * (s + c) / k
    # (1 - tanh) / (1 + tanh) = e^(-2 k t_b)
    left_behind = passing * sqrt((1.0 + next_tanh) / (1.0 - next_tanh))
    return reach - left_behind - keeping
