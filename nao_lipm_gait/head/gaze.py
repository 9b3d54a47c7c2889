"""Pan and tilt that point the camera at a point of the torso frame, in closed form."""

from dataclasses import dataclass
from functools import lru_cache
from math import asin, atan2, hypot

import numpy as np
import pinocchio as pin

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.robot import RobotDescription
from nao_lipm_gait.types import Point3

PAN, TILT = "HeadYaw", "HeadPitch"
"""Joints of a head; a positive tilt looks down."""
CAMERA = "gaze"
"""The link whose x axis is the line of sight (REP-120)."""


@dataclass(frozen=True, slots=True)
class Neck:
    """A pan joint with a tilt joint above it; both axes meet in one point."""

    pan: int
    """Index of the joint."""
    tilt: int
    position: Point3
    """[m] where the axes meet, in the torso frame."""
    camera_height: float
    """[m] of the line of sight above that point, with the head straight."""

    def angles_to(self, point: Point3) -> tuple[float, float] | None:
        """Pan and tilt [rad] that look at a point (torso frame) [m], before any limit.

        None for a point that is too near to be looked at.
        """
        x, y, z = (a - b for a, b in zip(point, self.position, strict=True))
        across = hypot(x, y)
        distance = hypot(across, z)
        if distance <= abs(self.camera_height) + 1e-6:
            return None
        pan = atan2(y, x) if across > 1e-9 else 0.0
        # The line of sight passes the neck at the height of the camera.
        return pan, asin(self.camera_height / distance) - atan2(z, across)


@lru_cache(maxsize=8)
def neck_of(robot: RobotDescription) -> Neck | None:
    """None for a robot without a head to turn."""
    if PAN not in robot.joint_names or TILT not in robot.joint_names:
        return None
    model = pin.buildModelFromXML(robot.urdf, pin.JointModelFreeFlyer())
    data = model.createData()
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    torso = data.oMf[model.getFrameId(robot.torso_frame, pin.FrameType.BODY)]
    pan, tilt = (torso.actInv(data.oMi[model.getJointId(name)]) for name in (PAN, TILT))
    apart = hypot(*(pan.translation - tilt.translation)[:2])
    if apart > 1e-4:
        raise NaoGaitError(
            f"URDF {robot.urdf_path}", f"neck axes {apart:.4f} m apart", "axes that meet in a point"
        )
    height = 0.0
    if model.existFrame(CAMERA, pin.FrameType.BODY):
        camera = torso.actInv(data.oMf[model.getFrameId(CAMERA, pin.FrameType.BODY)])
        height = float(camera.translation[2] - tilt.translation[2])
    x, y, z = np.asarray(tilt.translation).tolist()
    return Neck(robot.index(PAN), robot.index(TILT), (x, y, z), height)
