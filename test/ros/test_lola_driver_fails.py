"""A driver that says what the bridge cannot read: the bridge ends, and says why."""

import socket
from pathlib import Path

from lola_bridge.link import END, PACKET_BYTES, address, pack_log
from lola_bridge.ros.node import RESTARTS_MAX
from nao_lipm_gait.ros.process import FAILED
from nao_lipm_gait.runtime.diagnostics import Level, LogLine
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
