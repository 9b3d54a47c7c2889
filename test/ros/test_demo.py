"""The demo as its user runs it: a process, over DDS, with a bag, a table and figures."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from mcap.reader import make_reader

from ros_probe import ROOT, TIMEOUT


def start(out: Path, *arguments: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "gait_lab.cli", "demo", "--out", str(out), *arguments],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )


def children(pid: int) -> list[int]:
    """Processes below `pid`, from /proc."""
    found = []
    for entry in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = entry.read_text().rsplit(")", 1)[1].split()
        except OSError:
            continue
        if int(fields[1]) == pid:
            found.append(int(entry.parent.name))
    return found


def alive(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0]
    except OSError:
        return False
    return state != "Z"


def wait_until(predicate: object) -> bool:
    deadline = time.monotonic() + TIMEOUT
    while time.monotonic() < deadline:
        if predicate():  # type: ignore[operator]
            return True
        time.sleep(0.05)
    return False


def test_short_tour_is_walked_recorded_and_drawn(tmp_path: Path) -> None:
    process = start(tmp_path / "demo", "--tour", "short")
    text, _ = process.communicate(timeout=3.0 * TIMEOUT)
    assert process.returncode == 0, text
    assert "The tour was completed upright." in text
    result = json.loads((tmp_path / "demo" / "result.json").read_text())
    forward = next(phase for phase in result["phases"] if phase["phase"] == "forward")
    assert forward["achieved"][0] > 0.16
    for name in ("report.html", "frames.png"):
        assert (tmp_path / "demo" / name).stat().st_size > 10_000
    (bag,) = (tmp_path / "demo" / "bag").glob("*.mcap")
    with bag.open("rb") as file:
        statistics = make_reader(file).get_summary()
    topics = {channel.topic: key for key, channel in statistics.channels.items()}
    counts = statistics.statistics.channel_message_counts
    # 10.5 s of 100 Hz: nothing was lost on the way.
    for topic in ("/joint_states", "/imu/data", "/joint_command", "/ground_truth/odom"):
        assert counts[topics[topic]] >= 1050


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
def test_an_interrupted_demo_leaves_no_process_behind(tmp_path: Path, how: int) -> None:
    process = start(tmp_path / "demo", "--tour", "short")
    assert wait_until(lambda: len(children(process.pid)) >= 2)
    nodes = children(process.pid)
    os.kill(process.pid, how)
    process.communicate(timeout=TIMEOUT)
    assert process.returncode != 0
    assert wait_until(lambda: not any(map(alive, nodes)))


def test_a_node_that_does_not_start_fails_the_demo_with_its_reason(tmp_path: Path) -> None:
    soft = ("--robot", "booster_t1", "--engine", "pybullet")  # which has no motors that give way
    process = start(tmp_path / "demo", "--tour", "short", *soft)
    text, _ = process.communicate(timeout=TIMEOUT)
    assert process.returncode == 1
    assert "got 'pybullet'" in text
    assert "Falls: none" not in text
    assert "Traceback" not in text


@pytest.mark.parametrize("what", ["plant", "preset", "robot", "engine"])
def test_an_unknown_name_is_refused_before_anything_starts(tmp_path: Path, what: str) -> None:
    process = start(tmp_path / "demo", f"--{what}", "no_such_name")
    text, _ = process.communicate(timeout=TIMEOUT)
    assert process.returncode == 2
    assert len(text.splitlines()) == 1
    assert "got 'no_such_name'" in text
    assert not (tmp_path / "demo").exists()
