"""A recorded walk as arrays over simulated time; what the bag lacks is empty."""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gait_lab.analysis.bag_reading import BagContents, open_bag
from gait_lab.analysis.metrics import DOUBLE, LEFT, RIGHT
from gait_lab.report.topics import find_parts, missing_parts
from nao_lipm_gait.types import FloatArray

IntArray = NDArray[np.int64]
_NANO = 1e-9
RESTART = 500_000_000
"""[ns] A longer step back in time is a new run and not a message out of order."""
Messages = Sequence[tuple[int, Any]]


@dataclass(frozen=True, slots=True)
class Table:
    """Rows over time, t of them."""

    stamp: IntArray
    """(t,) [ns] that the values belong to, rising."""
    arrived: IntArray
    """(t,) [ns] when they were recorded, on the same clock."""
    value: FloatArray
    """(t, n)"""

    def __len__(self) -> int:
        return len(self.stamp)

    def __bool__(self) -> bool:
        return len(self.stamp) > 0

    def at(self, stamps: IntArray) -> FloatArray:
        """(s, n) the rows with exactly these stamps; NaN where there is none."""
        result = np.full((len(stamps), self.value.shape[1]), np.nan)
        if len(self):
            row = np.minimum(np.searchsorted(self.stamp, stamps), len(self) - 1)
            same = self.stamp[row] == stamps
            result[same] = self.value[row[same]]
        return result


@dataclass(frozen=True, slots=True)
class Footsteps:
    """What `footsteps` drew, in odom: m rows."""

    stamp: IntArray
    left_sole: FloatArray
    """(m, 3) x, y [m], yaw [rad]"""
    right_sole: FloatArray
    origin: FloatArray
    """(m, 2) pendulum origin [m]."""
    com: FloatArray
    """(m, 2) estimated CoM [m]."""
    support: IntArray
    """(m,) LEFT or RIGHT by the sole that is drawn pale; DOUBLE where none is."""


@dataclass(frozen=True, slots=True)
class Walk:
    """One bag."""

    name: str
    bag: BagContents
    parts: dict[str, str]
    """part -> topic"""
    missing: tuple[str, ...]
    remarks: tuple[str, ...]
    origin: int
    """[ns] the zero of every time axis."""
    age: int
    """[ns] how old the sensors are when they are recorded; 0 if unknown."""
    joint_names: tuple[str, ...]
    position: Table
    """(t, j) [rad]"""
    velocity: Table
    """(t, j) [rad/s]"""
    effort: Table
    """(t, j) [N m]"""
    target_names: tuple[str, ...]
    targets: Table
    """(t, k) [rad]; the stamp is that of the joint state that is answered."""
    command: Table
    """(t, 3) [m/s, m/s, rad/s]"""
    truth: Table
    """(t, 10) torso in world: x, y, z [m], quaternion xyzw, velocity in the torso frame [m/s]."""
    true_com: Table
    """(t, 3) [m] in world"""
    odometry: Table
    """(t, 3) x, y [m], yaw [rad]"""
    expected: Table
    """(t, 3) [m] in Q"""
    measured: Table
    estimated: Table
    wrenches: tuple[Table, Table]
    """Left, right: (t, 6) force [N], torque [N m] in the sole frame."""
    push: Table
    """(t, 3) [N] in world"""
    support: tuple[tuple[int, str], ...]
    """(stamp of arrival [ns], state and support foot) at each change."""
    footsteps: Footsteps
    diagnostics: tuple[tuple[int, dict[str, str]], ...]
    """(stamp of arrival [ns], values)"""
    urdf: str | None

    @property
    def duration(self) -> float:
        """[s]"""
        tables = (self.position, self.truth, self.odometry, self.expected, self.targets)
        ends = [int(table.stamp[-1]) for table in tables if len(table)]
        return max(0.0, (max(ends, default=self.origin) - self.origin) * _NANO)

    @property
    def period(self) -> int:
        """[ns] between two joint states, most often; 0 if there are none."""
        for table in (self.position, self.expected, self.truth):
            if len(table) > 1:
                return int(np.median(np.diff(table.stamp)))
        return 0

    def seconds(self, stamp: IntArray | int) -> FloatArray:
        """Stamps [ns] on the time axis of the report [s]."""
        return (np.asarray(stamp) - self.origin) * _NANO


