"""The plant in MuJoCo."""

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.robot_description import RobotDescription
from nao_lipm_gait.signals import FloatArray
from sim_bridge.backend import StartState, TrueState
from sim_bridge.body import CONTACT_RADIUS, Body, BodyPose, Link, Shape, Sole
from sim_bridge.encoders import Encoders
from sim_bridge.individual import Individual
from sim_bridge.motors import TorqueLimits
from sim_bridge.plant import Plant
from sim_bridge.vectors import cross, rows_of, turned_back

_FLOOR, _LEFT_LEG = 1, 2
"""Collision bits: the floor meets what has the first, the left leg what has the second."""
_SOLE_PRIORITY = 1
"""The soles' contact numbers go before those of the floor."""
_IMPEDANCE_RATIO = 10.0
"""Friction is this much harder than the normal contact: at 80 % of what it can hold, a foot creeps
by 0.3 mm/s. With 100 it is 0.1 mm/s, and the solver needs a tenth more time."""
_TOLERANCE = 1e-6
"""Of the constraint solver, relative to the inertia of the robot."""
_SERVO_DAMPING = 1.5
"""Largest damping of a servo x step / rotor inertia. As the mass matrix is never smaller than the
rotors alone, the servos stay stable below 2 in any pose, and whether the torque is cut or not."""
_STIFF_STEP = 0.004
"""[s] and"""
_STIFF_ARMATURE = 0.5
"""share of the real rotor inertia with which a servo can still count as stiff."""
_FRAME = 1.0 / 60.0
"""[s] between two pictures in the window."""
_PLAY_INERTIA = 1e-4
"""[kg m^2] and"""
_PLAY_DAMPING = 0.002
"""[N m s/rad] between the two sides of the play."""
_GEOMS = {
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "sphere": mujoco.mjtGeom.mjGEOM_SPHERE,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
}
_LEG_CONTACT = "leg_contact"
_NET_FORCE = 3
"""How a contact sensor sums up: one force and torque, in the axes of the world."""
_COLLIDING, _SEEN = 3, 1
"""Groups of shapes; the window shows the second only."""


@dataclass(frozen=True, slots=True)
class _Spring:
    """A spring and a damper that hold a constraint."""

    stiffness: float
    """[N/m] or [N m/rad]."""
    damping: float
    """[N s/m] or [N m s/rad]."""

    def compiled(self, inverse_inertia: float, step: float) -> tuple[list[float], list[float]]:
        """(solref, solimp) with which MuJoCo integrates this spring implicitly over a step.

        MuJoCo solves R f + a = a_ref with a_ref = -b v - k d r, R = A (1 - d)/d and A the inverse
        inertia seen by the constraint [1/kg] or [1/(kg m^2)]; negative solref numbers are divided
        by d^2 and by d. An implicit spring is f = -(K r + (K dt + B) (v + a dt)).
        """
        slope = self.stiffness * step + self.damping
        regularizer = 1.0 / (step * slope)
        share = inverse_inertia / (inverse_inertia + regularizer)
        solref = [-self.stiffness * regularizer * share, -slope * regularizer * share]
        return solref, [share, share, 0.001, 0.5, 2.0]


_RIGID_FLOOR = _Spring(1e6, 2e3)
"""Per contact point: sinks by 6 um under a standing NAO."""
_END_STOP = _Spring(1e4, 5.0)
"""Of joints and of their play."""
_COUPLING = _Spring(2e4, 20.0)
"""Of joints that share a motor."""
_DRY_FRICTION = _Spring(0.0, 50.0)
"""A joint held by dry friction creeps with torque / damping: below 0.4 deg/s."""


