"""Single support phases: when they changed, how long they took, how far they went."""

import itertools
from dataclasses import dataclass

import numpy as np

from gait_lab.analysis.metrics import DOUBLE, SUPPORT_CODES
from gait_lab.report.walk import IntArray, Walk
from nao_lipm_gait.geometry import relative
from nao_lipm_gait.types import FloatArray, Pose2

SAME = 1e-7
"""[m] by which one distance may differ in two coordinate systems."""


@dataclass(frozen=True, slots=True)
class Phase:
    """The gait in one state on one foot."""

    stamp: int
    """[ns] of its first tick."""
    end: int
    """[ns] of the next one's first tick."""
    state: str
    """stand, walk, stop, fallen, relaxed."""
    support: int
    """DOUBLE, LEFT or RIGHT."""
    sole_in_odom: Pose2 | None
    """The support sole as the phase began; None where no footsteps were recorded."""
    q_in_odom: Pose2 | None
    """The paper's Q."""

    @property
    def duration(self) -> float:
        """[s]"""
        return (self.end - self.stamp) * 1e-9


def find_phases(walk: Walk) -> tuple[Phase, ...]:
    """The phases in order, sharp to the tick where footsteps were recorded.

    The topic `support` has no stamp, only a time of arrival, and a busy recorder is late. So it
    says when the gait walked; on which foot, the footsteps say, which are drawn in the very tick of
    each support change, the sole that does not carry the robot pale.
    """
    changes = _told(walk)
    if not changes:
        return ()
    drawn, sides = _drawn_changes(walk)
    if len(drawn):
        changes = _sharpened(changes, drawn, sides)
    end = walk.origin + round(walk.duration * 1e9)
    phases = []
    for index, (stamp, state, support) in enumerate(changes):
        until = changes[index + 1][0] if index + 1 < len(changes) else max(stamp, end)
        sole = _sole_at(walk, stamp, support) if support != DOUBLE else None
        q = _q_in_odom(walk, stamp, until) if support != DOUBLE else None
        phases.append(Phase(stamp, until, state, support, sole, q))
    return tuple(phases)


Change = tuple[int, str, int]
"""Stamp [ns], state, support."""


def _told(walk: Walk) -> list[Change]:
    """What the topic `support` said. A change belongs to sensors that were old when it was told."""
    changes: list[Change] = []
    for arrived, text in walk.support:
        state, _, support = text.partition(" ")
        if support in SUPPORT_CODES:
            stamp = arrived - walk.age
            if len(walk.expected):
                near = np.argmin(np.abs(walk.expected.stamp - stamp))
                stamp = int(walk.expected.stamp[near])
            if changes and stamp <= changes[-1][0]:
                stamp = changes[-1][0] + max(1, walk.period)
            changes.append((stamp, state, SUPPORT_CODES[support]))
    return changes


def _drawn_changes(walk: Walk) -> tuple[IntArray, IntArray]:
    """Stamps of the support changes that the footsteps show, and the support then."""
    steps = walk.footsteps
    if len(steps.stamp) < 2:
        return steps.stamp[:0], steps.stamp[:0]
    if np.any(steps.support != DOUBLE):
        changed = np.flatnonzero(np.diff(steps.support)) + 1
        changed = changed[steps.support[changed] != DOUBLE]
        return steps.stamp[changed], steps.support[changed]
    # A bag in which no sole is pale: the CoM jumps in Q, and not in odom.
    in_q = walk.estimated.at(steps.stamp)[:, :2]
    moved_in_q = np.linalg.norm(np.diff(in_q, axis=0), axis=1)
    moved_in_odom = np.linalg.norm(np.diff(steps.com, axis=0), axis=1)
    changed = np.flatnonzero(np.abs(moved_in_q - moved_in_odom) > SAME) + 1
    return steps.stamp[changed], _sides(walk)[changed]


def _sides(walk: Walk) -> IntArray:
    """LEFT or RIGHT, for each footsteps: the sole next to the pendulum origin."""
    steps = walk.footsteps
    left = np.linalg.norm(steps.origin - steps.left_sole[:, :2], axis=1)
    right = np.linalg.norm(steps.origin - steps.right_sole[:, :2], axis=1)
    return np.where(left < right, SUPPORT_CODES["left"], SUPPORT_CODES["right"])


