"""A robot behind LoLA's socket, `lola_bridge`'s driver and a gait, in one process and without ROS.

The parts are those that ship: socket and body of `lola_server`, driver, gait behind its checks.
Time is counted in frames.
"""

import math
import select
import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Protocol

import msgpack
import numpy as np

from lola_bridge import driver as driver_module
from lola_bridge.codec import (
    JOINTS,
    LolaCommand,
    LolaSensors,
    decode_sensors,
    encode_sensors,
)
from lola_bridge.driver import Driver, DriverSettings
from lola_bridge.link import (
    PACKET_BYTES,
    SETTINGS,
    SensorPacket,
    address,
    pack_command,
    unpack_from_driver,
)
from lola_bridge.safety import Mode, SafetySettings
from lola_frames import LOWER, MAP, ROBOT, SAFETY, SPEED, STAND, UPPER, sensors
from nao_lipm_gait.presets import DEFAULT, preset_for
from nao_lipm_gait.runtime.controller import ControllerSettings, GaitController
from nao_lipm_gait.runtime.inputs import ImuInput, JointInput, LoadInput, TwistInput
from robot_core.log import LogLine
from robot_core.types import GRAVITY, GaitState
from sim_bridge.lola.body import HOLD_CYCLES, LolaBody
from sim_bridge.lola.server import LolaSocket
from sim_bridge.plant import load_plant
from sim_bridge.world import World

PERIOD = 0.012
ROUNDING = 1e-5
"""[rad] of a float32."""
SETTINGS_OF_BRIDGE = replace(
    SAFETY, stiffness_ramp=0.3, silence_time=0.12, sit_time=0.8
)  # what a user has, but quicker
SPEED_AHEAD = 0.15
"""[m/s] that is commanded."""


class Body(Protocol):
    """A robot: frames out, commands in."""

    def sensors(self) -> LolaSensors | None:
        """The frame of this cycle."""
        ...

    def command(self, command: LolaCommand | None) -> None:
        """Take what has come in this cycle, and let a period pass."""
        ...

    @property
    def lies(self) -> bool:
        """Whether it has fallen."""
        ...


class ObedientBody:
    """A robot whose joints are where they were told to be; a limp one stays where it is."""

    lies = False

    def __init__(self) -> None:
        self._position, self.stiffness = list(STAND), [0.0] * len(JOINTS)
        self._silent = self._frames = 0

    def sensors(self) -> LolaSensors:
        """Upright and at rest, with a little noise."""
        self._frames += 1
        noise = 1e-3 * (-1) ** self._frames + 1e-4 * math.sin(self._frames)
        return sensors(
            position=self._position, stiffness=self.stiffness, gyroscope=[noise] * 3,
            accelerometer=[noise, noise, noise - GRAVITY],
        )  # fmt: skip

    def command(self, command: LolaCommand | None) -> None:
        """Obey; without commands hold the last one, then go limp, as `LolaBody` does."""
        self._silent = self._silent + 1 if command is None else 0
        if self._silent > HOLD_CYCLES:
            self.stiffness = [0.0] * len(JOINTS)
        if command is None or command.position is None or command.stiffness is None:
            return
        self.stiffness = list(command.stiffness)
        self._position = [
            target if share > 0.0 else now
            for now, target, share in zip(
                self._position, command.position, self.stiffness, strict=True
            )
        ]


