"""Joint torques that carry the body on its soles, without accelerations of its own.

With the gravity torques g of a free body and the force F of the ground at the point p of a sole,

    tau = g - J_p^T F.

F points from p to the CoM, as the pendulum has it, and carries the weight, or the share of it that
rests on that sole.
"""

from typing import NamedTuple

import numpy as np
import pinocchio as pin

from robot_core.robot import RobotDescription
from robot_core.types import GRAVITY, FloatArray, Point3


class Load(NamedTuple):
    """The force of the ground on a sole.

    Attributes:
        share: Of the weight.
        x: Of its point ahead of the sole's frame [m], along the heading of the torso.
        y: The same to the left [m].
        ahead: Horizontal force along x over the vertical one.
        aside: The same to the left.
    """

    share: float
    x: float = 0.0
    y: float = 0.0
    ahead: float = 0.0
    aside: float = 0.0


class SupportTorque:
    """Torques of the joints of one robot.

    Args:
        robot: The robot, in its own size.

    Attributes:
        weight: [N].
    """

    def __init__(self, robot: RobotDescription) -> None:
        self._model = model = pin.buildModelFromXML(robot.urdf, pin.JointModelFreeFlyer())
        self._data = model.createData()
        self._q = pin.neutral(model)
        joints = [model.joints[model.getJointId(name)] for name in robot.joint_names]
        self._q_columns = np.array([joint.idx_q for joint in joints])
        self._v_columns = np.array([joint.idx_v for joint in joints])
        self._soles = [model.getFrameId(name, pin.FrameType.BODY) for name in robot.sole_frames]
        self._rest, self._a = np.zeros(model.nv), np.zeros(model.nv)
        motors = (robot.motors[name] for name in robot.joint_names)
        self._rotor = np.array([motor.reflected_inertia for motor in motors])
        self.weight = GRAVITY * float(sum(inertia.mass for inertia in model.inertias))

    def at(
        self, position: FloatArray, roll: float, pitch: float, loads: tuple[Load, Load],
        acceleration: FloatArray | None = None,
    ) -> FloatArray:
        """Torques (n,) [N m] of the joints.

        Args:
            position: Joint angles (n,) [rad].
            roll: Of the torso [rad].
            pitch: Of the torso [rad].
            loads: Of the left and the right sole; their shares add up to 1.
            acceleration: (n,) [rad/s^2] of joints that move against a resting torso; None = rest.
        """
        model, data, q = self._model, self._data, self._q
        q[self._q_columns] = position
        q[3:7] = pin.Quaternion(pin.rpy.rpyToMatrix(roll, pitch, 0.0)).coeffs()
        if acceleration is None:
            torque = pin.computeGeneralizedGravity(model, data, q)[self._v_columns]
        else:
            self._a[self._v_columns] = acceleration
            torque = pin.rnea(model, data, q, self._rest, self._a)[self._v_columns]
            torque = torque + self._rotor * acceleration
        pin.computeJointJacobians(model, data, q)
        for frame, load in zip(self._soles, loads, strict=True):
            if load.share == 0.0:
                continue
            pin.updateFramePlacement(model, data, frame)
            jacobian = pin.getFrameJacobian(model, data, frame, LOCAL)[:, self._v_columns]
            up = load.share * self.weight
            force = (load.ahead * up, load.aside * up, up)
            torque = torque - jacobian.T @ np.array((*force, *_moment(load.x, load.y, force)))
        return np.asarray(torque)


LOCAL = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED


def _moment(x: float, y: float, force: Point3) -> Point3:
    """Moment about the sole's frame of a force at x, y."""
    return y * force[2], -x * force[2], x * force[1] - y * force[0]
