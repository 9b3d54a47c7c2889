"""The trajectories of one half stride, eqs (1)-(6) of Friedmann et al. (IJHR 5(3), 2008).

A full stride of duration T is two half strides, one per leg. The paper divides it into 4n ticks: up
and down of one foot, up and down of the other. Here time is continuous and every share goes from 0
to 1; t = 0 is the middle of a half stride, where the hip is farthest out.

    paper              here
    T/2                half stride, `zmp_step_duration`
    y_ZMP              `zmp_offset_y`
    h                  `pendulum_height`
    z_height, c_4      `swing_lift` is the height that (5) reaches, their product with the constants
    c_3                acos(1 - `zmp_double_support`)
    x_dist             half the distance of the feet, from the step sizes

As printed, eq (5) begins below the ground and reaches it at the share 1 - cos(c_3) of the way up.
Until then both feet stand. With c_3 = 0.75 this is 27 % of a half stride, and with c_4 = 8 the foot
rises to 2.1 z_height.
"""

from math import acos, asin, cosh, pi, sinh


def sway(t: float, half_stride: float, y_zmp: float, w: float) -> tuple[float, float, float]:
    """Lateral motion of the CoM: eqs (1), (2).

    Args:
        t: Time from the middle of the half stride, -T/4 to T/4 [s].
        half_stride: Its duration T/2 [s].
        y_zmp: Desired ZMP [m], positive towards the standing foot.
        w: sqrt(g / h) [1/s].

    Returns:
        Distance of the CoM from the middle of the feet [m], its velocity and its acceleration.
    """
    c = -y_zmp / (2.0 * cosh(0.5 * w * half_stride))  # C_1 = C_2, with T/4 = half_stride / 2
    y = 2.0 * c * cosh(w * t) + y_zmp
    return y, 2.0 * c * w * sinh(w * t), 2.0 * c * w * w * cosh(w * t)


def travel(share: float, double_support: float) -> float:
    """Eq (4): share of its distance that the swing foot has moved, at constant speed.

    It moves from lift-off to touch-down, not over the whole half stride as printed: a foot on the
    ground would slide.
    """
    on_ground = 0.5 * double_support
    return min(max((share - on_ground) / (1.0 - double_support), 0.0), 1.0)


def lift_up(share: float, double_support: float) -> float:
    """Eq (5): height at the share i/n of the way up; 0 on the ground, 1 at the highest point."""
    c_3 = acos(1.0 - double_support)
    height = pi / 2.0 - asin(min(max(1.0 - share, 0.0), 1.0)) - c_3
    return max(0.0, height / (pi / 2.0 - c_3))


def lift(share: float, double_support: float) -> float:
    """Eqs (5), (6): height at a share of the half stride, up and then its mirror image."""
    return lift_up(2.0 * min(share, 1.0 - share), double_support)


def entry_speed(half_stride: float, y_zmp: float, w: float) -> float:
    """Lateral speed of the CoM where it passes the middle of the feet [m/s]."""
    return sway(-0.5 * half_stride, half_stride, y_zmp, w)[1]


def swing_in(t: float, duration: float, speed: float) -> float:
    """Lateral motion at the start: from rest in the middle over one foot and back to the middle.

    Not in the paper: the cubic with these ends.

    Args:
        t: Time since the start [s].
        duration: Duration of the motion [s].
        speed: Speed at its end [m/s].

    Returns:
        y of the CoM [m].
    """
    return speed * (t * t * t / (duration * duration) - t * t / duration)


def swing_out(t: float, duration: float, speed: float) -> float:
    """Lateral motion at the stop, the mirror image in time of `swing_in`: from `speed` to rest.

    Arguments and result are as there; `speed` [m/s] is that at its beginning.
    """
    return -swing_in(duration - t, duration, speed)
