"""A recorded walk: the topics of a bag as arrays over simulated time, in any namespace."""

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter, itemgetter
from pathlib import Path
from typing import Any

import numpy as np

from gait_lab.analysis.bag import BagContents, on_one_clock, open_bag
from gait_lab.analysis.recorded_topics import (
    PARTS,
    find_parts,
    may_be_part,
    missing_parts,
    robots_in,
    topics_of,
)
from robot_core.geometry import yaw_of_quaternion
from robot_core.types import FloatArray, Pose2
from sim_bridge.trials.trace import DOUBLE, LEFT, RIGHT, IntArray

_NANO = 1e-9
RESTART = 500_000_000
"""[ns] A longer step back in time begins a new run; a shorter one is a late message."""
STEADY = ("joints", "odometry", "truth", "targets", "expected")
"""Parts that are sent in every tick."""
Messages = Sequence[tuple[int, Any]]


@dataclass(frozen=True, slots=True)
class Table:
    """t rows over time.

    Attributes:
        stamp: (t,) [ns] of the values, strictly increasing.
        arrived: (t,) [ns] when they were recorded, on the same clock.
        value: (t, n).
    """

    stamp: IntArray
    arrived: IntArray
    value: FloatArray

    def __len__(self) -> int:
        return len(self.stamp)

    def at(self, stamps: IntArray) -> FloatArray:
        """(s, n) the rows with exactly these stamps (s,); NaN where there is none."""
        result = np.full((len(stamps), self.value.shape[1]), np.nan)
        if len(self):
            row = np.minimum(np.searchsorted(self.stamp, stamps), len(self) - 1)
            same = self.stamp[row] == stamps
            result[same] = self.value[row[same]]
        return result


@dataclass(frozen=True, slots=True)
class Footsteps:
    """What the topic `footsteps` drew, in odom: m rows.

    Attributes:
        stamp: (m,) [ns].
        left_sole: (m, 3) x, y [m], yaw [rad] of the left sole.
        right_sole: (m, 3) the same of the right sole.
        origin: (m, 2) [m] pendulum origin.
        com: (m, 2) [m] estimated CoM.
        support: (m,) LEFT or RIGHT: the other sole is drawn pale; DOUBLE where none is.
    """

    stamp: IntArray
    left_sole: FloatArray
    right_sole: FloatArray
    origin: FloatArray
    com: FloatArray
    support: IntArray


