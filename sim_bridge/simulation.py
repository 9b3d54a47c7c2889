"""The simulated robot as the outside sees it: joint targets in, delayed sensor frames out."""

import math
from typing import NamedTuple

import numpy as np

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.robot import RobotDescription
from nao_lipm_gait.types import FloatArray, JointTargets, SensorFrame
from sim_bridge.ball import Ball, BallState, ball_position
from sim_bridge.body import Body
from sim_bridge.delay_line import DelayLine
from sim_bridge.engines.backend import StartState, TrueState
from sim_bridge.engines.registry import make_backend
from sim_bridge.individual import draw_individual
from sim_bridge.motors import Setpoints, TorqueLimits
from sim_bridge.plant import Plant, with_sensors_of
from sim_bridge.sensors import SensorModel
from sim_bridge.soles import sole_points
from sim_bridge.terrain import Prism, ground_height, prisms
from sim_bridge.vectors import rotation_matrix

START_STATES = ("stand", "lying_front", "lying_back")
LOADED = 1.0
"""[N] of normal force from which on a sole counts as loaded."""
SATURATED = 0.95
"""Share of the torque limit from which on a motor counts as saturated: the speed that sets the
limit has changed a little by the end of the step."""
_SECOND = 1_000_000_000


class Reading(NamedTuple):
    """One sensor frame with what the gait does not use but a real robot also reports."""

    frame: SensorFrame
    joint_effort: FloatArray
    """(n,) [N m] motor torques."""
    sole_wrench: tuple[FloatArray, FloatArray]
    """Left, right (6,): force [N] and torque [N m] on the sole, in the sole frame."""


class SolePose(NamedTuple):
    """Where a sole is in the world."""

    position: FloatArray
    """(3,) [m]."""
    rotation: FloatArray
    """(3, 3), sole to world."""


class GroundTruth(NamedTuple):
    """What really happens; for metrics and tests, never for the gait."""

    stamp: int
    """[ns]."""
    torso_position: FloatArray
    """(3,) [m] of the torso link frame in the world."""
    torso_quaternion: FloatArray
    """(4,) x y z w, torso to world."""
    torso_linear_velocity_in_torso: FloatArray
    """(3,) [m/s] of the torso origin, in the torso frame."""
    torso_angular_velocity_in_torso: FloatArray
    """(3,) [rad/s]."""
    com: FloatArray
    """(3,) [m] of the whole body in the world."""
    soles: tuple[SolePose, SolePose]
    """Left, right."""
    sole_force: FloatArray
    """(2,) [N] normal force on the left and the right sole."""
    sole_slip: FloatArray
    """(2,) [m/s] mean sliding speed of the centre of pressure over the last control period; NaN
    of a sole that was not loaded all the time."""
    legs_touch: bool
    """The legs touched each other during the last control period."""
    joint_position: FloatArray
    """(n,) [rad] true angles."""
    joint_torque: FloatArray
    """(n,) [N m]."""
    torque_saturated: int
    """Number of joints whose motor is at its torque limit."""


