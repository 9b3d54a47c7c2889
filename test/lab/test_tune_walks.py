"""Protocols and scores on real walks: the stride grows, a fall costs, hopping does not pay."""

import dataclasses
import math
from pathlib import Path

import pytest

pytest.importorskip("joblib")
pytest.importorskip("mujoco")

from test_tune_study import GOOD

from gait_lab.tune import growing_stride
from gait_lab.tune.measures import Measures
from gait_lab.tune.preset_file import write_preset
from gait_lab.tune.protocols import PROTOCOLS
from gait_lab.tune.study import parse_study
from gait_lab.tune.trial import evaluate, robot_score, score_of
from gait_lab.tune.walker import Push, Setting, walk
from nao_lipm_gait.parameters import GaitParameters, load_preset
from nao_lipm_gait.types import STANDSTILL, GaitStatus, VelocityCommand

STUDY = parse_study(GOOD)


def test_the_stride_grows_every_two_steps_up_to_the_last_one() -> None:
    options = PROTOCOLS["growing_stride"].checked("", {"steps": 12, "first": 0.03, "last": 0.09})
    trace, pilot, fell = growing_stride.record(Setting(), options)
    times = pilot.step_times
    assert not fell
    assert len(times) == 12
    first, second = (growing_stride.distance(trace, times[step]) for step in (5, 11))
    assert first < second - first < sum(0.03 + 0.06 * stage / 6 for stage in (3, 4, 5))
    strides = []
    for steps in range(13):
        pilot.step_times = [0.0] * steps
        strides.append(pilot.stride)
    assert strides[0] == pytest.approx(0.03)
    assert strides[12] == pytest.approx(0.09)
    assert all(strides[i] == strides[i + 1] for i in range(0, 12, 2))
    assert all(strides[i + 1] < strides[i + 2] for i in range(0, 11, 2))


def test_distance_counts_along_the_start_heading_until_the_last_step() -> None:
    options = PROTOCOLS["growing_stride"].checked("", {"steps": 8, "hold": 1.0})
    trace, pilot, _ = growing_stride.record(Setting(), options)
    assert pilot.done_at is not None
    at_last_step = growing_stride.distance(trace, pilot.done_at)
    assert 0.0 < at_last_step < growing_stride.distance(trace, None)
    assert trace.time[-1] == pytest.approx(pilot.done_at + 1.0, abs=0.03)


def test_a_posture_that_cannot_walk_falls_and_has_no_speed() -> None:
    protocol = PROTOCOLS["growing_stride"]
    options = protocol.checked("", {"steps": 30, "first": 0.2, "last": 0.24})
    poor = GaitParameters(swing_lift=0.0, torso_pitch=-0.3)
    measures = protocol.run(Setting(poor), options)
    assert measures.fell
    assert measures.values["speed"] == 0.0
    assert set(measures.values) == set(protocol.measures)


def test_penalties_are_taken_per_robot() -> None:
    honest = Measures(0, {"distance": 2.0}, fell=False)
    assert robot_score(STUDY, honest) == 2.0
    assert robot_score(STUDY, Measures(0, {"distance": 2.0}, fell=True)) == 2.0 - 3.0
    hopping = Measures(0, {"distance": 2.2}, fell=False, excess=0.5)
    assert robot_score(STUDY, hopping) < robot_score(STUDY, honest)
    assert score_of(STUDY, (honest, hopping)) == pytest.approx((2.0 + 1.7) / 2)


def test_a_trial_is_repeatable_and_never_raises() -> None:
    first, again = (evaluate(STUDY, 1, (0.5, 0.5)) for _ in range(2))
    assert first.error is None
    assert first.score > 0.0
    assert (first.score, first.measures) == (again.score, again.measures)
    broken = dataclasses.replace(STUDY, urdf="no_such_robot")
    assert "no_such_robot" in str(evaluate(broken, 0, (0.5, 0.5)).error)


def test_com_error_and_speed_come_from_the_same_walk() -> None:
    protocol = PROTOCOLS["com_error"]
    measures = protocol.run(Setting(), protocol.checked("", {"window": 2.0}))
    assert set(measures.values) == set(protocol.measures)
    assert 0.0 < measures.values["error_measured"] < 0.03
    speed = measures.values["speed"]
    assert speed == pytest.approx(0.15, rel=0.4)
    assert measures.values["speed_error"] == pytest.approx(abs(speed - 0.15))


def test_omni_measures_all_directions_and_pushes() -> None:
    protocol = PROTOCOLS["omni"]
    gentle = {"forward": 0.1, "back": 0.1, "side": 0.05, "turn": 20.0, "window": 1.0}
    measures = protocol.run(Setting(), protocol.checked("", {**gentle, "impulse": 0.1}))
    assert set(measures.values) == set(protocol.measures)
    assert measures.values["upright"] == 1.0
    assert measures.values["pushes"] == 1.0
    assert measures.values["turn"] == pytest.approx(math.radians(20.0), rel=0.5)
    asked = {"forward": 0.1, "back": 0.1, "side": 0.05, "turn": math.radians(20.0)}
    off = [abs(measures.values[name] / wanted - 1.0) for name, wanted in asked.items()]
    assert measures.values["reached"] == pytest.approx(1.0 - sum(off) / 4.0)


def stepping(time: float, status: GaitStatus | None) -> VelocityCommand:
    return VelocityCommand(0.0, 0.0, 1e-3) if time > 0.5 else STANDSTILL


def test_a_push_acts_when_it_is_due_and_a_hard_one_fells() -> None:
    calm, _ = walk(Setting(), stepping, time_limit=2.0)
    pushed, _ = walk(Setting(), stepping, time_limit=2.0, pushes=(Push(1.5, (10.0, 0.0, 0.0)),))
    before = calm.time < 1.5
    assert (calm.torso_position[before] == pushed.torso_position[before]).all()
    assert pushed.torso_position[-1, 0] > calm.torso_position[-1, 0] + 0.005
    _, fell = walk(Setting(), stepping, time_limit=4.0, pushes=(Push(1.5, (80.0, 0.0, 0.0)),))
    assert fell


def test_the_winner_is_a_preset_that_every_tool_takes(tmp_path: Path) -> None:
    winner = GaitParameters(swing_lift=0.0231234, feedback=False)
    path = write_preset(tmp_path / "best.yaml", winner, {"swing_lift": 0.0231234}, ["Tuned: a: b"])
    assert load_preset(path) == winner
    text = path.read_text(encoding="utf-8")
    assert text.startswith("# Tuned: a: b\n")
    # the defaults may change later, this file does not
    assert all(f"{name}:" in text for name in winner.as_dict())