@dataclass(frozen=True, slots=True)
class RecordedWalk:
    """The topics of one bag.

    Attributes:
        parts: Topic by part, see `PARTS`.
        missing: Which parts the bag lacks, in words.
        remarks: What was wrong with the bag, in words.
        step: Which part is used of a bag whose clock was set, in words; empty for any other.
        origin: [ns] the zero of every time axis.
        age: [ns] median age of the sensors when they were recorded; 0 if unknown.
        position: (t, j) [rad].
        velocity: (t, j) [rad/s].
        effort: (t, j) [N m].
        targets: (t, k) [rad]; the stamp is that of the joint state that is answered.
        command: (t, 3) [m/s, m/s, rad/s].
        truth: (t, 10) torso in world: x, y, z [m], quaternion xyzw, velocity in the torso frame
            [m/s].
        true_com: (t, 3) [m] in world.
        odometry: (t, 3) x, y [m], yaw [rad] of base_footprint in odom.
        expected: (t, 3) [m] CoM in Q.
        measured: (t, 3) [m] CoM in Q.
        estimated: (t, 3) [m] CoM in Q.
        wrenches: Left, right: (t, 6) force [N] and torque [N m] in the sole frame.
        push: (t, 3) [N] in world.
        support: (arrival [ns], state and support foot) at each change.
        diagnostics: (arrival [ns], values by name).
        urdf: The robot_description; None without one.
        seen: (stamp [ns] of the image, `vision/percepts`), in order.
        ball: (t, 3) [m] true centre of the ball in world.
        scene: The scene_description; None without one.
        others: The other robots of the bag by name: as `truth`.
        own_pose: (t, 5) what the player estimates: x, y [m], yaw [rad] of base_footprint in its
            field, and the deviations of place [m] and heading [rad].
        own_valid: (t, 1) 1 where its pose estimate is valid, at arrival.
        own_ball: (t, 2) [m] the ball in its field.
    """

    name: str
    bag: BagContents
    parts: dict[str, str]
    missing: tuple[str, ...]
    remarks: tuple[str, ...]
    step: str
    origin: int
    age: int
    joint_names: tuple[str, ...]
    position: Table
    velocity: Table
    effort: Table
    target_names: tuple[str, ...]
    targets: Table
    command: Table
    truth: Table
    true_com: Table
    odometry: Table
    expected: Table
    measured: Table
    estimated: Table
    wrenches: tuple[Table, Table]
    push: Table
    support: tuple[tuple[int, str], ...]
    footsteps: Footsteps
    diagnostics: tuple[tuple[int, dict[str, str]], ...]
    urdf: str | None
    seen: tuple[tuple[int, Any], ...]
    ball: Table
    scene: str | None
    others: Mapping[str, Table]
    own_pose: Table
    own_valid: Table
    own_ball: Table

    @property
    def duration(self) -> float:
        """[s] from the origin to the last sensor or status."""
        tables = (self.position, self.truth, self.odometry, self.expected, self.targets)
        ends = [int(table.stamp[-1]) for table in tables if len(table)]
        return max(0.0, (max(ends, default=self.origin) - self.origin) * _NANO)

    @property
    def period(self) -> int:
        """[ns] median time between two joint states; 0 without any."""
        for table in (self.position, self.expected, self.truth):
            if len(table) > 1:
                return int(np.median(np.diff(table.stamp)))
        return 0

    def seconds(self, stamp: IntArray | int) -> FloatArray:
        """Stamps [ns] as times since the origin [s]."""
        return (np.asarray(stamp) - self.origin) * _NANO


def read_walk(path: Path, robot: str = "") -> RecordedWalk:
    """Read a bag.

    Args:
        path: A rosbag2 folder, or an .mcap or .db3 file.
        robot: Name of a robot out of several; "" for the only one.

    Returns:
        The walk; what the bag lacks is empty and listed in `missing`.

    Raises:
        NaoGaitError: The path is no bag, or the bag has no such robot.
    """
    bag = open_bag(path, wanted=may_be_part)
    prefix, topics = topics_of(bag.topics, robot)
    parts = find_parts(topics)
    steady, step = next((parts[part] for part in STEADY if part in parts), None), ""
    if steady is not None:
        latched = {parts[part] for part in ("description", "scene") if part in parts}
        bag, step = on_one_clock(bag, steady, latched)

    def messages(part: str) -> Messages:
        found = bag.messages.get(parts[part], ()) if part in parts else ()
        return _of_one_side(found) if step and "clock" not in parts else found

    clock = _Clock(messages("clock"), messages("joints"))
    remarks = list(bag.remarks)

    def table(part: str, width: int, values: Callable[[Any], Any], stamped: bool = True) -> Table:
        return of_topic(parts.get(part, part), messages(part), width, values, stamped)

    def of_topic(
        name: str, found: Messages, width: int, values: Callable[[Any], Any], stamped: bool = True
    ) -> Table:
        rows = []
        for log, message in found:
            arrived = clock.at(log)
            stamp = _stamp(message) if stamped else arrived
            rows.append((stamp or arrived, arrived, values(message)))
        return _rising(rows, width, name, remarks)

    names, targets = _names(messages("joints")), _names(messages("targets"))
    tables = {
        **{
            field: table("joints", len(names), _by_name(names, field))
            for field in ("position", "velocity", "effort")
        },
        "targets": table("targets", len(targets), _by_name(targets, "position")),
        "command": table("command", 3, _twist, stamped=False),
        "truth": table("truth", 10, _odometry3),
        "true_com": table("true_com", 3, _point),
        "odometry": table("odometry", 3, lambda m: _planar(m.pose.pose)),
        "expected": table("expected", 3, _point),
        "measured": table("measured", 3, _point),
        "estimated": table("estimated", 3, _point),
        "push": table("push", 3, _force, stamped=False),
    }
    firsts = [int(each.stamp[0]) for each in tables.values() if len(each)]
    descriptions, scenes = messages("description"), messages("scene")
    others = {
        name: f"{other}{PARTS['truth'].topic}"
        for name, other in robots_in(bag.topics).items()
        if other != prefix
    }
    return RecordedWalk(
        name=path.name if path.name != "bag" else path.resolve().parent.name,
        bag=bag,
        parts=parts,
        missing=tuple(missing_parts(parts)),
        remarks=tuple(dict.fromkeys(remarks)),
        step=step,
        origin=min(firsts, default=0),
        age=_age(tables["position"]),
        joint_names=names,
        target_names=targets,
        wrenches=(table("left_sole", 6, _wrench), table("right_sole", 6, _wrench)),
        support=tuple((clock.at(log), str(m.data)) for log, m in messages("support")),
        footsteps=_footsteps(messages("footsteps")),
        diagnostics=tuple(
            (clock.at(log), values)
            for log, m in messages("diagnostics")
            if (values := _diagnosed(m, prefix))
        ),
        urdf=str(descriptions[-1][1].data) if descriptions else None,
        seen=tuple(sorted(((_stamp(m), m) for _, m in messages("percepts")), key=itemgetter(0))),
        ball=table("ball", 3, _point),
        own_pose=table("own_pose", 5, _own_pose),
        own_valid=table("own_valid", 1, lambda m: (float(m.data),), stamped=False),
        own_ball=table("own_ball", 2, _place),
        scene=str(scenes[-1][1].data) if scenes else None,
        others={
            name: of_topic(topic, bag.messages.get(topic, ()), 10, _odometry3)
            for name, topic in others.items()
        },
        **tables,
    )