class Simulation:
    """One individual robot on a floor, stepped by control periods. No threads, no wall clock."""

    def __init__(
        self,
        robot: RobotDescription,
        plant: Plant,
        robot_seed: int = 0,
        noise_seed: int = 0,
        engine: str = "pybullet",
        sensor_delay: float | None = None,
        control_period: float = 0.01,
        gui: bool = False,
        start_state: str = "stand",
        ball: Ball | None = None,
    ) -> None:
        """Args:
        robot_seed: which individual; -1 = the nominal robot.
        noise_seed: of the sensor noise, at least 0.
        sensor_delay: [s]; None = the plant's.
        control_period: [s], a multiple of the plant's physics step.
        gui: open the engine's own window.
        start_state: `stand`, `lying_front` or `lying_back`.
        ball: a ball on the floor; None = none.
        """
        plant = with_sensors_of(plant, robot)
        if start_state not in START_STATES:
            raise NaoGaitError("start_state", start_state, ", ".join(START_STATES))
        if isinstance(noise_seed, bool) or not isinstance(noise_seed, int) or noise_seed < 0:
            raise NaoGaitError("noise_seed", noise_seed, "a whole number from 0")
        delay = plant.sensors.delay if sensor_delay is None else sensor_delay
        if not (math.isfinite(delay) and 0.0 <= delay <= 1.0):
            raise NaoGaitError("sensor_delay", sensor_delay, "0 to 1 s")
        step = _nanoseconds(plant.physics.step)
        self._period = _nanoseconds(control_period) if math.isfinite(control_period) else 0
        if self._period <= 0 or self._period % step:
            raise NaoGaitError(
                "control_period", control_period, f"a multiple of {plant.physics.step} s"
            )
        self.robot = robot
        self.plant = plant
        self.individual = draw_individual(plant, robot, robot_seed)
        self.body = Body(robot, self.individual, sole_points(plant, robot))
        self.ground = prisms(plant.terrain, robot_seed)
        self._start = _start_state(
            robot, self.body, self.individual.joint_zero, start_state, self.ground
        )
        self._step_seconds = plant.physics.step
        substeps = self._period // step
        self._setpoints = Setpoints(robot, plant, self.individual, substeps)
        self._limits = TorqueLimits(robot, plant, self.individual)
        self._sensors = SensorModel(
            plant, self.individual, self.body, noise_seed, self._period / _SECOND
        )
        self._line: DelayLine[Reading] = DelayLine(_nanoseconds(delay))
        self._ball = ball
        self._backend = make_backend(
            engine, robot, plant, self.individual, self.body, gui=gui, ball=ball
        )
        self._time = 0
        self._idle = np.zeros(3)
        self._torque_share = np.ones(len(robot.joint_names))
        self._friction: float | None = None
        self.reset()

    @property
    def time(self) -> int:
        """[ns] since the start; goes on through resets."""
        return self._time

    @property
    def start(self) -> StartState:
        """Where a reset puts the robot."""
        return self._start

    @property
    def control_period(self) -> int:
        """[ns]."""
        return self._period

    def reset(self) -> None:
        """Back to the start state at rest; frames under way are lost, the clock goes on."""
        self._backend.reset(self._start)
        if self._ball is not None and self.ground:
            self.put_ball(self._ball.x, self._ball.y)
        self._setpoints.reset(self._start.joint_position - self.individual.joint_zero)
        self._target = self._setpoints.current.copy()
        self._stiffness: float | FloatArray = 1.0
        self._push_force = np.zeros(3)
        self._push_steps = 0
        self._sensors.reset()
        self._line.clear()
        self._state = self._backend.observe()
        self._slip = np.full(2, math.nan)
        self._record()

    def step(self, targets: JointTargets | None) -> None:
        """One control period; None holds the last targets.

        Setpoints go linearly to the targets, cut at joint limits and joint speeds.
        """
        if targets is not None:
            self._accept(targets)
        for setpoint in self._setpoints.advance(self._target):
            push = self._idle
            if self._push_steps > 0:
                self._push_steps -= 1
                push = self._push_force
            self._backend.step(setpoint, self._stiffness, push)
        self._time += self._period
        before = self._state
        self._state = self._backend.observe()
        self._slip = _slip(before, self._state, self._period / _SECOND)
        self._record()

    def sense(self) -> SensorFrame | None:
        """The newest frame that the delay lets through; None before the first one."""
        reading = self.read()
        return None if reading is None else reading.frame

    def read(self) -> Reading | None:
        """Like `sense`, with motor torques and sole wrenches of the same instant."""
        return self._line.newest(self._time)

    def coming(self) -> list[SensorFrame | None]:
        """What `sense` gives now and after each of the next control periods, as far as it has been
        sampled already. For a delay of four periods these are five frames.
        """
        readings = self._line.coming(self._time, self._period)
        return [None if reading is None else reading.frame for reading in readings]

    def push(self, force: FloatArray, duration: float) -> None:
        """Push the torso at its centre of mass with `force` (3,) [N] in the world frame.

        Begins with the next physics step; a push that is still acting is replaced. `duration` [s]
        is rounded to physics steps, at least one.
        """
        force = np.array(force, dtype=float)
        if force.shape != (3,) or not np.isfinite(force).all():
            raise NaoGaitError("push force", force.tolist(), "three finite numbers [N]")
        if not (math.isfinite(duration) and duration > 0.0):
            raise NaoGaitError("push duration", duration, "more than 0 s")
        self._push_force = force
        self._push_steps = max(1, round(duration / self._step_seconds))

    def weaken(self, joint: str, share: float) -> None:
        """From now on the motor of this joint has a share of its torque, 0 (limp) to 1 (whole).

        Of joints with one motor it is the leader's that counts.
        """
        if joint not in self.robot.joint_names:
            raise NaoGaitError("joint", joint, f"a joint of {self.robot.name}")
        if not 0.0 <= share <= 1.0:
            raise NaoGaitError("torque share", share, "0 to 1")
        self._torque_share[self.robot.index(joint)] = share
        self._disturb()

    def set_friction(self, friction: float | None) -> None:
        """From now on the soles have this friction on the floor; None = the individual's own."""
        if friction is not None and not (math.isfinite(friction) and 0.0 <= friction <= 10.0):
            raise NaoGaitError("friction", friction, "0 to 10")
        self._friction = friction
        self._disturb()

    def _disturb(self) -> None:
        self._limits.weaken(self._torque_share)
        self._backend.disturb(self._torque_share, self._friction)

    def truth(self) -> GroundTruth:
        """The exact state now."""
        state, pose = self._state, self._state.pose
        left = SolePose(pose.sole_position[0], pose.sole_rotation[0])
        right = SolePose(pose.sole_position[1], pose.sole_rotation[1])
        return GroundTruth(
            stamp=self._time,
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

    @property
    def ball(self) -> BallState | None:
        """The ball now; None in a world without one."""
        return self._backend.ball()

    def put_ball(self, x: float, y: float) -> None:
        """Lay the ball at rest on the floor at x, y [m] in the world."""
        if self._ball is None:
            raise NaoGaitError("ball", (x, y), "a place in a world with a ball")
        self._backend.put_ball(ball_position(x, y, self._ball.radius, self.ground))

    def close(self) -> None:
        """Free the engine."""
        self._backend.close()

    def __enter__(self) -> "Simulation":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _accept(self, targets: JointTargets) -> None:
        position = np.array(targets.position, dtype=float)
        if position.shape != self._target.shape or not np.isfinite(position).all():
            raise NaoGaitError(
                "targets.position", position.tolist(), f"{len(self._target)} finite angles [rad]"
            )
        if not 0.0 <= targets.stiffness <= 1.0:
            raise NaoGaitError("targets.stiffness", targets.stiffness, "0 to 1")
        stiffness: float | FloatArray = float(targets.stiffness)
        if targets.joint_stiffness is not None:
            stiffness = _shares(targets.joint_stiffness, len(position))
        self._target, self._stiffness = position, stiffness

    def _record(self) -> None:
        frame = self._sensors.sample(self._time, self._state)
        reading = Reading(frame, self._state.joint_torque, self._state.sole_wrench)
        self._line.put(self._time, reading)


def _shares(stiffness: FloatArray, count: int) -> FloatArray:
    shares = np.array(stiffness, dtype=float)
    if shares.shape != (count,) or not ((shares >= 0.0) & (shares <= 1.0)).all():
        allowed = f"{count} shares, 0 to 1"
        raise NaoGaitError("targets.joint_stiffness", shares.tolist(), allowed)
    return shares


def _nanoseconds(seconds: float) -> int:
    return round(seconds * _SECOND)


def _normal_force(state: TrueState, side: int) -> float:
    """[N] upwards."""
    x, y, z, *_ = state.sole_wrench[side].tolist()
    across, along, up = state.pose.sole_rotation[side][2].tolist()
    return float(across * x + along * y + up * z)


def _slip(before: TrueState, now: TrueState, period: float) -> FloatArray:
    """(2,) [m/s]: how fast the point of the sole that carries the load moved over the floor; NaN of
    a sole that was not loaded all the time.
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
        # the point, where the load acts
        px, py = -across / load, along / load
        slip[side] = math.hypot(x + (xx * px + xy * py), y + (yx * px + yy * py)) / period
    return np.array(slip)


def _start_state(
    robot: RobotDescription,
    body: Body,
    joint_zero: FloatArray,
    name: str,
    ground: tuple[Prism, ...],
) -> StartState:
    """At rest on the floor, in the stand pose as this robot believes it to be.

    On what lies on the floor it is set down from above, over the highest point under a standing
    sole.
    """
    joints = robot.stand_pose + joint_zero
    if name == "stand":
        pose = body.pose(np.zeros(3), np.eye(3), joints)
        rotation = _turn_upright(pose.sole_rotation[0][:, 2] + pose.sole_rotation[1][:, 2])
    else:
        half = math.pi / 4.0 if name == "lying_front" else -math.pi / 4.0
        rotation = np.array([0.0, math.sin(half), 0.0, math.cos(half)])
    height = -body.lowest_point(rotation_matrix(rotation), joints)
    if ground:
        height += _highest_under(body, rotation_matrix(rotation), joints, ground)
    return StartState(np.array([0.0, 0.0, height]), rotation, joints)


def _highest_under(
    body: Body, rotation: FloatArray, joints: FloatArray, ground: tuple[Prism, ...]
) -> float:
    """[m] height of the ground under the soles of a robot whose torso is over the origin."""
    pose = body.pose(np.zeros(3), rotation, joints)
    points = [
        position + axes @ point
        for sole, position, axes in zip(
            body.soles, pose.sole_position, pose.sole_rotation, strict=True
        )
        for point in sole.points
    ]
    return max(ground_height(ground, x, y) for x, y, _ in points)


def _turn_upright(normal: FloatArray) -> FloatArray:
    """(4,) quaternion of the shortest turn that brings `normal` upright."""
    x, y, z = normal / np.linalg.norm(normal)
    quaternion = np.array([y, -x, 0.0, 1.0 + z])
    return quaternion / np.linalg.norm(quaternion)
