"""One simulated robot: joint targets in, delayed sensor frames and the ground truth out."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from robot_core.command_input import PUSH_ABSURD
from robot_core.errors import NaoGaitError
from robot_core.geometry import ORIGIN, rotation_matrix
from robot_core.message_checks import read_array
from robot_core.robot import RobotDescription
from robot_core.schema import Choice, Number, Optional
from robot_core.types import FloatArray, JointTargets, Pose2, SensorFrame
from sim_bridge.body import Body
from sim_bridge.cameras.camera import (
    CameraImage,
    CameraSettings,
    Render,
    SimulatedCamera,
    make_cameras,
)
from sim_bridge.delay_line import DelayLine
from sim_bridge.engines.backend import make_robot_model
from sim_bridge.force_sensors import ForceSensorModel
from sim_bridge.heat import HeatModel, MotorState
from sim_bridge.motors import Setpoints, TorqueLimits
from sim_bridge.plant import Plant
from sim_bridge.sensors import SensorModel, TorqueSensors
from sim_bridge.shapes import Color
from sim_bridge.state import StartState, StepInput, TrueState
from sim_bridge.terrain import Prism, ground_height

_LYING = {
    "lying_front": (0.0, 1.0, 0.0),
    "lying_back": (0.0, -1.0, 0.0),
    "lying_left": (-1.0, 0.0, 0.0),
    "lying_right": (1.0, 0.0, 0.0),
}
"""Axis of the torso about which a standing robot turns by 90 degrees to lie."""
START_STATES = ("stand", *_LYING)
LOADED = 1.0
"""[N] of normal force from which on a sole counts as loaded."""
SATURATED = 0.95
"""Share of the torque limit from which on a motor counts as saturated. Below 1, because the speed
that sets the limit has changed a little by the end of the step."""
FADE_STEP = 0.01
"""Change of a motor's torque share by heat and voltage, from which on the engine uses it."""
_SECOND = 1_000_000_000
_STAMP = Number(unit="ns", whole=True)
_SHARE = Number(0.0, 1.0)
_DELAY = Number(0.0, 1.0, "s")
_DURATION = Number(1e-6, 60.0, "s")


@dataclass(frozen=True, slots=True)
class RobotSpec:
    """A robot of a world.

    Attributes:
        seed: Number of the individual; -1 = the nominal robot.
        noise_seed: Seed of the sensor noise, at least 0.
        sensor_delay: [s], 0 to 1; None = the plant's.
        start_state: One of `START_STATES`.
        name: Unique in its world; empty for a robot that is alone.
        pose: x [m], y [m], heading [rad] of the torso at the start, in the world.
        color: Red, green, blue of its upper body in pictures; None = those of the URDF.
    """

    robot: RobotDescription
    seed: int = 0
    noise_seed: int = 0
    sensor_delay: float | None = None
    start_state: str = "stand"
    name: str = ""
    pose: Pose2 = ORIGIN
    color: Color | None = None


class Reading(NamedTuple):
    """All sensors of one instant.

    Attributes:
        frame: The sensors that the gait uses.
        joint_velocity: (n,) [rad/s] between the last two encoder readings.
        joint_effort: (n,) [N m] measured motor torques.
        sole_wrench: left, right (6,): force [N] and torque [N m] of the floor on the sole, in the
            sole frame, as its force sensors give them.
        motors: Temperatures, currents and battery; None in a plant without heat.
    """

    frame: SensorFrame
    joint_velocity: FloatArray
    joint_effort: FloatArray
    sole_wrench: tuple[FloatArray, FloatArray]
    motors: MotorState | None = None


class SolePose(NamedTuple):
    """Pose of a sole in the world.

    Attributes:
        position: (3,) [m].
        rotation: (3, 3), sole to world.
    """

    position: FloatArray
    rotation: FloatArray


