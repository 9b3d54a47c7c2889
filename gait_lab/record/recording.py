"""A bag with the topics of this package, as arrays over simulated time."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gait_lab.analysis.bag import open_bag
from nao_lipm_gait.types import FloatArray

TRUTH = "/ground_truth/odom"
JOINTS = "/joint_states"
COMMANDS = "/joint_command"
VELOCITY = "/cmd_vel"
ODOMETRY = "/odom"
EXPECTED = "/gait/com_expected"
MEASURED = "/gait/com_measured"
ESTIMATED = "/gait/com_estimated"
SUPPORT = "/gait/support"
FOOTSTEPS = "/gait/footsteps"
LEFT_WRENCH = "/l_sole/wrench"
RIGHT_WRENCH = "/r_sole/wrench"
TOPICS = (
    TRUTH, JOINTS, VELOCITY, ODOMETRY, EXPECTED, MEASURED, SUPPORT, FOOTSTEPS, LEFT_WRENCH,
    RIGHT_WRENCH, COMMANDS,
)  # fmt: skip

Messages = list[tuple[int, Any]]


def _seconds(stamp: Any) -> float:
    return float(stamp.sec + 1e-9 * stamp.nanosec)


@dataclass(frozen=True)
class TruthTrack:
    """Ground truth of the torso, t rows."""

    time: FloatArray
    """(t,) [s]."""
    position: FloatArray
    """(t, 3) [m] in world."""
    quaternion: FloatArray
    """(t, 4) xyzw."""
    velocity: FloatArray
    """(t, 3) [m/s] in the torso frame."""

    @cached_property
    def _up(self) -> FloatArray:
        """(t, 3): the torso's z row of its rotation, the vertical in the torso frame."""
        x, y, z, w = self.quaternion.T
        return np.stack([2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], axis=1)

    @property
    def tilt(self) -> FloatArray:
        """(t,) [rad] between the torso's z axis and the vertical."""
        return np.arccos(np.clip(self._up[:, 2], -1.0, 1.0))

    @cached_property
    def yaw(self) -> FloatArray:
        """(t,) [rad] heading of the torso's x axis."""
        x, y, z, w = self.quaternion.T
        return np.arctan2(2 * (x * y + z * w), 1 - 2 * (y * y + z * z))

    @cached_property
    def velocity_in_heading(self) -> FloatArray:
        """(t, 2) [m/s] forward and left on the ground plane."""
        x, y, z, w = self.quaternion.T
        v = self.velocity
        world_x = (
            (1 - 2 * (y * y + z * z)) * v[:, 0]
            + 2 * (x * y - z * w) * v[:, 1]
            + 2 * (x * z + y * w) * v[:, 2]
        )
        world_y = (
            2 * (x * y + z * w) * v[:, 0]
            + (1 - 2 * (x * x + z * z)) * v[:, 1]
            + 2 * (y * z - x * w) * v[:, 2]
        )
        c, s = np.cos(self.yaw), np.sin(self.yaw)
        return np.stack([c * world_x + s * world_y, c * world_y - s * world_x], axis=1)


@dataclass(frozen=True)
class Series:
    """Rows of numbers over time."""

    time: FloatArray
    """(t,) [s]."""
    value: FloatArray
    """(t, n)."""

    def between(self, start: float, end: float) -> "Series":
        """The rows from start to end [s]."""
        inside = (self.time >= start) & (self.time <= end)
        return Series(self.time[inside], self.value[inside])


def _series(rows: Sequence[tuple[float, tuple[float, ...]]], width: int) -> Series:
    if not rows:
        return Series(np.empty(0), np.empty((0, width)))
    return Series(np.array([row[0] for row in rows]), np.array([row[1] for row in rows]))


