"""Measured CoM: torso orientation and the kinematic chain to the support foot.

The level frame of a sole has its origin in the sole, its x axis along the sole's heading, and its
z axis up.
"""

from math import atan2, sqrt
from typing import final

from nao_lipm_gait.geometry import compose, cross, dot, rotate_planar
from nao_lipm_gait.types import Point3, Pose2
from nao_lipm_gait.whole_body.body_model import SolePose


@final
class LevelFrame:
    """The level frame of a sole, given in the torso frame.

    Attributes:
        origin: Origin [m].
        forward: Unit x axis.
        left: Unit y axis.
        up: Unit z axis.
    """

    __slots__ = ("forward", "left", "origin", "up")

    def __init__(self, origin: Point3, forward: Point3, left: Point3, up: Point3):
        self.origin = origin
        self.forward = forward
        self.left = left
        self.up = up

    def level_components(self, vector: Point3) -> tuple[float, float]:
        """The components of a vector of the torso frame along x and y of this frame."""
        return dot(vector, self.forward), dot(vector, self.left)

    def coordinates(self, point: Point3) -> Point3:
        """A point [m] of the torso frame in this frame."""
        ox, oy, oz = self.origin
        x, y, z = point[0] - ox, point[1] - oy, point[2] - oz
        (fx, fy, fz), (lx, ly, lz), (ux, uy, uz) = self.forward, self.left, self.up
        return fx * x + fy * y + fz * z, lx * x + ly * y + lz * z, ux * x + uy * y + uz * z

    def pose_of(self, sole: SolePose) -> Pose2:
        """The planar pose of another sole in this frame."""
        x, y, _ = self.coordinates(sole.position)
        forward, left = self.level_components(sole.forward)
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


def measured_com_in_q(com_in_torso: Point3, sole: LevelFrame, sole_in_q: Pose2) -> Point3:
    """The measured CoM x_m of eq (11) [m] in Q.

    Args:
        com_in_torso: CoM [m] in the torso frame, by the joint angles.
        sole: Level frame of the support sole.
        sole_in_q: Pose of the support sole in Q, by the walk.

    Returns:
        x, y in Q and z above the sole [m].
    """
    x, y, z = sole.coordinates(com_in_torso)
    x, y, _ = compose(sole_in_q, (x, y, 0.0))
    return x, y, z


def measured_acceleration_in_q(
    specific_force: Point3, sole: LevelFrame, sole_in_q: Pose2
) -> tuple[float, float]:
    """The torso's acceleration [m/s^2] along x and y of Q; gravity has no level component.

    Args:
        specific_force: Accelerometer [m/s^2] in the torso frame.
        sole: Level frame of the support sole.
        sole_in_q: Pose of the support sole in Q, by the walk.
    """
    forward, left = sole.level_components(specific_force)
    return rotate_planar(forward, left, sole_in_q[2])
