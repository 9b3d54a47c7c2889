"""The whole-body model in Pinocchio: CoM and sole poses in the torso frame for joint angles."""

from math import hypot
from typing import final

import numpy as np
import pinocchio as pin

from robot_core.geometry import as_point
from robot_core.robot import RobotDescription
from robot_core.types import LEFT, RIGHT, FloatArray, Point3


@final
class SolePose:
    """Pose of a sole in the torso frame.

    Attributes:
        position: Position [m].
        forward: Unit x axis of the sole.
        normal: Unit z axis of the sole.
    """

    __slots__ = ("forward", "normal", "position")

    def __init__(self, position: Point3, forward: Point3, normal: Point3):
        self.position = position
        self.forward = forward
        self.normal = normal

    def points(self, points_in_sole: FloatArray) -> FloatArray:
        """Points (n, 3) [m] in the torso frame for x, y (n, 2) [m] in the plane of the sole."""
        forward, left = np.array(self.forward), np.cross(self.normal, self.forward)
        points: FloatArray = np.array(self.position) + points_in_sole @ (forward, left)
        return points


class BodyModel:
    """Mass distribution and kinematics of the robot; the root is a free-flyer at the torso.

    Args:
        robot: The robot.

    Attributes:
        model: The Pinocchio model.
        total_mass: Mass of the robot [kg].
    """

    def __init__(self, robot: RobotDescription):
        # A fixed root would drop the torso's own mass from the CoM.
        self.model = pin.buildModelFromXML(robot.urdf, pin.JointModelFreeFlyer())
        self._data = self.model.createData()
        self._q = pin.neutral(self.model)
        self._columns = np.array(
            [self.model.joints[self.model.getJointId(name)].idx_q for name in robot.joint_names]
        )
        # By type too, because a joint may have the name of a link.
        torso_id = self.model.getFrameId(robot.torso_frame, pin.FrameType.BODY)
        torso = self.model.frames[torso_id].placement
        self._torso_rotation = torso.rotation.T.copy()
        self._torso_translation = torso.translation.copy()
        self._torso_is_root = torso.isIdentity()
        self._soles = []
        for frame_name in robot.sole_frames:
            frame = self.model.getFrameId(frame_name, pin.FrameType.BODY)
            placement = self._data.oMf[frame]
            # Both arrays are views of Pinocchio's memory, so they follow every update.
            self._soles.append((frame, placement.translation, placement.rotation))
        self.total_mass = float(sum(inertia.mass for inertia in self.model.inertias))

    def set_joints(self, position: FloatArray) -> Point3:
        """Set joint angles (n,) [rad], also for the soles; the CoM [m] in the torso frame."""
        self._q[self._columns] = position
        com = pin.centerOfMass(self.model, self._data, self._q, False)
        if not self._torso_is_root:
            com = self._torso_rotation @ (com - self._torso_translation)
        return as_point(com)

    def vertical(self, position: FloatArray) -> FloatArray:
        """Set joint angles (n,) [rad]; the mean normal (3,) of the soles in the torso frame."""
        self.set_joints(position)
        left, right = self.sole_in_torso(LEFT), self.sole_in_torso(RIGHT)
        normal = np.array(left.normal) + np.array(right.normal)
        return normal / max(hypot(*normal.tolist()), 1e-6)

    def sole_in_torso(self, side: int) -> SolePose:
        """Pose of a sole, LEFT or RIGHT, in the torso frame."""
        frame, position, rotation = self._soles[0 if side > 0 else 1]
        pin.updateFramePlacement(self.model, self._data, frame)
        if not self._torso_is_root:
            position = self._torso_rotation @ (position - self._torso_translation)
            rotation = self._torso_rotation @ rotation
        rows: list[list[float]] = rotation.tolist()
        a, b, c = rows[0], rows[1], rows[2]
        return SolePose(as_point(position), (a[0], b[0], c[0]), (a[2], b[2], c[2]))