class MujocoBackend:
    """MuJoCo behind the four methods of `Backend`.

    A position servo is here a torque, of a spring and a damper whose ratio is the lag, cut at the
    motor's limit. That leaves room for stiffness, rotor inertia, dry friction and play. Where the
    plant gives no stiffness, the servo is as stiff as the integration bears, and where it gives no
    rotor inertia, the rotors have their real one: a stiff servo of a foot without it would chatter.
    """

    def __init__(
        self,
        robot: RobotDescription,
        plant: Plant,
        individual: Individual,
        body: Body,
        *,
        gui: bool = False,
    ) -> None:
        self._robot = robot
        self._plant = plant
        self._individual = individual
        self._body = body
        self._visual = gui
        _refuse(plant, robot)
        self._rotors = _shared(robot, _rotor_inertia(robot, plant))
        self._limits = TorqueLimits(robot, plant, individual)
        self._encoders = Encoders(plant, individual) if plant.motor.encoder_feedback else None
        self._geoms: dict[str, tuple[str, ...]] = {}
        self._model = self._compile()
        self._set_springs()
        self._data = mujoco.MjData(self._model)
        self._find_addresses()
        self._legs_touch = False
        self._pushed = False
        self._scale: float | FloatArray | None = None
        self._shown = 0.0
        self._viewer = _open_viewer(self._model, self._data) if gui else None

    def reset(self, start: StartState) -> None:
        data = self._data
        mujoco.mj_resetData(self._model, data)
        data.qpos[:3] = start.torso_position
        data.qpos[3:7] = np.roll(start.torso_rotation, 1)
        data.qpos[self._motor_q] = start.joint_position
        self._setpoint[:] = start.joint_position
        self._legs_touch = self._pushed = False
        self._scale = None

    def step(
        self, setpoint: FloatArray, torque_scale: float | FloatArray, push_force: FloatArray
    ) -> None:
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

    def observe(self) -> TrueState:
        data = self._data
        # mj_step leaves the places of the bodies as they were before it.
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
        return TrueState(
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

    def _angles(self, position: FloatArray) -> FloatArray:
        """(n,) [rad] true joint angles, play included."""
        angles: FloatArray = position[self._motor_q]
        if len(self._play):
            angles[self._play] += position[self._play_q]
        return angles

    def _encoder_error(self, encoders: Encoders) -> FloatArray:
        """(n,) [rad] by which the motors are ahead of what the encoders say."""
        position = self._data.qpos.copy()
        seen = encoders.read(self._angles(position)) + self._individual.joint_zero
        error: FloatArray = position[self._motor_q] - seen
        return error

    def _allow(self, share: float | FloatArray) -> None:
        """Lets the motors use this share of their torques, of all or (n,) of each."""
        model, count = self._model, len(self._setpoint)
        most, loss = share * self._limits.standstill, share * self._limits.loss
        cut = np.stack((-most, most), axis=1)
        model.actuator_forcerange[:count] = cut
        model.jnt_actfrcrange[self._motors] = cut
        model.actuator_biasprm[:count, 2] = loss - self._damping
        model.actuator_biasprm[count:, 2] = -loss

    def disturb(self, torque_share: FloatArray, friction: float | None) -> None:
        self._limits.weaken(torque_share)
        self._scale = None
        coefficient = self._individual.friction if friction is None else friction
        for names in self._geoms.values():
            for name in names:
                self._model.geom(name).friction[0] = coefficient

    def _show(self, viewer: Any) -> None:
        if self._data.time < self._shown:  # after a reset
            self._shown = 0.0
        if self._data.time >= self._shown + _FRAME:
            self._shown = self._data.time
            viewer.sync()

    def close(self) -> None:
        if self._viewer is not None:
            self._viewer.close()
            self._viewer = None

    def _sole_wrenches(self, pose: BodyPose) -> tuple[FloatArray, FloatArray]:
        left, right = self._sole_contacts
        return (
            _wrench(left.tolist(), pose.sole_position[0], pose.sole_rotation[0]),
            _wrench(right.tolist(), pose.sole_position[1], pose.sole_rotation[1]),
        )

    def _compile(self) -> mujoco.MjModel:
        spec = mujoco.MjSpec()
        spec.compiler.degree = False
        physics, option = self._plant.physics, spec.option
        option.timestep = physics.step
        option.gravity = [0.0, 0.0, -physics.gravity]
        option.iterations = physics.iterations
        # Implicit integrators change a torque after it was cut at its limit, and report it before.
        option.integrator = mujoco.mjtIntegrator.mjINT_EULER
        option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
        option.impratio = _IMPEDANCE_RATIO
        option.tolerance = _TOLERANCE
        # a quarter faster for this robot, alone on its floor
        option.jacobian = mujoco.mjtJacobian.mjJAC_SPARSE
        option.disableflags = mujoco.mjtDisableBit.mjDSBL_ISLAND
        spec.worldbody.add_geom(
            name="floor",
            type=mujoco.mjtGeom.mjGEOM_PLANE,
            size=[0.0, 0.0, 0.05],
            contype=_FLOOR,
            conaffinity=0,
            condim=3,
            friction=[0.0, 0.0, 0.0],  # MuJoCo takes the larger coefficient of the two bodies
            group=_COLLIDING,
        )
        if self._visual:
            _light(spec)
        bodies = {"": spec.worldbody}
        children: dict[str, list[Link]] = {}
        for link in self._body.links:
            children.setdefault(link.parent, []).append(link)
        waiting = list(children[""])
        while waiting:
            link = waiting.pop(0)
            bodies[link.name] = self._add_link(bodies[link.parent], link)
            # in the order of the joint arrays: a joint array is then a slice of the state
            waiting = (
                sorted(children.get(link.name, []), key=lambda c: self._robot.index(c.joint))
                + waiting
            )
        self._add_leg_contact(spec)
        for sole in self._body.soles:
            self._add_sole(bodies[sole.parent], sole)
            self._add_sole_contact(spec, sole)
        for leader, follower in self._robot.coupled_joints:
            spec.add_equality(
                name=follower,
                type=mujoco.mjtEq.mjEQ_JOINT,
                name1=follower,
                name2=leader,
                data=[0.0, 1.0] + [0.0] * 10,
            )
        self._add_motors(spec)
        return spec.compile()

    def _add_motors(self, spec: mujoco.MjSpec) -> None:
        """Two actuators per joint: what the servo asks for, and what speed takes from it.

        With the largest torque M and its loss per speed s = M/w0, the torque of a motor is

            cut(cut(servo + s w) - s w),   servo = k (setpoint - q) - k lag w,   cut at -M and M:

        at most M - s w while it drives, M while it brakes. `_allow` sets M and s.
        """
        gains, self._damping = self._servos()
        joints = self._robot.joint_names
        servos = [(name, name, gain, True) for name, gain in zip(joints, gains, strict=True)]
        losses = [(f"{name}_loss", name, 0.0, False) for name in joints]
        for name, joint, gain, limited in servos + losses:
            spec.add_actuator(
                name=name,
                target=joint,
                trntype=mujoco.mjtTrn.mjTRN_JOINT,
                gaintype=mujoco.mjtGain.mjGAIN_FIXED,
                gainprm=[gain] + [0.0] * 9,
                biastype=mujoco.mjtBias.mjBIAS_AFFINE,
                biasprm=[0.0, -gain] + [0.0] * 8,
                forcelimited=limited,
                forcerange=[-1.0, 1.0],
            )

    def _servos(self) -> tuple[FloatArray, FloatArray]:
        """(n,) stiffness [N m/rad] and (n,) damping [N m s/rad] of the servos."""
        motor = self._plant.motor
        damping = _largest_damping(self._robot, self._plant)
        if motor.stiffness is not None:
            damping = np.minimum(damping, motor.stiffness * motor.lag)
        return damping / motor.lag, damping

    def _add_link(self, parent: mujoco.MjsBody, link: Link) -> mujoco.MjsBody:
        body = parent.add_body(name=link.name, pos=link.position, quat=_quaternion(link.rotation))
        inertia = link.inertia
        body.explicitinertial = True
        body.mass = link.mass
        body.ipos = link.com
        body.fullinertia = [
            inertia[0, 0], inertia[1, 1], inertia[2, 2], inertia[0, 1], inertia[0, 2], inertia[1, 2]
        ]  # fmt: skip
        if link.joint:
            motor, index = self._plant.motor, self._robot.index(link.joint)
            body.add_joint(
                name=link.joint,
                type=mujoco.mjtJoint.mjJNT_HINGE,
                axis=link.axis,
                limited=True,
                range=[link.lower, link.upper],
                actfrclimited=True,
                actfrcrange=[-1.0, 1.0],
                armature=self._rotors[index],
                frictionloss=motor.friction if link.side else 0.0,
            )
            if link.joint in self._joints_with_play():
                body.add_joint(
                    name=_play_name(link.joint),
                    type=mujoco.mjtJoint.mjJNT_HINGE,
                    axis=link.axis,
                    limited=True,
                    range=[-motor.play / 2.0, motor.play / 2.0],
                    actfrclimited=False,
                    armature=_PLAY_INERTIA,
                    damping=[_PLAY_DAMPING, 0.0, 0.0],
                )
        else:
            body.add_freejoint()
        feet = {sole.parent for sole in self._body.soles}
        meets = 0 if link.name in feet else _FLOOR
        legs_meet = self._plant.physics.self_collision
        contype = _LEFT_LEG if legs_meet and link.side == "left" else 0
        meets |= _LEFT_LEG if legs_meet and link.side == "right" else 0
        plates = [sole.plate for sole in self._body.soles if sole.parent == link.name]
        for shape in (*link.collision, *plates):
            _add_shape(
                body,
                shape,
                contype=contype,
                conaffinity=meets,
                condim=3,
                friction=[self._individual.friction, 0.0, 0.0],
                # as stiff as MuJoCo lets a contact be
                solref=[2.5 * self._plant.physics.step, 1.0],
                group=_COLLIDING,
            )
        for shape in link.visual if self._visual else ():
            _add_shape(body, shape, contype=0, conaffinity=0, group=_SEEN, rgba=shape.color)
        return body

    def _add_sole(self, foot: mujoco.MjsBody, sole: Sole) -> None:
        names = []
        for index, point in enumerate(sole.points):
            names.append(f"{sole.name}_{index}")
            foot.add_geom(
                name=names[-1],
                type=mujoco.mjtGeom.mjGEOM_SPHERE,
                size=[CONTACT_RADIUS, 0.0, 0.0],
                pos=sole.position + sole.rotation @ point,
                contype=0,
                conaffinity=_FLOOR,
                condim=3,
                friction=[self._individual.friction, 0.0, 0.0],
                priority=_SOLE_PRIORITY,
                group=_COLLIDING,
            )
        self._geoms[sole.name] = tuple(names)
        foot.add_site(
            name=sole.name,
            pos=sole.position,
            quat=_quaternion(sole.rotation),
            group=_COLLIDING,
        )

    def _add_leg_contact(self, spec: mujoco.MjSpec) -> None:
        """A sensor for the number of contacts between the legs."""
        left, right = (
            next(link.name for link in self._body.links if link.side == side)
            for side in ("left", "right")
        )
        spec.add_sensor(
            name=_LEG_CONTACT,
            type=mujoco.mjtSensor.mjSENS_CONTACT,
            objtype=mujoco.mjtObj.mjOBJ_XBODY,  # the body and all that hangs on it
            objname=left,
            reftype=mujoco.mjtObj.mjOBJ_XBODY,
            refname=right,
            intprm=[1 << int(mujoco.mjtConDataField.mjCONDATA_FOUND), 0, 1],
        )

    def _add_sole_contact(self, spec: mujoco.MjSpec, sole: Sole) -> None:
        """A sensor for the sum of all contacts between a foot and the world; see `_wrench`."""
        field = mujoco.mjtConDataField
        fields = (field.mjCONDATA_FORCE, field.mjCONDATA_TORQUE, field.mjCONDATA_POS)
        spec.add_sensor(
            name=sole.name,
            type=mujoco.mjtSensor.mjSENS_CONTACT,
            objtype=mujoco.mjtObj.mjOBJ_BODY,
            objname=sole.parent,
            reftype=mujoco.mjtObj.mjOBJ_BODY,
            refname="world",
            intprm=[sum(1 << int(each) for each in fields), _NET_FORCE, 1],
        )

    def _joints_with_play(self) -> tuple[str, ...]:
        if not self._plant.motor.play:
            return ()
        legs = (self._robot.left_leg, self._robot.right_leg)
        return tuple(
            joint for leg in legs for joint in (leg.hip_pitch, leg.knee_pitch, leg.ankle_pitch)
        )

    def _set_springs(self) -> None:
        """Contact and constraint numbers; they need the inertias of the compiled model."""
        model, step, contact = self._model, self._plant.physics.step, self._plant.contact
        floor = _RIGID_FLOOR
        if not contact.rigid:
            stiffness = contact.stiffness * self._individual.stiffness_scale
            floor = _Spring(stiffness, contact.damping)
        for sole in self._body.soles:
            inverse_mass = model.body(sole.parent).invweight0[0]
            for name in self._geoms[sole.name]:
                geom = model.geom(name)
                geom.solref[:], geom.solimp[:] = floor.compiled(inverse_mass, step)
        for dof in range(6, model.nv):
            inverse_inertia = model.dof_invweight0[dof]
            joint = model.dof_jntid[dof]
            model.jnt_solref[joint], model.jnt_solimp[joint] = _END_STOP.compiled(
                inverse_inertia, step
            )
            model.dof_solref[dof], model.dof_solimp[dof] = _DRY_FRICTION.compiled(
                inverse_inertia, step
            )
        for index in range(model.neq):
            inverse_inertia = sum(
                model.dof_invweight0[model.jnt_dofadr[joint]]
                for joint in (model.eq_obj1id[index], model.eq_obj2id[index])
            )
            model.eq_solref[index], model.eq_solimp[index] = _COUPLING.compiled(
                inverse_inertia, step
            )

    def _find_addresses(self) -> None:
        model, data, robot = self._model, self._data, self._robot
        joints = [model.joint(name) for name in robot.joint_names]
        self._motor_q = _slice([int(joint.qposadr[0]) for joint in joints])
        self._motor_v = _slice([int(joint.dofadr[0]) for joint in joints])
        self._motors = [joint.id for joint in joints]
        self._setpoint = data.ctrl[: len(joints)]
        play = self._joints_with_play()
        hinges = [model.joint(_play_name(name)) for name in play]
        self._play = np.array([robot.index(name) for name in play], dtype=int)
        self._play_q = np.array([hinge.qposadr[0] for hinge in hinges], dtype=int)
        self._play_v = np.array([hinge.dofadr[0] for hinge in hinges], dtype=int)
        self._torso = model.body(robot.torso_frame).id
        # Views of MuJoCo's own memory, which follow every step.
        self._com_view = data.subtree_com[self._torso]
        self._torso_view = data.xmat[self._torso].reshape(3, 3)
        sites = [data.site(sole.name) for sole in self._body.soles]
        self._sole_views = [(site.xpos, site.xmat.reshape(3, 3)) for site in sites]
        self._leg_contacts = data.sensor(_LEG_CONTACT).data
        self._sole_contacts = [data.sensor(sole.name).data for sole in self._body.soles]


def _wrench(contact: list[float], origin: FloatArray, rotation: FloatArray) -> FloatArray:
    """(6,) force [N] and torque [N m] of the floor on a sole, about its origin and in its axes.

    Args:
        contact: what the contact sensor says, in the world: force and torque of the sole on the
            floor, and the point about which the torque is.
        origin, rotation: (3,) [m] and (3, 3), where the sole is in the world.
    """
    fx, fy, fz, tx, ty, tz, x, y, z = contact
    if not fz:
        return np.zeros(6)
    ox, oy, oz = origin.tolist()
    mx, my, mz = cross((x - ox, y - oy, z - oz), (fx, fy, fz))
    axes = rows_of(rotation)
    force = turned_back(axes, (-fx, -fy, -fz))
    return np.array(force + turned_back(axes, (-tx - mx, -ty - my, -tz - mz)))


def _rotor_inertia(robot: RobotDescription, plant: Plant) -> FloatArray:
    """(n,) [kg m^2] of each motor, as felt at its joint."""
    factor = 1.0 if plant.motor.armature is None else plant.motor.armature
    return factor * np.array([robot.motors[name].reflected_inertia for name in robot.joint_names])


def _largest_damping(robot: RobotDescription, plant: Plant) -> FloatArray:
    """(n,) [N m s/rad] of servos that the integration still bears."""
    damping: FloatArray = _SERVO_DAMPING * _rotor_inertia(robot, plant) / plant.physics.step
    return damping


def _refuse(plant: Plant, robot: RobotDescription) -> None:
    """NaoGaitError for what MuJoCo cannot honour."""
    motor, step = plant.motor, plant.physics.step

    def refuse(key: str, value: object, allowed: str) -> None:
        raise NaoGaitError(f"{plant.name}: {key}", value, f"{allowed} with engine mujoco")

    if motor.lag < 2.0 * step:
        refuse("motor.lag", motor.lag, f"at least {2.0 * step:g} s (two steps)")
    if motor.stiffness is None:
        if step > _STIFF_STEP:
            refuse("physics.step", step, f"at most {_STIFF_STEP} s where motor.stiffness is null,")
        if motor.armature is not None and motor.armature < _STIFF_ARMATURE:
            allowed = f"at least {_STIFF_ARMATURE} or null where motor.stiffness is null,"
            refuse("motor.armature", motor.armature, allowed)
        return
    damping = _largest_damping(robot, plant)
    legs = (*robot.left_leg.names, *robot.right_leg.names)
    most = min(damping[robot.index(joint)] for joint in legs) / motor.lag
    if motor.stiffness > most:
        allowed = f"at most {most:.4g} N m/rad with this armature, lag and step"
        refuse("motor.stiffness", motor.stiffness, allowed)


def _shared(robot: RobotDescription, inertia: FloatArray) -> FloatArray:
    """(n,) [kg m^2] with half of a motor's rotor on either joint that it turns."""
    shared = inertia.copy()
    for leader, follower in robot.coupled_joints:
        for name in (leader, follower):
            shared[robot.index(name)] = inertia[robot.index(leader)] / 2.0
    return shared


def _slice(addresses: list[int]) -> slice | NDArray[np.intp]:
    """Without play, the joints stand in a row, which is four times as fast to read."""
    first, count = addresses[0], len(addresses)
    if addresses == list(range(first, first + count)):
        return slice(first, first + count)
    return np.array(addresses, dtype=np.intp)


def _play_name(joint: str) -> str:
    return f"{joint}_play"


def _quaternion(rotation: FloatArray) -> FloatArray:
    """(4,) w x y z of a (3, 3) rotation."""
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(rotation).ravel())
    return quaternion


def _add_shape(body: mujoco.MjsBody, shape: Shape, **options: object) -> None:
    size = shape.size
    if shape.kind == "box":
        size = tuple(edge / 2.0 for edge in size)
    elif shape.kind == "cylinder":
        size = (size[0], size[1] / 2.0)
    body.add_geom(
        type=_GEOMS[shape.kind],
        size=[*size, *(0.0,) * (3 - len(size))],
        pos=shape.position,
        quat=_quaternion(shape.rotation),
        **options,
    )


def _light(spec: mujoco.MjSpec) -> None:
    """Something to see the walk by."""
    spec.worldbody.add_light(pos=[0.0, 0.0, 3.0], dir=[0.0, 0.0, -1.0])
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[0.0, 0.0, 0.25],
        contype=0,
        conaffinity=0,
        group=_SEEN,
        rgba=[0.66, 0.72, 0.78, 1.0],
    )


def _open_viewer(model: mujoco.MjModel, data: mujoco.MjData) -> Any:
    import mujoco.viewer

    return mujoco.viewer.launch_passive(model, data)
