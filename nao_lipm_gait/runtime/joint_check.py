"""Do the leg joints follow their targets? Judged from the first stand to the first steps.

Each reading is compared with its own target, and with what it would be if something were wrong: a
sign, a unit, a scale, a zero, a name, a joint that is stuck. A wrong command shows the same.

Exchanged names are looked for in two ways. `_explained` compares any two joints over `WINDOW`, but
exchanged knees have felled a T1 by then. `_exchanged` sees a joint and its image in the other leg
within `PAIR_WINDOW`, because loads that move both leave their difference as it is; two joints of
one leg have no such difference.
"""

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from robot_core.robot import RobotDescription
from robot_core.types import FloatArray

WINDOW = 0.3
"""[s] over which a reading is compared."""
PAIR_WINDOW = 0.1
"""[s] over which left and right are compared: exchanged knees or hips of a robot whose motors give
way fell it unless it stands 0.1 s after its first foot has lifted."""
PAIR_DEVIATION = 0.03
"""[rad] Least deviation of each of two joints that may be exchanged, and largest from each other's
targets. Loads move both of them, and zeros are off by less."""
FIRST_TIME = 0.5
"""[s] from the beginning of a walk in which a joint may be out of its range: later that is a fault
which may pass."""
EVERY = 3
"""Ticks between two comparisons of each joint."""
LAGS = range(-6, 7)
"""Ticks by which a joint may be later than `feedback_delay` says: that may be wrong, too."""
DEVIATION, YIELDING_DEVIATION = 0.014, 0.05
"""[rad] Deviation (root mean square) that needs an explanation, also of motors that give way.
Healthy NAOs reach 0.01 in a stand and 0.08 in steps, which nothing else explains."""
WORN_STUCK, YIELDING_STUCK = 0.025, 0.14
"""[rad] Deviation from which on a motor may be stuck, and one that gives way may turn half as far:
until then friction or a load holds it."""
BETTER = 10.0
"""Times by which the squares that another explanation leaves must be smaller."""
NOISE = 0.004
"""[rad] that no explanation has to explain."""
GROSS = 0.2, 0.4
"""[rad] Deviation that needs no other explanation; of motors that give way."""
LASTING = 0.25
"""Share of the readings that must deviate as much: single ones are spikes."""
ZERO_MIN = 0.1
"""[rad] Smaller wrong zeros are for the calibration."""
CONSTANT = 1e-12
"""[rad^2] Variance of a reading that does not change at all: friction leaves some."""
MOVED = 0.05
"""[rad] by which the target of a joint must move before the joint is stuck."""
PROVEN_RANGE, PROVEN_SHARE = 0.1, 1.0 / 16.0
"""A joint has proved itself if its target moved by this [rad] in steps, and its deviation is this
share of the target's variance."""
BRIDGED = 3
"""Ticks from one reading to the next up to which lost ones are bridged; a computer that is held up
for longer sends late targets, which look like exchanged legs."""
UNSETTLED = 12
"""Readings after that which are left out."""
SCALES = {
    -1.0: "sign of the reading or of the command?",
    0.5: "scale 0.5?",
    2.0: "scale 2?",
    180.0 / np.pi: "unit deg instead of rad?",
}
STUCK, OTHER = "does not move; encoder, cable or motor?", "motor off, blocked or moved by others?"


