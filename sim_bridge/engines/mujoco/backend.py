"""The plant in MuJoCo."""

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.geometry import as_rotation, cross, rotate_back
from nao_lipm_gait.types import FloatArray
from sim_bridge.ball import Ball, BallState
from sim_bridge.body import BodyPose
from sim_bridge.engines.backend import RobotModel, only_one
from sim_bridge.engines.mujoco.model import LEG_CONTACT, MujocoModel, play_name
from sim_bridge.engines.mujoco.scene import ball_state, put_ball
from sim_bridge.motors import TorqueLimits
from sim_bridge.sensors import Encoders
from sim_bridge.state import StartState, StepInput, TrueState
from sim_bridge.terrain import Prism

_FRAME = 1.0 / 60.0
"""[s] of simulated time between two pictures in the window."""


class MujocoBackend:
    """`Backend` with MuJoCo.

    A position servo is the torque of a spring and a damper whose ratio is the lag, limited by the
    motor. Servos can have a stiffness, and joints rotor inertia, dry friction and play. If the
    plant gives no stiffness, the servo is as stiff as the integration allows. If it gives no rotor
    inertia, the rotors have their real one: without it the stiff servo of a foot would chatter.
    """

    def __init__(
        self,
        robots: Sequence[RobotModel],
        ground: tuple[Prism, ...] = (),
        *,
        gui: bool = False,
        ball: Ball | None = None,
    ) -> None:
        """Compile the model and open the window.

        Args:
            robots: one individual.
            ground: prisms that rise above the floor.
            gui: open MuJoCo's window.
            ball: ball on the floor; None = none.

        Raises:
            NaoGaitError: there is not one robot, or MuJoCo cannot honour an option of the plant.
        """
        robot = only_one(robots, "mujoco")
        plant, individual = robot.plant, robot.individual
        self._robot = robot.description
        self._ball = ball
        self._individual = individual
        self._body = robot.body
        self._limits = TorqueLimits(self._robot, plant, individual)
        self._encoders = Encoders(plant, individual) if plant.motor.encoder_feedback else None
        self._compiled = MujocoModel(robot, ground, visual=gui, ball=ball)
        self._model = self._compiled.model
        self._data = mujoco.MjData(self._model)
        self._find_addresses()
        self._legs_touch = False
        self._pushed = False
        self._scale: float | FloatArray | None = None
        self._shown = 0.0
        self._viewer = _open_viewer(self._model, self._data) if gui else None

    def reset(self, starts: Sequence[StartState]) -> None:
        """See `Backend`."""
        (start,) = starts
        data = self._data
        mujoco.mj_resetData(self._model, data)
        data.qpos[:3] = start.torso_position
        data.qpos[3:7] = np.roll(start.torso_rotation, 1)
        data.qpos[self._motor_q] = start.joint_position
        self._setpoint[:] = start.joint_position
        if self._ball is not None:
            self.put_ball(self._ball.start)
        self._legs_touch = self._pushed = False
        self._scale = None

    def step(self, inputs: Sequence[StepInput]) -> None:
        """See `Backend`."""
        ((setpoint, torque_scale, push_force),) = inputs
        data = self._data
        self._setpoint[:] = setpoint
        if self._encoders is not None:
            self._setpoint += self._encoder_error(self._encoders)
        if torque_scale is not self._scale:
            self._allow(torque_scale)
            self._scale = torque_scale
        if any(push_force.tolist()):
            data.xfrc_applied[self._torso, :3] = push_force
            self._pushed = True
        elif self._pushed:
            data.xfrc_applied[self._torso, :3] = 0.0
            self._pushed = False
        mujoco.mj_step(self._model, data)
        if not self._legs_touch and self._leg_contacts[0]:
            self._legs_touch = True
        if self._viewer is not None:
            self._show(self._viewer)

    def observe(self) -> list[TrueState]:
        """See `Backend`."""
        data = self._data
        if any(warning.number for warning in self._unstable):
            raise NaoGaitError(
                "physics", "a state that is not finite, or huge", "smaller forces, or smaller steps"
            )
        # mj_step leaves the poses of the bodies as they were before the step.
        mujoco.mj_kinematics(self._model, data)
        mujoco.mj_comPos(self._model, data)
        position, velocity = data.qpos.copy(), data.qvel.copy()
        angles, speeds = self._angles(position), velocity[self._motor_v]
        if len(self._play):
            speeds[self._play] += velocity[self._play_v]
        (left, left_axes), (right, right_axes) = self._sole_views
        pose = BodyPose(
            com=self._com_view.copy(),
            sole_position=(left.copy(), right.copy()),
            sole_rotation=(left_axes.copy(), right_axes.copy()),
        )
        w, x, y, z = position[3:7].tolist()
        touch, self._legs_touch = self._legs_touch, False
        state = TrueState(
            torso_position=position[:3],
            torso_rotation=np.array((x, y, z, w)),
            torso_matrix=self._torso_view.copy(),
            torso_linear_velocity=velocity[:3],
            torso_angular_velocity=velocity[3:6],
            joint_position=angles,
            joint_velocity=speeds,
            pose=pose,
            joint_torque=data.qfrc_actuator[self._motor_v].copy(),
            sole_wrench=self._sole_wrenches(pose),
            legs_touch=touch,
        )
        return [state]

    def ball(self) -> BallState | None:
        """See `Backend`."""
        return None if self._ball is None else ball_state(self._data)

    def put_ball(self, position: FloatArray) -> None:
        """See `Backend`."""
        put_ball(self._data, position)

    def _angles(self, position: FloatArray) -> FloatArray:
        """(n,) [rad] true joint angles, play included."""
        angles: FloatArray = position[self._motor_q]
        if len(self._play):
            angles[self._play] += position[self._play_q]
        return angles

    def _encoder_error(self, encoders: Encoders) -> FloatArray:
        """(n,) [rad] angles of the motors minus the encoder readings."""
        position = self._data.qpos.copy()
        seen = encoders.read(self._angles(position)) + self._individual.joint_zero
        error: FloatArray = position[self._motor_q] - seen
        return error

    def _allow(self, share: float | FloatArray) -> None:
        """Limit the motors to this share of their torques; one for all, or (n,) for each."""
        model, count = self._model, len(self._setpoint)
        most, loss = share * self._limits.standstill, share * self._limits.loss
        limits = np.stack((-most, most), axis=1)
        model.actuator_forcerange[:count] = limits
        model.jnt_actfrcrange[self._motors] = limits
        model.actuator_biasprm[:count, 2] = loss - self._compiled.damping
        model.actuator_biasprm[count:, 2] = -loss

    def disturb(self, robot: int, torque_share: FloatArray, friction: float | None) -> None:
        """See `Backend`."""
        self._limits.weaken(torque_share)
        self._scale = None
        coefficient = self._individual.friction if friction is None else friction
        for names in self._compiled.sole_geoms:
            for name in names:
                self._model.geom(name).friction[0] = coefficient

    def _show(self, viewer: Any) -> None:
        if self._data.time < self._shown:  # after a reset
            self._shown = 0.0
        if self._data.time >= self._shown + _FRAME:
            self._shown = self._data.time
            viewer.sync()

    def close(self) -> None:
        """See `Backend`."""
        if self._viewer is not None:
            self._viewer.close()
            self._viewer = None

    def _sole_wrenches(self, pose: BodyPose) -> tuple[FloatArray, FloatArray]:
        left, right = self._sole_contacts
        return (
            _wrench(left.tolist(), pose.sole_position[0], pose.sole_rotation[0]),
            _wrench(right.tolist(), pose.sole_position[1], pose.sole_rotation[1]),
        )

    def _find_addresses(self) -> None:
        model, data, robot = self._model, self._data, self._robot
        joints = [model.joint(name) for name in robot.joint_names]
        self._motor_q = _slice([int(joint.qposadr[0]) for joint in joints])
        self._motor_v = _slice([int(joint.dofadr[0]) for joint in joints])
        self._motors = [joint.id for joint in joints]
        self._setpoint = data.ctrl[: len(joints)]
        play = self._compiled.joints_with_play
        hinges = [model.joint(play_name(name)) for name in play]
        self._play = np.array([robot.index(name) for name in play], dtype=int)
        self._play_q = np.array([hinge.qposadr[0] for hinge in hinges], dtype=int)
        self._play_v = np.array([hinge.dofadr[0] for hinge in hinges], dtype=int)
        self._torso = model.body(robot.torso_frame).id
        warnings = mujoco.mjtWarning
        self._unstable = [
            data.warning[int(kind)]
            for kind in (warnings.mjWARN_BADQPOS, warnings.mjWARN_BADQVEL, warnings.mjWARN_BADQACC)
        ]
        # Views of MuJoCo's own memory: every step updates them.
        self._com_view = data.subtree_com[self._torso]
        self._torso_view = data.xmat[self._torso].reshape(3, 3)
        sites = [data.site(sole.name) for sole in self._body.soles]
        self._sole_views = [(site.xpos, site.xmat.reshape(3, 3)) for site in sites]
        self._leg_contacts = data.sensor(LEG_CONTACT).data
        self._sole_contacts = [data.sensor(sole.name).data for sole in self._body.soles]


