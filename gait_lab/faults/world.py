"""A robot, its gait and an operator, joined by channels that a fault may disturb.

Physics runs in `Simulation`, the gait behind `GaitEntry` and the robot's ear behind `CommandInput`:
the classes of the two nodes. Only DDS is left out; what it does is a fault too.
"""

import time
from collections.abc import Iterator, Sequence

import numpy as np

from gait_lab.faults.fault import Fault
from gait_lab.faults.judge import Judge
from gait_lab.faults.wire import Channel, Command, Message
from gait_lab.metrics import has_fallen
from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.robot_description import RobotDescription
from nao_lipm_gait.ros.gait_entry import GaitEntry, Others
from nao_lipm_gait.ros.health import Level, reports
from nao_lipm_gait.ros.inputs import ImuInput, JointInput, LoadInput, TwistInput
from nao_lipm_gait.signals import GaitStatus, JointTargets, VelocityCommand
from sim_bridge.command_input import CommandInput
from sim_bridge.simulation import GroundTruth, Reading, Simulation

PERIOD = 0.01
"""[s] of a tick."""
DRIVE_TICKS = 10
"""Between two messages of the operator."""
WATCH_TICKS, DIAGNOSE_TICKS = 25, 100
RESET_SILENCE = 60
"""Ticks without sensors after a reset, as in the bridge."""
_SECOND = 1_000_000_000


class LiveGait:
    """One gait process, as far as the world can tell."""

    def __init__(self, world: "World", name: str) -> None:
        self.name = name
        self._world = world
        self.entry = GaitEntry(
            world.robot, world.parameters, world.fault.settings, self, world.seconds
        )
        self.sent: list[JointTargets] = []

    def command(self, targets: JointTargets) -> None:
        self.sent.append(targets)
        self._world.judge.see_command(self, targets)

    def status(self, status: GaitStatus) -> None:
        pass

    def log(self, level: Level, text: str) -> None:
        pass

    def receive(self, message: Message) -> None:
        """Take a message; the judge looks at how long that took."""
        before = time.thread_time()
        self.entry.receive(message.topic, lambda: message.content)
        self._world.judge.see_duration(message.topic, time.thread_time() - before)