class JointCheck:
    """Compares readings with targets; one tick after the other.

    Args:
        robot: The robot.
        period: Control period [s].

    Attributes:
        trouble: What is wrong; empty while nothing is known to be.
        done: All leg joints have proved themselves.
    """

    def __init__(self, robot: RobotDescription, period: float) -> None:
        names = dict.fromkeys(robot.leg_joints)
        self._names = list(names)
        self._index = [robot.index(name) for name in names]
        sides = zip(robot.left_leg.names, robot.right_leg.names, strict=True)
        pairs = np.array([[self._names.index(name) for name in pair] for pair in sides])
        self._left, self._right = pairs[pairs[:, 0] != pairs[:, 1]].T
        self._first = round(FIRST_TIME / period)
        self._pair_ticks = round(PAIR_WINDOW / period)
        yields = bool(robot.soft_joint)
        self._deviation = YIELDING_DEVIATION if yields else DEVIATION
        self._stuck = YIELDING_STUCK if yields else WORN_STUCK
        self._held = (STUCK, SCALES[0.5]) if yields else (STUCK,)
        self._gross = GROSS[yields]
        self._ticks = round(WINDOW / period)
        self._size = self._ticks + LAGS[-1] - LAGS[0]
        # Each row is kept twice, `_size` apart: the last ones are always one block.
        self._measured, self._targets = np.zeros((2, 2 * self._size, len(self._names)))
        windows = sliding_window_view(self._targets, self._ticks, axis=0)
        self._windows: FloatArray = windows.transpose(0, 2, 1)
        # The same of left minus right.
        self._apart, self._wanted = np.zeros((2, 2 * self._size, len(self._left)))
        self._pair_windows = sliding_window_view(self._wanted, self._pair_ticks, axis=0)
        self.restart()

    def restart(self) -> None:
        """The sensors may be others from here on."""
        self._proven = np.zeros(len(self._names), dtype=bool)
        self._final = self.done = False
        self._found = 0
        self._wait = 0
        self.trouble = ""
        self.interrupt()

    @property
    def begins(self) -> bool:
        """The first steps, in which readings that are refused are judged, too."""
        return 0 < self._walked < self._first

    def interrupt(self, unsettled: int = 0) -> None:
        """The joints need not follow, or nobody knows their targets, nor for some readings more."""
        self._rows = self._walked = 0
        self._unsettled = unsettled

    def update(
        self, measured: FloatArray, target: FloatArray, *, walking: bool, ticks: int = 1
    ) -> None:
        """One reading of a robot that stands or walks.

        Args:
            measured: Joint angles (n,) [rad].
            target: Their targets (n,) [rad].
            walking: It walks.
            ticks: Control periods since the last reading.
        """
        if ticks > BRIDGED:
            self.interrupt(UNSETTLED)
        if self._unsettled > 0:
            self._unsettled -= 1
            return
        for _ in range(ticks if self._rows else 1):
            place = self._rows % self._size
            self._measured[place :: self._size] = row = measured[self._index]
            self._targets[place :: self._size] = wanted = target[self._index]
            self._apart[place :: self._size] = row[self._left] - row[self._right]
            self._wanted[place :: self._size] = wanted[self._left] - wanted[self._right]
            self._rows += 1
        self._walked = self._walked + 1 if walking else 0
        self._wait += 1
        if self._final or self._exchanged():
            return
        if self._wait >= EVERY and self._rows >= self._size:
            self._wait = 0
            self._judge()

    def _exchanged(self) -> bool:
        """Whether a joint and its image in the other leg have each other's name.

        The difference between left and right then follows its target with the wrong sign. A load
        that moves both joints does not matter.
        """
        left, right, ticks = self._left, self._right, self._pair_ticks
        if self._rows < ticks + LAGS[-1]:
            return False
        end = self._size + self._rows % self._size
        first = end - ticks
        apart, wanted = self._apart[first:end], self._pair_windows[first - LAGS[-1] : first + 1]
        alike = np.einsum("ljt,tj->lj", wanted, apart) / ticks
        if alike.min() > -0.9 * PAIR_DEVIATION**2:
            return False  # none would be below
        # Of half the difference, which is the deviation of each.
        size = 0.25 * (np.mean(wanted**2, axis=2) + np.mean(apart**2, axis=0))
        own, other = (size - 0.5 * alike).min(axis=0), (size + 0.5 * alike).min(axis=0)
        pairs = (own > PAIR_DEVIATION**2) & (other < PAIR_DEVIATION**2)
        pairs &= own > BETTER * (other + 0.5 * NOISE**2)
        pairs &= ~(self._proven[left] & self._proven[right])
        pairs &= np.ptp(apart, axis=0) >= MOVED  # else motors that are off
        if pairs.any():  # their sum is as right as ever
            measured, target = self._measured[first:end], self._targets[first - LAGS[-1] : end]
            both = measured[:, left] + measured[:, right]
            sums = sliding_window_view(target[:, left] + target[:, right], ticks, axis=0)
            rest = 0.25 * np.mean((both.T - sums) ** 2, axis=2).min(axis=0)
            pairs &= rest < PAIR_DEVIATION**2
        if not pairs.any():
            return False
        if not self.trouble:
            wrong = np.zeros(len(self._names), dtype=bool)
            wrong[left[pairs]] = wrong[right[pairs]] = True
            off = np.zeros(len(self._names))
            off[left] = off[right] = own
            guesses = np.array(self._names, dtype=object)
            guesses[left], guesses[right] = guesses[right], guesses[left]
            guesses = np.array([f"exchanged with {each}?" for each in guesses])
            self._report(wrong, off, guesses, PAIR_WINDOW, PAIR_DEVIATION)
        return True

    def _judge(self) -> None:
        measured, shifted = self._window()
        rest = np.flatnonzero(~self._proven)
        off = shifted[:, :, rest] - measured[:, rest]
        own = np.zeros(len(self._names))
        own[rest] = np.einsum("ltj,ltj->lj", off, off).min(axis=0) / self._ticks
        suspect = own > self._deviation**2
        if suspect.any():
            left, guesses = self._explained(measured, shifted)
            named = suspect & (own > BETTER * (left + NOISE**2))
            held = np.isin(guesses, self._held)
            named &= (own > self._stuck**2) | ~held | (left < CONSTANT)
            gross = own > self._gross**2
            if gross.any():
                gross &= self._lasting(off, rest) > self._gross**2
            wrong = named | gross
            if wrong.any():
                if not self.trouble:
                    guessed = np.where(named, guesses, OTHER)
                    self._report(wrong, own, guessed, WINDOW, self._deviation)
                return
        self.trouble = ""
        if self._walked >= self._size:
            target = shifted[-LAGS[0]][:, rest]
            moved = np.ptp(target, axis=0) >= PROVEN_RANGE
            if moved.any():
                self._proven[rest] = moved & (own[rest] < PROVEN_SHARE * target.var(axis=0))
                self.done = bool(self._proven.all())

    def _lasting(self, off: FloatArray, rest: np.ndarray) -> FloatArray:
        """Squares (n,) [rad^2] of the deviations that a share `LASTING` of the readings exceeds.

        Args:
            off: Targets minus readings (lags, ticks, joints) [rad].
            rest: The joints (joints,) that have not proved themselves.
        """
        lasting = np.zeros(len(self._names))
        lasting[rest] = np.quantile(off**2, 1.0 - LASTING, axis=1).min(axis=0)
        return lasting

    def _window(self) -> tuple[FloatArray, FloatArray]:
        """Angles (ticks, n) [rad] and the targets for each lag (lags, ticks, n) [rad]."""
        begin = self._rows % self._size
        measured = self._measured[begin + LAGS[-1] :][: self._ticks]
        return measured, self._windows[begin : begin + len(LAGS)][::-1]

    def _explained(
        self, measured: FloatArray, shifted: FloatArray
    ) -> tuple[FloatArray, list[str]]:
        """Mean squares (n,) [rad^2] that the best other explanation leaves, and these.

        Args:
            measured: Angles (ticks, n) [rad].
            shifted: Targets (lags, ticks, n) [rad].
        """
        count = len(self._names)
        moved = np.ptp(shifted, axis=1) >= MOVED
        left = np.where(moved[0], measured.var(axis=0), np.inf)
        guesses = [STUCK] * count

        def take(squares: FloatArray, guess: list[str]) -> None:
            for joint in np.flatnonzero(squares < left):
                left[joint], guesses[joint] = squares[joint], guess[joint]

        for scale, guess in SCALES.items():
            squares = np.mean((measured - scale * shifted) ** 2, axis=1)
            take(squares.min(axis=0), [guess] * count)

        off = measured - shifted
        zeros = off.mean(axis=1)
        squares = np.where(np.abs(zeros) < ZERO_MIN, np.inf, off.var(axis=1))
        best = zeros[squares.argmin(axis=0), np.arange(count)]
        take(squares.min(axis=0), [f"zero off by {each:.2g} rad?" for each in best])

        size = np.mean(measured**2, axis=0)[:, None] + np.mean(shifted**2, axis=1)[:, None]
        others = size - 2.0 * (measured.T @ shifted) / len(measured)
        others = np.where(moved[:, None], others, np.inf).min(axis=0)
        np.fill_diagonal(others, np.inf)
        named = [f"exchanged with {self._names[k]}?" for k in others.argmin(axis=1)]
        take(others.min(axis=1), named)
        return left, guesses

    def _report(
        self, wrong: np.ndarray, own: FloatArray, guesses: np.ndarray, window: float, allowed: float
    ) -> None:
        # Motors that are off may be switched on; then the joints follow.
        follows_nobody = wrong & np.isin(guesses, (STUCK, OTHER))
        driven = 2 * follows_nobody.sum() <= len(self._names)
        self._found += driven and wrong.sum() <= 2  # deg in a stand are wrong now and then
        self._final = driven and (self._walked > 0 or self._found > 1)
        worst = int(np.argmax(np.where(wrong, own, 0.0)))
        more = [self._names[joint] for joint in np.flatnonzero(wrong) if joint != worst]
        also = f"; also {', '.join(more[:3])}{' and others' if len(more) > 3 else ''}"
        off = np.sqrt(own[worst])
        self.trouble = (
            f"joint_states position[{self._names[worst]}]: got {off:.2g} rad off its "
            f"target for {window:g} s; allowed: {allowed:g} rad, or what loads explain; "
            f"{guesses[worst]}{also if more else ''}; the robot stands"
        )