class GroundTruth(NamedTuple):
    """Exact state of a robot, for metrics and tests, never for the gait.

    Attributes:
        stamp: [ns].
        torso_position: (3,) [m] of the torso link frame in the world.
        torso_quaternion: (4,) x y z w, torso to world.
        torso_linear_velocity_in_torso: (3,) [m/s] of the torso origin, in the torso frame.
        torso_angular_velocity_in_torso: (3,) [rad/s].
        com: (3,) [m] of the whole body in the world.
        soles: left, right.
        sole_force: (2,) [N] normal force on the left and the right sole.
        sole_slip: (2,) [m/s] mean sliding speed of the centre of pressure over the last control
            period; NaN for a sole that was not loaded at its start and end.
        legs_touch: The legs touched each other during the last control period.
        joint_position: (n,) [rad] true angles.
        joint_torque: (n,) [N m].
        torque_saturated: Number of joints whose motor is at its torque limit.
    """

    stamp: int
    torso_position: FloatArray
    torso_quaternion: FloatArray
    torso_linear_velocity_in_torso: FloatArray
    torso_angular_velocity_in_torso: FloatArray
    com: FloatArray
    soles: tuple[SolePose, SolePose]
    sole_force: FloatArray
    sole_slip: FloatArray
    legs_touch: bool
    joint_position: FloatArray
    joint_torque: FloatArray
    torque_saturated: int

    @property
    def base_footprint(self) -> Pose2:
        """Pose of base_footprint in the world: between the soles, with their mean heading."""
        left, right = self.soles
        x, y, _ = (0.5 * (left.position + right.position)).tolist()
        forward = left.rotation[:, 0] + right.rotation[:, 0]
        return x, y, math.atan2(forward[1], forward[0])


