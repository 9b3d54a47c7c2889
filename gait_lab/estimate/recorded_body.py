"""The body of a recorded robot: any URDF, with the links that a log needs."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pinocchio as pin

from nao_lipm_gait.whole_body.body_model import SolePose
from robot_core.errors import NaoGaitError
from robot_core.geometry import as_point
from robot_core.resources import find
from robot_core.robot import load_robot
from robot_core.robot.urdf_model import LARGEST_URDF
from robot_core.schema import read_text
from robot_core.types import FloatArray, Point3

SOLES = ("l_sole", "r_sole")


class RecordedBody:
    """Soles and CoM in the root link of a URDF, by recorded joint angles.

    Args:
        robot: Shipped name or path of the URDF.
        joints: Recorded joints; all others are held at zero.
        imu: Link of the IMU; empty = the only one with "imu" in its name that is fixed to the root.
        soles: Links of the left and the right sole; none = l_sole and r_sole, else as `load_robot`
            finds or adds them.

    Raises:
        NaoGaitError: Names the joint or link that is missing, or that does not fit.

    Attributes:
        mass: [kg].
        imu_rotation: (3, 3), IMU to root link.
    """

    def __init__(
        self, robot: str, joints: Sequence[str], imu: str = "", soles: Sequence[str] = ()
    ) -> None:
        path = find("urdf", robot)
        text = read_text(path, "URDF", LARGEST_URDF)
        if not soles:
            soles = SOLES
            if not all(f'"{sole}"' in text for sole in SOLES):
                description = load_robot(robot)
                text, soles = description.urdf, description.sole_frames
        try:
            self._model = model = pin.buildModelFromXML(text, pin.JointModelFreeFlyer())
        except (ValueError, RuntimeError) as error:
            raise NaoGaitError(f"URDF {path}", str(error).strip(), "a robot") from error
        self.name = model.name
        self._data = model.createData()
        self._q = pin.neutral(model)
        for joint in joints:
            if not model.existJointName(joint):
                allowed = f"the joints of {path}: {', '.join(model.names[2:])}"
                raise NaoGaitError("joint of the log", joint, allowed)
        self._columns = [model.joints[model.getJointId(joint)].idx_q for joint in joints]
        self.mass = pin.computeTotalMass(model)
        bodies = [frame for frame in model.frames if frame.type == pin.FrameType.BODY]
        self.root = next(frame.name for frame in bodies if frame.parentJoint == 1)
        self._soles = [self._frame(sole, path) for sole in soles]
        fixed = [f.name for f in bodies if f.parentJoint == 1 and "imu" in f.name.lower()]
        if not imu and len(fixed) != 1:
            allowed = f"--imu LINK, one of {', '.join(fixed or [b.name for b in bodies])}"
            raise NaoGaitError(f"IMU in {path}", fixed or "no link with imu in its name", allowed)
        frame = model.frames[self._frame(imu or fixed[0], path)]
        if frame.parentJoint != 1:
            raise NaoGaitError(f"IMU {imu} in {path}", "moved by a joint", f"fixed to {self.root}")
        self.imu_rotation: FloatArray = frame.placement.rotation.copy()

    def _frame(self, link: str, path: Path) -> int:
        if not self._model.existFrame(link, pin.FrameType.BODY):
            raise NaoGaitError(f"link {link} in {path}", "missing", "a link (--soles, --imu)")
        return int(self._model.getFrameId(link, pin.FrameType.BODY))

    def in_root(self, link: str) -> pin.SE3:
        """Pose of a link that is fixed to the root.

        Raises:
            NaoGaitError: There is no such link, or a joint moves it.
        """
        for frame in self._model.frames:
            if (frame.name, frame.type, frame.parentJoint) == (link, pin.FrameType.BODY, 1):
                return frame.placement
        raise NaoGaitError("link of the reference", link, f"a link fixed to {self.root}")

    def set_joints(self, position: FloatArray) -> tuple[Point3, SolePose, SolePose]:
        """CoM [m], left and right sole in the root link for joint angles (j,) [rad]."""
        self._q[self._columns] = position
        com = pin.centerOfMass(self._model, self._data, self._q, False)
        left, right = (
            pin.updateFramePlacement(self._model, self._data, frame) for frame in self._soles
        )
        return as_point(com), _sole(left), _sole(right)


def _sole(pose: pin.SE3) -> SolePose:
    columns = np.asarray(pose.rotation).T
    return SolePose(as_point(pose.translation), as_point(columns[0]), as_point(columns[2]))
