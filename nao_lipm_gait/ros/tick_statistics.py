"""How long the ticks of the last while took."""

import math
from collections import deque
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class TickSummary:
    """Durations in microseconds."""

    count: int
    p50: float
    p99: float
    maximum: float


def quantile(ordered: list[float], share: float) -> float:
    """The smallest value that at least `share` of the sorted values do not exceed."""
    return ordered[max(0, math.ceil(share * len(ordered)) - 1)]


class TickStatistics:
    """Keeps the durations since the last summary, the newest 10000 at most."""

    def __init__(self) -> None:
        self._durations: deque[float] = deque(maxlen=10_000)

    def add(self, duration: float) -> None:
        """duration [us]"""
        self._durations.append(duration)

    def summarize(self) -> TickSummary | None:
        """Summary since the last call; None when there was no tick."""
        if not self._durations:
            return None
        ordered = sorted(self._durations)
        self._durations.clear()
        return TickSummary(
            len(ordered), quantile(ordered, 0.5), quantile(ordered, 0.99), ordered[-1]
        )
