"""The stamps of sensor messages: what each is relative to those before, how old a frame is.

One stamp alone does not prove a new time base: a message may have been overtaken on its way or
carry a wrong number. A time jump is accepted once further stamps continue from it.
"""

from collections import deque
from enum import Enum

LONGEST_GAP = 500_000_000
"""[ns] After a longer gap the previous frames say nothing about the robot any more."""
DUE = 0.6
"""Share of a period after which the next tick is due. At twice the rate this takes every second
frame, also if the stamps jitter a little."""
LATE = 100_000_000
"""[ns] A stamp this little behind the newest one was most likely overtaken on its way."""
MEMORY = 100
"""Frames over which the mean step is averaged."""
STEPS = 25
"""Steps of which the usual one is taken."""
PROOF_FAR, PROOF_LATE = 2, 4
"""Stamps in a row, increasing from the new time, until it is accepted; far from and little behind
the newest stamp."""
AGE_MAX = 0.12
"""[s] Older sensors are treated as this old: a prediction over a longer time is worth nothing."""
AGE_ABSURD = 1.0
"""[s] A larger age, or one below minus a control period, shows that the clocks differ."""
HYSTERESIS = 0.75
"""Control periods by which the age must have changed to count: arrivals jitter by a few ms."""


class Step(Enum):
    """What a stamp is relative to those before it; only NEXT and the last two lead to a tick."""

    FIRST = "first"
    NEXT = "next"
    REPEATED = "repeated"
    EARLY = "too soon"
    LATE = "late"
    DOUBTFUL = "doubtful"
    BACKWARDS = "backwards"
    JUMP = "jump"


class StampMonitor:
    """Compares each stamp with those before it and counts the frames that are missing.

    Args:
        period: Expected time between two frames [ns].
        gap_ticks: Periods between two frames that still belong to one walk.

    Attributes:
        last: The newest accepted stamp [ns]; None before the first.
        mean_step: Mean time from one frame to the next [ns], lost frames left out.
        longest_gap: Longest time between two frames of one walk [ns].
    """

    def __init__(self, period: int, gap_ticks: int = 20) -> None:
        self._period = period
        self.longest_gap = min(LONGEST_GAP, round((gap_ticks + 0.5) * period))
        self.last: int | None = None
        self.missed = 0
        self.mean_step = float(period)
        self._steps: deque[int] = deque([period] * STEPS, maxlen=STEPS)
        self._candidate: int | None = None
        """Newest stamp of a time base that is not accepted yet [ns]."""
        self._proof = 0

    def classify(self, stamp: int) -> Step:
        """Compare a stamp [ns] with those before, without keeping it."""
        last = self.last
        if last is None:
            return Step.FIRST
        ahead = stamp - last
        if ahead == 0:
            return Step.REPEATED
        if 0 < ahead < DUE * self._period:
            return Step.EARLY
        if 0 < ahead <= self.longest_gap:
            return Step.NEXT
        late = -LATE <= ahead < 0
        if self._proof_with(stamp) < (PROOF_LATE if late else PROOF_FAR):
            return Step.LATE if late else Step.DOUBTFUL
        return Step.BACKWARDS if ahead < 0 else Step.JUMP

    def accept(self, stamp: int, step: Step) -> None:
        """Keep a stamp [ns] that `classify` has called `step`."""
        if step in (Step.REPEATED, Step.EARLY):
            return
        if step in (Step.LATE, Step.DOUBTFUL):
            self._candidate, self._proof = stamp, self._proof_with(stamp)
            return
        if step is Step.NEXT and self.last is not None:
            ahead = stamp - self.last
            ticks = round(ahead / self._period)
            self.missed += ticks - 1
            self._steps.append(ahead)
            self.mean_step += (ahead / ticks - self.mean_step) / MEMORY
        self.last, self._candidate = stamp, None

    @property
    def usual_step(self) -> int:
        """A step [ns] that four of five frames reach: lost ones do not make it longer."""
        return sorted(self._steps)[STEPS // 5]

    def _proof_with(self, stamp: int) -> int:
        """Stamps in a row that support a new time base, this one included."""
        # The same stamp again counts too: in lockstep the robot repeats it until it has an answer.
        base = self._candidate
        continues = base is not None and 0 <= stamp - base <= self.longest_gap
        return self._proof + 1 if continues else 1


class SensorAge:
    """Compares stamps of sensors with their arrival.

    The arrival is a part of the input: without it, or on a clock that is not that of the stamps,
    the age is the one that the walk is set to.

    Args:
        period: Control period [s].

    Attributes:
        usual: Age [s] that the walk is set to.
        age: Age [s] of the last frame on arrival; None if it is unknown.
        late: Control periods by which that is older than the usual age, rounded; below 0 fresher.
    """

    def __init__(self, period: float) -> None:
        self._period = period
        self._offset = 0.0
        self.usual = 0.0
        self.age: float | None = None
        self.late = 0

    def set_clock(self, stamp: int, arrived: int | None) -> None:
        """The clock of the stamps was set, and no time has passed: the age is what it was."""
        if arrived is not None and self.age is not None:
            self._offset = (arrived - stamp) * 1e-9 - self.age

    def update(self, stamp: int, arrived: int | None) -> int:
        """Measure the age of a frame by its stamp and arrival [ns]; returns `late`."""
        self.age = None if arrived is None else (arrived - stamp) * 1e-9 - self._offset
        if self.age is None or not -self._period <= self.age <= AGE_ABSURD:
            self.age, self.late = None, 0
            return 0
        late = (min(max(self.age, 0.0), AGE_MAX) - self.usual) / self._period
        if abs(late - self.late) > HYSTERESIS:
            self.late = round(late)
        return self.late
