"""What the bridge logs about its surroundings: each thing when it begins, gets worse and ends."""

from collections.abc import Mapping

from robot_core.log import Level, LogLine

WINDOW = 2.0
"""[s] of wall time over which the speed of the simulation is measured."""
_SECOND = 1_000_000_000


class SpeedMonitor:
    """Reports when the simulation becomes slower than asked, much slower, and fast enough again.

    A machine that is slow again and again is reported less and less often: with each time the speed
    must be right for twice as long until it counts as recovered.
    """

    SLOW, WORSE, RECOVERED = 0.95, 0.7, 0.99
    """Share of the speed below which it is slow; share of the reported share below which it is
    reported again; share from which on it has recovered, after `CALM` windows at first."""
    CALM = 3

    def __init__(self, factor: float, now: int) -> None:
        """Start at `now` [ns] of wall time; `factor` is the requested speed."""
        self._factor = factor
        self._window_start = now
        self._lost = 0
        self._reported: float | None = None
        self._slow_since = now
        self._calm_windows = 0
        self._calm_needed = self.CALM

    def update(self, now: int, lost: int) -> LogLine | None:
        """A line for the log if the speed has changed.

        Args:
            now: Wall time [ns].
            lost: [ns] of wall time given up so far, as of `Pacer`.
        """
        elapsed = now - self._window_start
        if elapsed < WINDOW * _SECOND:
            return None
        share = 1.0 - (lost - self._lost) / elapsed
        self._window_start, self._lost = now, lost
        if self._reported is None:
            if share >= self.SLOW:
                return None
            self._reported, self._slow_since, self._calm_windows = share, now - elapsed, 0
            return self._slower(share)
        if share < self.WORSE * self._reported:
            self._reported, self._calm_windows = share, 0
            return self._slower(share)
        self._calm_windows = self._calm_windows + 1 if share >= self.RECOVERED else 0
        if self._calm_windows < self._calm_needed:
            return None
        self._reported = None
        self._calm_needed *= 2
        slow = (now - self._slow_since) * 1e-9
        text = f"real_time_factor {self._factor:g} is reached again, after {slow:.0f} s"
        return LogLine(Level.OK, text)

    def _slower(self, share: float) -> LogLine:
        reached = share * self._factor
        text = f"slower than real_time_factor {self._factor:g}: {reached:.2g} is reached"
        return LogLine(Level.WARN, text)


class PublisherMonitor:
    """Reports topics of the bridge on which others publish too."""

    def __init__(self, advice: Mapping[str, str]) -> None:
        """`advice`: what to do about a second publisher, by topic."""
        self._advice = advice
        self._counts = dict.fromkeys(advice, 1)

    def update(self, counts: Mapping[str, int]) -> list[LogLine]:
        """Lines for the log about topics whose number of publishers has changed.

        Args:
            counts: Number of publishers by topic, the bridge included.
        """
        lines = []
        for topic, count in counts.items():
            before, self._counts[topic] = self._counts[topic], count
            if count > 1 and count > before:
                text = f"{count} publishers on {topic}; {self._advice[topic]}"
                lines.append(LogLine(Level.WARN, text))
            elif before > 1 and count <= 1:
                lines.append(LogLine(Level.OK, f"one publisher on {topic} again"))
        return lines
