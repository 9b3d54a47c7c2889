"""The time of a match by the stamps of a simulation, which may begin again."""


class MatchClock:
    """Match time [ns] that never decreases; the match begins `wait` [ns] after the first stamp."""

    def __init__(self, wait: int = 0) -> None:
        self._wait = wait
        self._began = 0
        self._last: int | None = None

    def at(self, stamp: int) -> int:
        """The time [ns] since the match began; negative before.

        A stamp that is smaller than the last one is of a simulation that was started again: the
        match goes on from the time that it had reached.
        """
        if self._last is None:
            self._began = stamp + self._wait
        elif stamp < self._last:
            self._began -= self._last - stamp
        self._last = stamp
        return stamp - self._began
