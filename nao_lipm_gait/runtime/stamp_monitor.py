"""What a sensor stamp says beside its frame: the next one, the same again, late, or a new time.

One stamp alone proves no new time: a message may have been overtaken on the way, or carry a wrong
number. A time jump is believed when further stamps go on from it.
"""

from enum import Enum

LONGEST_GAP = 500_000_000
"""[ns] A larger step ahead means that the past is worth nothing."""
DUE = 0.6
"""Share of a period after which the next tick is due: at twice the rate every second frame, also
where the stamps jitter a little."""
LATE = 100_000_000
"""[ns] A stamp this little behind the newest one was most likely overtaken on the way."""
MEMORY = 100
"""Frames over which the mean step is taken."""
PROOF_FAR, PROOF_LATE = 2, 4
"""Stamps in a row that rise from the new time, the first one counted, until it is believed."""


class Step(Enum):
    NEXT = "next"
    REPEATED = "repeated"
    SOON = "too soon"
    """Before the next tick is due: to be left out, the next one may be."""
    LATE = "late"
    """Behind the newest stamp by little: to be left out."""
    DOUBTFUL = "doubtful"
    """Far from the newest stamp, and not yet confirmed by another one."""
    BACKWARDS = "backwards"
    JUMP = "jump"


class StampMonitor:
    """Compares each stamp with those before and counts the frames that did not come."""

    def __init__(self, period: int, gap_ticks: int = 20) -> None:
        """period: expected distance of two frames [ns]; gap_ticks: periods between two frames that
        are still one walk.
        """
        self._period = period
        self._gap = min(LONGEST_GAP, round((gap_ticks + 0.5) * period))
        self.last: int | None = None
        self.missed = 0
        self.mean_step = float(period)
        """[ns] from one tick to the next, lost ones left out."""
        self._new: int | None = None
        self._proof = 0

    @property
    def longest_gap(self) -> int:
        """[ns] between two frames; a longer one is a new beginning."""
        return self._gap

    def is_next(self, stamp: int) -> bool:
        """Whether `see` would call this stamp the next one; nothing is kept."""
        return self.last is not None and DUE * self._period <= stamp - self.last <= self._gap

    def see(self, stamp: int) -> Step:
        """Classify a stamp [ns]; the ones to leave out do not become the new last stamp."""
        last = self.last
        if last is None:
            self.last = stamp
            return Step.NEXT
        ahead = stamp - last
        if ahead == 0:
            return Step.REPEATED
        if 0 < ahead < DUE * self._period:
            return Step.SOON
        if self.is_next(stamp):
            ticks = round(ahead / self._period)
            self.missed += ticks - 1
            self.mean_step += (ahead / ticks - self.mean_step) / MEMORY
            self.last, self._new = stamp, None
            return Step.NEXT
        return self._elsewhere(stamp, last)

    def _elsewhere(self, stamp: int, last: int) -> Step:
        # The same once more is a proof too: in lockstep the robot insists on an answer.
        goes_on = self._new is not None and 0 <= stamp - self._new <= self._gap
        self._proof = self._proof + 1 if goes_on else 1
        self._new = stamp
        late = -LATE <= stamp - last < 0
        if self._proof < (PROOF_LATE if late else PROOF_FAR):
            return Step.LATE if late else Step.DOUBTFUL
        self.last, self._new = stamp, None
        return Step.BACKWARDS if stamp < last else Step.JUMP
