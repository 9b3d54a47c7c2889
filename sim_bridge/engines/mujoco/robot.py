"""One robot in a MuJoCo model: its links, soles, motors and contact sensors."""

import mujoco
import numpy as np

from robot_core.errors import NaoGaitError
from robot_core.robot import RobotDescription
from robot_core.types import FloatArray
from sim_bridge.ball import shoe
from sim_bridge.body import CONTACT_RADIUS, Link, Sole
from sim_bridge.engines.backend import RobotModel
from sim_bridge.engines.mujoco.scene import (
    BALL_BIT,
    COLLIDING,
    FLOOR_BIT,
    LEFT_LEG_BIT,
    VISIBLE,
    add_shape,
    quaternion,
)
from sim_bridge.engines.mujoco.springs import COUPLING, DRY_FRICTION, END_STOP, RIGID_FLOOR, Spring
from sim_bridge.plant import Plant
from sim_bridge.soles import contact_of

_SOLE_PRIORITY = 1
"""Makes the contact parameters of the soles count, not those of the floor."""
_SERVO_DAMPING = 1.5
"""Largest value of servo damping x step / rotor inertia. The mass matrix is never smaller than the
rotors alone, so the servos are stable below 2 in any pose, whether the torque is limited or not."""
_STIFF_STEP = 0.004
"""[s] longest physics step with which a servo still counts as stiff."""
_STIFF_ARMATURE = 0.5
"""Smallest share of the real rotor inertia with which a servo still counts as stiff."""
_PLAY_INERTIA = 1e-4
"""[kg m^2] armature of a joint's play."""
_PLAY_DAMPING = 0.002
"""[N m s/rad] damping of a joint's play."""
LEG_CONTACT = "leg_contact"
"""Name of the sensor that counts the contacts between the legs."""
_NET_FORCE = 3
"""Reduction of a contact sensor to one force and torque, in world axes."""


