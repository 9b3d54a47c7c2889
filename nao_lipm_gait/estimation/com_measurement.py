"""The measured CoM: torso orientation and the kinematic chain to the supporting foot."""

from math import atan2, cos, sin, sqrt

from nao_lipm_gait.kinematics.body_model import SolePose
from nao_lipm_gait.signals import Point3, Pose2


def level_heading(sole: SolePose, up: Point3) -> tuple[Point3, Point3]:
    """Horizontal unit axes, forward and left of a sole, in the torso frame."""
    fx, fy, fz = sole.forward
    ux, uy, uz = up
    along = fx * ux + fy * uy + fz * uz
    fx, fy, fz = fx - along * ux, fy - along * uy, fz - along * uz
    length = sqrt(fx * fx + fy * fy + fz * fz)
    if length < 1e-6:
        return (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
    fx, fy, fz = fx / length, fy / length, fz / length
    return (fx, fy, fz), (uy * fz - uz * fy, uz * fx - ux * fz, ux * fy - uy * fx)


def com_from_sole(com_in_torso: Point3, sole: SolePose, up: Point3) -> Point3:
    """The CoM seen from the sole, in the level frame that points where the sole points [m]."""
    forward, left = level_heading(sole, up)
    cx, cy, cz = com_in_torso
    sx, sy, sz = sole.position
    away = (cx - sx, cy - sy, cz - sz)
    return _dot(away, forward), _dot(away, left), _dot(away, up)


def measured_com_in_q(com_from_support_sole: Point3, sole_in_q: Pose2) -> Point3:
    """x_m of eq (11): the same point relative to Q, where the walk has put the sole [m]."""
    x, y, z = com_from_support_sole
    c, s = cos(sole_in_q[2]), sin(sole_in_q[2])
    return sole_in_q[0] + c * x - s * y, sole_in_q[1] + s * x + c * y, z


def measured_acceleration_in_q(
    specific_force: Point3, sole: SolePose, up: Point3, sole_in_q: Pose2
) -> tuple[float, float]:
    """The torso's acceleration along x and y of Q [m/s^2]; gravity has no part in the level."""
    forward, left = level_heading(sole, up)
    x, y = _dot(specific_force, forward), _dot(specific_force, left)
    c, s = cos(sole_in_q[2]), sin(sole_in_q[2])
    return c * x - s * y, s * x + c * y


def sole_from_sole(target: SolePose, reference: SolePose, up: Point3) -> Pose2:
    """Pose of one sole on the ground plane as seen from the other [m, m, rad]."""
    forward, left = level_heading(reference, up)
    px, py, pz = target.position
    rx, ry, rz = reference.position
    away = (px - rx, py - ry, pz - rz)
    turn = atan2(_dot(target.forward, left), _dot(target.forward, forward))
    return _dot(away, forward), _dot(away, left), turn


def _dot(a: Point3, b: Point3) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