class SimulatedRobot:
    """One individual robot. `World` steps it; users command it and read its sensors.

    Attributes:
        spec: Which robot it is, and where it starts.
        name: Unique in its world; empty for a robot that is alone.
        model: What the engine builds.
        description: Facts of all robots of this kind.
        plant: The plant with this robot's own sensors.
        body: Masses, joints and shapes of this individual.
        individual: The errors of this robot.
        start: Where a reset puts the robot.
        cameras: Its cameras, in the order of its description; empty in a world without.
        last_command: The last accepted joint targets since the start; None = none yet.
        heat: Temperatures of its motors and its battery; None in a plant without heat.
        time: [ns] now.
        state: The last observed state.
    """

    def __init__(
        self,
        spec: RobotSpec,
        plant: Plant,
        ground: tuple[Prism, ...],
        control_period: int,
        cameras: CameraSettings | None = None,
    ) -> None:
        """Draw the individual and prepare its motors and sensors.

        Args:
            spec: Which robot.
            plant: Kind of robot and floor.
            ground: Prisms that rise above the floor.
            control_period: [ns], a multiple of the plant's physics step.
            cameras: Settings of its cameras; None = without cameras.

        Raises:
            NaoGaitError: A value of `spec` is not allowed, or the robot has no camera.
        """
        Choice(START_STATES).check("start_state", spec.start_state)
        noise = int(Number(0, whole=True).check("noise_seed", spec.noise_seed))
        delay = plant.sensors.delay if spec.sensor_delay is None else spec.sensor_delay
        delay = _DELAY.check("sensor_delay", delay)
        self.spec, self.name = spec, spec.name
        self.model = make_robot_model(spec.robot, plant, spec.seed, spec.name, spec.color)
        self.description, self.plant = spec.robot, self.model.plant
        self.individual, self.body = self.model.individual, self.model.body
        self._spec, self._ground = spec, ground
        self.start = self.start_at(None)
        self._period = control_period
        self._physics_step = plant.physics.step
        substeps = control_period // round(plant.physics.step * _SECOND)
        self._setpoints = Setpoints(spec.robot, self.plant, self.individual, substeps)
        self._limits = TorqueLimits(spec.robot, self.plant, self.individual)
        self._sensors = SensorModel(
            self.plant, self.individual, self.body, noise, control_period / _SECOND
        )
        self._torque_sensors = TorqueSensors(spec.robot, self.plant, noise)
        self._force_sensors = ForceSensorModel(spec.robot, self.plant, self.individual, noise)
        self.heat = HeatModel(spec.robot, self.plant) if self.plant.heat.enabled else None
        self._delay_line: DelayLine[Reading] = DelayLine(round(delay * _SECOND))
        self.cameras: tuple[SimulatedCamera, ...] = ()
        if cameras is not None:
            self.cameras = make_cameras(
                spec.robot, self.plant, cameras, seed=spec.seed, noise_seed=noise
            )
        self.last_command: JointTargets | None = None
        self._stiffness: float | FloatArray = 1.0
        self._no_push = np.zeros(3)
        self._torque_share = np.ones(len(spec.robot.joint_names))
        self._faded = np.ones(len(spec.robot.joint_names))
        self._friction: float | None = None
        self._faults_changed = False
        self.time = self._restarted = 0

    def start_at(self, pose: Pose2 | None) -> StartState:
        """At rest and upright at x, y [m], heading [rad] in the world; None = at its start."""
        spec = self._spec
        if pose is not None:
            spec = replace(spec, pose=pose, start_state="stand")
        return _start_state(self.body, self.individual.joint_zero, spec, self._ground)

    # -- for users ---------------------------------------------------------------------------------

    def command(self, targets: JointTargets | None) -> None:
        """Set the joint targets from the next step on; None keeps the last ones.

        Setpoints go linearly to the targets, limited by joint limits and joint speeds. Answers to
        frames of the time before the last restart are left out.

        Raises:
            NaoGaitError: The targets are not usable; the last ones stay.
        """
        if targets is None:
            return
        names = self.description.joint_names
        _STAMP.check("targets.stamp", targets.stamp)
        position = read_array(
            targets.position, "targets.position", (len(names),), unit="rad", names=names
        )
        stiffness: float | FloatArray = _SHARE.check("targets.stiffness", targets.stiffness)
        if targets.joint_stiffness is not None:
            stiffness = read_array(
                targets.joint_stiffness, "targets.joint_stiffness", (len(names),), 1.0, names=names
            )
            _SHARE.check("targets.joint_stiffness", float(np.min(stiffness)))
        if targets.lead is not None:
            read_array(targets.lead, "targets.lead", (len(names),), unit="rad", names=names)
        if 0 < targets.stamp < self._restarted:
            return
        self._target, self._stiffness = position, stiffness
        self.last_command = targets

    def sense(self) -> SensorFrame | None:
        """The newest frame that has passed the delay; None before the first one."""
        reading = self.read()
        return None if reading is None else reading.frame

    def read(self) -> Reading | None:
        """The newest reading that has passed the delay; None before the first one."""
        return self._delay_line.newest(self.time)

    def coming(self) -> list[SensorFrame | None]:
        """The frames of `sense` now and after each of the next steps that are sampled already.

        With a delay of four control periods these are five frames.
        """
        readings = self._delay_line.coming(self.time, self._period)
        return [None if reading is None else reading.frame for reading in readings]

    def images(self) -> list[CameraImage | None]:
        """The newest image of each camera that has passed its delay; None before the first one."""
        return [camera.newest(self.time) for camera in self.cameras]

    def push(self, force: FloatArray, duration: float) -> None:
        """Push the torso at its centre of mass, from the next physics step on.

        A push that still acts is replaced.

        Args:
            force: (3,) [N] in the world frame.
            duration: [s], rounded to physics steps, at least one.

        Raises:
            NaoGaitError: The force or the duration is not usable.
        """
        force = read_array(force, "push force", (3,), PUSH_ABSURD, "N")
        duration = _DURATION.check("push duration", duration)
        self._push_force = force
        self._push_steps = max(1, round(duration / self._physics_step))

    def weaken(self, joint: str, share: float) -> None:
        """Leave a joint's motor a share of its torque from now on, 0 (limp) to 1 (whole).

        Of joints with one motor the leader's share counts.

        Raises:
            NaoGaitError: The robot has no such joint, or the share is not from 0 to 1.
        """
        if not isinstance(joint, str) or joint not in self.description.joint_names:
            raise NaoGaitError("joint", joint, f"a joint of {self.description.name}")
        self._torque_share[self.description.index(joint)] = _SHARE.check("torque share", share)
        self._apply_torque_share()

    def _fade(self, share: FloatArray) -> None:
        """Leave the motors what temperature and voltage leave; small changes wait."""
        if np.abs(share - self._faded).max() > FADE_STEP:
            self._faded = share
            self._apply_torque_share()

    def _apply_torque_share(self) -> None:
        self._limits.weaken(self._torque_share * self._faded)
        self._faults_changed = True

    def set_friction(self, friction: float | None) -> None:
        """Set the friction of the soles on the floor from now on; None = the individual's own.

        Raises:
            NaoGaitError: It is not from 0 to 10.
        """
        self._friction = Optional(Number(0.0, 10.0)).check("friction", friction)
        self._faults_changed = True

    def truth(self) -> GroundTruth:
        """The exact state now."""
        state, pose = self.state, self.state.pose
        left = SolePose(pose.sole_position[0], pose.sole_rotation[0])
        right = SolePose(pose.sole_position[1], pose.sole_rotation[1])
        return GroundTruth(
            stamp=self.time,
            torso_position=state.torso_position,
            torso_quaternion=state.torso_rotation,
            torso_linear_velocity_in_torso=state.torso_linear_velocity @ state.torso_matrix,
            torso_angular_velocity_in_torso=state.torso_angular_velocity,
            com=pose.com,
            soles=(left, right),
            sole_force=np.array([_normal_force(state, 0), _normal_force(state, 1)]),
            sole_slip=self._slip,
            legs_touch=state.legs_touch,
            joint_position=state.joint_position,
            joint_torque=state.joint_torque,
            torque_saturated=self._limits.saturated(
                state.joint_velocity, state.joint_torque, SATURATED * self._stiffness
            ),
        )

    # -- for the world -----------------------------------------------------------------------------

    def restart(self, time: int, state: TrueState) -> None:
        """Forget commands, pushes and delayed readings; the engine has put the robot at `start`.

        Args:
            time: [ns] now.
            state: The robot at its start.
        """
        self._restarted = time
        self._setpoints.reset(self.start.joint_position - self.individual.joint_zero)
        self.last_command = None
        self._target = self._setpoints.current.copy()
        self._stiffness = 1.0
        self._push_force = np.zeros(3)
        self._push_steps = 0
        self._sensors.reset()
        self._torque_sensors.restart()
        self._force_sensors.restart()
        if self.heat is not None:
            self.heat.restart()
            self._fade(self.heat.state.share)
        self._delay_line.clear()
        self._slip = np.full(2, math.nan)
        for camera in self.cameras:
            camera.restart(time)
        self._record(time, state)

    def new_faults(self) -> tuple[FloatArray, float | None] | None:
        """(n,) torque shares and sole friction; None if unchanged since the last call."""
        if not self._faults_changed:
            return None
        self._faults_changed = False
        return self._torque_share * self._faded, self._friction

    def step_inputs(self) -> Iterator[StepInput]:
        """Input of each physics step of the next control period."""
        for setpoint in self._setpoints.advance(self._target):
            push = self._no_push
            if self._push_steps > 0:
                self._push_steps -= 1
                push = self._push_force
            yield StepInput(setpoint, self._stiffness, push)

    def observe(self, time: int, state: TrueState) -> None:
        """Take the state at the end of a control period, at `time` [ns], and sample the sensors."""
        self._slip = _slip(self.state, state, self._period / _SECOND)
        if self.heat is not None:
            motors = self.heat.step(
                state.joint_torque, state.joint_velocity, self._period / _SECOND
            )
            self._fade(motors.share)
        self._record(time, state)

    def expose(self, render: Render) -> None:
        """Let the cameras expose the images that are due; `render` shows the world as it is now."""
        for camera in self.cameras:
            camera.observe(self.time, self.state, render)

    def _record(self, time: int, state: TrueState) -> None:
        self.time, self.state = time, state
        frame = self._sensors.sample(time, state)
        wrenches = self._force_sensors.read(state.sole_wrench)
        motors = None if self.heat is None else self.heat.state
        velocity = self._sensors.joint_velocity
        effort = self._torque_sensors.read(state.joint_torque)
        self._delay_line.put(time, Reading(frame, velocity, effort, wrenches, motors))