def _wrench(contact: list[float], origin: FloatArray, rotation: FloatArray) -> FloatArray:
    """Force [N] and torque [N m] (6,) of the floor on a sole, about its origin and in its axes.

    Args:
        contact: reading of the contact sensor, in the world: force and torque of the sole on the
            floor, and the point of reference of the torque.
        origin: (3,) [m] of the sole in the world.
        rotation: (3, 3), sole to world.
    """
    fx, fy, fz, tx, ty, tz, x, y, z = contact
    if not fz:
        return np.zeros(6)
    ox, oy, oz = origin.tolist()
    mx, my, mz = cross((x - ox, y - oy, z - oz), (fx, fy, fz))
    axes = as_rotation(rotation)
    force = rotate_back(axes, (-fx, -fy, -fz))
    return np.array(force + rotate_back(axes, (-tx - mx, -ty - my, -tz - mz)))


def _slice(addresses: list[int]) -> slice | NDArray[np.intp]:
    """As a slice if they are consecutive (without play): that is four times as fast to read."""
    first, count = addresses[0], len(addresses)
    if addresses == list(range(first, first + count)):
        return slice(first, first + count)
    return np.array(addresses, dtype=np.intp)


def _open_viewer(model: mujoco.MjModel, data: mujoco.MjData) -> Any:
    import mujoco.viewer

    return mujoco.viewer.launch_passive(model, data)
