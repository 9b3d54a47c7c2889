"""State and inputs of one robot in a compiled MuJoCo model."""

import mujoco
import numpy as np
from numpy.typing import NDArray

from robot_core.geometry import as_rotation, cross, rotate_back
from robot_core.types import FloatArray
from sim_bridge.body import BodyPose
from sim_bridge.engines.mujoco.robot import LEG_CONTACT, RobotParts, play_name
from sim_bridge.motors import TorqueLimits
from sim_bridge.sensors import Encoders
from sim_bridge.state import StartState, StepInput, TrueState


class MujocoRobot:
    """One robot of a running simulation."""

    def __init__(self, parts: RobotParts, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Find the robot in the model.

        Args:
            parts: The robot.
            model: The compiled model.
            data: Its state.
        """
        robot = parts.robot
        plant, self._individual = robot.plant, robot.individual
        self._parts, self._model, self._data = parts, model, data
        self._limits = TorqueLimits(robot.description, plant, self._individual)
        self._encoders = Encoders(plant, self._individual) if plant.motor.encoder_feedback else None
        self._find_addresses()
        self._legs_touch = False
        self._pushed = False
        self._scale: float | FloatArray | None = None

    def reset(self, start: StartState) -> None:
        """Put the robot at its start in a state that has been reset."""
        data = self._data
        data.qpos[self._base_q][:3] = start.torso_position
        data.qpos[self._base_q][3:7] = np.roll(start.torso_rotation, 1)
        data.qpos[self._motor_q] = start.joint_position
        self._setpoint[:] = start.joint_position
        self._legs_touch = self._pushed = False
        self._scale = None

    def place(self, start: StartState) -> None:
        """Put the robot at its start, at rest, in a running simulation."""
        data = self._data
        data.qvel[self._all_v] = 0.0
        data.qacc_warmstart[self._all_v] = 0.0
        data.xfrc_applied[self.torso] = 0.0
        data.qpos[self._play_q] = 0.0
        self.reset(start)

    def apply(self, given: StepInput) -> None:
        """Set what acts on the robot in the next physics step."""
        setpoint, torque_scale, push_force = given
        data = self._data
        self._setpoint[:] = setpoint
        if self._encoders is not None:
            self._setpoint += self._encoder_error(self._encoders)
        if torque_scale is not self._scale:
            self._allow(torque_scale)
            self._scale = torque_scale
        if any(push_force.tolist()):
            data.xfrc_applied[self.torso, :3] = push_force
            self._pushed = True
        elif self._pushed:
            data.xfrc_applied[self.torso, :3] = 0.0
            self._pushed = False

    def watch_legs(self) -> None:
        """Remember whether the legs touch each other."""
        if not self._legs_touch and self._leg_contacts[0]:
            self._legs_touch = True

    def observe(self) -> TrueState:
        """The state now; the poses of the bodies must be up to date."""
        data = self._data
        position, velocity = data.qpos.copy(), data.qvel.copy()
        base = position[self._base_q]
        angles, speeds = self._angles(position), velocity[self._motor_v]
        if len(self._play):
            speeds[self._play] += velocity[self._play_v]
        (left, left_axes), (right, right_axes) = self._sole_views
        pose = BodyPose(
            com=self._com_view.copy(),
            sole_position=(left.copy(), right.copy()),
            sole_rotation=(left_axes.copy(), right_axes.copy()),
        )
        w, x, y, z = base[3:7].tolist()
        touch, self._legs_touch = self._legs_touch, False
        first = self._all_v.start
        return TrueState(
            torso_position=base[:3],
            torso_rotation=np.array((x, y, z, w)),
            torso_matrix=self._torso_view.copy(),
            torso_linear_velocity=velocity[first : first + 3],
            torso_angular_velocity=velocity[first + 3 : first + 6],
            joint_position=angles,
            joint_velocity=speeds,
            pose=pose,
            joint_torque=data.qfrc_actuator[self._motor_v].copy(),
            sole_wrench=self._sole_wrenches(pose),
            legs_touch=touch,
        )

    def disturb(self, torque_share: FloatArray, friction: float | None) -> None:
        """Set the faults; see `Backend.disturb`."""
        self._limits.weaken(torque_share)
        self._scale = None
        coefficient = self._individual.friction if friction is None else friction
        for names in self._parts.sole_geoms:
            for name in names:
                self._model.geom(name).friction[0] = coefficient

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
        model = self._model
        most, loss = share * self._limits.standstill, share * self._limits.loss
        limits = np.stack((-most, most), axis=1)
        model.actuator_forcerange[self._servos] = limits
        model.jnt_actfrcrange[self._motors] = limits
        model.actuator_biasprm[self._servos, 2] = loss - self._parts.damping
        model.actuator_biasprm[self._losses, 2] = -loss

    def _sole_wrenches(self, pose: BodyPose) -> tuple[FloatArray, FloatArray]:
        left, right = self._sole_contacts
        return (
            _wrench(left.tolist(), pose.sole_position[0], pose.sole_rotation[0]),
            _wrench(right.tolist(), pose.sole_position[1], pose.sole_rotation[1]),
        )

    def _find_addresses(self) -> None:
        model, data = self._model, self._data
        robot, prefix = self._parts.robot.description, self._parts.robot.prefix
        joints = [model.joint(prefix + name) for name in robot.joint_names]
        count = len(joints)
        self._motor_q = _slice([int(joint.qposadr[0]) for joint in joints])
        self._motor_v = _slice([int(joint.dofadr[0]) for joint in joints])
        self._motors = [joint.id for joint in joints]
        # The servos come first, then the losses.
        servo = model.actuator(prefix + robot.joint_names[0]).id
        self._servos = slice(servo, servo + count)
        self._losses = slice(servo + count, servo + 2 * count)
        self._setpoint = data.ctrl[self._servos]
        play = self._parts.joints_with_play
        hinges = [model.joint(prefix + play_name(name)) for name in play]
        self._play = np.array([robot.index(name) for name in play], dtype=int)
        self._play_q = np.array([hinge.qposadr[0] for hinge in hinges], dtype=int)
        self._play_v = np.array([hinge.dofadr[0] for hinge in hinges], dtype=int)
        torso = model.body(prefix + robot.torso_frame)
        self.torso = torso.id
        base = int(torso.jntadr[0])
        position, velocity = int(model.jnt_qposadr[base]), int(model.jnt_dofadr[base])
        self._base_q = slice(position, position + 7)
        self._all_v = slice(velocity, velocity + 6 + count + len(play))
        # Views of MuJoCo's own memory: every step updates them.
        self._com_view = data.subtree_com[self.torso]
        self._torso_view = data.xmat[self.torso].reshape(3, 3)
        sites = [data.site(prefix + sole.name) for sole in self._parts.robot.body.soles]
        self._sole_views = [(site.xpos, site.xmat.reshape(3, 3)) for site in sites]
        self._leg_contacts = data.sensor(prefix + LEG_CONTACT).data
        self._sole_contacts = [
            data.sensor(prefix + sole.name).data for sole in self._parts.robot.body.soles
        ]


def _wrench(contact: list[float], origin: FloatArray, rotation: FloatArray) -> FloatArray:
    """Force [N] and torque [N m] (6,) of the floor on a sole, about its origin and in its axes.

    Args:
        contact: Reading of the contact sensor, in the world: force and torque of the sole on the
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
