"""`lola_bridge` and `lola_server` each without the other: silent robots, drivers that fail."""

import socket
import time
from contextlib import suppress
from pathlib import Path

from diagnostic_msgs.msg import DiagnosticArray
from sensor_msgs.msg import Temperature

from lola_bridge.codec import encode_sensors
from lola_bridge.link import END, PACKET_BYTES, address, pack_log
from lola_bridge.ros.node import RESTARTS_MAX
from lola_frames import sensors
from robot_core.log import Level, LogLine
from robot_core.ros.process import FAILED
from ros_probe import Probe


def test_an_unreadable_packet_ends_the_bridge_with_one_line(probe: Probe, tmp_path: Path) -> None:
    path = str(tmp_path / "lola")
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as driver:
        driver.bind(address(path))
        driver.listen(1)
        bridge = probe.start("lola_bridge", socket=path)
        link, _ = driver.accept()
        with link:
            assert link.recv(PACKET_BYTES * 8)[:1] == b"S"
            link.send(b"Fxx")
            assert bridge.wait() == FAILED
            assert link.recv(10) == END, "the robot sits down"
    (line,) = [each for each in bridge.log.splitlines() if not each.startswith("[INFO]")]
    assert line.startswith("lola_bridge: ends after NaoGaitError: driver: got ")
    assert "allowed: a packet of this version" in line


def test_drivers_that_end_again_and_again_end_the_bridge(probe: Probe, tmp_path: Path) -> None:
    path = str(tmp_path / "lola")
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as driver:
        driver.bind(address(path))
        driver.listen(1)
        bridge = probe.start("lola_bridge", socket=path)
        for _ in range(RESTARTS_MAX + 1):
            link, _ = driver.accept()
            link.recv(PACKET_BYTES * 8)
            link.send(pack_log(LogLine(Level.ERROR, "no robot")))
            link.close()
        assert bridge.wait() == FAILED
    assert f"driver: got 'ended {RESTARTS_MAX + 1} times; no robot'" in bridge.log


def test_a_robot_that_is_not_heard_is_an_error_and_its_temperatures_end(
    probe: Probe, tmp_path: Path
) -> None:
    path = str(tmp_path / "lola")
    states: list[str] = []

    def note(message: DiagnosticArray) -> None:
        states.append(f"{ord(message.status[0].level)} {message.status[0].message}")

    probe.subscribe(DiagnosticArray, "/diagnostics", callback=note)
    temperatures = probe.subscribe(Temperature, "temperature")
    probe.start("lola_bridge", socket=path)
    probe.wait(lambda: f"2 no frame of LoLA so far; socket {path}" in str(states), "a report")
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as listener:
        listener.bind(path)
        listener.listen(1)
        robot, _ = listener.accept()
        with robot:
            frame = encode_sensors(sensors())
            sent = 0.0

            def send() -> None:
                nonlocal sent
                sent = time.monotonic()
                robot.sendall(frame)
                with suppress(BlockingIOError):  # answers that nobody reads would block the bridge
                    robot.recv(1 << 16, socket.MSG_DONTWAIT)

            def heard() -> bool:
                return states[-1].startswith("1 limp") and len(temperatures) > 0

            probe.wait(heard, "sensors", every=send, pause=0.01)
            probe.wait(lambda: states[-1].startswith("2 no frame of LoLA for "), "an error")
            probe.settle()  # temperatures from before the silence
            temperatures.clear()
            reports = len(states)
            probe.wait(lambda: len(states) >= reports + 2, "two more reports")
            assert "no frame of LoLA for " in states[-1]
            assert time.monotonic() > sent + 2.0
            assert not temperatures


def test_a_server_that_waits_for_a_client_says_so(probe: Probe, tmp_path: Path) -> None:
    reports = probe.subscribe(DiagnosticArray, "/diagnostics")
    probe.start("lola_server", socket=tmp_path / "lola", engine="mujoco", real_time_factor=0)
    probe.wait(lambda: len(reports) > 1, "two reports")
    assert {each.status[0].message for each in reports} == {"no client, robot held"}


def test_a_second_bridge_of_a_robot_ends_and_the_first_stays(probe: Probe, tmp_path: Path) -> None:
    path = str(tmp_path / "lola")
    reports = probe.subscribe(DiagnosticArray, "/diagnostics")
    first = probe.start("lola_bridge", socket=path)
    probe.wait(lambda: len(reports) > 0, "a report of the first")
    second = probe.start("lola_bridge", socket=path)
    assert second.wait() == FAILED
    probe.processes.remove(second)
    assert "this robot has a lola_bridge already" in second.log.splitlines()[-1]
    reports.clear()
    probe.wait(lambda: len(reports) > 1, "more reports of the first")
    assert first.status is None
