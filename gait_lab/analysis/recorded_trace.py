"""Support phases, steps and the `Trace` of a recorded walk."""

import itertools
import math
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from gait_lab.analysis.body import BodyTrack, yaw_of_pose
from gait_lab.analysis.recorded_walk import RecordedWalk, Table, read_walk
from robot_core.geometry import planar_rotation, relative, rotate_each
from robot_core.types import FloatArray, Pose2
from sim_bridge.trials.trace import DOUBLE, LEFT, RIGHT, SUPPORT_CODES, IntArray, Trace


@dataclass(frozen=True, slots=True)
class SupportPhase:
    """The gait in one state, on one foot or on both.

    Attributes:
        stamp: [ns] of its first tick.
        end: [ns] of the next one's first tick.
        state: `stand`, `walk`, `stop`, `fallen` or `relaxed`.
        support: DOUBLE, LEFT or RIGHT.
        sole_in_odom: The support sole as the phase began; None where no footsteps were recorded.
        q_in_odom: The paper's Q.
    """

    stamp: int
    end: int
    state: str
    support: int
    sole_in_odom: Pose2 | None
    q_in_odom: Pose2 | None

    @property
    def duration(self) -> float:
        """Duration [s]."""
        return (self.end - self.stamp) * 1e-9


def find_phases(walk: RecordedWalk) -> tuple[SupportPhase, ...]:
    """The support phases in order, exact to the tick where footsteps were recorded.

    The topic `support` has no stamp, only a time of arrival, which is late on a busy recorder. It
    is used for the state of the gait. The support foot is taken from the footsteps: they are drawn
    in the tick of each support change, with the swinging sole pale.
    """
    changes = _published_changes(walk)
    if not changes:
        return ()
    drawn, sides = _drawn_changes(walk)
    if len(drawn):
        changes = _exact(changes, drawn, sides)
    end = walk.origin + round(walk.duration * 1e9)
    phases = []
    for index, (stamp, state, support) in enumerate(changes):
        until = changes[index + 1][0] if index + 1 < len(changes) else max(stamp, end)
        sole = _sole_at(walk, stamp, support) if support != DOUBLE else None
        q = _q_in_odom(walk, stamp, until) if support != DOUBLE else None
        phases.append(SupportPhase(stamp, until, state, support, sole, q))
    return tuple(phases)


Change = tuple[int, str, int]
"""Stamp [ns], state, support."""


def _published_changes(walk: RecordedWalk) -> list[Change]:
    """The changes on the topic `support`, at the stamps of the sensors that they belong to."""
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


def _drawn_changes(walk: RecordedWalk) -> tuple[IntArray, IntArray]:
    """Stamps of the support changes that the footsteps show, and the support then."""
    steps = walk.footsteps
    if len(steps.stamp) < 2:
        return steps.stamp[:0], steps.stamp[:0]
    changed = np.flatnonzero(np.diff(steps.support)) + 1
    changed = changed[steps.support[changed] != DOUBLE]
    return steps.stamp[changed], steps.support[changed]


def _exact(published: list[Change], drawn: IntArray, sides: IntArray) -> list[Change]:
    """The published changes with the support changes at the stamps at which they were drawn."""
    exact: list[Change] = []
    index = 0
    while index < len(published):
        stamp, state, support = published[index]
        if support == DOUBLE:
            exact.append(published[index])
            index += 1
            continue
        # All of one walk, up to the next change of state.
        last, single = index, ((state, LEFT), (state, RIGHT))
        while last + 1 < len(published) and published[last + 1][1:] in single:
            last += 1
        until = published[last + 1][0] if last + 1 < len(published) else 2**62
        exact.append((stamp, state, support))
        row = int(np.searchsorted(drawn, stamp, side="right"))
        while row < len(drawn) and drawn[row] < until:
            if sides[row] != exact[-1][2]:
                exact.append((int(drawn[row]), state, int(sides[row])))
            row += 1
        index = last + 1
    return exact


def _sole_at(walk: RecordedWalk, stamp: int, support: int) -> Pose2 | None:
    row = int(np.searchsorted(walk.footsteps.stamp, stamp))
    if row >= len(walk.footsteps.stamp) or walk.footsteps.stamp[row] != stamp:
        return None
    soles = (
        walk.footsteps.left_sole if support == LEFT else walk.footsteps.right_sole
    )
    x, y, yaw = soles[row].tolist()
    return x, y, yaw


