"""Forward kinematics of one moment: where every link is, in the torso frame."""

import numpy as np
import pinocchio as pin

from gait_lab.analysis.body import inverse_pose
from nao_lipm_gait.robot import RobotDescription
from nao_lipm_gait.types import FloatArray


class LinkPoses:
    """Poses of the links of one robot."""

    def __init__(self, robot: RobotDescription, links: tuple[str, ...]) -> None:
        self._model = pin.buildModelFromXML(robot.urdf, pin.JointModelFreeFlyer())
        self._data = self._model.createData()
        self._q = pin.neutral(self._model)
        self._columns = {
            name: self._model.joints[self._model.getJointId(name)].idx_q
            for name in robot.joint_names
        }
        self._torso = self._frame(robot.torso_frame)
        self._soles = [self._frame(name) for name in robot.sole_frames]
        self._links = [self._frame(name) for name in links]

    def _frame(self, name: str) -> int:
        return int(self._model.getFrameId(name, pin.FrameType.BODY))

    def at(self, names: list[str], position: list[float]) -> tuple[FloatArray, FloatArray]:
        """Links (l, 4, 4) and soles (2, 4, 4) in the torso frame; unknown joints are left alone."""
        for name, angle in zip(names, position, strict=False):
            column = self._columns.get(name)
            if column is not None and np.isfinite(angle):
                self._q[column] = angle
        pin.framesForwardKinematics(self._model, self._data, self._q)
        to_torso = inverse_pose(self._data.oMf[self._torso].homogeneous)
        links = np.array([self._data.oMf[frame].homogeneous for frame in self._links])
        soles = np.array([self._data.oMf[frame].homogeneous for frame in self._soles])
        return to_torso @ links, to_torso @ soles
