"""The loop behind every trial: a simulated robot and its gait in lockstep, in one process.

A trial has three parts:

- a world (`make_world`): the robot on its floor, stepped by control periods;
- a `Walker`: the gait, or what walks in its place;
- a `Policy`: what is commanded when, what is disturbed, and when the trial ends.

`run` joins them and yields one `Tick` per control period, the first one at rest:

    with make_world(spec) as world:
        for tick in run(world, make_gait(spec), TimedCommands(task.command_at)):
            ...

One period, from t to t + T, has this order:

1. `policy.disturb(world, tick)`: pushes, faults, a ball. `tick` is the last one, of time t.
2. The world advances to t + T with the last targets.
3. `policy.command(t + T, tick)`: the command for the gait; None ends the trial here.
4. The walker answers the newest frame that has passed the sensor delay; a `JointTargets` in place
   of a command goes to the motors directly, and the walker is not called.
5. The tick of t + T is yielded. The caller may act on the world or the gait before the next one,
   and changes the command of a `HeldCommand`.

An attempt that goes step by step (a kick, a get-up) is a `Trial`, which holds all three. Several
robots: `make_scene_world`, `make_gaits`, `run_several`. A trial whose robot is not driven by one
gait on fresh frames (several processes, lossy channels) implements `Responder` and calls
`run_responder`; `run_responders` is the loop itself.

No ROS, no clock, no threads: a trial depends on its specification alone.
"""

import math
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np

from nao_lipm_gait.calibration import NOT_CALIBRATED, Calibration
from nao_lipm_gait.gait import Gait
from nao_lipm_gait.parameters import GaitParameters
from robot_core.robot import RobotDescription, load_robot
from robot_core.types import STANDSTILL, GaitStatus, JointTargets, SensorFrame, VelocityCommand
from sim_bridge.ball import Ball
from sim_bridge.cameras.camera import CameraSettings
from sim_bridge.plant import Plant, PlantOption, load_plant, with_options
from sim_bridge.robot import GroundTruth, SimulatedRobot
from sim_bridge.scene import Scene
from sim_bridge.trials.compiled import check_fresh
from sim_bridge.trials.metrics import has_fallen, yaw_of
from sim_bridge.world import World

