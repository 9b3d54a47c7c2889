"""Messages get the simulated time of their arrival, however late they are handled."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from gait_lab.record.recorder import WAITING_MAX, ClockOrder

MS = 1_000_000


def replayed(events: list[tuple[int, str, int]]) -> dict[bytes, int]:
    """Simulated time by message. Events: (arrival, topic, tick or number), in order of handling."""
    written: dict[bytes, int] = {}
    order = ClockOrder(lambda topic, stamp, data: written.__setitem__(data, stamp))
    for arrived, topic, value in events:
        if topic == "/clock":
            order.tick(topic, arrived, value, b"clock%d" % value)
        else:
            order.message(topic, arrived, b"%d" % value)
    order.flush()
    return written


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1))
def test_the_order_of_handling_between_topics_does_not_matter(seed: int) -> None:
    rng = np.random.default_rng(seed)
    arrivals = np.sort(rng.choice(10_000, 60, replace=False))
    topics = rng.choice(["/clock", "/a", "/b"], 60)
    events = []
    for number, (arrived, topic) in enumerate(zip(arrivals.tolist(), topics, strict=True)):
        events.append((arrived, str(topic), number * MS))
    # Each topic on its own comes in order; whose turn it is does not.
    queues = {t: [e for e in events if e[1] == t] for t in ("/clock", "/a", "/b")}
    shuffled = []
    while any(queues.values()):
        topic = rng.choice([t for t, queue in queues.items() if queue])
        shuffled.append(queues[str(topic)].pop(0))
    assert replayed(shuffled) == replayed(events)


def test_a_message_gets_the_last_tick_before_it() -> None:
    written = replayed([(5, "/a", 1), (10, "/clock", 100), (20, "/clock", 200), (15, "/a", 2),
                        (25, "/a", 3)])  # fmt: skip
    assert written[b"1"] == 100, "before any tick: the first one"
    assert written[b"2"] == 100, "handled after the second tick, but it came before"
    assert written[b"3"] == 200


def test_without_a_clock_nothing_is_lost() -> None:
    assert replayed([(5, "/a", 1)]) == {b"1": 0}


def test_without_a_clock_everything_keeps_its_arrival() -> None:
    written: list[tuple[str, int, bytes]] = []
    order = ClockOrder(lambda *message: written.append(message))
    order.message("/a", 5, b"held")
    assert written == []
    order.use_wall_time()
    order.message("/b", 7, b"later")
    order.flush()
    assert written == [("/a", 5, b"held"), ("/b", 7, b"later")]


def test_a_clock_that_stands_still_holds_no_endless_queue() -> None:
    written: list[tuple[str, int, bytes]] = []
    order = ClockOrder(lambda *message: written.append(message))
    order.tick("/clock", 0, 100, b"clock")
    for number in range(3 * WAITING_MAX):
        order.message("/diagnostics", 1 + number, b"x")
    assert len(written) > 2 * WAITING_MAX
    assert {stamp for _, stamp, _ in written} == {100}


def test_a_recorder_that_is_behind_touches_each_message_once() -> None:
    """It may handle thousands of a topic before those of the clock, or after."""
    looked: list[int] = []
    count = 300

    class Arrival(int):
        def __lt__(self, other: int) -> bool:
            looked.append(self)
            return int(self) < int(other)

        def __ge__(self, other: int) -> bool:
            return not self < other

    order = ClockOrder(lambda *message: None)
    for number in range(count):
        order.message("/a", Arrival(10 * number + 5), b"x")
    for number in range(count):
        order.tick("/clock", 10 * number, number * MS, b"clock")
    assert len(looked) < 30 * count