class ServedBody:
    """The simulated robot of `lola_server`."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._body = LolaBody(world.robot, PERIOD)
        self.stiffness = [0.0] * len(JOINTS)

    def sensors(self) -> LolaSensors | None:
        """As the server reads them."""
        return self._body.sensors()

    def command(self, command: LolaCommand | None) -> None:
        """As the server obeys."""
        self._body.command(command)
        self._world.step()
        found = self._body.sensors()
        if found is not None:
            self.stiffness = list(found.stiffness)

    def push(self, force: float) -> None:
        """Push it to the left [N] for 0.1 s."""
        self._world.robot.push(np.array((0.0, force, 0.0)), 0.1)

    def weaken(self, joint: str) -> None:
        """Take the torque of a motor away."""
        self._world.robot.weaken(joint, 0.0)

    @property
    def lies(self) -> bool:
        """By the truth: tilted by more than 60 deg."""
        x, y, _, _ = self._world.robot.truth().torso_quaternion.tolist()
        return 1.0 - 2.0 * (x * x + y * y) < 0.5


class Node:
    """The node's end of the driver's link, and a gait that walks ahead while it is `driven`."""

    def __init__(self, settings: DriverSettings, seconds: Any) -> None:
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._socket.connect(address(settings.socket))
        self._socket.setblocking(False)
        self.send(SETTINGS + settings.to_json().encode())
        self.gait = GaitController(
            ROBOT, preset_for(ROBOT, DEFAULT), ControllerSettings(PERIOD, bias_wait=0.0), seconds
        )
        self.mode = Mode.LIMP
        self.frames = 0
        self.driven = True
        self.turned_away = False
        self.log: list[str] = []

    def send(self, packet: bytes) -> None:
        """Send a packet, if the driver still listens."""
        with suppress(OSError):
            self._socket.send(packet)

    def close(self) -> None:
        """As a process that is killed."""
        self._socket.close()

    def read(self) -> Iterator[SensorPacket]:
        """The frames that the driver has sent; its log is kept."""
        while True:
            try:
                packet = self._socket.recv(PACKET_BYTES)
            except OSError:
                return
            if not packet:
                self.turned_away = True
                return
            message = unpack_from_driver(packet)
            if isinstance(message, LogLine):
                self.log.append(message.text)
            else:
                self.mode = message.status.mode
                self.frames += 1
                yield message

    def answer(self, stamp: int, found: LolaSensors) -> tuple[list[float], list[float]] | None:
        """Position and stiffness (25,) with which the gait answers a frame."""
        gait = self.gait
        gait.note_motors(self.mode is Mode.ACTIVE)
        sec, nanosec = divmod(stamp, 1_000_000_000)
        if self.driven and self.frames % 8 == 0:
            self._hear("cmd_vel", TwistInput((SPEED_AHEAD, 0.0, 0.0), (0.0, 0.0, 0.0)))
        x, y, z = found.accelerometer
        turn = tuple(found.gyroscope)
        self._hear("imu/data", ImuInput(sec, nanosec, turn, (-x, -y, -z)))
        joints = JointInput(sec, nanosec, MAP.names, MAP.measured(found.position))
        targets = self._hear("joint_states", joints)
        if gait.needs_loads:
            for side in (0, 1):
                load = GRAVITY * sum(found.fsr[4 * side : 4 * side + 4])
                frame = f"{ROBOT.sole_frames[side]}/wrench"
                self._hear(frame, LoadInput(sec, nanosec, side, load))
        if targets is None:
            return None
        each = targets.joint_stiffness
        shares = [targets.stiffness] * len(targets.position) if each is None else each.tolist()
        return MAP.from_gait(targets.position), MAP.from_gait(shares)

    def _hear(self, topic: str, message: Any) -> Any:
        output = self.gait.receive(topic, lambda: message)
        self.log += [line.text for line in output.log]
        return output.answers[-1].targets if output.answers else None


class Fault:
    """What is wrong in a cycle; this one is nothing. `time` [s] counts from its begin."""

    def frame(self, found: LolaSensors, time: float) -> LolaSensors:
        """The sensors as they are sent."""
        return found

    def data(self, frame: bytes, time: float) -> bytes | None:
        """The bytes as they are sent; None sends nothing."""
        return frame

    def command(
        self, stamp: int, position: list[float], stiffness: list[float], time: float
    ) -> bytes | None:
        """The packet with which the node answers; None for no answer."""
        return pack_command(stamp, position, stiffness)

    def act(self, chain: "Chain", time: float) -> None:
        """Do something else at the begin of a cycle."""


@dataclass
class Chain:
    """Robot, driver and node.

    Attributes:
        now: Time [s].
        fault: What is wrong, from `begin` on; None before.
        sent: Commands that the robot has got, the last one of each cycle; None without one.
    """

    body: Any
    settings: DriverSettings
    listener: socket.socket
    now: float = 100.0
    wall_ahead: float = 0.0
    fault: Fault | None = None
    begin: float = math.inf
    hangs_until: float = 0.0
    frozen_until: float = 0.0
    driver_is_killed: bool = False
    sent: list[LolaCommand | None] = field(default_factory=list)
    log: list[tuple[float, str]] = field(default_factory=list)
    node: Node | None = None
    others: list[Node] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.driver = Driver(
            self.settings, self.listener, clock=lambda: self.now,
            wall=lambda: round((self.now + self.wall_ahead) * 1e9),
        )  # fmt: skip
        self.before = np.array(STAND), np.zeros(len(JOINTS))
        self.listens = False
        self.listen()

    def listen(self) -> None:
        """Make LoLA's socket."""
        self.server, self.listens = LolaSocket(self.settings.socket), True

    def close_lola(self) -> None:
        """Close LoLA's socket."""
        self.server.close()
        self.listens = False

    def attach(self) -> None:
        """Start a node."""
        self.node = Node(self.settings, lambda: self.now)

    def close(self) -> None:
        """Close every socket."""
        for node in (self.node, *self.others):
            if node is not None:
                node.close()
        self.driver.close()
        if self.listens:
            self.close_lola()

    @property
    def gait_state(self) -> GaitState:
        """What the gait does."""
        assert self.node is not None
        return self.node.gait.state

    def run(self, seconds: float) -> None:
        """Let cycles pass."""
        for _ in range(round(seconds / PERIOD)):
            self.cycle()

    def cycle(self) -> None:
        """One frame, its answer, and a period of the robot."""
        fault = Fault() if self.fault is None else self.fault
        time = self.now - self.begin
        fault.act(self, time)
        found = self.body.sensors()
        data = None
        if found is not None:
            changed = fault.frame(found, time)
            data = fault.data(_encoded(changed), time)
        frozen = self.now < self.frozen_until
        if data is not None and self.listens and not frozen:
            self.server.send(data)
        if not self.driver_is_killed and not frozen and self.now >= self.hangs_until:
            self._serve(fault, time)
        commands = self.server.wait(0.0) if self.listens else []
        command = commands[-1] if commands else None
        for each in commands:
            self.check(each)
        self.sent.append(command)
        self.body.command(command)
        self.now += PERIOD

    def _serve(self, fault: Fault, time: float) -> None:
        """Let the driver take a frame, the node answer it, and the driver send the answer."""
        self.driver.serve()
        self._answer(fault, time)
        self.driver.serve()
        start = self.now
        self.now += driver_module.ANSWER_SHARE * PERIOD  # a frame whose answer does not come
        self.driver.serve()
        self.now = start
        self._answer(fault, time)

    def _answer(self, fault: Fault, time: float) -> None:
        if self.node is None:
            return
        for packet in self.node.read():
            answer = self.node.answer(packet.stamp, decode_sensors(packet.sensors))
            reply = None if answer is None else fault.command(packet.stamp, *answer, time)
            if reply is not None:
                self.node.send(reply)
        self.log += [(self.now, text) for text in self.node.log]
        self.node.log.clear()

    def check(self, command: LolaCommand) -> None:
        """No command is beyond a limit, whatever happens."""
        assert command.position is not None
        assert command.stiffness is not None
        position, stiffness = np.array(command.position), np.array(command.stiffness)
        assert (position >= np.array(LOWER) - ROUNDING).all()
        assert (position <= np.array(UPPER) + ROUNDING).all()
        assert ((stiffness >= 0.0) & (stiffness <= 1.0)).all()
        assert not stiffness[~np.array(MAP.driven)].any()
        before, stiffness_before = self.before
        held = (stiffness > 0.06) & (stiffness_before > 0.06)
        allowed = np.array(SPEED) * PERIOD + ROUNDING
        assert (np.abs(position - before)[held] <= allowed[held]).all()
        self.before = position, stiffness


