"""`nao_gait record` beside both nodes: every storage, and what is left after kill -9."""

import math
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rosbags")

from rosgraph_msgs.msg import Clock
from std_msgs.msg import Header

from gait_lab.analysis.bag import open_bag
from gait_lab.record import recorder
from gait_lab.record.recorder import ClockChoice, StampGaps, TopicRecorder
from robot_core.errors import NaoGaitError
from robot_core.ros.lockstep import UNTIL, LockstepPartner
from ros_probe import ROOT, TIMEOUT, Probe, nanoseconds, stamp

TOPICS = ("/clock", "/joint_states", "/ground_truth/odom")
SECOND = 1_000_000_000


def record(probe: Probe, out: Path, *arguments: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "gait_lab.cli", "record", str(out), *arguments],
        cwd=ROOT, env=probe.domain.environment() | {"PYTHONUNBUFFERED": "1"},
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip


def start_nodes(probe: Probe, **parameters: object) -> None:
    probe.start("sim_bridge", engine="mujoco", lockstep=True, **parameters)
    probe.start("gait")


def on_disk(bag: Path) -> dict[str, tuple[int, int]]:
    """[ns] of the first and the last message of each topic that a reader finds; or 0, 0."""
    try:
        found = open_bag(bag, TOPICS).messages
    except NaoGaitError:
        found = {}  # nothing of the file has been written yet
    messages = {topic: found.get(topic) for topic in TOPICS}
    return {topic: (each[0][0], each[-1][0]) if each else (0, 0)
            for topic, each in messages.items()}  # fmt: skip


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_a_killed_recording_has_all_up_to_its_last_second(
    probe: Probe, tmp_path: Path, storage: str
) -> None:
    clock = probe.subscribe(Clock, "/clock")
    start_nodes(probe, real_time_factor=0.3)  # a busy machine keeps up with that
    probe.wait(lambda: clock, "the clock")
    recorder = record(probe, tmp_path / "bag", "--storage", storage)

    seen = 0

    def behind() -> float:
        """[s] of simulated time that are not on the disk yet; infinite before 0.3 s have passed."""
        nonlocal seen
        now = nanoseconds(clock[-1].clock)
        if now - seen < 3 * SECOND // 10:
            return math.inf
        seen = now
        kept = on_disk(tmp_path / "bag").values()
        if any(end - start < SECOND for start, end in kept):
            return math.inf  # the recorder has come late
        return 1e-9 * (now - min(end for _, end in kept))

    try:
        assert recorder.stdout is not None
        assert "recording to" in recorder.stdout.readline()
        assert "simulated time" in recorder.stdout.readline()
        # A busy machine gives the recorder its turn late; it does not lose by that.
        probe.wait(lambda: behind() < 1.0, "a bag on the disk up to its last second")
        kept = {topic: end for topic, (_, end) in on_disk(tmp_path / "bag").items()}
        os.kill(recorder.pid, signal.SIGKILL)
    finally:
        recorder.kill()
        recorder.communicate()
    bag = open_bag(tmp_path / "bag")
    assert "metadata.yaml is missing" in bag.remarks[0]
    for topic in TOPICS:
        got = [stamp for stamp, _ in bag.messages[topic]]
        assert got[-1] - got[0] >= SECOND, topic
        assert got[-1] >= kept[topic], topic


def test_a_recording_ends_whole_and_in_order(probe: Probe, tmp_path: Path) -> None:
    # The bridge keeps ten messages for a late reader: a busy machine needs time.
    start_nodes(probe, real_time_factor=0.1)
    recorder = record(probe, tmp_path / "bag", "--topics", "/joint_states", "/robot_description",
                      "--duration", "6")  # fmt: skip
    text, _ = recorder.communicate(timeout=TIMEOUT)
    assert recorder.returncode == 0, text
    assert re.search(r"\d+ messages of 3 topics", text)
    bag = open_bag(tmp_path / "bag")
    assert set(bag.topics) == {"/joint_states", "/robot_description", "/clock"}
    assert bag.remarks == ()
    assert bag.topics["/robot_description"].count == 1
    joints = bag.messages["/joint_states"]
    sampled = np.array([stamp(message) for _, message in joints])
    # In lockstep an unanswered reading is sent again.
    assert np.all(np.diff(sampled) >= 0), "in order"
    assert np.all(np.diff(np.unique(sampled)) == 10_000_000), "none is missing"
    ages = np.array([stamp for stamp, _ in joints]) - sampled
    # Arrival counts, and not when a busy recorder came round to it.
    assert np.mean((ages >= 40_000_000) & (ages <= 50_000_000)) > 0.95


