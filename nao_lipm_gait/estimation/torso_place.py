"""Where the torso is relative to the ground, by the vertical and the soles."""

from math import asin, atan2, cos, sin
from typing import NamedTuple

from nao_lipm_gait.whole_body.body_model import SolePose
from robot_core.geometry import dot
from robot_core.types import Point3, Pose2, Pose6


class TorsoPlace(NamedTuple):
    """Pose of the torso relative to the ground.

    Attributes:
        up: Unit vertical in the torso frame.
        left_sole: Left sole in the torso frame.
        right_sole: Right sole in the torso frame.
        base_footprint_in_odom: x, y [m], yaw [rad].
    """

    up: Point3
    left_sole: SolePose
    right_sole: SolePose
    base_footprint_in_odom: Pose2

    def from_footprint(self, point: Point3) -> Point3:
        """Transform a point from base_footprint to the torso frame [m]."""
        forward, left = self._ground_axes()
        x, y, z = point
        ax, ay, az = (
            m + x * f + y * side + z * u
            for m, f, side, u in zip(self._footprint(), forward, left, self.up, strict=True)
        )
        return ax, ay, az

    def from_odom(self, point: Point3) -> Point3:
        """Transform a point from odom to the torso frame [m]."""
        bx, by, yaw = self.base_footprint_in_odom
        dx, dy, c, s = point[0] - bx, point[1] - by, cos(yaw), sin(yaw)
        return self.from_footprint((c * dx + s * dy, c * dy - s * dx, point[2]))

    def in_footprint(self) -> Pose6:
        """The torso in base_footprint: x, y, z [m], roll, pitch, yaw [rad]."""
        forward, left = self._ground_axes()
        axes = (forward, left, self.up)  # of base_footprint, in the torso frame
        middle = self._footprint()
        x, y, _ = (-sum(a * m for a, m in zip(axis, middle, strict=True)) for axis in axes)
        # The lower sole is on the ground.
        z = max(-dot(self.up, sole.position) for sole in (self.left_sole, self.right_sole))
        pitch = asin(min(max(-self.up[0], -1.0), 1.0))
        return x, y, z, atan2(self.up[1], self.up[2]), pitch, atan2(left[0], forward[0])

    def _footprint(self) -> Point3:
        """Origin of base_footprint in the torso frame: the middle between the soles."""
        x, y, z = (
            0.5 * (a + b)
            for a, b in zip(self.left_sole.position, self.right_sole.position, strict=True)
        )
        return x, y, z

    def _ground_axes(self) -> tuple[Point3, Point3]:
        """Forward and left on the ground, in the torso frame: the mean heading of the soles."""
        mean = [
            a + b for a, b in zip(self.left_sole.forward, self.right_sole.forward, strict=True)
        ]
        along = sum(a * b for a, b in zip(mean, self.up, strict=True))
        x, y, z = (a - along * b for a, b in zip(mean, self.up, strict=True))
        size = (x * x + y * y + z * z) ** 0.5 or 1.0
        x, y, z = x / size, y / size, z / size
        ux, uy, uz = self.up
        return (x, y, z), (uy * z - uz * y, uz * x - ux * z, ux * y - uy * x)
