"""The trace of a walk: ground truth and gait status as arrays at the control rate.

A trial records it with a `Recorder`; `recorded_trace` makes the same of a bag.
"""

import math
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from robot_core.errors import NaoGaitError
from robot_core.geometry import relative, rotate_each
from robot_core.types import GaitStatus, VelocityCommand
from sim_bridge.robot import GroundTruth

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

DOUBLE, LEFT, RIGHT = 0, 1, 2
ALARM_STATES = frozenset({"fallen"})
"""States of the gait in which it reports a fall."""
SUPPORT_CODES = {"double": DOUBLE, "left": LEFT, "right": RIGHT}

UNKNOWN = (math.nan, math.nan, math.nan)


@dataclass(frozen=True, slots=True)
class Trace:
    """Ground truth and gait status of one walk, one row per control tick (t rows).

    Pairs are left, right. Frames: `world` has z up; `torso` is the torso link; Q is the gait's own
    coordinate system of the single support phase, on the ground plane.

    Attributes:
        stamp: (t,) [ns] strictly increasing.
        torso_position: (t, 3) [m] in world.
        torso_quaternion: (t, 4) xyzw, torso to world.
        torso_velocity: (t, 3) [m/s] in the torso frame.
        com: (t, 3) [m] in world.
        sole_position: (t, 2, 3) [m] in world.
        sole_yaw: (t, 2) [rad] in world.
        sole_force: (t, 2) [N] normal force.
        sole_slip: (t, 2) [m/s] horizontal speed.
        legs_touch: (t,) whether the legs touch each other.
        saturated: (t,) number of motors at their torque limit.
        alarm: (t,) whether the gait reports a fall.
        command: (t, 3) commanded velocity [m/s, m/s, rad/s].
        odometry: (t, 3) the gait's own base_footprint in odom [m, m, rad]; NaN before the first
            frame.
        status_stamp: (t,) [ns] sampling time that the gait's values belong to; -1 before the first
            frame.
        support: (t,) DOUBLE, LEFT or RIGHT: the support leg as the gait has it.
        support_sole_in_q: (t, 3) sole frame of the support leg in Q [m, m, rad]; NaN without single
            support.
        com_expected_in_q: (t, 3) [m].
        com_measured_in_q: (t, 3) [m].
        com_estimated_in_q: (t, 3) [m].
    """

    stamp: IntArray
    torso_position: FloatArray
    torso_quaternion: FloatArray
    torso_velocity: FloatArray
    com: FloatArray
    sole_position: FloatArray
    sole_yaw: FloatArray
    sole_force: FloatArray
    sole_slip: FloatArray
    legs_touch: BoolArray
    saturated: IntArray
    alarm: BoolArray
    command: FloatArray
    odometry: FloatArray
    status_stamp: IntArray
    support: IntArray
    support_sole_in_q: FloatArray
    com_expected_in_q: FloatArray
    com_measured_in_q: FloatArray
    com_estimated_in_q: FloatArray

    def __post_init__(self) -> None:
        ticks = len(self.stamp)
        for field in fields(self):
            rows = len(getattr(self, field.name))
            if rows != ticks:
                raise NaoGaitError(f"trace.{field.name}", f"{rows} rows", f"{ticks} rows")
        if ticks > 1 and not np.all(np.diff(self.stamp) > 0):
            raise NaoGaitError("trace.stamp", "not increasing", "strictly increasing stamps")

    def __len__(self) -> int:
        return len(self.stamp)

    def __repr__(self) -> str:
        return f"Trace({len(self)} ticks: {', '.join(field.name for field in fields(self))})"

    @property
    def time(self) -> FloatArray:
        """(t,) seconds since the first tick."""
        return (self.stamp - self.stamp[0]) * 1e-9

    def between(self, start: float, end: float) -> "Trace":
        """The ticks with start <= time < end [s since the first tick]."""
        time = self.time
        # Half a tick of slack: the ends are sums of floats, the ticks are integers.
        slack = 0.5e-9 * float(np.diff(self.stamp).min()) if len(self) > 1 else 0.0
        return self[(time >= start - slack) & (time < end - slack)]

    def __getitem__(self, rows: BoolArray | slice) -> "Trace":
        return Trace(**{field.name: getattr(self, field.name)[rows] for field in fields(self)})