def _of_one_side(messages: Messages) -> Messages:
    """Without those that were stamped before the clock was set and logged after it."""
    stamps = [_header_stamp(message) for _, message in messages]
    if not stamps or not all(stamps):
        return messages
    ages = np.array([log for log, _ in messages]) - np.array(stamps)
    near = np.abs(ages - np.median(ages)) < RESTART
    return [each for each, keep in zip(messages, near, strict=True) if keep]


def _header_stamp(message: Any) -> int:
    """[ns] of a message or its first marker; 0 if it has none."""
    first = message.markers[0] if getattr(message, "markers", ()) else message
    return _stamp(first) if hasattr(first, "header") else 0


class _Clock:
    """Turns log times into simulated times; `ros2 bag record` may have logged wall time."""

    def __init__(self, clock: Messages, joints: Messages) -> None:
        if clock:
            pairs = [(log, _nanoseconds(message.clock)) for log, message in clock]
        else:
            pairs = [(log, stamp) for log, m in joints if (stamp := _stamp(m))]
        self._log = np.array([pair[0] for pair in pairs], dtype=np.int64)
        self._offset = np.array([pair[1] - pair[0] for pair in pairs], dtype=np.int64)
        # Recorded on the same clock: nothing to convert, also where a message came a tick late.
        self._same = not len(pairs) or bool(np.max(np.abs(self._offset)) < 1_000_000_000)

    def at(self, log: int) -> int:
        if self._same:
            return log
        row = max(0, int(np.searchsorted(self._log, log, side="right")) - 1)
        return log + int(self._offset[row])


def _age(joints: Table) -> int:
    if not len(joints):
        return 0
    return max(0, int(np.median(joints.arrived - joints.stamp)))


def _rising(
    rows: list[tuple[int, int, Any]], width: int, topic: str, remarks: list[str]
) -> Table:
    """The rows by increasing stamp, each stamp once; the longest of several runs in one bag."""
    # Several messages can have the same log time; readers return them in any order.
    rows = sorted(rows, key=lambda row: (row[1], row[0]))
    stamps = np.array([row[0] for row in rows], dtype=np.int64)
    begins = [0, *(np.flatnonzero(np.diff(stamps) < -RESTART) + 1).tolist(), len(rows)]
    if len(begins) > 2:
        runs = list(itertools.pairwise(begins))
        first, last = max(runs, key=lambda run: run[1] - run[0])
        rows, stamps = rows[first:last], stamps[first:last]
        remarks.append(f"{topic}: time restarts {len(runs) - 1} times; the longest run is kept")
    _, order = np.unique(stamps, return_index=True)
    value = np.full((len(order), width), np.nan)
    for index, row in enumerate(order):
        value[index] = rows[row][2]
    return Table(
        stamps[order], np.array([rows[row][1] for row in order], dtype=np.int64), value
    )