def read_walk(path: Path) -> Walk:
    """Read a bag; NaoGaitError for what is none. Whatever is missing is empty, and said."""
    # The topics are only known once the bag is open.
    bag = open_bag(path)
    parts = find_parts(bag.topics)

    def messages(part: str) -> Messages:
        return bag.messages.get(parts[part], ()) if part in parts else ()

    clock = _Clock(messages("clock"), messages("joints"))
    remarks = list(bag.remarks)

    def table(part: str, width: int, values: Callable[[Any], Any], stamped: bool = True) -> Table:
        rows = []
        for log, message in messages(part):
            arrived = clock.at(log)
            stamp = _stamp(message) if stamped else arrived
            rows.append((stamp or arrived, arrived, values(message)))
        return _rising(rows, width, parts.get(part, part), remarks)

    names = _names(messages("joints"))
    joints = [_by_name(names, field) for field in ("position", "velocity", "effort")]
    targets = _names(messages("targets"))
    tables = {
        "position": table("joints", len(names), joints[0]),
        "velocity": table("joints", len(names), joints[1]),
        "effort": table("joints", len(names), joints[2]),
        "targets": table("targets", len(targets), _by_name(targets, "position")),
        "command": table("command", 3, _twist, stamped=False),
        "truth": table("truth", 10, _odometry3),
        "true_com": table("true_com", 3, _point),
        "odometry": table("odometry", 3, _odometry2),
        "expected": table("expected", 3, _point),
        "measured": table("measured", 3, _point),
        "estimated": table("estimated", 3, _point),
        "push": table("push", 3, _force, stamped=False),
    }
    firsts = [int(each.stamp[0]) for each in tables.values() if len(each)]
    descriptions = messages("description")
    return Walk(
        name=path.name if path.name != "bag" else path.resolve().parent.name,
        bag=bag,
        parts=parts,
        missing=tuple(missing_parts(parts)),
        remarks=tuple(dict.fromkeys(remarks)),
        origin=min(firsts, default=0),
        age=_age(tables["position"]),
        joint_names=names,
        target_names=targets,
        wrenches=(table("left_sole", 6, _wrench), table("right_sole", 6, _wrench)),
        support=tuple((clock.at(log), str(m.data)) for log, m in messages("support")),
        footsteps=_footsteps(messages("footsteps")),
        diagnostics=tuple(
            (clock.at(log), {v.key: v.value for status in m.status for v in status.values})
            for log, m in messages("diagnostics")
        ),
        urdf=str(descriptions[-1][1].data) if descriptions else None,
        **tables,
    )


class _Clock:
    """From the time of recording to simulated time. `ros2 bag record` may have used wall time."""

    def __init__(self, clock: Messages, joints: Messages) -> None:
        if clock:
            pairs = [(log, _nanoseconds(message.clock)) for log, message in clock]
        else:
            pairs = [(log, _stamp(message)) for log, message in joints]
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
    """The rows by rising stamp, each stamp once; of several runs in one bag the longest."""
    # Recorders give several messages one time; readers then return them in any order.
    rows = sorted(rows, key=lambda row: (row[1], row[0]))
    stamps = np.array([row[0] for row in rows], dtype=np.int64)
    begins = [0, *(np.flatnonzero(np.diff(stamps) < -RESTART) + 1).tolist(), len(rows)]
    if len(begins) > 2:
        runs = list(itertools.pairwise(begins))
        first, last = max(runs, key=lambda run: run[1] - run[0])
        rows, stamps = rows[first:last], stamps[first:last]
        remarks.append(f"{topic}: time begins anew {len(runs) - 1} times; the longest run is kept")
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


def _point(message: Any) -> tuple[float, float, float]:
    return message.point.x, message.point.y, message.point.z


def _force(message: Any) -> tuple[float, float, float]:
    force = message.wrench.force
    return force.x, force.y, force.z


def _wrench(message: Any) -> tuple[float, ...]:
    force, torque = message.wrench.force, message.wrench.torque
    return force.x, force.y, force.z, torque.x, torque.y, torque.z


def _odometry3(message: Any) -> tuple[float, ...]:
    p, q = message.pose.pose.position, message.pose.pose.orientation
    v = message.twist.twist.linear
    return p.x, p.y, p.z, q.x, q.y, q.z, q.w, v.x, v.y, v.z


def _yaw(q: Any) -> float:
    return float(np.arctan2(2 * (q.x * q.y + q.z * q.w), 1 - 2 * (q.y * q.y + q.z * q.z)))


def _odometry2(message: Any) -> tuple[float, float, float]:
    pose = message.pose.pose
    return pose.position.x, pose.position.y, _yaw(pose.orientation)


def _footsteps(messages: Messages) -> Footsteps:
    rows: list[tuple[Any, ...]] = []
    for _, message in messages:
        poses = {marker.ns: marker.pose for marker in message.markers}
        if not {"left sole", "right sole", "pendulum origin", "com"} <= set(poses):
            continue
        stamp = _stamp(message.markers[0])
        if rows and stamp <= rows[-1][0]:
            continue
        soles = [
            (p.position.x, p.position.y, _yaw(p.orientation))
            for p in (poses["left sole"], poses["right sole"])
        ]
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
