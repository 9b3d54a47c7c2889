"""A simulated robot, its gaits and an operator in one process, with faults on the way between them.

The classes are those behind the two ROS nodes: `World` and `CommandInput` of the bridge,
`GaitController` of the gait. Only DDS is missing; what it can do to a message is a fault too.
"""

import math
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np

from gait_lab.channel import Channel
from gait_lab.faults.invariants import Invariants
from gait_lab.faults.messages import Command, Delivery, Message
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.runtime.controller import ControllerSettings, GaitController, Output
from nao_lipm_gait.runtime.inputs import ImuInput, JointInput, LoadInput, TwistInput
from nao_lipm_gait.runtime.reporter import PublisherCounts
from robot_core.command_input import CommandInput
from robot_core.errors import NaoGaitError
from robot_core.robot import RobotDescription
from robot_core.types import GaitStatus, JointTargets, VelocityCommand
from sim_bridge.robot import GroundTruth, Reading
from sim_bridge.trials.trial import Tick, run_responder
from sim_bridge.world import World

PERIOD = 0.01
"""Control period [s]: the length of a tick."""
RESET_SILENCE = 60
"""Ticks without sensor messages after a reset, as in the bridge."""
VELOCITY_TICKS = 10
"""Ticks between two velocity commands of the operator."""
WATCHDOG_TICKS, DIAGNOSTICS_TICKS = 25, 100
"""Ticks between two runs of the gait's timers."""
ROBOTS = 100
"""Number of individuals from which a run draws its robot."""
_SECOND = 1_000_000_000


class Timed(Protocol):
    """Where a fault acts."""

    def seconds(self) -> float:
        """Time since the start [s]."""
        ...


class Fault:
    """A disturbance of the robot, the gait, the operator, or of the messages between them.

    This base class disturbs nothing. A subclass overrides the methods of what it disturbs, and
    `_draw`, in which it draws its random properties.

    Attributes:
        why: Why robots fall, for the table; empty if they do not.
        end: Duration of a run [s].
        settings: ControllerSettings of the gait; a fault for comparison may replace them.
        says: Parts of the warnings that explain a stop by this fault; used by the scopes `soccer`
            and `robot`.
        span: Shortest and longest time [s] of a fault that ends by itself; log-uniform.
        begin: Time at which the fault begins [s]; the robot walks by then.
        duration: Time for which it acts [s].
    """

    why = ""
    end = 6.0
    settings = ControllerSettings()
    says: tuple[str, ...] = ()
    span: tuple[float, float] | None = None
    duration = math.inf

    def __init__(self, random: np.random.Generator) -> None:
        self.random = random
        self.begin = float(random.uniform(2.0, 3.0))
        if self.span is not None:
            self.duration = float(np.exp(random.uniform(*np.log(self.span))))
        self._draw(random)

    def _draw(self, random: np.random.Generator) -> None:
        pass

    def individual(self, seed: int) -> int:
        """Seed of the robot in the run with this seed; drawn after the command."""
        return int(self.random.integers(ROBOTS))

    def active(self, harness: Timed) -> bool:
        """Whether the fault acts in this tick."""
        return self.begin <= harness.seconds() < self.begin + self.duration

    def explained_by(self, warning: str) -> bool:
        """Whether a warning explains a stop by this fault."""
        return any(part in warning for part in self.says)

    def coasts(self, harness: Timed) -> bool:
        """Whether gaits without sensors may walk on in this tick; by default they may."""
        return True

    def before_physics(self, harness: "Harness") -> None:
        """Disturb the robot or the processes before the physics of a tick."""

    def on_sensor(self, harness: "Harness", message: Message) -> Iterable[Delivery[Message]]:
        """Return what arrives at the gaits of one sensor message."""
        yield Delivery(0, message)

    def on_velocity(self, harness: "Harness", message: Message) -> Iterable[Delivery[Message]]:
        """Return what arrives at the gaits of one velocity command of the operator."""
        yield Delivery(0, message)

    def on_command(self, harness: "Harness", command: Command) -> Iterable[Delivery[Command]]:
        """Return what arrives at the robot of one joint command of a gait."""
        yield Delivery(0, command)


class TemporaryFault(Fault):
    """A fault that ends by itself."""

    span = (0.05, 2.0)


