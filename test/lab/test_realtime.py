"""Times of a replay: latency, period, and what of them is the machine's."""

import pytest

from gait_lab.bench.ros_replay import ReplayTimes
from gait_lab.bench.suites.realtime import ros_rows
from gait_lab.bench.wake_up import Sleeper, deviations
from robot_core.errors import NaoGaitError

PERIOD = 0.01
TICKS = 200


def steady(delay: float, machine: float = 0.0) -> ReplayTimes:
    """Every joint state is answered after `delay` [s]; the machine is `machine` [s] late."""
    sent = tuple(index * PERIOD for index in range(TICKS))
    return ReplayTimes(sent, tuple(each + delay for each in sent), (machine,) * TICKS)


def milliseconds(times: ReplayTimes) -> dict[str, float | None]:
    """The measured quantities."""
    return {row.quantity: row.value for row in ros_rows("", times, PERIOD)}


def test_a_constant_delay_is_latency_and_no_jitter() -> None:
    found = milliseconds(steady(0.002, machine=0.0005))
    assert found["latency_p99_net"] == pytest.approx(1.5)
    assert found["period_p99_net"] == pytest.approx(0.0, abs=1e-6)
    assert found["missed"] == 0


def test_what_the_machine_does_to_both_does_not_count() -> None:
    late = [0.003 if index % 20 == 0 else 0.0 for index in range(TICKS)]
    sent = [index * PERIOD for index in range(TICKS)]
    answered = [each + 0.001 + wait for each, wait in zip(sent, late, strict=True)]
    found = milliseconds(ReplayTimes(tuple(sent), tuple(answered), tuple(late)))
    assert found["latency_p99"] == pytest.approx(4.0)
    assert found["latency_p99_net"] == pytest.approx(1.0)
    assert found["period_p99"] == pytest.approx(3.0)
    assert found["period_p99_net"] == pytest.approx(0.0, abs=1e-6)


def test_late_and_lost_answers_are_missed_and_lost_ones_are_a_gap() -> None:
    sent, answered, machine = steady(0.002)
    changed = list(answered)
    changed[50] = changed[60] = changed[70] = None
    changed[100] = sent[100] + 0.0101
    found = milliseconds(ReplayTimes(sent, tuple(changed), machine))
    assert found["missed"] == 4
    assert found["period_p99"] == pytest.approx(1e3 * PERIOD)


@pytest.mark.parametrize("answers", [0, 1])
def test_a_gait_that_does_not_answer_is_named(answers: int) -> None:
    sent, answered, machine = steady(0.002)
    none = (None,) * (TICKS - answers)
    with pytest.raises(NaoGaitError, match=f"got '{answers} answers to {TICKS} joint states'"):
        milliseconds(ReplayTimes(sent, (*answered[:answers], *none), machine))


def test_intervals_deviate_in_both_directions() -> None:
    assert deviations((0.0, 1.0, 2.5, 3.0), 1.0) == pytest.approx((0.0, 0.5, 0.5))


def test_a_sleeper_wakes_up_once_per_deadline_and_never_early() -> None:
    with Sleeper(0.0, 1e-4, 25) as sleeper:
        late = sleeper.lateness()
    assert len(late) == 25
    assert min(late) > 0.0
