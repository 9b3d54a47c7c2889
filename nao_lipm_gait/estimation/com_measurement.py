"""Measured CoM: torso orientation and the kinematic chain to the support foot.

The level frame of a sole has its origin in the sole, its x axis along the sole's heading, and its
z axis up.
"""

from math import atan2, sqrt
from typing import final

from nao_lipm_gait.whole_body.body_model import SolePose
from robot_core.geometry import compose, cross, dot, rotate_planar
from robot_core.types import Point3, Pose2


@final
class LevelFrame:
    """The level frame of a sole, given in the torso frame.

    Attributes:
        origin: Origin [m].
    """

    __slots__ = ("forward", "left", "origin", "up")

    def __init__(self, origin: Point3, forward: Point3, left: Point3, up: Point3):
        self.origin = origin
        self.forward = forward
        self.left = left
        self.up = up

    def components(self, vector: Point3) -> Point3:
        """A vector of the torso frame in this frame."""
        x, y, z = vector
        (fx, fy, fz), (lx, ly, lz), (ux, uy, uz) = self.forward, self.left, self.up
        return fx * x + fy * y + fz * z, lx * x + ly * y + lz * z, ux * x + uy * y + uz * z

    def coordinates(self, point: Point3) -> Point3:
        """A point [m] of the torso frame in this frame."""
        ox, oy, oz = self.origin
        x, y, z = point[0] - ox, point[1] - oy, point[2] - oz
        (fx, fy, fz), (lx, ly, lz), (ux, uy, uz) = self.forward, self.left, self.up
        return fx * x + fy * y + fz * z, lx * x + ly * y + lz * z, ux * x + uy * y + uz * z

    def pose_of(self, sole: SolePose) -> Pose2:
        """The planar pose of another sole in this frame."""
        x, y, _ = self.coordinates(sole.position)
        forward, left, _ = self.components(sole.forward)
        return x, y, atan2(left, forward)

    @property
    def torso_yaw(self) -> float:
        """Yaw [rad] of the torso in this frame."""
        return atan2(self.left[0], self.forward[0])


def level_frame(sole: SolePose, up: Point3) -> LevelFrame:
    """The level frame of a sole; `up`: unit vertical in the torso frame."""
    fx, fy, fz = sole.forward
    ux, uy, uz = up
    along = dot(sole.forward, up)
    fx, fy, fz = fx - along * ux, fy - along * uy, fz - along * uz
    length = sqrt(fx * fx + fy * fy + fz * fz)
    if length < 1e-6:
        return LevelFrame(sole.position, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), up)
    forward = (fx / length, fy / length, fz / length)
    return LevelFrame(sole.position, forward, cross(up, forward), up)


def measured_com_in_q(com_in_sole: Point3, sole_in_q: Pose2) -> Point3:
    """The measured CoM x_m of eq (11) [m] in Q.

    Args:
        com_in_sole: CoM [m] in the level frame of the support sole, by the joint angles.
        sole_in_q: Pose of the support sole in Q, by the walk.

    Returns:
        x, y in Q and z above the sole [m].
    """
    x, y, z = com_in_sole
    x, y, _ = compose(sole_in_q, (x, y, 0.0))
    return x, y, z


def measured_acceleration_in_q(force_in_sole: Point3, sole_in_q: Pose2) -> tuple[float, float]:
    """The torso's acceleration [m/s^2] along x and y of Q; gravity has no level component.

    Args:
        force_in_sole: Accelerometer [m/s^2] in the level frame of the support sole.
        sole_in_q: Pose of the support sole in Q, by the walk.
    """
    forward, left, _ = force_in_sole
    return rotate_planar(forward, left, sole_in_q[2])
