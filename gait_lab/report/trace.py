"""The recorded walk as the `Trace` that the benchmark scores, so that both give the same numbers.

Row for row as a rollout keeps it: the truth of a tick beside what the gait said in that tick, which
is about sensors that are older. What a bag does not hold is NaN, and so are the numbers from it.
"""

from dataclasses import fields

import numpy as np

from gait_lab.analysis.metrics import DOUBLE, SUPPORT_CODES, Trace
from gait_lab.report.body import BodyTrack, yaw_of_pose
from gait_lab.report.steps import Phase, supports_at
from gait_lab.report.walk import IntArray, Table, Walk
from nao_lipm_gait.geometry import relative
from nao_lipm_gait.types import FloatArray


def make_trace(walk: Walk, phases: tuple[Phase, ...], body: BodyTrack | None) -> Trace | None:
    """None if the bag tells nothing about the motion of the robot."""
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
        # What is no topic of the contract cannot have been recorded.
        known.setdefault(field.name, np.zeros(count, dtype=bool))
    return Trace(**known)


def _rounded(value: int, period: int) -> int:
    return round(value / period) * period if period else value


def _torso_from_odometry(odometry: Table) -> FloatArray:
    """(t, 10) like ground truth; the height is unknown and the torso taken as upright."""
    x, y, yaw = odometry.value.T
    yaw = np.unwrap(yaw)
    seconds = odometry.stamp * 1e-9
    vx, vy = np.gradient(x, seconds), np.gradient(y, seconds)
    c, s = np.cos(yaw), np.sin(yaw)
    rows = np.zeros((len(odometry), 10))
    rows[:, 0], rows[:, 1], rows[:, 2] = x, y, np.nan
    rows[:, 5], rows[:, 6] = np.sin(0.5 * yaw), np.cos(0.5 * yaw)
    rows[:, 7], rows[:, 8] = c * vx + s * vy, c * vy - s * vx
    return rows


def _soles(
    walk: Walk, body: BodyTrack | None, stamp: IntArray
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


def _support_sole_in_q(phases: tuple[Phase, ...], stamp: IntArray) -> FloatArray:
    rows = [(np.nan, np.nan, np.nan)]
    for phase in phases:
        sole, q = phase.sole_in_odom, phase.q_in_odom
        rows.append(
            rows[0] if sole is None or q is None or phase.support == SUPPORT_CODES["double"]
            else relative(sole, q)
        )  # fmt: skip
    begins = np.array([phase.stamp for phase in phases], dtype=np.int64)
    return np.array(rows)[np.searchsorted(begins, stamp, side="right")]
