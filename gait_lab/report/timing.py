"""Period, age and gaps of the sensors, and how fast they were answered."""

from dataclasses import dataclass

import numpy as np

from gait_lab.report.walk import Walk
from nao_lipm_gait.types import FloatArray


@dataclass(frozen=True, slots=True)
class Timing:
    """All in seconds unless it says otherwise."""

    period: float
    jitter: float
    """Largest difference of a gap between two joint states from the period, missing ones apart."""
    missed: int
    """Joint states that were never recorded."""
    unanswered: int
    """Joint states without a joint_command of the same stamp."""
    age: float
    """Median age of a joint state when it was recorded."""
    age_worst: float
    answer: FloatArray
    """(t,) from a joint state's recording to that of its answer."""
    interval_time: FloatArray
    """(t,) on the report's axis"""
    interval: FloatArray
    """(t,) between two joint states."""
    tick_time: FloatArray
    """(d,) on the report's axis"""
    tick: FloatArray
    """(d, 2) the gait's own p50 and p99 [us] of one tick, from its diagnostics."""
    missed_by_gait: int | None
    """As the gait itself counted."""


def find_timing(walk: Walk) -> Timing | None:
    """None without joint states."""
    joints = walk.position
    if len(joints) < 2 or not walk.period:
        return None
    gaps = np.diff(joints.stamp)
    ticks = np.maximum(1, np.rint(gaps / walk.period))
    unanswered, answer = 0, np.empty(0)
    if len(walk.targets):
        first, last = walk.targets.stamp[0], walk.targets.stamp[-1]
        asked = (joints.stamp >= first) & (joints.stamp <= last)
        row = np.searchsorted(walk.targets.stamp, joints.stamp[asked])
        found = walk.targets.stamp[row] == joints.stamp[asked]
        unanswered = int((~found).sum())
        answer = (walk.targets.arrived[row] - joints.arrived[asked])[found] * 1e-9
    age = (joints.arrived - joints.stamp) * 1e-9
    ticked = [
        (float(walk.seconds(stamp)), p50, p99)
        for stamp, values in walk.diagnostics
        if (p50 := _number(values.get("tick p50 [us]"))) is not None
        and (p99 := _number(values.get("tick p99 [us]"))) is not None
    ]
    table = np.array(ticked) if ticked else np.empty((0, 3))
    counted = [_number(values.get("missed ticks")) for _, values in walk.diagnostics]
    known = [value for value in counted if value is not None]
    return Timing(
        period=walk.period * 1e-9,
        jitter=float(np.max(np.abs(gaps - ticks * walk.period))) * 1e-9,
        missed=int((ticks - 1).sum()),
        unanswered=unanswered,
        age=float(np.median(age)),
        age_worst=float(np.max(age)),
        answer=answer,
        interval_time=walk.seconds(joints.stamp[1:]),
        interval=gaps * 1e-9,
        tick_time=table[:, 0],
        tick=table[:, 1:],
        missed_by_gait=int(known[-1]) if known else None,
    )


def _number(text: str | None) -> float | None:
    try:
        return float(text) if text else None
    except ValueError:
        return None
