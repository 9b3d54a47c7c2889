"""The measured CoM: torso orientation and the kinematic chain to the supporting foot."""

from nao_lipm_gait.estimation.level_frame import LevelFrame
from nao_lipm_gait.planar import compose, turned
from nao_lipm_gait.signals import Point3, Pose2


def measured_com_in_q(com_in_torso: Point3, sole: LevelFrame, sole_in_q: Pose2) -> Point3:
    """x_m of eq (11): the CoM relative to Q, by where the walk has put the sole [m]."""
    x, y, z = sole.seen(com_in_torso)
    x, y, _ = compose(sole_in_q, (x, y, 0.0))
    return x, y, z


def measured_acceleration_in_q(
    specific_force: Point3, sole: LevelFrame, sole_in_q: Pose2
) -> tuple[float, float]:
    """The torso's acceleration along x and y of Q [m/s^2]; gravity has no part in the level."""
    ahead, aside = sole.along(specific_force)
    return turned(ahead, aside, sole_in_q[2])
