"""Times of a replay: latency, period, and what of them is the machine's."""

import pytest

from gait_lab.bench.ros_replay import ReplayTimes, RosReplay
from gait_lab.bench.wake_up import Sleeper, deviations
from robot_core.errors import NaoGaitError

PERIOD = 0.01
TICKS = 200


def steady(delay: float, machine: float = 0.0) -> ReplayTimes:
    """Every joint state is answered after `delay` [s]; the machine is `machine` [s] late."""
    sent = tuple(index * PERIOD for index in range(TICKS))
    return ReplayTimes(sent, tuple(each + delay for each in sent), (machine,) * TICKS)


def test_a_constant_delay_is_latency_and_no_jitter() -> None:
    found = RosReplay.of(steady(0.002, machine=0.0005), PERIOD)
    assert found.latency_excess == pytest.approx(0.0015)
    assert found.period_excess == pytest.approx(0.0, abs=1e-9)
    assert (found.misses, found.count) == (0, TICKS)


def test_what_the_machine_does_to_both_does_not_count() -> None:
    late = [0.003 if index % 20 == 0 else 0.0 for index in range(TICKS)]
    sent = [index * PERIOD for index in range(TICKS)]
    answered = [each + 0.001 + wait for each, wait in zip(sent, late, strict=True)]
    found = RosReplay.of(ReplayTimes(tuple(sent), tuple(answered), tuple(late)), PERIOD)
    assert found.latency[-1] == pytest.approx(0.004)
    assert found.latency_excess == pytest.approx(0.001)
    assert found.period[-1] == pytest.approx(0.003)
    assert found.period_excess == pytest.approx(0.0, abs=1e-9)


def test_late_and_lost_answers_are_missed_and_lost_ones_are_a_gap() -> None:
    sent, answered, machine = steady(0.002)
    changed = list(answered)
    changed[50] = None
    changed[100] = sent[100] + 0.0101
    found = RosReplay.of(ReplayTimes(sent, tuple(changed), machine), PERIOD)
    assert found.misses == 2
    assert found.period[-1] == pytest.approx(PERIOD)


@pytest.mark.parametrize("answers", [0, 1])
def test_a_gait_that_does_not_answer_is_named(answers: int) -> None:
    sent, answered, machine = steady(0.002)
    none = (None,) * (TICKS - answers)
    with pytest.raises(NaoGaitError, match=f"got '{answers} answers to {TICKS} joint states'"):
        RosReplay.of(ReplayTimes(sent, (*answered[:answers], *none), machine), PERIOD)


def test_intervals_deviate_in_both_directions() -> None:
    assert deviations((0.0, 1.0, 2.5, 3.0), 1.0) == pytest.approx((0.0, 0.5, 0.5))


def test_a_sleeper_wakes_up_once_per_deadline_and_never_early() -> None:
    with Sleeper(0.0, 1e-4, 25) as sleeper:
        late = sleeper.lateness()
    assert len(late) == 25
    assert min(late) > 0.0
