"""Faults of one player in the middle of a match, and of the nodes of one robot."""

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gait_lab.faults.messages import Delivery
from gait_lab.faults.node_faults import NODE_FAULTS, NodeFault
from gait_lab.faults.soccer_faults import SOCCER_FAULTS, VisionGone
from gait_lab.faults.soccer_harness import SoccerHarness
from gait_lab.soccer.match import Match, MatchSpec
from nao_soccer.player import Player
from nao_soccer.vision.percepts import Kind, Percept, Percepts
from nao_soccer.world.state import WorldState
from sim_bridge.cameras.camera import CameraImage

pytest.importorskip("mujoco")


class EarlyVisionGone(VisionGone):
    """Vision dies while the robots walk to their places."""

    end = 8.0

    def __init__(self) -> None:
        super().__init__(np.random.default_rng(0))
        self.begin, self.duration = 1.0, float("inf")


def play(seed: int = 3) -> SoccerHarness:
    spec = MatchSpec(scene="pitch", seed=seed, robots=1, frames=False)
    harness = SoccerHarness(spec, EarlyVisionGone())
    try:
        harness.run()
    finally:
        harness.close()
    return harness


def test_a_player_without_vision_stands_and_says_why() -> None:
    harness = play()
    assert harness.violations == {}
    assert harness.stopped
    assert list(harness.explained) == ["no usable image"]


def test_a_remark_about_something_else_explains_no_stop(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Player, "remark", "no team mate heard")
    harness = play()
    assert not harness.stopped


def test_a_player_that_walks_on_blindly_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(WorldState, "blind", False)
    assert "walks blind" in play().violations


def test_no_player_hears_the_referee_of_a_match_in_its_silence() -> None:
    with Match(MatchSpec(silence=(1.0, 2.0))) as match:
        ways = match.pitch.channels
        heard = [ways.referee_message(0, b"told", time) for time in (0.9, 1.0, 1.9, 2.0)]
    assert list(map(list, heard)) == [[b"told"], [], [], [b"told"]]


PERCEPT = Percept(Kind.BALL, (1.0, 0.2), (0.01, 0.0, 0.01))
COVARIANCES = np.tile((0.01, 0.0, 0.01), (4, 1))
PERCEPTS = Percepts(0, PERCEPT, (PERCEPT,), np.ones((4, 2)), COVARIANCES)


def at(seconds: float) -> Any:
    return SimpleNamespace(seconds=lambda: seconds)


@pytest.mark.parametrize("name", SOCCER_FAULTS)
def test_no_fault_does_anything_before_it_begins(name: str) -> None:
    fault = SOCCER_FAULTS[name](np.random.default_rng(1))
    before = at(fault.begin - 0.1)
    image = CameraImage(0, np.full((4, 4, 3), 100, dtype=np.uint8))
    arrived = fault.on_image(before, "camera_top", image)
    assert arrived is not None
    assert np.array_equal(arrived.pixels, image.pixels)
    ((delay, percepts),) = fault.on_percepts(before, PERCEPTS)
    assert (delay, percepts.stamp, percepts.ball) == Delivery(0, PERCEPTS.stamp) + (PERCEPT,)
    assert list(fault.on_team_message(before, b"told")) == [b"told"]
    assert list(fault.on_referee_message(before, b"told")) == [b"told"]


@pytest.mark.parametrize("name", [name for name in SOCCER_FAULTS if name != "none"])
def test_every_fault_does_something_once_it_has_begun(name: str) -> None:
    fault = SOCCER_FAULTS[name](np.random.default_rng(1))
    done: list[str] = []
    now = SimpleNamespace(seconds=lambda: fault.begin + 0.1, kill_player=lambda: done.append("k"))
    image = CameraImage(0, np.full((4, 4, 3), 100, dtype=np.uint8))
    fault.on_image(at(fault.begin - 0.1), "camera_top", image)
    newer = CameraImage(round(1e9 * (fault.begin + 0.1)), np.full((4, 4, 3), 50, dtype=np.uint8))
    shown = fault.on_image(now, "camera_top", newer)  # type: ignore[arg-type]
    same_image = shown is not None and np.array_equal(shown.pixels, newer.pixels)
    found = [list(fault.on_percepts(now, PERCEPTS)) for _ in range(20)]  # type: ignore[arg-type]
    same_percepts = all(
        len(each) == 1
        and each[0].delay == 0
        and each[0].item.stamp == PERCEPTS.stamp
        and each[0].item.ball == PERCEPT
        for each in found
    )
    team = list(fault.on_team_message(now, b"told"))  # type: ignore[arg-type]
    referee = list(fault.on_referee_message(now, b"told"))  # type: ignore[arg-type]
    fault.before_frame(now)  # type: ignore[arg-type]
    heard = team == referee == [b"told"]
    assert not (same_image and same_percepts and heard and not done)


class Nodes:
    """Keeps what a fault does to the nodes."""

    def __init__(self) -> None:
        self.now = 0.0
        self.done: list[tuple[float, str, str]] = []

    def seconds(self) -> float:
        return self.now

    def kill(self, name: str) -> None:
        self.done.append((self.now, "kill", name))

    def start(self, name: str) -> None:
        self.done.append((self.now, "start", name))

    def pause(self, name: str, paused: bool) -> None:
        self.done.append((self.now, "pause" if paused else "go on", name))


@pytest.mark.parametrize("name", NODE_FAULTS)
@pytest.mark.parametrize("seed", range(4))
def test_a_node_is_struck_once_and_comes_back_once_or_never(name: str, seed: int) -> None:
    fault: NodeFault = NODE_FAULTS[name](np.random.default_rng(seed))
    nodes = Nodes()
    while nodes.now < fault.end:
        fault.before_frame(nodes)  # type: ignore[arg-type]
        nodes.now += 0.05
    if name == "none":
        assert nodes.done == []
        return
    began, action, victim = nodes.done[0]
    assert began == pytest.approx(fault.begin, abs=0.051)
    assert (action, victim) == ("pause" if fault.hangs else "kill", fault.victim)
    assert len(nodes.done) == (1 if math.isinf(fault.duration) else 2)
    if math.isfinite(fault.duration):
        back, action, victim = nodes.done[1]
        assert back == pytest.approx(began + fault.duration, abs=0.11)
        assert (action, victim) == ("go on" if fault.hangs else "start", fault.victim)
