"""When the bridge steps, in real time and in lockstep, and what it logs. No process, no sleep."""

from collections.abc import Callable
from typing import Any

import pytest

from sim_bridge.ros.monitors import WINDOW, PublisherMonitor, SpeedMonitor
from sim_bridge.ros.stepping import BACKLOG, FORGET, RELEASE, RESEND, Pacer, serve_until_due

MS = 1_000_000
SECOND = 1_000_000_000


class WallClock:
    """Monotonic time [ns] that the test sets."""

    def __init__(self) -> None:
        self.now = 0

    def __call__(self) -> int:
        return self.now

    def seconds(self) -> float:
        return self.now * 1e-9


# -- real time -------------------------------------------------------------------------------------


def test_pacing_does_not_drift() -> None:
    clock = WallClock()
    pacer = Pacer(10 * MS, 3.0, clock)  # 3.33.. ms of wall time per step: no whole number
    for _ in range(300_000):
        clock.now += max(0, round(pacer.wait() * 1e9))
        pacer.stepped()
    assert clock.now == pytest.approx(1000e9, abs=10 * MS)
    assert pacer.lost == 0


def test_small_backlog_is_made_up() -> None:
    clock = WallClock()
    pacer = Pacer(10 * MS, 1.0, clock)
    clock.now += 100 * MS
    steps = 0
    while pacer.wait() <= 0.0:
        pacer.stepped()
        steps += 1
    assert steps == 11
    assert pacer.lost == 0


def test_large_backlog_is_given_up() -> None:
    clock = WallClock()
    pacer = Pacer(10 * MS, 1.0, clock)
    clock.now += 5 * SECOND
    steps = 0
    while pacer.wait() <= 0.0:
        pacer.stepped()
        steps += 1
    assert steps <= BACKLOG * 100 + 2
    assert pacer.lost == pytest.approx((5 - BACKLOG) * SECOND, abs=20 * MS)


def test_factor_zero_never_waits() -> None:
    pacer = Pacer(10 * MS, 0.0, WallClock())
    for _ in range(10):
        assert pacer.wait() <= 0.0
        pacer.stepped()
    assert pacer.lost == 0


def messages(shares: list[float]) -> list[tuple[int, str]]:
    """Messages, with the index of the window, if these shares of the speed are reached."""
    monitor, now, lost, said = SpeedMonitor(1.0, 0), 0, 0, []
    for index, share in enumerate(shares):
        for _ in range(200):  # one window
            now += round(WINDOW * SECOND / 200)
            lost += round((1.0 - share) * WINDOW * SECOND / 200)
            line = monitor.update(now, lost)
            if line is not None:
                said.append((index, line.text))
    return said


def test_full_speed_is_not_reported() -> None:
    assert messages([1.0, 0.97, 1.0] * 10) == []


def test_slow_simulation_is_reported_once_and_again_only_when_it_gets_worse() -> None:
    said = messages([1.0] + [0.8] * 100 + [0.4] * 100 + [0.35] * 100)
    assert [index for index, _ in said] == [1, 101]
    assert said[0][1] == "slower than real_time_factor 1: 0.8 is reached"
    assert said[1][1] == "slower than real_time_factor 1: 0.4 is reached"


def test_recovery_is_reported_once_it_lasts() -> None:
    said = messages([0.5, 1.0, 0.5, 1.0, 1.0, 1.0, 1.0, 0.5])
    assert [index for index, _ in said] == [0, 5, 7]
    assert said[1][1] == "real_time_factor 1 is reached again, after 12 s"


def test_a_machine_that_is_slow_again_and_again_for_half_an_hour_is_few_lines() -> None:
    windows = round(1800 / WINDOW)
    said = messages(([0.9] * 4 + [1.0] * 10) * (windows // 14))
    assert 3 <= len(said) < 8


# -- other publishers -----------------------------------------------------------------------------


def test_another_publisher_is_reported_when_it_comes_and_when_it_goes() -> None:
    monitor = PublisherMonitor({"/clock": "rename", "joint_states": "rename"})
    said = [
        [line.text for line in monitor.update({"/clock": clock, "joint_states": joints})]
        for clock, joints in ((1, 1), (2, 1), (2, 1), (3, 2), (2, 2), (1, 2), (0, 1))
    ]
    assert said == [
        [],
        ["2 publishers on /clock; rename"],
        [],
        ["3 publishers on /clock; rename", "2 publishers on joint_states; rename"],
        [],
        ["one publisher on /clock again"],
        ["one publisher on joint_states again"],
    ]


# -- lockstep --------------------------------------------------------------------------------------


class Bridge:
    """Stands for the node and its executor; an answer comes at a time that the test sets."""

    def __init__(self, answer_at: float, clock: WallClock) -> None:
        self.clock, self.answer_at = clock, answer_at
        self.resent: list[float] = []
        self.forgot: list[float] = []
        self.released: list[float] = []
        self.log: list[str] = []

    @property
    def waits_for_answer(self) -> bool:
        return self.clock.seconds() < self.answer_at

    def spin_once(self, timeout_sec: float) -> None:
        self.clock.now += round(timeout_sec * 1e9)

    def resend(self) -> None:
        self.resent.append(self.clock.seconds())

    def forget_ended(self) -> None:
        self.forgot.append(self.clock.seconds())

    def release_control(self) -> None:
        self.released.append(self.clock.seconds())

    def report_wait(self, waited: float) -> None:
        self.log.append(f"waits for {waited:.0f} s")

    def get_logger(self) -> "Bridge":
        return self

    def info(self, message: str) -> None:
        self.log.append(message)


def serve(answer_at: float, stop: Any = False, factor: float = 0.0) -> tuple[Bridge, bool, Pacer]:
    """Serve a bridge in lockstep whose answer comes at a time [s]."""
    clock = WallClock()
    pacer = Pacer(10 * MS, factor, clock)
    pacer.stepped()
    bridge = Bridge(answer_at, clock)
    served: Callable[..., bool] = serve_until_due
    return bridge, served(bridge, bridge, stop, pacer, clock.seconds), pacer


def test_an_answer_lets_the_next_step_begin() -> None:
    bridge, due, _ = serve(0.04)
    assert due
    assert bridge.clock.seconds() == pytest.approx(0.05)
    assert (bridge.resent, bridge.released, bridge.log) == ([], [], [])


def test_real_time_holds_in_lockstep_too() -> None:
    bridge, due, _ = serve(0.0, factor=0.1)
    assert due
    assert bridge.clock.seconds() == pytest.approx(0.1)


def test_an_unanswered_reading_is_sent_again() -> None:
    bridge, due, pacer = serve(1.0, factor=1.0)
    assert due
    assert len(bridge.resent) == 3
    assert bridge.resent[0] == pytest.approx(RESEND, abs=0.06)
    assert pacer.lost == 0, "waiting for a gait is not a slow simulation"


def test_another_gait_may_answer_after_a_while() -> None:
    bridge, _, _ = serve(RELEASE + 1.0)
    assert bridge.released[0] == pytest.approx(RELEASE, abs=0.06)
    assert bridge.forgot[0] == pytest.approx(FORGET, abs=0.06)


def test_a_long_wait_is_logged_when_it_begins_gets_longer_and_ends() -> None:
    bridge, _, _ = serve(100.0)
    assert bridge.log == ["waits for 3 s", "waits for 30 s", "lockstep: resumed after 100 s"]


def test_a_stop_ends_the_wait() -> None:
    _, due, _ = serve(1e9, stop=True)
    assert not due