_COLUMNS = {
    "stamp": 1, "torso_position": 3, "torso_quaternion": 4, "torso_velocity": 3, "com": 3,
    "sole_position": 6, "sole_yaw": 2, "sole_force": 2, "sole_slip": 2, "legs_touch": 1,
    "saturated": 1, "command": 3, "alarm": 1, "odometry": 3, "status_stamp": 1, "support": 1,
    "support_sole_in_q": 3, "com_expected_in_q": 3, "com_measured_in_q": 3, "com_estimated_in_q": 3,
}  # fmt: skip
"""Numbers per tick of each column of a `Trace`, in the order in which they are recorded."""
_NO_STATUS = (False, *UNKNOWN, -1, DOUBLE, *UNKNOWN, *UNKNOWN, *UNKNOWN, *UNKNOWN)
"""The columns of the gait, from `alarm` on, before its first frame."""


class Recorder:
    """Collects one row of numbers per control tick.

    The rows are plain tuples of numbers: thousands of kept objects would cost time in every run of
    Python's garbage collector.
    """

    def __init__(self) -> None:
        self._rows: list[tuple[float, ...]] = []
        self._phase: tuple[str, int] | None = None
        self._sole_in_q = UNKNOWN

    def add(
        self, truth: GroundTruth, command: VelocityCommand, status: GaitStatus | None = None
    ) -> None:
        """Append a tick.

        Args:
            truth: Ground truth.
            command: What the gait was commanded.
            status: Status of the gait; None before its first frame.
        """
        left, right = truth.soles
        self._rows.append((
            truth.stamp,
            *truth.torso_position.tolist(),
            *truth.torso_quaternion.tolist(),
            *truth.torso_linear_velocity_in_torso.tolist(),
            *truth.com.tolist(),
            *left.position.tolist(), *right.position.tolist(),
            _yaw(left.rotation), _yaw(right.rotation),
            *truth.sole_force.tolist(),
            *truth.sole_slip.tolist(),
            truth.legs_touch,
            truth.torque_saturated,
            command.x, command.y, command.yaw,
            *(_NO_STATUS if status is None else self._of_status(status)),
        ))  # fmt: skip

    def _of_status(self, status: GaitStatus) -> tuple[float, ...]:
        # The status has the soles as commanded, ahead of the measurement by the delay: at the end
        # of a phase the support sole already swings. So the pose at the start of the phase is kept.
        phase = (status.support, status.step_count)
        if phase != self._phase:
            self._phase = phase
            self._sole_in_q = _support_sole_in_q(status)
        return (
            status.state.value in ALARM_STATES,
            *status.base_footprint_in_odom,
            status.stamp,
            SUPPORT_CODES[status.support],
            *self._sole_in_q,
            *status.com_expected_in_q,
            *status.com_measured_in_q,
            *status.com_estimated_in_q,
        )

    def trace(self) -> Trace:
        """All ticks so far."""
        table = np.array(self._rows, dtype=float).reshape(-1, sum(_COLUMNS.values()))
        ends = np.cumsum(list(_COLUMNS.values()))
        columns = dict(zip(_COLUMNS, np.split(table, ends[:-1], axis=1), strict=True))
        for name, width in _COLUMNS.items():
            if width == 1:
                columns[name] = columns[name][:, 0]
        columns["sole_position"] = columns["sole_position"].reshape(-1, 2, 3)
        for name in ("stamp", "saturated", "status_stamp", "support"):
            columns[name] = columns[name].astype(np.int64)
        for name in ("legs_touch", "alarm"):
            columns[name] = columns[name].astype(bool)
        return Trace(**columns)


def _yaw(rotation: np.ndarray) -> float:
    return math.atan2(rotation[1, 0], rotation[0, 0])


def _support_sole_in_q(status: GaitStatus) -> tuple[float, float, float]:
    if status.support == "double":
        return UNKNOWN
    sole = status.left_sole_in_odom if status.support == "left" else status.right_sole_in_odom
    return relative((sole[0], sole[1], sole[5]), status.q_in_odom)


def from_start(pose: FloatArray) -> FloatArray:
    """Poses (t, 3) x, y [m], yaw [rad] in the frame of the first one."""
    if not len(pose):
        return pose
    dx, dy, turn = (pose - pose[0]).T
    return np.column_stack([*rotate_each(dx, dy, -pose[0, 2]), turn])
