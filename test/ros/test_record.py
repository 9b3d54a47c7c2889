"""`nao_gait record` beside both nodes: every storage, and what is left after kill -9."""

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rosbags")

from rosgraph_msgs.msg import Clock  # noqa: E402

from gait_lab.bag_reading import open_bag  # noqa: E402
from ros_probe import ROOT, Probe  # noqa: E402


def record(probe: Probe, out: Path, *arguments: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "gait_lab.cli", "record", "--out", str(out), *arguments],
        cwd=ROOT, env=probe.domain.environment() | {"PYTHONUNBUFFERED": "1"},
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip


def start_nodes(probe: Probe) -> None:
    probe.start("sim_bridge", engine="mujoco", lockstep=True)
    probe.start("gait")


def stamps(bag: Path, topic: str) -> list[int]:
    return [stamp for stamp, _ in open_bag(bag, (topic,)).messages[topic]]


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_a_killed_recording_has_all_up_to_its_last_second(
    probe: Probe, tmp_path: Path, storage: str
) -> None:
    clock = probe.subscribe(Clock, "/clock")
    start_nodes(probe)
    probe.wait(lambda: clock, "the clock")
    recorder = record(probe, tmp_path / "bag", "--storage", storage)
    try:
        assert recorder.stdout is not None
        assert "recording to" in recorder.stdout.readline()
        assert "simulated time" in recorder.stdout.readline()
        began = len(clock)
        probe.wait(lambda: len(clock) > began + 400, "4 s of simulated time")
        os.kill(recorder.pid, signal.SIGKILL)
        killed = time.monotonic(), clock[-1].clock
    finally:
        recorder.kill()
        recorder.communicate()
    now = killed[1].sec + 1e-9 * killed[1].nanosec
    bag = open_bag(tmp_path / "bag")
    assert "metadata.yaml is missing" in bag.remarks[0]
    for topic in ("/clock", "/joint_states", "/ground_truth/odom"):
        got = [stamp for stamp, _ in bag.messages[topic]]
        assert len(got) > 100
        # Physics may run a little faster or slower than the wall clock: one simulated second.
        assert now - 1e-9 * got[-1] < 1.0, topic


def test_a_recording_ends_whole_and_in_order(probe: Probe, tmp_path: Path) -> None:
    start_nodes(probe)
    recorder = record(probe, tmp_path / "bag", "--topics", "/joint_states", "/robot_description",
                      "--duration", "6")  # fmt: skip
    text, _ = recorder.communicate(timeout=60)
    assert recorder.returncode == 0, text
    assert re.search(r"\d+ messages of 3 topics", text)
    bag = open_bag(tmp_path / "bag")
    assert set(bag.topics) == {"/joint_states", "/robot_description", "/clock"}
    assert bag.remarks == () and bag.topics["/robot_description"].count == 1
    joints = bag.messages["/joint_states"]
    sampled = np.array([m.header.stamp.sec * 10**9 + m.header.stamp.nanosec for _, m in joints])
    assert np.all(np.diff(sampled) == 10_000_000), "none is missing"
    ages = np.array([stamp for stamp, _ in joints]) - sampled
    # Arrival counts, and not when a busy recorder came round to it.
    assert np.mean((ages >= 40_000_000) & (ages <= 50_000_000)) > 0.95
