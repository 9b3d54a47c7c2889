"""Protocols and scores on real walks: the stride grows, a fall costs, hopping does not pay."""

import dataclasses
import math

import pytest

pytest.importorskip("optuna")
pytest.importorskip("mujoco")

from test_tune_study import GOOD

from gait_lab.tune.growing_stride import (
    GrowingStride,
    GrowingStrideOptions,
    distance,
    walk_growing_stride,
)
from gait_lab.tune.protocols import PROTOCOLS, Measures
from gait_lab.tune.search import walk_robots
from gait_lab.tune.study import parse_study
from nao_lipm_gait.parameters import GaitParameters
from sim_bridge.trials.trial import TrialSpec

STUDY = parse_study(GOOD)
ROBOT = TrialSpec(engine="mujoco")


def test_the_robot_walks_farther_as_the_stride_grows() -> None:
    options = GrowingStrideOptions(steps=12, first=0.03, last=0.09)
    trace, policy, fell = walk_growing_stride(ROBOT, options)
    times = policy.step_times
    assert not fell
    assert len(times) == 12
    first, second = (distance(trace, times[step]) for step in (5, 11))
    assert first < second - first < sum(0.03 + 0.06 * stage / 6 for stage in (3, 4, 5))


def test_the_commanded_stride_grows_every_two_steps() -> None:
    policy = GrowingStride(GrowingStrideOptions(steps=12, first=0.03, last=0.09))
    strides = [policy.stride_after(steps) for steps in range(13)]
    assert strides[0] == pytest.approx(0.03)
    assert strides[12] == pytest.approx(0.09)
    assert all(strides[i] == strides[i + 1] for i in range(0, 12, 2))
    assert all(strides[i + 1] < strides[i + 2] for i in range(0, 11, 2))


def test_distance_counts_along_the_start_heading_until_the_last_step() -> None:
    options = GrowingStrideOptions(steps=8, hold=1.0)
    trace, policy, _ = walk_growing_stride(ROBOT, options)
    assert policy.done_at is not None
    at_last_step = distance(trace, policy.done_at)
    assert 0.0 < at_last_step < distance(trace, None)
    assert trace.time[-1] == pytest.approx(policy.done_at + 1.0, abs=0.03)


def test_a_posture_that_cannot_walk_falls_and_has_no_speed() -> None:
    protocol = PROTOCOLS["growing_stride"]
    options = protocol.options.from_mapping({"steps": 30, "first": 0.2, "last": 0.24})
    poor = GaitParameters(swing_lift=0.0, torso_pitch=-0.3, step_forward_max=0.2)
    measures = protocol.run(TrialSpec(engine="mujoco", parameters=poor), options)
    assert measures.fell
    assert measures.values["speed"] == 0.0
    assert set(measures.values) == set(protocol.measures)


def test_penalties_are_taken_per_robot() -> None:
    honest = Measures(0, {"distance": 2.0}, fell=False)
    assert STUDY.robot_score(honest) == 2.0
    assert STUDY.robot_score(Measures(0, {"distance": 2.0}, fell=True)) == 2.0 - 3.0
    hopping = Measures(0, {"distance": 2.2}, fell=False, excess=0.5)
    assert STUDY.robot_score(hopping) < STUDY.robot_score(honest)
    assert STUDY.score((honest, hopping)) == pytest.approx((2.0 + 1.7) / 2)


def test_a_trial_is_repeatable() -> None:
    first, again = (
        walk_robots(STUDY, STUDY.start, STUDY.file.robots, STUDY.place) for _ in range(2)
    )
    assert STUDY.score(first) > 0.0
    assert first == again


def test_com_error_and_speed_come_from_the_same_walks() -> None:
    protocol = PROTOCOLS["com_error"]
    measures = protocol.run(ROBOT, protocol.options.from_mapping({"forward": 0.15, "window": 2.0}))
    assert set(measures.values) == set(protocol.measures)
    assert 0.0 < measures.values["error_measured"] < 0.03
    assert 0.6 < measures.values["reached"] <= 1.0
    assert measures.values["drift"] < 0.03
    assert measures.values["upright"] == 1.0


def test_a_small_com_error_does_not_pay_if_the_robot_does_not_move() -> None:
    protocol = PROTOCOLS["com_error"]
    still = dataclasses.replace(ROBOT, parameters=GaitParameters(step_forward_max=0.0))
    options = protocol.options.from_mapping({"forward": 0.15, "window": 1.0})
    assert protocol.run(still, options).values["reached"] < 0.2


def test_omni_counts_the_pushes_before_the_one_that_makes_the_robot_fall() -> None:
    protocol = PROTOCOLS["omni"]
    gentle = {"forward": 0.1, "back": 0.1, "side": 0.05, "turn": 20.0, "window": 1.0}
    measures = protocol.run(ROBOT, protocol.options.from_mapping({**gentle, "impulse": 5.0}))
    assert measures.values["pushes"] == 0.0


def test_omni_measures_all_directions_and_pushes() -> None:
    protocol = PROTOCOLS["omni"]
    gentle = {"forward": 0.1, "back": 0.1, "side": 0.05, "turn": 20.0, "window": 1.0}
    measures = protocol.run(ROBOT, protocol.options.from_mapping({**gentle, "impulse": 0.1}))
    assert set(measures.values) == set(protocol.measures)
    assert measures.values["upright"] == 1.0
    assert measures.values["pushes"] == 1.0
    assert measures.values["turn"] == pytest.approx(math.radians(20.0), rel=0.5)
    asked = {"forward": 0.1, "back": 0.1, "side": 0.05, "turn": math.radians(20.0)}
    off = [abs(measures.values[name] / wanted - 1.0) for name, wanted in asked.items()]
    assert measures.values["reached"] == pytest.approx(1.0 - sum(off) / 4.0)