class WatchedGait:
    """Collects the commands of its gait, sent under its name, and shows them to the invariants."""

    def __init__(
        self,
        name: str,
        robot: RobotDescription,
        parameters: GaitParameters,
        settings: ControllerSettings,
        invariants: Invariants,
        seconds: Callable[[], float],
    ) -> None:
        self.name = name
        self._invariants = invariants
        self._seconds = seconds
        self.controller = GaitController(robot, parameters, settings, seconds)
        self._answered = False
        self._commands: list[JointTargets] = []

    def take_commands(self) -> list[JointTargets]:
        """Return the commands since the last call."""
        commands, self._commands = self._commands, []
        return commands

    def receive(self, message: Message) -> None:
        """Process a message; check its answers and the processor time that it took."""
        before = time.thread_time()
        content = message.content
        if isinstance(content, JointInput):
            content = replace(content, arrived=round(self._seconds() * 1e9))
        output = self.controller.receive(message.topic, lambda: content)
        self._invariants.check_duration(message.topic, time.thread_time() - before)
        self._keep(output)

    def end_period(self) -> None:
        """Nothing more arrives in this control period: without an answer, the gait walks on."""
        if not self._answered:
            self._keep(self.controller.overdue())
        self._answered = False

    def _keep(self, output: Output) -> None:
        self._answered |= bool(output.answers)
        for targets, status, _ in output.answers:
            state = self.controller.state if status is None else status.state
            self._invariants.check_command(self.name, state, targets)
            self._commands.append(targets)


