"""A robot, its gait and an operator, joined by channels that a fault may disturb.

Physics runs in `Simulation`, the gait behind `GaitController` and the robot's ear behind `CommandInput`:
the classes of the two nodes. Only DDS is left out; what it does is a fault too.
"""

from collections.abc import Iterator, Sequence

from gait_lab.analysis.metrics import has_fallen
from gait_lab.faults.channel import Channel, Command, Message
from gait_lab.faults.fault import Fault
from gait_lab.faults.harness import Harness
from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.runtime.diagnostics import reports
from nao_lipm_gait.runtime.inputs import ImuInput, JointInput, LoadInput, TwistInput
from nao_lipm_gait.types import VelocityCommand
from sim_bridge.simulation import Reading, Simulation

DRIVE_TICKS = 10
"""Between two messages of the operator."""
WATCH_TICKS, DIAGNOSE_TICKS = 25, 100
_SECOND = 1_000_000_000


class World(Harness):
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
        super().__init__(simulation, parameters, fault.settings, command)
        self.fault = fault
        self._walk_begins = start
        self._to_gait: Channel[Message] = Channel()
        self._to_robot: Channel[Command] = Channel()
        self._names = list(self.robot.joint_names)
        self.start_gait()

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
            self.truth.torso_position, self.truth.torso_quaternion, self.height
        )
        self._look_after()
        asked_to_walk = self.seconds() > self._walk_begins and not self.command.is_zero
        self.judge.see_tick(self.fallen, [gait.entry for gait in self.gaits], asked_to_walk)

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
        if self.seconds() < self._walk_begins or self.tick % DRIVE_TICKS:
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
            sender, now = command.sender, self.seconds()
            self._ear.admit(sender, now)
            position = targets.position.tolist()
            read, _ = self._ear.read(sender, now, targets.stamp, self._names, position, effort)
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
                self.judge.see_reports(reports(gait.entry.health()))


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