CONTROL_PERIOD = 0.01
"""[s] between two ticks of the gait, unless a trial says otherwise."""
PUSH_DURATION = 0.1
"""[s] for which the force of a push acts."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialSpec:
    """The robot, its plant and its gait: what every trial depends on. Small and picklable.

    Attributes:
        robot_seed: The individual; -1 is the nominal robot.
        noise_seed: Seed of the sensor noise, and of what else a trial draws at random.
        parameters: Parameters of the gait.
        calibration: Known constant errors of the robot's sensors.
        plant: Name or file of the plant.
        plant_options: Replaced options of the plant: (("motor.play", 0.035), ...).
        urdf: Name or file of the robot.
        engine: `pybullet` or `mujoco`.
        urdf_effort: Use the effort limits of the URDF as stall torques, not the motors' own.
        gains: Joint, stiffness [N m/rad] and damping [N m s/rad] of servos, not the robot's own.
        control_period: [s] between two ticks of the gait.
    """

    robot_seed: int = 0
    noise_seed: int = 0
    parameters: GaitParameters = field(default_factory=GaitParameters)
    calibration: Calibration = NOT_CALIBRATED
    plant: str = "reference"
    plant_options: tuple[PlantOption, ...] = ()
    urdf: str = "nao_h21_v33"
    engine: str = "pybullet"
    urdf_effort: bool = False
    gains: tuple[tuple[str, float, float], ...] = ()
    control_period: float = CONTROL_PERIOD

    @property
    def fields(self) -> dict[str, Any]:
        """These, of this trial or one of a more special kind, as arguments for another kind."""
        return {name: getattr(self, name) for name in TrialSpec.__dataclass_fields__}


@lru_cache(maxsize=4)
def loaded_robot(urdf: str) -> RobotDescription:
    """The robot of a URDF, read once per process."""
    return load_robot(urdf)


def make_world(
    spec: TrialSpec,
    *,
    start_state: str = "stand",
    ball: Ball | None = None,
    plant: Plant | None = None,
) -> World:
    """The robot of a trial at rest, at time 0; the caller closes the world.

    Args:
        spec: The trial.
        start_state: One of `sim_bridge.robot.START_STATES`.
        ball: A ball on the floor; None for none.
        plant: In place of that of the specification.
    """
    robot = loaded_robot(spec.urdf)
    return World.single(
        _with_gains(_with_urdf_effort(robot) if spec.urdf_effort else robot, spec.gains),
        with_options(load_plant(spec.plant), spec.plant_options) if plant is None else plant,
        robot_seed=spec.robot_seed,
        noise_seed=spec.noise_seed,
        engine=spec.engine,
        control_period=spec.control_period,
        start_state=start_state,
        ball=ball,
    )


def make_gait(spec: TrialSpec) -> Gait:
    """The gait of a trial; NaoGaitError if its compiled form is out of date."""
    check_fresh()
    robot = loaded_robot(spec.urdf)
    return Gait(robot, spec.parameters, spec.control_period, calibration=spec.calibration)


def make_scene_world(
    scene: Scene, *, plant: str | Plant = "reference", engine: str = "mujoco", noise_seed: int = 0,
    cameras: CameraSettings | None = None, visual: bool = False,
) -> World:
    """The robots of a scene at rest, at time 0; the caller closes the world.

    `noise_seed` is that of the first robot's sensors; the next ones have the seeds after it.
    `visual`: with what can be seen, also without cameras.
    """
    return World.of_scene(
        scene,
        load_plant(plant) if isinstance(plant, str) else plant,
        engine=engine,
        noise_seed=noise_seed,
        control_period=CONTROL_PERIOD,
        cameras=cameras,
        visual=visual,
    )


def make_gaits(world: World) -> list[Gait]:
    """A gait for each robot of the world, with the preset of its kind."""
    check_fresh()
    return [Gait(robot.description) for robot in world.robots]


def _with_urdf_effort(robot: RobotDescription) -> RobotDescription:
    motors = {
        name: motor.replace(stall_torque=robot.limits[name].effort)
        for name, motor in robot.motors.items()
    }
    return replace(robot, motors=motors)


def _with_gains(
    robot: RobotDescription, gains: Sequence[tuple[str, float, float]]
) -> RobotDescription:
    motors = {
        joint: robot.motors[joint].replace(stiffness=stiffness, damping=damping)
        for joint, stiffness, damping in gains
    }
    return replace(robot, motors={**robot.motors, **motors}) if motors else robot


class Walker(Protocol):
    """The gait, or what walks in its place."""

    def step(self, frame: SensorFrame, command: VelocityCommand) -> JointTargets:
        """The targets that answer a frame."""
        ...

    @property
    def status(self) -> GaitStatus:
        """As of the last step."""
        ...


@runtime_checkable
class SeesTruth(Protocol):
    """A walker that is told more than sensors measure: never the gait."""

    def see(self, truth: GroundTruth) -> None:
        """Take the truth at the end of a control period, before the next one."""
        ...


class Tick(NamedTuple):
    """The state at the end of one control period.

    Attributes:
        truth: Ground truth.
        command: What the gait was commanded in this period.
        status: Status of the gait; None before its first frame.
        fallen: The torso is tilted too far or too low.
    """

    truth: GroundTruth
    command: VelocityCommand
    status: GaitStatus | None
    fallen: bool


Action = VelocityCommand | JointTargets | None
"""A command for the gait, or targets for the motors without the gait, or None: the trial ends."""


class Policy:
    """What happens in a trial; the base class commands standing and never ends the trial.

    Attributes:
        looks_ahead: `command` depends on the time alone, and no other requests are made to the
            gait. The walker may then answer several frames in a row before the world is stepped,
            which is faster and gives bit-identical results: frames that the sensor delay still
            holds back cannot change.
    """

    looks_ahead = False

    def disturb(self, world: World, tick: Tick) -> None:
        """Act on the world at the beginning of a control period; `tick` ended the last one."""

    def command(self, time: float, tick: Tick | None) -> Action:
        """What is commanded at increasing times [s] since the start; None ends the trial.

        `tick` is the last complete control period, of `time` - T; None at the start, and always
        None if the policy is `looks_ahead`.
        """
        return STANDSTILL


class HeldCommand(Policy):
    """A command that the caller changes between two ticks."""

    def __init__(self, action: Action = STANDSTILL) -> None:
        self.action = action

    def command(self, time: float, tick: Tick | None) -> Action:
        """The present command."""
        return self.action


@dataclass(frozen=True, slots=True)
class Push:
    """A push at the torso, for `PUSH_DURATION`.

    Attributes:
        time: [s] since the start.
        impulse: [N s]; the force is this over `PUSH_DURATION`.
        direction: [rad] of the force, counter-clockwise from the robot's heading at that moment.
    """

    time: float
    impulse: float
    direction: float

    def force(self, heading: float) -> np.ndarray:
        """(3,) [N] in the world, for a robot with this heading [rad]."""
        size, angle = self.impulse / PUSH_DURATION, heading + self.direction
        return np.array((size * math.cos(angle), size * math.sin(angle), 0.0))


class TimedCommands(Policy):
    """Commands by the time alone, and pushes.

    Args:
        command_at: The command by time since the start [s]; called at increasing times.
        pushes: Pushes, in any order.
        ahead: Whether the walker may answer frames in a row; False if the caller makes
            requests to the gait between two ticks.
    """

    def __init__(
        self,
        command_at: Callable[[float], VelocityCommand],
        pushes: Sequence[Push] = (),
        *,
        ahead: bool = True,
    ) -> None:
        self.looks_ahead = ahead
        self._command_at = command_at
        self._given = pushes
        self._pushes: dict[int, Push] = {}
        self._began: int | None = None

    def disturb(self, world: World, tick: Tick) -> None:
        """Begin the push that is due."""
        if self._began is None:
            self._began = tick.truth.stamp
            period = world.control_period
            self._pushes = {round(each.time * 1e9 / period) * period: each for each in self._given}
        push = self._pushes.get(tick.truth.stamp - self._began)
        if push is not None:
            heading = float(yaw_of(tick.truth.torso_quaternion))
            world.robot.push(push.force(heading), PUSH_DURATION)

    def command(self, time: float, tick: Tick | None) -> Action:
        """The command of this time."""
        return self._command_at(time)


class Responder(Protocol):
    """What drives the robot: a gait on its frames, or gait processes behind lossy channels.

    Attributes:
        command: What was commanded last.
        targets: Targets for the next control period; None holds the last ones.
        status: Status of the gait; None before its first frame.
    """

    command: VelocityCommand
    targets: JointTargets | None
    status: GaitStatus | None

    def respond(self, tick: Tick) -> bool:
        """Renew command, targets and status after the world has advanced.

        `tick` is the period before the advance. False ends the trial.
        """
        ...


def run(
    world: World, walker: Walker, policy: Policy, *, past_falls: bool = False
) -> Iterator[Tick]:
    """Step a world with one robot, and its walker, by control periods; time counts from now.

    Yields:
        The state at rest, then one tick per control period, up to and with a fall (`past_falls`:
        beyond it), or until the policy ends it. Endless otherwise.
    """
    responder = WalkerResponder(world, world.robot, walker, policy)
    return run_responder(world, responder, policy.disturb, past_falls=past_falls)


def run_responder(
    world: World,
    responder: Responder,
    disturb: Callable[[World, Tick], None],
    *,
    past_falls: bool = False,
) -> Iterator[Tick]:
    """The loop of `run` with any responder; `disturb` as that of a policy."""
    for (tick,) in run_responders(
        world, [responder], lambda world, ticks: disturb(world, ticks[0]), past_falls=past_falls
    ):
        yield tick


def run_responders(
    world: World,
    responders: Sequence[Responder],
    disturb: Callable[[World, Sequence[Tick]], None],
    *,
    past_falls: bool = False,
) -> Iterator[tuple[Tick, ...]]:
    """The loop behind every trial, with one responder for each robot of the world, in their order.

    Yields:
        The ticks of all robots, until one responder ends the trial or all robots have fallen
        (`past_falls`: beyond that).
    """
    robots = world.robots
    truths = [robot.truth() for robot in robots]
    heights = [float(truth.torso_position[2]) for truth in truths]
    ticks = tuple(
        Tick(truth, each.command, each.status, False)
        for truth, each in zip(truths, responders, strict=True)
    )
    yield ticks
    while past_falls or not all(tick.fallen for tick in ticks):
        disturb(world, ticks)
        for robot, responder in zip(robots, responders, strict=True):
            robot.command(responder.targets)
        world.step()
        for responder, tick in zip(responders, ticks, strict=True):
            if not responder.respond(tick):
                return
        ticks = tuple(map(_tick, robots, responders, heights))
        yield ticks


def run_several(
    world: World,
    walkers: Sequence[Walker],
    policies: Sequence[Policy],
    disturb: Callable[[World, Sequence[Tick]], None] = lambda world, ticks: None,
) -> Iterator[tuple[Tick, ...]]:
    """Step a world and the walkers of all its robots, past falls, until a policy ends the trial.

    Walkers and policies are in the order of the robots; the policies' own `disturb` is not called.
    """
    robots = zip(world.robots, walkers, policies, strict=True)
    responders = [WalkerResponder(world, *each) for each in robots]
    return run_responders(world, responders, disturb, past_falls=True)


def _tick(robot: SimulatedRobot, responder: Responder, height: float) -> Tick:
    """The end of a control period; `height` [m] of the torso at the start."""
    truth = robot.truth()
    fallen = has_fallen(truth.torso_position, truth.torso_quaternion, height)
    return Tick(truth, responder.command, responder.status, fallen)


class _Answer(NamedTuple):
    """Of the walker to one control period; an error is raised in its period."""

    command: VelocityCommand
    targets: JointTargets | None = None
    status: GaitStatus | None = None
    error: Exception | None = None


class WalkerResponder:
    """A walker on the frames of its robot, one by one or ahead of it (see `Policy.looks_ahead`).

    Ahead, the walker answers all frames that have been sampled already and the world follows with
    as many control periods. Each then works from caches that the other has not emptied.
    """

    def __init__(self, world: World, robot: SimulatedRobot, walker: Walker, policy: Policy) -> None:
        """Ask for the first command; time counts from now."""
        self._world = world
        self._robot = robot
        self._walker = walker
        self._policy = policy
        self._began = world.time
        self._answers: deque[_Answer] = deque()
        self.command = STANDSTILL
        self.targets: JointTargets | None = None
        self.status: GaitStatus | None = None
        # The first frame is answered after the first control period.
        action = policy.command(0.0, None)
        if isinstance(action, JointTargets):
            self.targets = action
        elif action is not None:
            self.command = action

    def respond(self, tick: Tick) -> bool:
        """See `Responder`."""
        if self._policy.looks_ahead:
            if not self._answers:
                self._answer_ahead()
            answer = self._answers.popleft()
            if answer.error is not None:
                raise answer.error
            self.command, self.targets, self.status, _ = answer
            return True
        action = self._policy.command((self._world.time - self._began) * 1e-9, tick)
        if action is None:
            return False
        if isinstance(action, JointTargets):
            self.targets = action
            return True
        self.command = action
        frame = self._robot.sense()
        if frame is None:
            self.targets = None
        else:
            self.targets = self._walker.step(frame, action)
            self.status = self._walker.status
        return True

    def _answer_ahead(self) -> None:
        time, period = self._world.time - self._began, self._world.control_period
        for frame in self._robot.coming():
            command = self._policy.command(time * 1e-9, None)
            if not isinstance(command, VelocityCommand):
                raise TypeError("a timed policy gives velocity commands only")
            if frame is None:
                self._answers.append(_Answer(command))
            else:
                try:
                    targets = self._walker.step(frame, command)
                    self._answers.append(_Answer(command, targets, self._walker.status))
                except Exception as error:
                    self._answers.append(_Answer(command, error=error))
                    break
            time += period


class Trial(AbstractContextManager["Trial"]):
    """A robot with its gait, commanded between two control periods; it goes on past falls.

    Use it as a context manager.

    Args:
        spec: The robot.
        action: What is commanded at first.
        start_state: As for `make_world`.
        ball: As for `make_world`.

    Attributes:
        world: The robot.
        gait: Its gait.
        action: What is commanded from the next period on.
        tick: The last complete control period; at first the state at rest.
        stood: It has not fallen so far.
    """

    def __init__(
        self,
        spec: TrialSpec,
        *,
        action: Action = STANDSTILL,
        start_state: str = "stand",
        ball: Ball | None = None,
    ) -> None:
        self.gait = make_gait(spec)
        self.world = make_world(spec, start_state=start_state, ball=ball)
        self._commands = HeldCommand(action)
        self._ticks = run(self.world, self.gait, self._commands, past_falls=True)
        self.tick = next(self._ticks)
        self.stood = True

    @property
    def action(self) -> Action:
        """What is commanded from the next period on."""
        return self._commands.action

    @action.setter
    def action(self, action: Action) -> None:
        self._commands.action = action

    def step(self) -> Tick:
        """Advance by one control period."""
        self.tick = next(self._ticks)
        self.stood = self.stood and not self.tick.fallen
        return self.tick

    def steps(self, seconds: float) -> Iterator[Tick]:
        """Advance by up to a time [s], one period after the other, as far as the caller asks."""
        for _ in range(round(seconds * 1e9 / self.world.control_period)):
            yield self.step()

    def advance(self, seconds: float) -> Tick:
        """Advance by a time [s]."""
        for _ in self.steps(seconds):
            pass
        return self.tick

    def __exit__(self, *_: object) -> None:
        self.world.close()