class Recording:
    """A bag opened for analysis; what it lacks is empty."""

    def __init__(self, path: Path) -> None:
        """Read a rosbag2 folder; NaoGaitError for what is none."""
        self._messages = open_bag(path, TOPICS).messages

    def count(self, topic: str) -> int:
        """Number of messages of a topic."""
        return len(self._messages[topic])

    @cached_property
    def truth(self) -> TruthTrack:
        rows: list[tuple[float, ...]] = []
        for _, message in self._messages[TRUTH]:
            p, q = message.pose.pose.position, message.pose.pose.orientation
            v = message.twist.twist.linear
            rows.append(
                (_seconds(message.header.stamp), p.x, p.y, p.z, q.x, q.y, q.z, q.w, v.x, v.y, v.z)
            )
        table = np.array(rows) if rows else np.empty((0, 11))
        return TruthTrack(table[:, 0], table[:, 1:4], table[:, 4:8], table[:, 8:11])

    @cached_property
    def expected(self) -> Series:
        """CoM expected in Q [m]."""
        return self._points(EXPECTED)

    @cached_property
    def measured(self) -> Series:
        """CoM measured in Q [m]."""
        return self._points(MEASURED)

    def _points(self, topic: str) -> Series:
        return _series(
            [
                (_seconds(m.header.stamp), (m.point.x, m.point.y, m.point.z))
                for _, m in self._messages[topic]
            ],
            3,
        )

    @cached_property
    def commands(self) -> Series:
        """Velocity commands x, y, yaw [m/s, rad/s] over the time of their recording."""
        rows = []
        for stamp, message in self._messages[VELOCITY]:
            twist = getattr(message, "twist", message)
            rows.append((1e-9 * stamp, (twist.linear.x, twist.linear.y, twist.angular.z)))
        return _series(rows, 3)

    @cached_property
    def odometry(self) -> Series:
        """The gait's own position x, y [m]."""
        return _series(
            [
                (_seconds(m.header.stamp), (m.pose.pose.position.x, m.pose.pose.position.y))
                for _, m in self._messages[ODOMETRY]
            ],
            2,
        )

    @cached_property
    def supports(self) -> list[tuple[float, str]]:
        """(time [s], state and support foot) at each change."""
        return [(1e-9 * stamp, message.data) for stamp, message in self._messages[SUPPORT]]

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """Of the joint states."""
        messages = self._messages[JOINTS]
        return tuple(messages[0][1].name) if messages else ()

    @cached_property
    def joints(self) -> Series:
        """Measured joint angles [rad], columns in the order of `joint_names`."""
        return _series(
            [(_seconds(m.header.stamp), tuple(m.position)) for _, m in self._messages[JOINTS]],
            len(self.joint_names),
        )

    @cached_property
    def soles(self) -> Series:
        """Commanded soles in odom: left x, y, yaw, z, then right [m, rad]."""
        rows = []
        for _, message in self._messages[FOOTSTEPS]:
            soles = {marker.ns: marker.pose for marker in message.markers}
            if {"left sole", "right sole"} <= set(soles):
                values: tuple[float, ...] = ()
                for name in ("left sole", "right sole"):
                    p, q = soles[name].position, soles[name].orientation
                    yaw = np.arctan2(2 * (q.x * q.y + q.z * q.w), 1 - 2 * (q.y**2 + q.z**2))
                    values += (p.x, p.y, float(yaw), p.z)
                rows.append((_seconds(message.markers[0].header.stamp), values))
        return _series(rows, 8)

    @cached_property
    def loads(self) -> Series:
        """Normal force on the left and the right sole [N]."""
        left, right = (
            {_seconds(m.header.stamp): m.wrench.force.z for _, m in self._messages[topic]}
            for topic in (LEFT_WRENCH, RIGHT_WRENCH)
        )
        return _series([(t, (left[t], right[t])) for t in sorted(left.keys() & right.keys())], 2)

    def com_error_y(self, start: float, end: float) -> float:
        """Mean |expected - measured| y of the CoM in Q [m]; NaN if nothing was recorded."""
        errors = self._com_errors
        inside = errors.between(start, end).value
        return float(np.abs(inside[:, 1]).mean()) if len(inside) else float("nan")

    @cached_property
    def _com_errors(self) -> Series:
        measured = dict(zip(self.measured.time.tolist(), self.measured.value, strict=True))
        rows = [
            (time, tuple(value - measured[time]))
            for time, value in zip(self.expected.time.tolist(), self.expected.value, strict=True)
            if time in measured
        ]
        return _series(rows, 3)

    def flight_share(self, start: float, end: float, loaded: float) -> float:
        """Share of the readings with less than `loaded` [N] under both soles."""
        loads: NDArray[np.float64] = self.loads.between(start, end).value
        return float((loads < loaded).all(axis=1).mean()) if len(loads) else float("nan")
