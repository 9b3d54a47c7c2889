"""Pan and tilt that point the camera at a point of the torso frame, in closed form."""

from dataclasses import dataclass
from functools import lru_cache
from math import asin, atan2, copysign, hypot

import numpy as np
import pinocchio as pin

from robot_core.robot import RobotDescription
from robot_core.types import Point3

CAMERA = "gaze"
"""The link whose x axis is the line of sight (REP-120)."""


@dataclass(frozen=True, slots=True)
class Neck:
    """A pan joint with a tilt joint above it.

    Attributes:
        position: [m] On the pan axis, as high as the tilt axis, in the torso frame.
        ahead: [m] Of the tilt axis from the pan axis, head straight.
        camera_height: [m] Height of the line of sight above that point, head straight.
        signs: Of the joints' angles against pan to the left and tilt downwards, +1 or -1.
    """

    pan: int
    tilt: int
    position: Point3
    ahead: float
    camera_height: float
    signs: tuple[float, float]

    def angles_to(self, point: Point3) -> tuple[float, float] | None:
        """Pan to the left and tilt down [rad] towards a point (torso frame) [m], without limits.

        None for a point that is too close.
        """
        x, y, z = (a - b for a, b in zip(point, self.position, strict=True))
        out = hypot(x, y)
        across = out - self.ahead
        distance = hypot(across, z)
        if distance <= abs(self.camera_height) + 1e-6:
            return None
        pan = atan2(y, x) if out > 1e-9 else 0.0
        # The line of sight passes the neck at the distance camera_height.
        return pan, asin(self.camera_height / distance) - atan2(z, across)


@lru_cache(maxsize=8)
def neck_of(robot: RobotDescription) -> Neck | None:
    """The neck of a robot; None without pan and tilt joints."""
    if robot.head is None:
        return None
    model = pin.buildModelFromXML(robot.urdf, pin.JointModelFreeFlyer())
    data = model.createData()
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    torso = data.oMf[model.getFrameId(robot.torso_frame, pin.FrameType.BODY)]
    pan, tilt = (torso.actInv(data.oMi[model.getJointId(name)]) for name in robot.head)
    height = 0.0
    if model.existFrame(CAMERA, pin.FrameType.BODY):
        camera = torso.actInv(data.oMf[model.getFrameId(CAMERA, pin.FrameType.BODY)])
        height = float(camera.translation[2] - tilt.translation[2])
    x, y, _ = np.asarray(pan.translation).tolist()
    tilt_x, _, z = np.asarray(tilt.translation).tolist()
    pan_index, tilt_index = map(robot.index, robot.head)
    pan_axis, tilt_axis = (
        place.rotation @ model.joints[model.getJointId(name)].createData().S[3:]
        for name, place in zip(robot.head, (pan, tilt), strict=True)
    )
    signs = copysign(1.0, pan_axis[2]), copysign(1.0, tilt_axis[1])
    return Neck(pan_index, tilt_index, (x, y, z), tilt_x - x, height, signs)
