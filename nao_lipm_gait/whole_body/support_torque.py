"""Joint torques that carry the body on its soles.

With the gravity torques g of a free body and the force F of the ground at the point p of a sole,

    tau = g - J_p^T F.

F points from p to the CoM, as the pendulum has it, and carries the weight, or the share of it that
rests on that sole. With accelerations of the joints, g are the torques that also move the links.
"""

from typing import NamedTuple

import numpy as np
import pinocchio as pin

from robot_core.robot import RobotDescription
from robot_core.types import GRAVITY, FloatArray, Point3

FRICTION = 0.2
"""Of the soles, for their twist: a slippery floor has 0.4, which also holds them to the side."""


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
        xs, ys = zip(*robot.sole_outline, strict=True)
        self._boxes = (
            ((min(xs), min(ys)), (max(xs), max(ys))), ((min(xs), -max(ys)), (max(xs), -min(ys))),
        )  # fmt: skip
        self._rest, self._a = np.zeros(model.nv), np.zeros(model.nv)
        motors = (robot.motors[name] for name in robot.joint_names)
        self._rotor = np.array([motor.reflected_inertia for motor in motors])
        radius = float(np.mean(np.hypot(*np.transpose(robot.sole_corners))))
        self.weight = GRAVITY * float(sum(inertia.mass for inertia in model.inertias))
        self._twist_max = FRICTION * radius * self.weight

    def at(
        self, position: FloatArray, pitch: float, loads: tuple[Load, Load],
        acceleration: FloatArray | None = None,
    ) -> FloatArray:
        """Torques (n,) [N m] of the joints.

        Args:
            position: Joint angles (n,) [rad].
            pitch: Of the torso [rad], whose roll is 0.
            loads: Of the left and the right sole; their shares add up to 1.
            acceleration: (n,) [rad/s^2] of the joints; None = rest. The points of the loads then
                move inside the soles, as far as the moment needs that turns the links.
        """
        model, data, q = self._model, self._data, self._q
        q[self._q_columns] = position
        q[3:7] = pin.Quaternion(pin.rpy.rpyToMatrix(0.0, pitch, 0.0)).coeffs()
        pin.computeJointJacobians(model, data, q)
        soles = [self._sole(frame) for frame in self._soles]
        shift_x = shift_y = twist = 0.0
        if acceleration is None:
            torque = pin.computeGeneralizedGravity(model, data, q)[self._v_columns]
        else:
            whole, (shift_x, shift_y, twist) = self._moving(acceleration, loads, soles)
            torque = whole[self._v_columns] + self._rotor * acceleration
        for (_, jacobian), load, box in zip(soles, loads, self._boxes, strict=True):
            if load.share == 0.0:
                continue
            x, y = load.x, load.y
            if acceleration is not None:
                x, y = np.clip((x + shift_x, y + shift_y), *box).tolist()
            force = self._force(load)
            tx, ty, tz = _moment(x, y, force)
            torque = torque - jacobian.T @ np.array((*force, tx, ty, tz + load.share * twist))
        return np.asarray(torque)

    def _sole(self, frame: int) -> tuple[FloatArray, FloatArray]:
        """Position (3,) [m] of a sole from the torso, and its Jacobian (6, n), in world axes."""
        place = pin.updateFramePlacement(self._model, self._data, frame).translation.copy()
        jacobian = pin.getFrameJacobian(self._model, self._data, frame, LOCAL)
        return place, jacobian[:, self._v_columns]

    def _force(self, load: Load) -> Point3:
        up = load.share * self.weight
        return load.ahead * up, load.aside * up, up

    def _moving(
        self,
        acceleration: FloatArray,
        loads: tuple[Load, Load],
        soles: list[tuple[FloatArray, FloatArray]],
    ) -> tuple[FloatArray, Point3]:
        """Torques (nv,) of a free body, and what its soles have to give beside their forces.

        The torso accelerates so that the ground's forces are those of the loads, and turns over
        the soles, which do not. The moment about them that the links then need moves the points of
        the loads, by x and y [m], and twists the soles [N m].
        """
        model, data, q, a = self._model, self._data, self._q, self._a
        turn = pin.Quaternion(q[3:7]).toRotationMatrix()
        a[:] = 0.0
        a[self._v_columns] = acceleration
        force, given, yaw = np.zeros(3), np.zeros(3), 0.0
        for (place, jacobian), load in zip(soles, loads, strict=True):
            part = self._force(load)
            force += part
            given += np.cross(place, part) + _moment(load.x, load.y, part)
            yaw -= load.share * float(jacobian[5] @ acceleration)
        a[3:6] = turn.T @ np.array((0.0, 0.0, yaw))
        lacking = turn.T @ force - pin.rnea(model, data, q, self._rest, a)[:3]
        a[:3] = lacking * GRAVITY / self.weight
        whole = pin.rnea(model, data, q, self._rest, a)
        x, y, z = (turn @ whole[3:6] - given).tolist()
        shift_x, shift_y = -y / self.weight, x / self.weight
        twist = z - (shift_x * float(force[1]) - shift_y * float(force[0]))
        return whole, (shift_x, shift_y, min(max(twist, -self._twist_max), self._twist_max))


LOCAL = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED


def _moment(x: float, y: float, force: Point3) -> Point3:
    """Moment about the sole's frame of a force at x, y."""
    return y * force[2], -x * force[2], x * force[1] - y * force[0]