STAMPED = ("/joint_states", "/imu/data", "/l_sole/wrench", "/ground_truth/odom", "/joint_command",
           "/odom", "/gait/torso_pose", "/gait/com_measured")  # fmt: skip


@pytest.mark.parametrize("awaited", [False, True])
def test_lockstep_at_full_speed_loses_nothing_from_the_first_message_on(
    probe: Probe, tmp_path: Path, awaited: bool
) -> None:
    clock = probe.subscribe(Clock, "/clock")
    names = {"lockstep_nodes": "nao_gait_record"} if awaited else {}
    start_nodes(probe, real_time_factor=0.0, **names)
    now = lambda: clock[-1].clock.sec if clock else 0  # noqa: E731
    if not awaited:
        probe.wait(lambda: now() > 2, "a simulation that runs")
    released = probe.subscribe(Header, UNTIL)
    recorder = record(probe, tmp_path / "bag")
    try:
        assert recorder.stdout is not None
        assert "recording to" in recorder.stdout.readline()
        assert "simulated time" in recorder.stdout.readline()
        probe.wait(lambda: released and nanoseconds(released[-1].stamp), "a recorder that records")
        until = now() + 2
        probe.wait(lambda: now() > until, "2 s of simulated time")
        recorder.send_signal(signal.SIGINT)
        text, _ = recorder.communicate(timeout=TIMEOUT)
    finally:
        recorder.kill()
        recorder.wait()
    assert recorder.returncode == 0, text
    assert "missing" not in text
    bag = open_bag(tmp_path / "bag")
    ticks = np.unique([stamp for stamp, _ in bag.messages["/clock"]])
    assert np.all(np.diff(ticks) == 10_000_000), "no tick is missing"
    assert not awaited or ticks[0] == 10_000_000, "the first tick of the simulation"
    for topic in STAMPED:
        messages = bag.messages[topic]
        sampled = np.unique([stamp(message) for _, message in messages])
        assert np.all(np.diff(sampled) == 10_000_000), topic
        if topic.startswith("/ground_truth"):
            assert sampled[0] == ticks[0], topic
            continue
        begin = 40_000_000 if awaited else ticks[0]
        assert sampled[0] == begin - 40_000_000, "sensors are 40 ms old"
        # The gait answers the robot first: the next tick may overtake the rest of its messages.
        assert begin <= messages[0][0] <= begin + 10_000_000, topic


def test_time_runs_on_only_after_the_bag_is_closed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # A simulator that runs on meanwhile outpaces a busy recorder, which then misses messages.
    ends = []
    for each, method in ((TopicRecorder, "close"), (LockstepPartner, "leave")):
        monkeypatch.setattr(each, method, lambda _, ended=method: ends.append(ended))
    recorder.record(tmp_path / "bag", duration=0.01, simulated_time=False, say=lambda _: None)
    assert ends == ["close", "leave"]


def simulator(answer: list[bool] | None) -> Any:
    """A node that sees one publisher of /clock, and what that answers about lockstep."""
    values = [SimpleNamespace(bool_value=each) for each in answer or ()]
    future = SimpleNamespace(
        done=lambda: answer is not None, result=lambda: SimpleNamespace(values=values)
    )
    return SimpleNamespace(
        count_publishers=lambda topic: 1,
        get_publishers_info_by_topic=lambda topic: [
            SimpleNamespace(node_namespace="/", node_name="simulator")
        ],
        create_client=lambda kind, service: SimpleNamespace(
            service_is_ready=lambda: True, call_async=lambda request: future
        ),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("answer", "subscribes"), [([True], False), ([False], True), ([], True), (None, False)]
)
def test_a_recorder_does_not_begin_before_a_simulator_in_lockstep_can_wait_for_it(
    answer: list[bool] | None, subscribes: bool
) -> None:
    choice, now = ClockChoice(simulator(answer), None), time.monotonic()
    assert choice.update(now)
    assert not choice.may_subscribe(now), "it has only asked"
    assert choice.may_subscribe(now + 1.0) is subscribes


def test_missing_messages_are_counted_by_their_stamps() -> None:
    gaps = StampGaps()
    lost, pause = {40, 41, 70}, range(80, 150)
    for tick in range(200):
        if tick not in lost:
            gaps.add("/clock", 10_000_000 * tick)
        if tick not in lost and tick not in pause:
            gaps.add("/joint_states", 10_000_000 * tick)
        if tick % 7 < 2:
            gaps.add("/footsteps", 10_000_000 * tick)
    assert gaps.missing == {"/clock": 3, "/joint_states": 3}
    assert "6 missing" in gaps.text()
    assert StampGaps().text() == ""