def _normal_force(state: TrueState, side: int) -> float:
    """[N] upwards."""
    x, y, z, *_ = state.sole_wrench[side].tolist()
    across, along, up = state.pose.sole_rotation[side][2].tolist()
    return float(across * x + along * y + up * z)


def _slip(before: TrueState, now: TrueState, period: float) -> FloatArray:
    """(2,) [m/s] speed over the floor of the point of each sole that carries the load.

    NaN for a sole that was not loaded in both states, which are `period` [s] apart.
    """
    slip = [math.nan, math.nan]
    for side in (0, 1):
        _, _, load, along, across, _ = now.sole_wrench[side].tolist()
        if load < LOADED or before.sole_wrench[side][2] < LOADED:
            continue
        turned = now.pose.sole_rotation[side] - before.pose.sole_rotation[side]
        moved = now.pose.sole_position[side] - before.pose.sole_position[side]
        (xx, xy, _), (yx, yy, _), _ = turned.tolist()
        x, y, _ = moved.tolist()
        px, py = -across / load, along / load  # centre of pressure in the sole frame
        slip[side] = math.hypot(x + (xx * px + xy * py), y + (yx * px + yy * py)) / period
    return np.array(slip)


def _start_state(
    body: Body, joint_zero: FloatArray, spec: RobotSpec, ground: tuple[Prism, ...]
) -> StartState:
    """The robot at rest on the floor, with its encoders at the stand pose.

    On uneven ground the robot starts above the highest point under a standing sole.

    Args:
        body: The body of the individual.
        joint_zero: (n,) [rad] encoder offsets of the individual.
        spec: Kind of robot, start state and pose.
        ground: Prisms that rise above the floor.
    """
    joints = spec.robot.stand_pose + joint_zero
    if spec.start_state == "stand":
        pose = body.pose(np.zeros(3), np.eye(3), joints)
        rotation = _upright_rotation(pose.sole_rotation[0][:, 2] + pose.sole_rotation[1][:, 2])
    else:
        half = math.pi / 4.0
        rotation = np.append(math.sin(half) * np.array(_LYING[spec.start_state]), math.cos(half))
    x, y, heading = spec.pose
    if heading:
        rotation = _turned(rotation, heading)
    lowest, _ = body.bounds(rotation_matrix(rotation), joints)
    height = -lowest[2]
    place = np.array([x, y, 0.0])
    if ground:
        height += _highest_under(body, place, rotation_matrix(rotation), joints, ground)
    return StartState(np.array([x, y, height]), rotation, joints)


def _turned(quaternion: FloatArray, heading: float) -> FloatArray:
    """(4,) the rotation followed by one about the vertical by `heading` [rad]."""
    x, y, z, w = quaternion.tolist()
    c, s = math.cos(heading / 2.0), math.sin(heading / 2.0)
    return np.array((c * x - s * y, c * y + s * x, c * z + s * w, c * w - s * z))


def _highest_under(
    body: Body,
    place: FloatArray,
    rotation: FloatArray,
    joints: FloatArray,
    ground: tuple[Prism, ...],
) -> float:
    """[m] height of the ground under the soles of a robot whose torso is above `place` (3,) [m]."""
    pose = body.pose(place, rotation, joints)
    points = [
        position + axes @ point
        for sole, position, axes in zip(
            body.soles, pose.sole_position, pose.sole_rotation, strict=True
        )
        for point in sole.points
    ]
    return max(ground_height(ground, x, y) for x, y, _ in points)


def _upright_rotation(normal: FloatArray) -> FloatArray:
    """(4,) quaternion of the shortest rotation that makes `normal` vertical."""
    x, y, z = normal / np.linalg.norm(normal)
    quaternion = np.array([y, -x, 0.0, 1.0 + z])
    return quaternion / np.linalg.norm(quaternion)
