"""A short part of the fuzzing; `nao_gait bench fuzz` runs a million ticks."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gait_lab.faults.fuzz_files import fuzz_files
from gait_lab.faults.fuzz_lola import LolaFuzzer
from gait_lab.faults.fuzz_messages import FLOATS, MOTION_FILES, NAMES, Fuzzer
from nao_lipm_gait.gait import Gait
from nao_lipm_gait.runtime.commands import head_angles, head_follow, head_mode, head_point
from nao_lipm_gait.runtime.inputs import ImuInput, JointInput, LoadInput, TwistInput
from robot_core.command_input import CommandInput, read_push
from robot_core.errors import NaoGaitError, is_number
from robot_core.robot import load_robot

ROBOT = load_robot()
NUMBERS = st.one_of(st.floats(), st.sampled_from(FLOATS), st.floats(-3.0, 3.0))
TRIPLES = st.tuples(NUMBERS, NUMBERS, NUMBERS)
SEC, NANOSEC = st.integers(-(2**31), 2**31 - 1), st.integers(0, 2**32 - 1)
TITLES = st.one_of(st.sampled_from((*ROBOT.joint_names, *NAMES)), st.text(max_size=20))
COLUMNS = st.lists(NUMBERS, max_size=30)
MESSAGES = st.one_of(
    st.tuples(st.just("cmd_vel"), st.builds(TwistInput, TRIPLES, TRIPLES)),
    st.tuples(
        st.just("imu/data"),
        st.builds(ImuInput, SEC, NANOSEC, TRIPLES, TRIPLES, st.tuples(*[NUMBERS] * 4), NUMBERS,
                  NUMBERS, NUMBERS),
    ),
    st.tuples(
        st.just("joint_states"),
        st.builds(JointInput, SEC, NANOSEC, st.lists(TITLES, max_size=30), COLUMNS, COLUMNS),
    ),
    st.tuples(
        st.just("joint_states"),
        st.builds(JointInput, SEC, NANOSEC, st.just(list(ROBOT.joint_names)),
                  st.lists(NUMBERS, min_size=22, max_size=22), COLUMNS),
    ),
    st.tuples(
        st.just("l_sole/wrench"), st.builds(LoadInput, SEC, NANOSEC, st.integers(0, 1), NUMBERS)
    ),
)  # fmt: skip


@settings(max_examples=40, deadline=None, derandomize=True)
@given(st.lists(MESSAGES, max_size=40))
def test_no_message_is_an_exception_or_a_bad_command(messages: list[tuple[str, Any]]) -> None:
    fuzzer = Fuzzer(0, ROBOT)
    for _ in range(3):
        fuzzer.tick()
    for topic, message in messages:
        fuzzer.send(topic, message)
    fuzzer.tick()
    assert not fuzzer.violations


def refused_with_a_reason(call: Callable[[], Any]) -> Any:
    """The result of a call; a refusal must name its field and what is allowed."""
    refusal = None
    try:
        return call()
    except NaoGaitError as error:
        refusal = error
    assert refusal.field
    assert refusal.allowed
    return None


@settings(max_examples=50, deadline=None, derandomize=True,
          suppress_health_check=[HealthCheck.too_slow])  # fmt: skip
@given(st.integers(0, 2**62), st.lists(TITLES, max_size=30), COLUMNS, COLUMNS)
def test_accepted_joint_commands_are_finite(
    stamp: int, names: list[str], position: list[float], effort: list[float]
) -> None:
    bridge = CommandInput(ROBOT)
    read = refused_with_a_reason(lambda: bridge.read("gait", 0.0, stamp, names, position, effort))
    if read is None:
        return
    targets, _ = read
    assert targets is not None
    assert np.isfinite(targets.position).all()
    assert 0.0 <= targets.stiffness <= 1.0


@given(TRIPLES, TRIPLES, st.text(max_size=10))
def test_a_push_is_finite_or_refused(force: Any, torque: Any, frame: str) -> None:
    push = refused_with_a_reason(lambda: read_push(force, torque, frame))
    assert push is None or np.isfinite(push).all()


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.lists(TITLES, max_size=5), COLUMNS, TRIPLES, TITLES)
def test_no_motion_and_no_goal_of_the_head_is_an_exception(
    names: list[str], position: list[float], point: Any, text: str
) -> None:
    fuzzer = Fuzzer(0, ROBOT)
    fuzzer.run(2)
    controller = fuzzer.controller
    for topic, work in (
        ("~/motion", lambda: controller.request_motion(text)),
        ("~/head", lambda: controller.look(head_angles(names, position, ROBOT))),
        ("~/head_mode", lambda: controller.look(head_mode(text))),
        ("~/look_at", lambda: controller.look(head_point("~/look_at", point, text, ROBOT))),
        ("~/look_at", lambda: controller.look(head_point("~/look_at", point, "torso", ROBOT))),
        ("~/follow", lambda: controller.look(head_follow(point, text, ROBOT))),
    ):
        controller.run(topic, work)
        assert controller.unexpected == 0, (topic, names, position, point, text)
        fuzzer.run(1)
    assert not fuzzer.violations


@pytest.mark.parametrize("name", MOTION_FILES)
def test_a_motion_file_that_cannot_be_read_is_one_line(name: str) -> None:
    fuzzer = Fuzzer(0, ROBOT)
    fuzzer.run(2)
    controller = fuzzer.controller
    output = controller.run("~/motion", lambda: controller.request_motion(name))
    assert controller.unexpected == 0
    (line,) = output.log
    assert "a readable UTF-8 file; message ignored" in line.text
    assert len(line.text) < 1000


@pytest.mark.parametrize("seed", [0, 1])
def test_a_thousand_ticks_of_invalid_messages(seed: int) -> None:
    found = Fuzzer(seed, ROBOT).run(1000)
    assert not found.violations
    assert found.answers > 500, "the gait continues to answer"
    assert found.refused > 200, "many messages were invalid"


def test_the_fuzzer_finds_a_gait_that_raises(monkeypatch: pytest.MonkeyPatch) -> None:
    fuzzer = Fuzzer(0, ROBOT)
    fuzzer.run(10)

    def fails(*_: Any) -> Any:
        raise ZeroDivisionError("on purpose")

    monkeypatch.setattr(Gait, "step", fails)
    assert any("on purpose" in text for text in fuzzer.run(10).violations)


def test_corrupt_files_are_read_or_refused_with_a_reason() -> None:
    found = fuzz_files(0, 180)
    assert not found.violations
    assert found.refused > 60
    assert found.read > 10


@pytest.mark.parametrize("value", [10**400, math.nan, math.inf, True, "1", None, [1.0]])
def test_values_that_are_not_finite_floats_are_not_numbers(value: Any) -> None:
    assert not is_number(value)


def test_lola_messages_change_no_limit() -> None:
    found = LolaFuzzer(0).run(1500)
    assert found.violations == ()
    assert 300 < found.refused < 1500


def test_a_gait_that_starts_again_goes_on_from_its_last_targets() -> None:
    """Parameters that need a restart, and a wrong angle of a joint in the next message."""
    assert Fuzzer(124).run(2010).violations == ()