def _encoded(found: LolaSensors) -> bytes:
    """The bytes of a frame; what is no number goes in after the encoder, which would refuse it."""
    arrays = {
        name: [float(each) for each in getattr(found, name)]
        for name in found._fields if name not in ("status", "robot_config")
    }  # fmt: skip
    known = {
        name: [each if math.isfinite(each) else 0.0 for each in values]
        for name, values in arrays.items()
    }
    message = encode_sensors(found._replace(**known))
    if known == arrays:
        return message
    content = msgpack.unpackb(message)
    for key in content:
        content[key] = arrays.get(key.lower(), content[key])
    changed: bytes = msgpack.packb(content, use_single_float=True)
    return changed


@contextmanager
def chain(
    folder: Path, kind: str, safety: SafetySettings = SETTINGS_OF_BRIDGE, engine: str = "mujoco"
) -> Iterator[Chain]:
    """A chain whose robot is `frames` (obedient) or `server` (simulated); nothing has run."""
    path = str(folder / "lola")
    settings = DriverSettings(path, False, safety)
    select_before = driver_module.select
    driver_module.select = SimpleNamespace(
        select=lambda r, w, x, _timeout: select.select(r, w, x, 0.0)
    )
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    listener.bind(address(path))
    listener.listen(1)
    world = None
    made = None
    try:
        if kind == "server":
            world = World.single(
                ROBOT, load_plant("reference"), robot_seed=0, engine=engine, control_period=PERIOD,
                sensor_delay=3 * PERIOD,
            )  # fmt: skip
        body = ObedientBody() if world is None else ServedBody(world)
        made = Chain(body, settings, listener)
        yield made
    finally:
        driver_module.select = select_before
        if made is not None:
            made.close()
        listener.close()
        if world is not None:
            world.close()