class RobotParts:
    """One robot, added to a model before it is compiled.

    The names of its parts begin with the robot's `prefix`.

    Attributes:
        damping: (n,) [N m s/rad] of the servos.
        sole_geoms: Names of the contact points of the left and the right sole.
    """

    def __init__(
        self,
        spec: mujoco.MjSpec,
        robot: RobotModel,
        *,
        bit: int = 0,
        meets: int = 0,
        ball: bool = False,
        visual: bool = False,
    ) -> None:
        """Add the robot.

        Args:
            spec: The model.
            robot: The individual.
            bit: Collision bit of this robot, for others; 0 = none.
            meets: Collision bits of other robots and fixtures that it meets.
            ball: There is a ball, which meets everything but the soles.
            visual: With visual shapes.

        Raises:
            NaoGaitError: MuJoCo cannot honour an option of the plant.
        """
        _refuse(robot.plant, robot.description)
        self.robot = robot
        self._robot, self._plant = robot.description, robot.plant
        self._individual, self._body = robot.individual, robot.body
        self._prefix, self._bit, self._meets = robot.prefix, bit, meets
        self._with_ball, self._visual = ball, visual
        self._rotors = _shared(self._robot, _rotor_inertia(self._robot, self._plant))
        self._geoms: dict[str, tuple[str, ...]] = {}
        self.joints_with_play = _joints_with_play(self._robot, self._plant)
        self._add(spec)
        left, right = (self._geoms[sole.name] for sole in self._body.soles)
        self.sole_geoms = left, right

    def _add(self, spec: mujoco.MjSpec) -> None:
        bodies = {"": spec.worldbody}
        children: dict[str, list[Link]] = {}
        for link in self._body.links:
            children.setdefault(link.parent, []).append(link)
        waiting = list(children[""])
        while waiting:
            link = waiting.pop(0)
            bodies[link.name] = self._add_link(bodies[link.parent], link)
            # In the order of the joint arrays, so that a joint array is a slice of the state.
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
                name=self._prefix + follower,
                type=mujoco.mjtEq.mjEQ_JOINT,
                name1=self._prefix + follower,
                name2=self._prefix + leader,
                data=[0.0, 1.0] + [0.0] * 10,
            )
        self._add_motors(spec)

    def _add_motors(self, spec: mujoco.MjSpec) -> None:
        """Two actuators per joint: the servo, and the loss of torque with speed.

        With the largest torque M and its loss per speed s = M/w0, the torque of a motor is

            clip(clip(servo + s w) - s w),   servo = k (setpoint - q) - k lag w,   clip to -M..M:

        at most M - s w while it drives, M while it brakes. The backend sets M and s.
        """
        gains, self.damping = self._servos()
        joints = self._robot.joint_names
        servos = [(name, name, gain, True) for name, gain in zip(joints, gains, strict=True)]
        losses = [(f"{name}_loss", name, 0.0, False) for name in joints]
        for name, joint, gain, limited in servos + losses:
            spec.add_actuator(
                name=self._prefix + name,
                target=self._prefix + joint,
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
            damping = np.minimum(damping, motor.stiffness * _lag(self._plant))
        gains = damping / _lag(self._plant)
        for index, name in enumerate(self._robot.joint_names):
            own = self._robot.motors[name]
            if own.stiffness is not None:
                gains[index] = min(gains[index], own.stiffness)
                damping[index] = min(damping[index], own.damping or 0.0)
        return gains, damping

    def _add_link(self, parent: mujoco.MjsBody, link: Link) -> mujoco.MjsBody:
        body = parent.add_body(
            name=self._prefix + link.name, pos=link.position, quat=quaternion(link.rotation)
        )
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
                name=self._prefix + link.joint,
                type=mujoco.mjtJoint.mjJNT_HINGE,
                axis=link.axis,
                limited=True,
                range=[link.lower, link.upper],
                actfrclimited=True,
                actfrcrange=[-1.0, 1.0],
                armature=self._rotors[index],
                frictionloss=motor.friction if link.side else 0.0,
            )
            if link.joint in self.joints_with_play:
                body.add_joint(
                    name=self._prefix + play_name(link.joint),
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
        meets = 0 if link.name in feet else FLOOR_BIT
        meets |= BALL_BIT if self._with_ball and link.name not in feet else 0
        legs_meet = self._plant.physics.self_collision
        contype = LEFT_LEG_BIT if legs_meet and link.side == "left" else 0
        meets |= LEFT_LEG_BIT if legs_meet and link.side == "right" else 0
        contype |= self._bit
        meets |= self._meets
        plates = [sole.plate for sole in self._body.soles if sole.parent == link.name]
        for shape in (*link.collision, *plates):
            add_shape(
                body,
                shape,
                contype=contype,
                conaffinity=meets,
                condim=3,
                friction=[self._individual.friction, 0.0, 0.0],
                # as stiff as MuJoCo lets a contact be
                solref=[2.5 * self._plant.physics.step, 1.0],
                group=COLLIDING,
            )
        for sole in self._body.soles if self._with_ball else ():
            if sole.parent == link.name:
                add_shape(body, shoe(sole), contype=0, conaffinity=BALL_BIT, group=COLLIDING)
        for shape in link.visual if self._visual else ():
            add_shape(body, shape, contype=0, conaffinity=0, group=VISIBLE, rgba=shape.color)
        return body

    def _add_sole(self, foot: mujoco.MjsBody, sole: Sole) -> None:
        names = []
        for index, point in enumerate(sole.points):
            names.append(f"{self._prefix}{sole.name}_{index}")
            foot.add_geom(
                name=names[-1],
                type=mujoco.mjtGeom.mjGEOM_SPHERE,
                size=[CONTACT_RADIUS, 0.0, 0.0],
                pos=sole.position + sole.rotation @ point,
                contype=0,
                conaffinity=FLOOR_BIT,
                condim=3,
                friction=[self._individual.friction, 0.0, 0.0],
                priority=_SOLE_PRIORITY,
                group=COLLIDING,
            )
        self._geoms[sole.name] = tuple(names)
        foot.add_site(
            name=self._prefix + sole.name,
            pos=sole.position,
            quat=quaternion(sole.rotation),
            group=COLLIDING,
        )

    def _add_leg_contact(self, spec: mujoco.MjSpec) -> None:
        """A sensor for the number of contacts between the legs."""
        left, right = (
            next(link.name for link in self._body.links if link.side == side)
            for side in ("left", "right")
        )
        spec.add_sensor(
            name=self._prefix + LEG_CONTACT,
            type=mujoco.mjtSensor.mjSENS_CONTACT,
            objtype=mujoco.mjtObj.mjOBJ_XBODY,  # the body and all that hangs on it
            objname=self._prefix + left,
            reftype=mujoco.mjtObj.mjOBJ_XBODY,
            refname=self._prefix + right,
            intprm=[1 << int(mujoco.mjtConDataField.mjCONDATA_FOUND), 0, 1],
        )

    def _add_sole_contact(self, spec: mujoco.MjSpec, sole: Sole) -> None:
        """A sensor for the sum of all contacts between a foot and the ground."""
        field = mujoco.mjtConDataField
        fields = (field.mjCONDATA_FORCE, field.mjCONDATA_TORQUE, field.mjCONDATA_POS)
        spec.add_sensor(
            name=self._prefix + sole.name,
            type=mujoco.mjtSensor.mjSENS_CONTACT,
            objtype=mujoco.mjtObj.mjOBJ_BODY,
            objname=self._prefix + sole.parent,
            reftype=mujoco.mjtObj.mjOBJ_BODY,
            refname="world",
            intprm=[sum(1 << int(each) for each in fields), _NET_FORCE, 1],
        )

    def set_springs(self, model: mujoco.MjModel) -> None:
        """Contact and constraint parameters; they need the inertias of the compiled model."""
        step, contact = self._plant.physics.step, self._plant.contact
        floor = RIGID_FLOOR
        if not contact.rigid:
            count = len(self._body.soles[0].points)
            floor = Spring(*contact_of(self._plant, self._individual, count, self._body.mass))
        for sole in self._body.soles:
            inverse_mass = model.body(self._prefix + sole.parent).invweight0[0]
            for name in self._geoms[sole.name]:
                geom = model.geom(name)
                geom.solref[:], geom.solimp[:] = floor.compiled(inverse_mass, step)
        joints = [link.joint for link in self._body.links if link.joint]
        for name in (*joints, *map(play_name, self.joints_with_play)):
            joint = model.joint(self._prefix + name).id
            dof = model.jnt_dofadr[joint]
            inverse_inertia = model.dof_invweight0[dof]
            model.jnt_solref[joint], model.jnt_solimp[joint] = END_STOP.compiled(
                inverse_inertia, step
            )
            model.dof_solref[dof], model.dof_solimp[dof] = DRY_FRICTION.compiled(
                inverse_inertia, step
            )
        for leader, follower in self._robot.coupled_joints:
            inverse_inertia = sum(
                model.dof_invweight0[model.joint(self._prefix + name).dofadr[0]]
                for name in (follower, leader)
            )
            equality = model.equality(self._prefix + follower).id
            model.eq_solref[equality], model.eq_solimp[equality] = COUPLING.compiled(
                inverse_inertia, step
            )


def _rotor_inertia(robot: RobotDescription, plant: Plant) -> FloatArray:
    """(n,) [kg m^2] of each motor, as felt at its joint."""
    factor = 1.0 if plant.motor.armature is None else plant.motor.armature
    return factor * np.array([robot.motors[name].reflected_inertia for name in robot.joint_names])


def _largest_damping(robot: RobotDescription, plant: Plant) -> FloatArray:
    """(n,) [N m s/rad] of servos with which the integration is stable."""
    damping: FloatArray = _SERVO_DAMPING * _rotor_inertia(robot, plant) / plant.physics.step
    return damping


def _lag(plant: Plant) -> float:
    """[s] of a servo: 0 is the shortest one with which the integration is stable."""
    return plant.motor.lag or 2.0 * plant.physics.step


def _refuse(plant: Plant, robot: RobotDescription) -> None:
    """Raise NaoGaitError for the first option that MuJoCo cannot honour."""
    motor, step = plant.motor, plant.physics.step

    def refuse(key: str, value: object, allowed: str) -> None:
        raise NaoGaitError(f"{plant.name}: {key}", value, f"{allowed} with engine mujoco{other}")

    worn = motor.friction or motor.play or motor.encoder_feedback
    servo = motor.stiffness is None and motor.armature is None
    other = ", or engine:=pybullet" if servo and not worn else ""

    if _lag(plant) < 2.0 * step:
        refuse("motor.lag", motor.lag, f"0 or at least {2.0 * step:g} s (two steps)")
    if motor.stiffness is None:
        if step > _STIFF_STEP:
            refuse("physics.step", step, f"at most {_STIFF_STEP} s where motor.stiffness is null,")
        if motor.armature is not None and motor.armature < _STIFF_ARMATURE:
            allowed = f"at least {_STIFF_ARMATURE} or null where motor.stiffness is null,"
            refuse("motor.armature", motor.armature, allowed)
        return
    damping = _largest_damping(robot, plant)
    most = min(damping[robot.index(joint)] for joint in robot.leg_joints) / _lag(plant)
    if motor.stiffness > most:
        allowed = f"at most {most:.4g} N m/rad with this armature, lag and step"
        refuse("motor.stiffness", motor.stiffness, allowed)


def _shared(robot: RobotDescription, inertia: FloatArray) -> FloatArray:
    """(n,) [kg m^2] with half of a shared motor's rotor at each of its joints."""
    shared = inertia.copy()
    for leader, follower in robot.coupled_joints:
        for name in (leader, follower):
            shared[robot.index(name)] = inertia[robot.index(leader)] / 2.0
    return shared


def play_name(joint: str) -> str:
    """Name of the hinge that stands for a joint's play."""
    return f"{joint}_play"


def _joints_with_play(robot: RobotDescription, plant: Plant) -> tuple[str, ...]:
    if not plant.motor.play:
        return ()
    legs = (robot.left_leg, robot.right_leg)
    return tuple(
        joint for leg in legs for joint in (leg.hip_pitch, leg.knee_pitch, leg.ankle_pitch)
    )
