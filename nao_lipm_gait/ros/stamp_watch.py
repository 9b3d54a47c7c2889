"""What a sensor stamp says beside its frame: the next one, the same again, back, or far ahead."""

from enum import Enum

JUMP = 500_000_000
"""[ns] A larger step ahead means that the past is worth nothing."""


class Step(Enum):
    NEXT = "next"
    REPEATED = "repeated"
    BACKWARDS = "backwards"
    JUMP = "jump"


class StampWatch:
    """Compares each stamp with the one before and counts the frames that did not come."""

    def __init__(self, period: int) -> None:
        """period: expected distance of two frames [ns]."""
        self._period = period
        self.last: int | None = None
        self.missed = 0

    def see(self, stamp: int) -> Step:
        """Classify a stamp [ns]; all but a repeated one become the new last stamp."""
        last = self.last
        if last is None:
            self.last = stamp
            return Step.NEXT
        if stamp == last:
            return Step.REPEATED
        self.last = stamp
        if stamp < last:
            return Step.BACKWARDS
        if stamp - last > JUMP:
            return Step.JUMP
        self.missed += max(0, round((stamp - last) / self._period) - 1)
        return Step.NEXT
