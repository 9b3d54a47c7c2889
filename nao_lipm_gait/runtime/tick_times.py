"""How long the ticks take, and whether the robot waited for them."""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class TickSummary:
    """Durations of ticks.

    Attributes:
        count: Number of ticks.
        p50: Median [us].
        p99: 99th percentile [us].
        maximum: [us].
    """

    count: int
    p50: float
    p99: float
    maximum: float


def quantile(ordered: Sequence[float], share: float) -> float:
    """The smallest of the sorted values that at least `share` of them do not exceed."""
    return ordered[max(0, math.ceil(share * len(ordered)) - 1)]


class TickTimes:
    """Durations of ticks since the last summary, the newest 10000 at most, and missed deadlines.

    A tick that takes longer than a control period misses its deadline. That is late only if the
    robot did not wait: in lockstep, no joint state arrives before the last one is answered.

    Args:
        period: The control period [s].

    Attributes:
        misses: Ticks that took longer than a control period, since the start.
    """

    def __init__(self, period: float) -> None:
        self._period = period
        self._durations: deque[float] = deque(maxlen=10_000)
        self._missed_until: float | None = None
        self.misses = 0

    def add(self, begin: float, end: float) -> None:
        """Keep a tick from `begin` to `end`, any monotonic time [s]."""
        self._durations.append((end - begin) * 1e6)
        if end - begin > self._period:
            self.misses += 1
            self._missed_until = end

    def was_late(self, arrived: float) -> bool:
        """Whether the tick before was late; to be called with each new joint state.

        Args:
            arrived: Arrival of the joint state [s], on the clock of `add`.
        """
        end, self._missed_until = self._missed_until, None
        return end is not None and arrived < end

    def summarize(self) -> TickSummary | None:
        """Summarize the ticks since the last call; None if there were none."""
        if not self._durations:
            return None
        ordered = sorted(self._durations)
        self._durations.clear()
        return TickSummary(
            len(ordered), quantile(ordered, 0.5), quantile(ordered, 0.99), ordered[-1]
        )
