"""The driver between a socket as LoLA has it and a node, in one process."""

import socket
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import pytest

from lola_bridge import driver as driver_module
from lola_bridge.codec import JOINTS, LolaCommand, command_stream, encode_sensors, read_command
from lola_bridge.driver import FAULTS_MAX, RESTART_SILENCE, Driver, DriverSettings
from lola_bridge.link import (
    END,
    PACKET_BYTES,
    SETTINGS,
    SensorPacket,
    address,
    pack_command,
    unpack_from_driver,
)
from lola_bridge.safety import Mode
from lola_frames import CONFIG, SAFETY, STAND, sensors
from robot_core.errors import NaoGaitError
from robot_core.log import LogLine

KNEE = JOINTS.index("LKneePitch")
PAUSE = round(RESTART_SILENCE / SAFETY.period)
STANDING = encode_sensors(sensors(position=STAND))


@dataclass
class Rig:
    """A driver, the robot's end of its socket, and the node's end of its link."""

    settings: DriverSettings
    driver: Driver
    listener: socket.socket
    time: list[float]
    """[s] of the monotonic clock, and by how much the clock of the stamps is ahead of it."""

    def __post_init__(self) -> None:
        self.robot: socket.socket | None = None
        self.parser = command_stream()
        self.answers: list[LolaCommand] = []
        self.frames: list[SensorPacket] = []
        self.log: list[str] = []
        self.node: socket.socket | None = None

    @property
    def now(self) -> float:
        """The time [s]."""
        return self.time[0]

    @now.setter
    def now(self, value: float) -> None:
        self.time[0] = value

    def serve(self, until: Callable[[], object]) -> None:
        """Serve the driver and both ends until something holds."""
        end = time.monotonic() + 600.0  # only ends a hang
        self.read()
        while not until():
            assert time.monotonic() < end, f"timeout; log: {self.log}"
            self.driver.serve()
            self.read()

    def read(self) -> None:
        """Take what the driver has sent."""
        if self.robot is None:
            try:
                self.robot, _ = self.listener.accept()
                self.robot.setblocking(False)
            except BlockingIOError:
                return
        try:
            self.parser.feed(self.robot.recv(65536))
            self.answers += [read_command(found) for found in self.parser]
        except (BlockingIOError, ConnectionResetError):
            pass
        while self.node is not None:
            try:
                packet = self.node.recv(PACKET_BYTES)
            except BlockingIOError:
                break
            if not packet:
                self.node = None
                break
            message = unpack_from_driver(packet)
            self.frames.append(message) if isinstance(message, SensorPacket) else self.hear(message)

    def hear(self, line: LogLine) -> None:
        self.log.append(line.text)

    def attach(self) -> None:
        """Let a node connect."""
        self.node = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.node.connect(address(self.settings.socket))
        self.node.setblocking(False)
        self.node.send(SETTINGS + self.settings.to_json().encode())

    def frame(self) -> bytes:
        """Sensors of a robot whose joints are where they were told to be."""
        position = self.answers[-1].position if self.answers else None
        return STANDING if position is None else encode_sensors(sensors(position=position))

    def cycle(
        self, frame: bytes | None = None, command: bool = False, pieces: int = 1
    ) -> LolaCommand:
        """Send a frame, perhaps answer it as the gait would, and return what the robot gets."""
        assert self.robot is not None
        frame = self.frame() if frame is None else frame
        count, seen = len(self.answers), len(self.frames)
        size = -(-len(frame) // pieces)
        for start in range(0, len(frame), size):
            self.robot.send(frame[start : start + size])
            self.driver.serve()
        if command:
            self.serve(lambda: len(self.frames) > seen)
            self.command()
        self.now += 0.012
        self.serve(lambda: len(self.answers) > count)
        return self.answers[-1]

    def command(self, stamp: int | None = None) -> None:
        assert self.node is not None
        stamp = self.frames[-1].stamp if stamp is None else stamp
        self.node.send(pack_command(stamp, STAND, [1.0] * 25))

    def start(self) -> None:
        """Until commands pass."""
        self.attach()
        self.serve(lambda: self.robot)
        for _ in range(PAUSE):
            self.cycle()
        for _ in range(14):
            self.cycle(command=True)


@pytest.fixture(params=[False, True], ids=["real_time", "lockstep"])
def rig(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Rig]:
    yield from make_rig(str(tmp_path / "lola"), lockstep=request.param)


@pytest.fixture
def timed(tmp_path: Path) -> Iterator[Rig]:
    yield from make_rig(str(tmp_path / "lola"), lockstep=False)


def make_rig(path: str, lockstep: bool) -> Iterator[Rig]:
    settings = DriverSettings(path, lockstep, SAFETY)
    with (
        socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as listener,
        socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as nodes,
    ):
        listener.bind(path)
        listener.listen(1)
        listener.setblocking(False)
        nodes.bind(address(path))
        nodes.listen(1)
        now = [100.0, 0.0]
        driver = Driver(
            settings, nodes, clock=lambda: now[0], wall=lambda: round(sum(now) * 1e9)
        )
        rig = Rig(settings, driver, listener, now)
        yield rig
        for each in (rig.robot, rig.node):
            if each is not None:
                each.close()


def test_commands_pass_frame_by_frame(rig: Rig) -> None:
    rig.start()
    sent = rig.cycle(command=True)
    assert sent.stiffness is not None
    assert sent.stiffness[KNEE] == 1.0
    assert sent.position[KNEE] == pytest.approx(STAND[KNEE], abs=1e-6)
    stamps = [frame.stamp for frame in rig.frames]
    assert {b - a for a, b in pairwise(stamps)} == {12_000_000}
    assert rig.frames[-1].status.mode is Mode.ACTIVE


def test_frames_in_pieces_are_put_together(rig: Rig) -> None:
    rig.start()
    for pieces in (2, 3, 7):
        rig.cycle(command=True, pieces=pieces)
    assert rig.frames[-1].sensors == STANDING


def test_a_gait_that_is_silent_leads_to_a_sitting_robot_and_starts_again(timed: Rig) -> None:
    timed.start()
    for _ in range(7):
        timed.cycle()
    assert "no joint_command for 0.07 s: sitting down" in timed.log
    seen = len(timed.frames)
    for _ in range(PAUSE - 1):
        timed.cycle()
    assert len(timed.frames) == seen, "the gait is to start again, so it gets no frames"
    timed.command(stamp=timed.frames[-1].stamp)  # an answer to an old frame does not count
    timed.cycle()
    assert timed.frames[-1].status.mode in (Mode.SITTING, Mode.RESTING)
    timed.cycle(command=True)
    assert timed.log[-1] == "commands arrive: stiffness rises"


@pytest.mark.parametrize("jump", [-50.0, 50.0])
def test_commands_pass_on_when_the_clock_is_set(timed: Rig, jump: float) -> None:
    """As at the first contact with a time server: a NAO has no clock of its own."""
    timed.start()
    timed.time[1] += jump
    seen = len(timed.frames)
    for _ in range(20):
        sent = timed.cycle(command=True)
        assert timed.frames[-1].status.mode is Mode.ACTIVE
    assert sent.stiffness[KNEE] == 1.0
    stamps = [frame.stamp for frame in timed.frames[seen - 1 :]]
    assert {b - a for a, b in pairwise(stamps)} == {12_000_000}


@pytest.mark.parametrize("parts", [1, 2, 3])
def test_stamps_never_run_backwards_after_a_burst(timed: Rig, parts: int) -> None:
    """Frames of a stall that come in several parts are ahead of the clock for a while."""
    timed.start()
    assert timed.robot is not None
    seen, answered = len(timed.frames), len(timed.answers)
    timed.now += 0.3
    for part in range(parts):
        for _ in range(24 // parts):
            timed.robot.send(STANDING)
        count = answered + (part + 1) * (24 // parts)
        timed.serve(lambda count=count: len(timed.answers) >= count - 1)
    for _ in range(2 * PAUSE):
        timed.cycle()
    stamps = [frame.stamp for frame in timed.frames[seen - 1 :]]
    assert min(b - a for a, b in pairwise(stamps)) > 0
    assert stamps[-1] == pytest.approx(sum(timed.time) * 1e9, abs=0.15e9)


def test_a_link_that_froze_is_said_and_the_robot_is_taken_for_a_new_one(timed: Rig) -> None:
    """LoLA has taken its stiffness off: the next command must not pull it to its old pose."""
    timed.start()
    timed.now += 2.3
    collapsed = encode_sensors(sensors(position=[0.4] * 25))
    sent = timed.cycle(collapsed)
    assert any(line.startswith("no frame for 2.3") for line in timed.log)
    assert max(sent.stiffness or ()) == 0.0
    assert sent.position[KNEE] == pytest.approx(0.4)
    for _ in range(PAUSE):
        timed.cycle(collapsed)
    sent = timed.cycle(collapsed, command=True)
    assert sent.stiffness[KNEE] < 0.2
    assert timed.frames[-1].status.mode is Mode.LIMP
    assert timed.log[-1] == "commands arrive: stiffness rises"


def test_frames_that_had_to_wait_keep_their_stamps(timed: Rig) -> None:
    """A driver that the machine holds up for 0.1 s finds 8 frames at once."""
    timed.start()
    assert timed.robot is not None
    seen, answered = len(timed.frames), len(timed.answers)
    for _ in range(8):
        timed.robot.send(STANDING)
        timed.now += 0.012
    timed.serve(lambda: len(timed.answers) >= answered + 7)
    stamps = [frame.stamp for frame in timed.frames[seen - 1 :]]
    assert len(stamps) > 5
    assert {b - a for a, b in pairwise(stamps)} == {12_000_000}
    for _ in range(PAUSE):
        timed.cycle()
    assert timed.frames[-1].stamp == pytest.approx(sum(timed.time) * 1e9, abs=0.05e9)


def test_every_frame_is_answered_when_there_is_no_node(timed: Rig) -> None:
    timed.serve(lambda: timed.robot)
    for _ in range(5):
        sent = timed.cycle()
    assert max(sent.stiffness or ()) == 0.0


def test_a_killed_node_sits_the_robot_down_and_the_next_one_takes_over(timed: Rig) -> None:
    timed.start()
    assert timed.node is not None
    timed.node.close()
    timed.node = None
    for _ in range(9):
        sent = timed.cycle()
    assert sent.stiffness[KNEE] == 1.0, "it sits down, it does not fall"
    timed.attach()
    for _ in range(PAUSE + 2):
        timed.cycle()
    assert timed.frames[-1].status.mode in (Mode.SITTING, Mode.RESTING)
    for _ in range(14):
        timed.cycle(command=True)
    assert timed.log[-1] == "commands pass"
    assert not timed.driver.done


def test_a_frame_that_waits_while_a_node_comes_is_answered(rig: Rig) -> None:
    """The settings of a node may arrive after a frame was given to it."""
    rig.start()
    assert rig.node is not None
    rig.node.close()
    rig.node = None
    for _ in range(PAUSE + 10):
        rig.cycle()
    rig.node = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    rig.node.connect(address(rig.settings.socket))
    rig.node.setblocking(False)
    rig.driver.serve()
    count, seen = len(rig.answers), len(rig.frames)
    assert rig.robot is not None
    rig.robot.send(STANDING)
    rig.serve(lambda: len(rig.frames) > seen)
    rig.node.send(SETTINGS + rig.settings.to_json().encode())
    rig.serve(lambda: len(rig.answers) > count)


def test_a_node_that_ends_leaves_a_limp_robot_and_no_driver(timed: Rig) -> None:
    timed.start()
    assert timed.node is not None
    timed.node.send(END)
    while not timed.driver.done:
        timed.cycle()
    assert max(timed.answers[-1].stiffness or ()) == 0.0


def test_a_node_that_takes_over_from_one_that_ends_is_not_turned_away(timed: Rig) -> None:
    timed.start()
    assert timed.node is not None
    timed.node.close()
    timed.attach()
    timed.driver.serve()  # it finds both at once
    for _ in range(PAUSE + 2):
        timed.cycle()
    assert timed.node is not None, "it was not turned away"
    assert not any("already" in line for line in timed.log)


def test_a_second_node_is_turned_away(timed: Rig) -> None:
    timed.start()
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as second:
        second.connect(address(timed.settings.socket))
        timed.cycle(command=True)
        line = unpack_from_driver(second.recv(PACKET_BYTES))
        assert isinstance(line, LogLine)
        assert line.text.startswith("this robot has a lola_bridge already")
        assert second.recv(10) == b""
    timed.cycle(command=True)


@pytest.mark.parametrize(
    ("frame", "text"),
    [
        (b"\xc1" * 896, "a MessagePack map"),
        (STANDING.replace(b"Gyroscope", b"Gyroscopy"), "Gyroscopy"),
        (STANDING.replace(b"\x4f\xae", b"\xff\xff")[:896].ljust(896, b"\0"), ""),
    ],
)
def test_a_bad_frame_is_answered_and_reported_once(timed: Rig, frame: bytes, text: str) -> None:
    timed.start()
    for _ in range(3):
        sent = timed.cycle(frame)
    assert sent.stiffness[KNEE] == 1.0
    lines = [line for line in timed.log if "frame ignored" in line]
    assert len(lines) == (1 if text else len(lines))
    assert all(text in line for line in lines)


def test_settings_that_cannot_be_read_turn_the_node_away(timed: Rig) -> None:
    timed.start()
    assert timed.node is not None
    timed.node.send(END)
    timed.serve(lambda: timed.node is None)
    for packet in (b"{", b"[]", b'{"socket": "", "safety": {"period": 1.0}}', b"\xff"):
        timed.node = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        timed.node.connect(address(timed.settings.socket))
        timed.node.setblocking(False)
        timed.node.send(SETTINGS + packet)
        timed.serve(lambda: timed.node is None)
        assert "another version of lola_bridge?" in timed.log[-1]
        sent = timed.cycle()
        assert sent.stiffness[KNEE] > 0.9, "the robot sits down all the same"


def test_an_unexpected_error_costs_one_answer_and_is_said(
    timed: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    timed.start()
    with monkeypatch.context() as patch:
        patch.setattr(driver_module, "pack_frame", broken)
        assert timed.robot is not None
        timed.robot.send(STANDING)
        timed.serve(lambda: "driver: ZeroDivisionError" in timed.log[-1])
    timed.now += 0.012
    for _ in range(3):
        sent = timed.cycle(command=True)
    assert sent.stiffness[KNEE] == 1.0
    assert timed.frames[-1].status.mode is Mode.ACTIVE


def test_a_driver_that_cannot_go_on_gives_up(
    timed: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    timed.start()
    monkeypatch.setattr(driver_module, "pack_frame", broken)
    assert timed.robot is not None
    for _ in range(FAULTS_MAX):
        timed.robot.send(STANDING)
        timed.driver.serve()
    timed.robot.send(STANDING)
    with pytest.raises(ZeroDivisionError):
        timed.driver.serve()


def broken(*_: object) -> bytes:
    raise ZeroDivisionError


def test_a_socket_that_is_not_there_is_reported_once(tmp_path: Path) -> None:
    path = str(tmp_path / "nothing")
    now = [0.0]
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as nodes:
        nodes.bind(address(path))
        nodes.listen(1)
        driver = Driver(DriverSettings(path, False, SAFETY), nodes, clock=lambda: now[0])
        with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as node:
            node.connect(address(path))
            lines = []
            for _ in range(6):
                now[0] += 1.0
                driver.serve()
                node.setblocking(False)
                try:
                    lines.append(unpack_from_driver(node.recv(PACKET_BYTES)))
                except BlockingIOError:
                    continue
    assert [line.text for line in lines] == [
        f"socket {path}: No such file or directory; trying again each 0.5 s"
    ]


def test_half_a_frame_and_a_closed_socket_are_said_and_the_robot_is_found_again(
    timed: Rig,
) -> None:
    timed.start()
    assert timed.robot is not None
    timed.robot.send(STANDING[:500])
    timed.robot.close()
    timed.robot = None
    timed.parser = command_stream()
    timed.driver.serve()
    timed.driver.serve()
    timed.now += 1.0
    timed.serve(lambda: timed.robot)
    timed.cycle()
    timed.serve(lambda: any("closed by the robot" in line for line in timed.log))
    assert any("in the middle of a frame (500 of 896 bytes)" in line for line in timed.log)
    for _ in range(PAUSE + 1):
        timed.cycle()
    for _ in range(14):
        timed.cycle(command=True)
    assert timed.log[-1] == "commands pass"


def test_a_robot_of_another_body_version_gets_no_stiffness(timed: Rig) -> None:
    timed.attach()
    timed.serve(lambda: timed.robot)
    other = encode_sensors(
        sensors(position=STAND, robot_config=CONFIG._replace(body_version="5.0.0"))
    )
    for _ in range(PAUSE + 1):
        timed.cycle(other)
    for _ in range(5):
        sent = timed.cycle(other, command=True)
    assert max(sent.stiffness or ()) == 0.0
    assert sum("body version: got '5.0.0'; allowed: 6.x" in line for line in timed.log) == 1


@pytest.mark.parametrize("packet", [b"F", b"Fxx", b"L\x77?", b"L", b"Z" + bytes(PACKET_BYTES - 1)])
def test_a_packet_of_another_version_is_refused(packet: bytes) -> None:
    with pytest.raises(NaoGaitError, match="a packet of this version"):
        unpack_from_driver(packet)


def test_settings_survive_the_way_as_text() -> None:
    settings = DriverSettings("/tmp/robocup", True, replace(SAFETY, dry_run=True))
    assert DriverSettings.from_json(settings.to_json()) == settings