class World:
    """Steps everything by one control period at a time."""

    def __init__(
        self,
        simulation: Simulation,
        parameters: GaitParameters,
        fault: Fault,
        command: VelocityCommand,
        start: float = 1.0,
    ) -> None:
        """command: what the operator asks for, from `start` [s] on."""
        self.simulation = simulation
        self.robot: RobotDescription = simulation.robot
        self.parameters = parameters
        self.tick = 0
        self.fault = fault
        self.command = command
        self.truth: GroundTruth = simulation.truth()
        self.gaits: list[LiveGait] = []
        self.others = Others()
        self.fallen = False
        self.walk_begins = start
        self._height = float(self.truth.torso_position[2])
        self._to_gait: Channel[Message] = Channel()
        self._to_robot: Channel[Command] = Channel()
        self._ear = CommandInput(self.robot)
        self._targets: JointTargets | None = None
        self._sent: Reading | None = None
        self._silent_until = 0
        self._names = list(self.robot.joint_names)
        self._births = 0
        self.judge = Judge(self)
        self.start_gait()

    def seconds(self) -> float:
        """[s] since the start."""
        return self.tick * PERIOD

    # -- what a fault may do -----------------------------------------------------------------------

    def start_gait(self) -> LiveGait:
        """One more gait process."""
        self._births += 1
        gait = LiveGait(self, f"gait_{self._births}")
        self.gaits.append(gait)
        return gait

    def kill_gait(self) -> None:
        """End the first gait without a word; what it sent is still under way."""
        del self.gaits[0]

    def reset_robot(self) -> None:
        """As the bridge's service: back to the start, the clock goes on, silence for a while."""
        self.simulation.reset()
        self._ear.reset(self.simulation.time)
        self._targets = self._sent = None
        self._silent_until = self.tick + RESET_SILENCE
        self.fallen = False
        self.judge.robot_was_reset()

    def restart_robot(self, ticks: int) -> None:
        """As if the bridge were killed and started again: nobody remembers who commanded."""
        self.reset_robot()
        self._ear = CommandInput(self.robot)
        self._silent_until = self.tick + ticks

    def disturb_robot(self, force: np.ndarray) -> None:
        """A force (3,) [N] on the torso during the next tick."""
        self.simulation.push(force, PERIOD)

    # -- the tick ----------------------------------------------------------------------------------

    def run(self, ticks: int) -> None:
        for _ in range(ticks):
            self.step()

    def step(self) -> None:
        self.tick += 1
        self.fault.act(self)
        self.simulation.step(self._targets)
        self._feel()
        self._drive()
        for message in self._to_gait.take(self.tick):
            for gait in tuple(self.gaits):
                gait.receive(message)
        for gait in self.gaits:
            sent, gait.sent = gait.sent, []
            for targets in sent:
                command = Command(gait.name, targets)
                for delay, changed in self.fault.commands(self, command):
                    self._to_robot.put(self.tick + delay, changed)
        for command in self._to_robot.take(self.tick):
            self._obey(command)
        self.truth = self.simulation.truth()
        self.fallen = has_fallen(
            self.truth.torso_position, self.truth.torso_quaternion, self._height
        )
        self._look_after()
        self.judge.see_tick()

    def _feel(self) -> None:
        """The robot publishes what it feels, IMU first."""
        reading = self.simulation.read()
        if reading is None or reading is self._sent or self.tick < self._silent_until:
            return
        self._sent = reading
        loads = any(gait.entry.wants_loads for gait in self.gaits)
        soles = self.robot.sole_frames if loads else ()
        for message in messages(reading, self._names, soles):
            for delay, changed in self.fault.sensors(self, message):
                self._to_gait.put(self.tick + delay, changed)

    def _drive(self) -> None:
        if self.seconds() < self.walk_begins or self.tick % DRIVE_TICKS:
            return
        asked = self.command
        message = Message("cmd_vel", TwistInput((asked.x, asked.y, 0.0), (0.0, 0.0, asked.yaw)))
        for delay, changed in self.fault.drive(self, message):
            self._to_gait.put(self.tick + delay, changed)

    def _obey(self, command: Command) -> None:
        targets = command.targets
        each = targets.joint_stiffness
        effort = [targets.stiffness] * len(self._names) if each is None else each.tolist()
        try:
            self._ear.admit(command.sender, self.seconds())
            read, _ = self._ear.read(targets.stamp, self._names, targets.position.tolist(), effort)
        except NaoGaitError:
            return  # the bridge warns and goes on
        if read is not None:
            self._targets = read

    def _look_after(self) -> None:
        for gait in self.gaits:
            if self.tick % WATCH_TICKS == 0:
                gait.entry.fenced("watchdog", gait.entry.watch)
            if self.tick % DIAGNOSE_TICKS == 0:
                gait.entry.see_others(self.others)
                self.judge.see_reports(gait, reports(gait.entry.health()))

    @property
    def height(self) -> float:
        """[m] of the torso over the floor while standing."""
        return self._height


def messages(reading: Reading, names: list[str], soles: Sequence[str]) -> Iterator[Message]:
    """What the bridge publishes of one reading, as far as a gait listens."""
    frame = reading.frame
    sec, nanosec = divmod(frame.stamp, _SECOND)
    wx, wy, wz = frame.angular_velocity.tolist()
    ax, ay, az = frame.linear_acceleration.tolist()
    yield Message("imu/data", ImuInput(sec, nanosec, (wx, wy, wz), (ax, ay, az)))
    position, velocity = frame.joint_position.tolist(), frame.joint_velocity.tolist()
    yield Message("joint_states", JointInput(sec, nanosec, names, position, velocity))
    for side, frame_name in enumerate(soles):
        force = float(reading.sole_wrench[side][2])
        yield Message(f"{frame_name}/wrench", LoadInput(sec, nanosec, side, force))