def _nanoseconds(time: Any) -> int:
    return int(time.sec) * 1_000_000_000 + int(time.nanosec)


def _stamp(message: Any) -> int:
    return _nanoseconds(message.header.stamp)


def _own_pose(message: Any) -> tuple[float, ...]:
    at, turn = message.pose.pose.position, message.pose.pose.orientation
    c = np.maximum(np.array(message.pose.covariance).reshape(6, 6), 0.0)
    return at.x, at.y, 2.0 * np.arctan2(turn.z, turn.w), np.sqrt(max(c[0, 0], c[1, 1])), np.sqrt(
        c[5, 5]
    )


def _diagnosed(message: Any, prefix: str) -> dict[str, str]:
    """Values of the statuses of one robot; /diagnostics has those of all."""
    own = f"{prefix.lstrip('/')}/" if prefix else ""
    return {
        value.key: value.value
        for status in message.status
        if status.name.lstrip("/").startswith(own)
        for value in status.values
    }


def _names(messages: Messages) -> tuple[str, ...]:
    return tuple(messages[0][1].name) if messages else ()


def _by_name(names: tuple[str, ...], field: str) -> Callable[[Any], Any]:
    def values(message: Any) -> Any:
        row = getattr(message, field)
        if len(row) != len(message.name):
            return np.nan  # the field is not filled
        if tuple(message.name) == names:
            return row
        by_name = dict(zip(message.name, row, strict=True))
        return [by_name.get(name, np.nan) for name in names]

    return values


def _twist(message: Any) -> tuple[float, float, float]:
    twist = getattr(message, "twist", message)
    return twist.linear.x, twist.linear.y, twist.angular.z


_point = attrgetter("point.x", "point.y", "point.z")
_place = attrgetter("pose.pose.position.x", "pose.pose.position.y")
_force = attrgetter(*(f"wrench.force.{axis}" for axis in "xyz"))
_wrench = attrgetter(*(f"wrench.{part}.{axis}" for part in ("force", "torque") for axis in "xyz"))
_odometry3 = attrgetter(
    *(f"pose.pose.position.{axis}" for axis in "xyz"),
    *(f"pose.pose.orientation.{axis}" for axis in "xyzw"),
    *(f"twist.twist.linear.{axis}" for axis in "xyz"),
)


def _planar(pose: Any) -> Pose2:
    p, q = pose.position, pose.orientation
    return p.x, p.y, yaw_of_quaternion(q.x, q.y, q.z, q.w)


def _footsteps(messages: Messages) -> Footsteps:
    rows: list[tuple[Any, ...]] = []
    for _, message in messages:
        poses = {marker.ns: marker.pose for marker in message.markers}
        if not {"left sole", "right sole", "pendulum origin", "com"} <= set(poses):
            continue
        stamp = _stamp(message.markers[0])
        if rows and stamp <= rows[-1][0]:
            continue
        soles = _planar(poses["left sole"]), _planar(poses["right sole"])
        points = [
            (p.position.x, p.position.y) for p in (poses["pendulum origin"], poses["com"])
        ]
        opacity = {marker.ns: marker.color.a for marker in message.markers}
        left_more = opacity["left sole"] - opacity["right sole"]
        support = LEFT if left_more > 0 else RIGHT if left_more < 0 else DOUBLE
        rows.append((stamp, *soles, *points, support))
    columns = list(zip(*rows, strict=True)) if rows else [(), (), (), (), (), ()]
    left, right, origin, com = (
        np.array(column, dtype=float).reshape(len(rows), width)
        for column, width in zip(columns[1:5], (3, 3, 2, 2), strict=True)
    )
    stamps, supports = (np.array(columns[i], dtype=np.int64) for i in (0, 5))
    return Footsteps(stamps, left, right, origin, com, supports)