def _sharpened(told: list[Change], drawn: IntArray, sides: IntArray) -> list[Change]:
    """The same walks, with the support changes as drawn."""
    sharp: list[Change] = []
    index = 0
    while index < len(told):
        stamp, state, support = told[index]
        if support == DOUBLE:
            sharp.append(told[index])
            index += 1
            continue
        # All of one walk, up to the next change of state.
        last = index
        while last + 1 < len(told) and told[last + 1][1] == state and told[last + 1][2]:
            last += 1
        until = told[last + 1][0] if last + 1 < len(told) else 2**62
        sharp.append((stamp, state, support))
        row = int(np.searchsorted(drawn, stamp, side="right"))
        while row < len(drawn) and drawn[row] < until:
            if sides[row] != sharp[-1][2]:
                sharp.append((int(drawn[row]), state, int(sides[row])))
            row += 1
        index = last + 1
    return sharp


def _sole_at(walk: Walk, stamp: int, support: int) -> Pose2 | None:
    row = int(np.searchsorted(walk.footsteps.stamp, stamp))
    if row >= len(walk.footsteps.stamp) or walk.footsteps.stamp[row] != stamp:
        return None
    soles = (
        walk.footsteps.left_sole if support == SUPPORT_CODES["left"] else walk.footsteps.right_sole
    )
    x, y, yaw = soles[row].tolist()
    return x, y, yaw


def _q_in_odom(walk: Walk, stamp: int, until: int) -> Pose2 | None:
    """Where Q lies, from CoMs that are given in Q and in odom alike; None with fewer than two."""
    inside = (walk.footsteps.stamp >= stamp) & (walk.footsteps.stamp < until)
    in_odom = walk.footsteps.com[inside]
    in_q = walk.estimated.at(walk.footsteps.stamp[inside])[:, :2]
    known = np.isfinite(in_q).all(axis=1)
    in_odom, in_q = in_odom[known], in_q[known]
    if len(in_q) < 2 or np.linalg.norm(np.ptp(in_q, axis=0)) < 1e-3:
        return None
    a, b = in_q - in_q.mean(axis=0), in_odom - in_odom.mean(axis=0)
    yaw = float(np.arctan2((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum(), (a * b).sum()))
    c, s = np.cos(yaw), np.sin(yaw)
    x, y = in_odom.mean(axis=0) - np.array([[c, -s], [s, c]]) @ in_q.mean(axis=0)
    return float(x), float(y), yaw


@dataclass(frozen=True, slots=True)
class Step:
    """From one support change to the next while walking."""

    time: float
    """[s] on the report's axis, when it began."""
    support: int
    duration: float
    """[s]"""
    size: tuple[float, float, float] | None
    """x, y [m], yaw [rad] of the next Q in this one, as it came out by odometry."""


def find_steps(walk: Walk, phases: tuple[Phase, ...]) -> tuple[Step, ...]:
    """Every whole step: a single support with another one after it."""
    steps = []
    for phase, following in itertools.pairwise(phases):
        if phase.support == DOUBLE or following.support in (DOUBLE, phase.support):
            continue
        size = None
        if phase.q_in_odom is not None and following.q_in_odom is not None:
            size = relative(following.q_in_odom, phase.q_in_odom)
            size = (size[0], size[1], (size[2] + np.pi) % (2 * np.pi) - np.pi)
        steps.append(
            Step(float(walk.seconds(phase.stamp)), phase.support, phase.duration, size)
        )
    return tuple(steps)


def origins_under_sole(walk: Walk, phases: tuple[Phase, ...], support: int) -> FloatArray:
    """(m, 3) time [s] and pendulum origin x, y [m] in the frame of the support sole."""
    rows = []
    stamps = walk.footsteps.stamp
    # Shortly before a change the gait already plans, and draws, the origin of the next phase.
    own = _sides(walk) == support
    for phase in phases:
        if phase.support != support or phase.state != "walk" or phase.sole_in_odom is None:
            continue
        for row in np.flatnonzero(own & (stamps >= phase.stamp) & (stamps < phase.end)):
            x, y = walk.footsteps.origin[row].tolist()
            at = relative((x, y, 0.0), phase.sole_in_odom)
            rows.append((float(walk.seconds(int(stamps[row]))), at[0], at[1]))
    return np.array(rows) if rows else np.empty((0, 3))


def supports_at(phases: tuple[Phase, ...], stamps: IntArray) -> IntArray:
    """(t,) the support of each stamp; DOUBLE before the first phase."""
    begins = np.array([phase.stamp for phase in phases], dtype=np.int64)
    codes = np.array([DOUBLE, *(phase.support for phase in phases)], dtype=np.int64)
    return codes[np.searchsorted(begins, stamps, side="right")]
