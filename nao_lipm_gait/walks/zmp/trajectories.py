"""The trajectories of one half stride, eqs (1)-(6) of Friedmann et al. (IJHR 5(3), 2008).

A full stride of duration T is two half strides, one per leg. The paper divides it into 4n ticks:
up and down of the one foot, up and down of the other. Here time is continuous and every share runs
over 0..1; t = 0 is the middle of a half stride, where the hip is farthest out.

    paper              here
    T/2                half stride, `zmp_step_duration`
    y_ZMP              `zmp_offset_y`
    h                  `pendulum_height`
    z_height, c_4      `swing_lift` is the height that (5) reaches, their product with the constants
    c_3                acos(1 - `zmp_double_support`)
    x_dist             half the distance of the feet, from the step sizes

As printed, eq (5) begins below the ground and reaches it at the share 1 - cos(c_3) of the way up:
so long both feet stand. With c_3 = 0.75 that is 27 % of a half stride, and c_4 = 8 lets the foot
rise to 2.1 z_height.
"""

from math import acos, asin, cos, cosh, pi, sinh

C_3 = 0.75
"""c_3 as published; `zmp_double_support` is made of it."""
DOUBLE_SUPPORT = 1.0 - cos(C_3)


def sway(t: float, half_stride: float, y_zmp: float, w: float) -> tuple[float, float, float]:
    """Eqs (1), (2): y [m] of the CoM from the middle of the feet, its velocity and acceleration.

    t [s] from -T/4 to T/4; y_zmp [m] towards the standing foot is positive; w = sqrt(g/h) [1/s].
    """
    c = -y_zmp / (2.0 * cosh(0.5 * w * half_stride))  # C_1 = C_2, with T/4 = half_stride / 2
    y = 2.0 * c * cosh(w * t) + y_zmp
    return y, 2.0 * c * w * sinh(w * t), 2.0 * c * w * w * cosh(w * t)


def zmp_under(y: float, acceleration: float, w: float) -> float:
    """Eq (3): where the ZMP [m] is under a CoM at y [m]; under (2) it is y_ZMP all the time."""
    return y - acceleration / (w * w)


def travel(share: float, double_support: float) -> float:
    """Eq (4): the share of its way that the swing foot has gone, evenly in time.

    Not over the whole half stride as printed, but from lift-off to touch-down: a foot that is on
    the ground would be dragged over it.
    """
    on_ground = 0.5 * double_support
    return min(max((share - on_ground) / (1.0 - double_support), 0.0), 1.0)


def lift_up(share: float, double_support: float) -> float:
    """Eq (5) over the share i/n of the way up; 0 on the ground, 1 at the highest."""
    c_3 = acos(1.0 - double_support)
    height = pi / 2.0 - asin(min(max(1.0 - share, 0.0), 1.0)) - c_3
    return max(0.0, height / (pi / 2.0 - c_3))


def lift(share: float, double_support: float) -> float:
    """Eqs (5), (6): height over the share of a whole half stride, up and then the mirror image."""
    return lift_up(2.0 * min(share, 1.0 - share), double_support)


def entry_speed(half_stride: float, y_zmp: float, w: float) -> float:
    """[m/s] of the CoM from foot to foot as it passes the middle."""
    return sway(-0.5 * half_stride, half_stride, y_zmp, w)[1]


def swing_in(t: float, duration: float, speed: float) -> float:
    """From rest in the middle back to it, where the CoM then has `speed` [m/s]; y [m] at t [s].

    Not in the paper: the cubic with these ends. It leans on the one leg and returns to the other.
    """
    return speed * (t * t * t / (duration * duration) - t * t / duration)


def swing_out(t: float, duration: float, speed: float) -> float:
    """The way back: through the middle with `speed` [m/s], then to rest there."""
    return -swing_in(duration - t, duration, speed)
