"""A flood of log lines is held back, and tick times are summarized."""

from nao_lipm_gait.runtime.diagnostics import Throttle, TickStatistics


def test_throttle_lets_one_through_and_counts_the_rest():
    throttle = Throttle(period=2.0)
    assert throttle.allow("a", 0.0) == 0
    assert throttle.allow("a", 0.5) is None
    assert throttle.allow("b", 0.5) == 0, "another fault is not held back"
    assert throttle.allow("a", 1.9) is None
    assert throttle.allow("a", 2.0) == 2
    assert throttle.allow("a", 4.5) == 0


def test_throttle_lets_a_burst_through():
    throttle = Throttle(period=2.0)
    assert [throttle.allow("a", 0.1 * i, burst=3) for i in range(5)] == [0, 0, 0, None, None]
    assert throttle.allow("a", 2.0, burst=3) == 2


def test_throttle_does_not_grow_with_hostile_keys():
    throttle = Throttle()
    for i in range(100_000):
        throttle.allow(str(i), 0.0)
    assert throttle.allow("0", 0.0) == 0, "forgotten"


def test_tick_summary_is_of_the_time_since_the_last_one():
    ticks = TickStatistics()
    assert ticks.summarize() is None
    for duration in range(100, 0, -1):
        ticks.add(float(duration))
    summary = ticks.summarize()
    assert summary is not None
    assert (summary.count, summary.p50, summary.p99, summary.maximum) == (100, 50.0, 99.0, 100.0)
    assert ticks.summarize() is None
