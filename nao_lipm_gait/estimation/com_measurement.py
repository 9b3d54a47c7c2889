"""The measured CoM: torso orientation and the kinematic chain to the supporting foot."""

from math import atan2, cos, sin, sqrt

from nao_lipm_gait.kinematics.body_model import SolePose
from nao_lipm_gait.signals import Point3, Pose2


def level_heading(sole: SolePose, up: Point3) -> tuple[Point3, Point3]:
    """Horizontal unit axes, forward and left of a sole, in the torso frame."""
    fx, fy, fz = sole.forward
    along = fx * up[0] + fy * up[1] + fz * up[2]
    fx, fy, fz = fx - along * up[0], fy - along * up[1], fz - along * up[2]
    length = sqrt(fx * fx + fy * fy + fz * fz)
    if length < 1e-6:
        return (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
    forward = (fx / length, fy / length, fz / length)
    left = (
        up[1] * forward[2] - up[2] * forward[1],
        up[2] * forward[0] - up[0] * forward[2],
        up[0] * forward[1] - up[1] * forward[0],
    )
    return forward, left


def com_from_sole(com_in_torso: Point3, sole: SolePose, up: Point3) -> Point3:
    """The CoM seen from the sole, in the level frame that points where the sole points [m]."""
    forward, left = level_heading(sole, up)
    dx = com_in_torso[0] - sole.position[0]
    dy = com_in_torso[1] - sole.position[1]
    dz = com_in_torso[2] - sole.position[2]
    return (
        dx * forward[0] + dy * forward[1] + dz * forward[2],
        dx * left[0] + dy * left[1] + dz * left[2],
        dx * up[0] + dy * up[1] + dz * up[2],
    )


def measured_com_in_q(com_from_support_sole: Point3, sole_in_q: Pose2) -> Point3:
    """x_m of eq (11): the same point relative to Q, where the walk has put the sole [m]."""
    x, y, z = com_from_support_sole
    c, s = cos(sole_in_q[2]), sin(sole_in_q[2])
    return sole_in_q[0] + c * x - s * y, sole_in_q[1] + s * x + c * y, z


def sole_from_sole(target: SolePose, reference: SolePose, up: Point3) -> Pose2:
    """Pose of one sole on the ground plane as seen from the other [m, m, rad]."""
    forward, left = level_heading(reference, up)
    d = [a - b for a, b in zip(target.position, reference.position, strict=True)]
    x = sum(a * b for a, b in zip(d, forward, strict=True))
    y = sum(a * b for a, b in zip(d, left, strict=True))
    along = sum(a * b for a, b in zip(target.forward, forward, strict=True))
    across = sum(a * b for a, b in zip(target.forward, left, strict=True))
    return x, y, atan2(across, along)
