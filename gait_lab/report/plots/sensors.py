"""Figures of the sensors: load of the soles, periods and ages."""

import numpy as np

from gait_lab.report.analysis import Analysis
from gait_lab.report.figure import (
    BLUE,
    GOLD,
    INK,
    LEFT_COLOR,
    RED,
    RIGHT_COLOR,
    ArrayStore,
    Figure,
    TimeFigure,
)


def loads(analysis: Analysis, store: ArrayStore) -> Figure | None:
    walk = analysis.walk
    if not all(len(table) > 1 for table in walk.wrenches):
        return None
    made = TimeFigure(
        store, "loads", "Load on the soles", "Force along the sole's normal.", ("force [N]",), 180
    )
    for table, name, color in zip(
        walk.wrenches, ("left", "right"), (LEFT_COLOR, RIGHT_COLOR), strict=True
    ):
        made.line(0, walk.seconds(table.stamp), table.value[:, 2], name, color, width=1.1)
    return made.figure


def timing(analysis: Analysis, store: ArrayStore) -> Figure | None:
    timing = analysis.timing
    if timing is None:
        return None
    walk = analysis.walk
    rows = ["sensors every [ms]", "sensors' age [ms]"]
    if len(timing.tick):
        rows.append("gait's tick [µs]")
    made = TimeFigure(
        store, "timing", "Timing",
        "Time between two joint states (a missing one shows as a double step), their age when "
        "they were recorded, and how long the gait computes, second by second.",
        rows, 120,
    )  # fmt: skip
    made.line(0, timing.interval_time, 1e3 * timing.interval, "interval", BLUE)
    made.y_range(0, 0.0, 1e3 * max(float(np.max(timing.interval)), 2 * timing.period) * 1.1)
    age = 1e-6 * (walk.position.arrived - walk.position.stamp).astype(float)
    made.line(1, walk.seconds(walk.position.stamp), age, "age", GOLD)
    made.y_range(1, min(0.0, float(np.min(age))), max(1.0, 1.2 * float(np.max(age))))
    if len(timing.tick):
        made.line(2, timing.tick_time, timing.tick[:, 0], "p50", INK, width=1.8)
        made.line(2, timing.tick_time, timing.tick[:, 1], "p99", RED, width=1.8)
    return made.figure