def _q_in_odom(walk: RecordedWalk, stamp: int, until: int) -> Pose2 | None:
    """Pose of Q in odom, fitted to CoMs known in both; None with fewer than two."""
    inside = (walk.footsteps.stamp >= stamp) & (walk.footsteps.stamp < until)
    in_odom = walk.footsteps.com[inside]
    in_q = walk.estimated.at(walk.footsteps.stamp[inside])[:, :2]
    known = np.isfinite(in_q).all(axis=1)
    in_odom, in_q = in_odom[known], in_q[known]
    if len(in_q) < 2 or np.linalg.norm(np.ptp(in_q, axis=0)) < 1e-3:
        return None
    a, b = in_q - in_q.mean(axis=0), in_odom - in_odom.mean(axis=0)
    yaw = float(np.arctan2((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum(), (a * b).sum()))
    x, y = in_odom.mean(axis=0) - planar_rotation(yaw) @ in_q.mean(axis=0)
    return float(x), float(y), yaw


@dataclass(frozen=True, slots=True)
class Step:
    """A step: from one support change to the next while walking.

    Attributes:
        time: [s] on the report's axis, when it began.
        support: LEFT or RIGHT.
        duration: [s].
        size: x, y [m], yaw [rad] of the next Q in this one, as it came out by odometry.
    """

    time: float
    support: int
    duration: float
    size: tuple[float, float, float] | None


def find_steps(walk: RecordedWalk, phases: tuple[SupportPhase, ...]) -> tuple[Step, ...]:
    """Every complete step: a single support that another one follows."""
    steps = []
    for phase, following in itertools.pairwise(phases):
        if phase.support == DOUBLE or following.support in (DOUBLE, phase.support):
            continue
        size = None
        if phase.q_in_odom is not None and following.q_in_odom is not None:
            size = relative(following.q_in_odom, phase.q_in_odom)
            size = (size[0], size[1], math.remainder(size[2], math.tau))
        steps.append(
            Step(float(walk.seconds(phase.stamp)), phase.support, phase.duration, size)
        )
    return tuple(steps)


def origins_under_sole(
    walk: RecordedWalk, phases: tuple[SupportPhase, ...], support: int
) -> FloatArray:
    """(m, 3) time [s] and pendulum origin x, y [m] in the frame of the support sole."""
    rows = []
    steps = walk.footsteps
    stamps = steps.stamp
    # Shortly before a change the gait already draws the origin of the next phase.
    left = np.linalg.norm(steps.origin - steps.left_sole[:, :2], axis=1)
    right = np.linalg.norm(steps.origin - steps.right_sole[:, :2], axis=1)
    own = np.where(left < right, LEFT, RIGHT) == support
    for phase in phases:
        if phase.support != support or phase.state != "walk" or phase.sole_in_odom is None:
            continue
        for row in np.flatnonzero(own & (stamps >= phase.stamp) & (stamps < phase.end)):
            x, y = steps.origin[row].tolist()
            at = relative((x, y, 0.0), phase.sole_in_odom)
            rows.append((float(walk.seconds(int(stamps[row]))), at[0], at[1]))
    return np.array(rows) if rows else np.empty((0, 3))


def supports_at(phases: tuple[SupportPhase, ...], stamps: IntArray) -> IntArray:
    """(t,) the support of each stamp; DOUBLE before the first phase."""
    begins = np.array([phase.stamp for phase in phases], dtype=np.int64)
    codes = np.array([DOUBLE, *(phase.support for phase in phases)], dtype=np.int64)
    return codes[np.searchsorted(begins, stamps, side="right")]


def read_trace(path: str | Path) -> Trace | None:
    """The trace of a bag, without poses of the soles; None if the bag has no motion data.

    Args:
        path: A rosbag2 folder, or an .mcap or .db3 file.

    Raises:
        NaoGaitError: The path is no bag.
    """
    walk = read_walk(Path(path))
    return make_trace(walk, find_phases(walk), None)


def make_trace(
    walk: RecordedWalk, phases: tuple[SupportPhase, ...], body: BodyTrack | None
) -> Trace | None:
    """The recorded walk as the `Trace` that the benchmark measures; both give the same numbers.

    A row has the truth of a tick and what the gait published in that tick, which belongs to older
    sensors. What the bag lacks is NaN, and so are the metrics that need it.

    Args:
        walk: The recording.
        phases: Its support phases.
        body: Its body; None if unknown.

    Returns:
        The trace; None without ground truth and without odometry.
    """
    if len(walk.truth):
        stamp = walk.truth.stamp
        torso = walk.truth.value
    elif len(walk.odometry) > 1:
        stamp = walk.odometry.stamp
        torso = _torso_from_odometry(walk.odometry)
    else:
        return None
    status_stamp = stamp - _rounded(walk.age, walk.period)
    seen = walk.expected if len(walk.expected) else walk.odometry
    status_stamp = np.where(np.isfinite(seen.at(status_stamp)[:, 0]), status_stamp, -1)
    support = np.where(status_stamp >= 0, supports_at(phases, status_stamp), DOUBLE)
    position, yaw, force = _soles(walk, body, stamp)
    count = len(stamp)
    known = {
        "stamp": stamp,
        "torso_position": torso[:, 0:3],
        "torso_quaternion": torso[:, 3:7],
        "torso_velocity": torso[:, 7:10],
        "com": walk.true_com.at(stamp),
        "sole_position": position,
        "sole_yaw": yaw,
        "sole_force": force,
        "sole_slip": np.full((count, 2), np.nan),
        "legs_touch": np.zeros(count, dtype=bool),
        "saturated": np.zeros(count, dtype=np.int64),
        "command": _held(walk.command, stamp),
        "odometry": walk.odometry.at(status_stamp),
        "status_stamp": status_stamp,
        "support": support,
        "support_sole_in_q": _support_sole_in_q(phases, status_stamp),
        "com_expected_in_q": walk.expected.at(status_stamp),
        "com_measured_in_q": walk.measured.at(status_stamp),
        "com_estimated_in_q": walk.estimated.at(status_stamp),
    }
    for field in fields(Trace):
        # What is on no topic cannot have been recorded.
        known.setdefault(field.name, np.zeros(count, dtype=bool))
    return Trace(**known)


def _rounded(value: int, period: int) -> int:
    return round(value / period) * period if period else value


def _torso_from_odometry(odometry: Table) -> FloatArray:
    """(t, 10) like ground truth, with an unknown height and an upright torso."""
    x, y, yaw = odometry.value.T
    yaw = np.unwrap(yaw)
    seconds = odometry.stamp * 1e-9
    vx, vy = np.gradient(x, seconds), np.gradient(y, seconds)
    rows = np.zeros((len(odometry), 10))
    rows[:, 0], rows[:, 1], rows[:, 2] = x, y, np.nan
    rows[:, 5], rows[:, 6] = np.sin(0.5 * yaw), np.cos(0.5 * yaw)
    rows[:, 7], rows[:, 8] = rotate_each(vx, vy, -yaw)
    return rows


def _soles(
    walk: RecordedWalk, body: BodyTrack | None, stamp: IntArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Positions (t, 2, 3) [m], headings (t, 2) [rad] and normal forces (t, 2) [N]."""
    count = len(stamp)
    position, yaw = np.full((count, 2, 3), np.nan), np.full((count, 2), np.nan)
    up = np.tile(np.array([0.0, 0.0, 1.0]), (count, 2, 1))
    if body is not None and len(body.stamp):
        row = np.minimum(np.searchsorted(body.stamp, stamp), len(body.stamp) - 1)
        same = body.stamp[row] == stamp
        position[same] = body.sole[row[same], :, :3, 3]
        yaw[same] = yaw_of_pose(body.sole)[row[same]]
        if body.from_truth:
            up[same] = body.sole[row[same], :, 2, :3]
    force = np.stack(
        [(table.at(stamp)[:, :3] * up[:, side]).sum(axis=1)
         for side, table in enumerate(walk.wrenches)], axis=1,
    )  # fmt: skip
    return position, yaw, force


def _held(command: Table, stamp: IntArray) -> FloatArray:
    """(t, 3) the last command before each stamp; NaN before the first."""
    result = np.full((len(stamp), 3), np.nan)
    if len(command):
        row = np.searchsorted(command.stamp, stamp, side="right") - 1
        result[row >= 0] = command.value[row[row >= 0]]
    return result


def _support_sole_in_q(phases: tuple[SupportPhase, ...], stamp: IntArray) -> FloatArray:
    rows = [(np.nan, np.nan, np.nan)]
    for phase in phases:
        sole, q = phase.sole_in_odom, phase.q_in_odom
        rows.append(
            rows[0] if sole is None or q is None or phase.support == DOUBLE
            else relative(sole, q)
        )  # fmt: skip
    begins = np.array([phase.stamp for phase in phases], dtype=np.int64)
    return np.array(rows)[np.searchsorted(begins, stamp, side="right")]