class Harness:
    """Steps the robot, its gaits, the operator and a fault by one control period at a time.

    It is the `Responder` of a trial: see `run_responder`. The caller closes the world.

    Attributes:
        command: Velocity that the operator commands from `walk_start` [s] on; may be replaced.
        gaits: Running gait processes, oldest first.
        height: Height of the torso over the floor while standing [m].
        obeyed: Name of the gait whose command the robot executed last.
        targets: Targets of the motors for the next tick; None holds the last ones.
        status: Status of the oldest gait; None without one.
    """

    def __init__(
        self,
        world: World,
        parameters: GaitParameters,
        fault: Fault,
        command: VelocityCommand,
        walk_start: float = 1.0,
    ) -> None:
        self.world = world
        self.robot: RobotDescription = world.robot.description
        self.parameters = parameters
        self.fault = fault
        self.command = command
        self.tick = 0
        self.truth: GroundTruth = world.robot.truth()
        self.gaits: list[WatchedGait] = []
        self.publishers = PublisherCounts()
        self.fallen = False
        self.height = float(self.truth.torso_position[2])
        self.invariants = Invariants(self.robot, self.seconds)
        self.obeyed: str | None = None
        self._walk_start = walk_start
        self._started_gaits = 0
        self._joint_names = list(self.robot.joint_names)
        self._command_input = CommandInput(self.robot)
        self.targets: JointTargets | None = None
        self.status: GaitStatus | None = None
        self._published: Reading | None = None
        self._silent_until = self._runs_from = 0
        self._to_gait: Channel[Message] = Channel()
        self._to_robot: Channel[Command] = Channel()
        self.start_gait()
        self._ticks = run_responder(
            world, self, lambda _world, _tick: self.fault.before_physics(self), past_falls=True
        )
        next(self._ticks)

    def seconds(self) -> float:
        """Time since the start [s]."""
        return self.tick * PERIOD

    # -- what a fault may do -----------------------------------------------------------------------

    def start_gait(self) -> WatchedGait:
        """Start one more gait process."""
        self._started_gaits += 1
        gait = WatchedGait(
            f"gait_{self._started_gaits}", self.robot, self.parameters, self.fault.settings,
            self.invariants, self.seconds,
        )  # fmt: skip
        self.gaits.append(gait)
        return gait

    def kill_gait(self) -> None:
        """End the oldest gait at once; its last commands still arrive."""
        del self.gaits[0]

    def reset_robot(self) -> None:
        """Reset the robot as the service of the bridge does: the clock continues."""
        self.world.reset()
        self._command_input.reset(self.world.time)
        self.targets = self._published = None
        self._silent_until = self.tick + RESET_SILENCE
        self.fallen = False
        self.invariants.robot_was_reset()

    def restart_robot(self, silence: int) -> None:
        """Restart the bridge with a new command input; it does not run for `silence` ticks."""
        self.reset_robot()
        self._command_input = CommandInput(self.robot)
        self._silent_until = self._runs_from = self.tick + silence

    def push_robot(self, force: np.ndarray) -> None:
        """Apply a force (3,) [N] in the world frame to the torso during the next tick."""
        self.world.robot.push(force, PERIOD)

    # -- one tick ----------------------------------------------------------------------------------

    def run(self, ticks: int) -> None:
        """Step `ticks` times."""
        for _ in range(ticks):
            self.step()

    def step(self) -> None:
        """Advance everything by one control period."""
        self.tick += 1
        state = next(self._ticks)
        self.truth, self.fallen = state.truth, state.fallen
        self._run_timers()
        asked_to_walk = self.seconds() > self._walk_start and not self.command.is_zero
        controllers = [gait.controller for gait in self.gaits]
        self.invariants.check_tick(self.fallen, controllers, asked_to_walk)

    def respond(self, tick: Tick) -> bool:
        """Deliver the messages of a tick to the gaits, and their commands to the robot."""
        self._publish_sensors()
        self._publish_velocity()
        for message in self._to_gait.receive(self.tick):
            for gait in tuple(self.gaits):
                gait.receive(message)
        for gait in self.gaits:
            if self.fault.coasts(self):
                gait.end_period()
            for targets in gait.take_commands():
                for delay, command in self.fault.on_command(self, Command(gait.name, targets)):
                    self._to_robot.send(self.tick + delay, command)
        for command in self._to_robot.receive(self.tick):
            self._execute(command)
        self.status = self.gaits[0].controller.last_status if self.gaits else None
        return True

    def _publish_sensors(self) -> None:
        reading = self.world.robot.read()
        if reading is None or reading is self._published or self.tick < self._silent_until:
            return
        self._published = reading
        loads = any(gait.controller.needs_loads for gait in self.gaits)
        soles = self.robot.sole_frames if loads else ()
        for message in sensor_messages(reading, self._joint_names, soles):
            for delay, changed in self.fault.on_sensor(self, message):
                self._to_gait.send(self.tick + delay, changed)

    def _publish_velocity(self) -> None:
        if self.seconds() < self._walk_start or self.tick % VELOCITY_TICKS:
            return
        twist = TwistInput((self.command.x, self.command.y, 0.0), (0.0, 0.0, self.command.yaw))
        for delay, changed in self.fault.on_velocity(self, Message("cmd_vel", twist)):
            self._to_gait.send(self.tick + delay, changed)

    def _execute(self, command: Command) -> None:
        """Check a joint command as the bridge does, and take its targets."""
        if self.tick < self._runs_from:
            return  # there is no bridge
        targets, names = command.targets, self._joint_names
        each = targets.joint_stiffness
        effort = [targets.stiffness] * len(names) if each is None else each.tolist()
        now = self.seconds()
        try:
            self._command_input.admit(command.sender, now)
            position = targets.position.tolist()
            accepted, _ = self._command_input.read(
                command.sender, now, targets.stamp, names, position, effort
            )
        except NaoGaitError:
            return  # the bridge warns and continues
        if accepted is not None:
            self.targets = accepted
            self.obeyed = command.sender

    def _run_timers(self) -> None:
        for gait in self.gaits:
            if self.tick % WATCHDOG_TICKS == 0:
                gait.controller.watch()
            if self.tick % DIAGNOSTICS_TICKS == 0:
                gait.controller.note_publishers(self.publishers)
                self.invariants.add_reports(gait.controller.reports())


def sensor_messages(
    reading: Reading, joint_names: list[str], sole_frames: Sequence[str]
) -> Iterator[Message]:
    """The messages to which a gait subscribes, the IMU first, with the loads of `sole_frames`."""
    frame = reading.frame
    sec, nanosec = divmod(frame.stamp, _SECOND)
    wx, wy, wz = frame.angular_velocity.tolist()
    ax, ay, az = frame.linear_acceleration.tolist()
    yield Message("imu/data", ImuInput(sec, nanosec, (wx, wy, wz), (ax, ay, az)))
    position, effort = frame.joint_position.tolist(), reading.joint_effort.tolist()
    yield Message("joint_states", JointInput(sec, nanosec, joint_names, position, effort))
    for side, name in enumerate(sole_frames):
        force = float(reading.sole_wrench[side][2])
        yield Message(f"{name}/wrench", LoadInput(sec, nanosec, side, force))
