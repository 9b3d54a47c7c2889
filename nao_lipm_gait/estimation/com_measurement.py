"""The measured CoM: torso orientation and the kinematic chain to the supporting foot.

The level frame of a sole: its origin in the sole, x to where the sole points, z up.
"""

from math import atan2, sqrt
from typing import NamedTuple

from nao_lipm_gait.geometry import compose, dot, rotate_planar
from nao_lipm_gait.types import Point3, Pose2
from nao_lipm_gait.whole_body.body_model import SolePose


class LevelFrame(NamedTuple):
    """Origin [m] and unit axes, in the torso frame."""

    origin: Point3
    forward: Point3
    left: Point3
    up: Point3

    def along(self, vector: Point3) -> tuple[float, float]:
        """The level part of a vector of the torso frame, forward and left."""
        return dot(vector, self.forward), dot(vector, self.left)

    def seen(self, point: Point3) -> Point3:
        """A point of the torso frame [m] in this one."""
        origin = self.origin
        away = (point[0] - origin[0], point[1] - origin[1], point[2] - origin[2])
        return dot(away, self.forward), dot(away, self.left), dot(away, self.up)

    def pose_of(self, sole: SolePose) -> Pose2:
        """Another sole on the ground plane [m, m, rad]."""
        x, y, _ = self.seen(sole.position)
        ahead, aside = self.along(sole.forward)
        return x, y, atan2(aside, ahead)

    @property
    def torso_yaw(self) -> float:
        """[rad] of the torso over the sole."""
        return atan2(self.left[0], self.forward[0])


def level_frame(sole: SolePose, up: Point3) -> LevelFrame:
    """Of a sole and the unit vertical, both in the torso frame."""
    fx, fy, fz = sole.forward
    ux, uy, uz = up
    along = fx * ux + fy * uy + fz * uz
    fx, fy, fz = fx - along * ux, fy - along * uy, fz - along * uz
    length = sqrt(fx * fx + fy * fy + fz * fz)
    if length < 1e-6:
        return LevelFrame(sole.position, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), up)
    fx, fy, fz = fx / length, fy / length, fz / length
    left = (uy * fz - uz * fy, uz * fx - ux * fz, ux * fy - uy * fx)
    return LevelFrame(sole.position, (fx, fy, fz), left, up)


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
    return rotate_planar(ahead, aside, sole_in_q[2])
