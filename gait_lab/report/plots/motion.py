"""Figures of the torso and the CoM: speeds, CoM beside its model, tilt."""

import math

import numpy as np

from gait_lab.analysis.metrics import true_com_in_q, velocity_in_heading, yaw_of
from gait_lab.report.analysis import Analysis
from gait_lab.report.figure import (
    BLUE,
    GOLD,
    GREY,
    INK,
    RED,
    ArrayStore,
    Figure,
    TimeFigure,
)
from gait_lab.report.plots.sampling import COM_WINDOW, SMOOTHING, largest, smoothed


def speeds(analysis: Analysis, store: ArrayStore) -> Figure | None:
    trace, walk = analysis.trace, analysis.walk
    if trace is None or len(trace) < 3:
        return None
    made = TimeFigure(
        store, "speeds", "Speeds: commanded and achieved",
        f"{'Ground truth' if len(walk.truth) else 'Odometry'} in the torso's own heading; thin: "
        f"every tick, thick: mean over {SMOOTHING} s, that is about two steps.",
        ("forward [cm/s]", "left [cm/s]", "turn [°/s]"), 150,
    )  # fmt: skip
    time = walk.seconds(trace.stamp)
    velocity = velocity_in_heading(trace.torso_quaternion, trace.torso_velocity)
    turn = np.gradient(np.unwrap(yaw_of(trace.torso_quaternion)), time)
    factors = (100.0, 100.0, math.degrees(1.0))
    for row, achieved in enumerate((velocity[:, 0], velocity[:, 1], turn)):
        value = factors[row] * achieved
        smooth = smoothed(value, time)
        made.line(row, time, value, "each tick", GREY, width=0.6, opacity=0.55)
        made.line(row, time, smooth, f"mean over {SMOOTHING} s", BLUE, width=2.2)
        asked = trace.command[:, row] * factors[row]
        made.line(row, time, asked, "commanded", INK, step=True, dash="dash", width=1.6)
        reach = 1.6 * max(
            float(np.nanmax(np.abs(asked), initial=0.0)), largest(smooth), 6.0 * (1 + row // 2)
        )
        made.y_range(row, -reach, reach)
    return made.figure


def com(analysis: Analysis, store: ArrayStore) -> Figure | None:
    walk = analysis.walk
    tables = ((walk.measured, "measured", RED), (walk.estimated, "estimated", GOLD),
              (walk.expected, "expected", INK))  # fmt: skip
    if not any(len(table) for table, _, _ in tables):
        return None
    made = TimeFigure(
        store, "com", "Centre of mass in Q: expected, measured, estimated",
        "The paper's Figs. 6 (y) and 7 (x). Q is the coordinate system of the running single "
        f"support and jumps with each step. Shown are {COM_WINDOW:.0f} s around the cursor; play, "
        "or click into another plot. True: from ground truth and the recorded joints, whose zero "
        "errors are in it as a constant.",
        ("y [mm]", "x [mm]"), 220,
    )  # fmt: skip
    trace = analysis.trace
    if trace is not None and np.isfinite(true := true_com_in_q(trace)).any():
        time = walk.seconds(trace.status_stamp)
        for row, axis in ((0, 1), (1, 0)):
            known = trace.status_stamp >= 0
            made.line(row, time[known], 1e3 * true[known, axis], "true", BLUE, dash="dot")
    for table, name, color in tables:
        for row, axis in ((0, 1), (1, 0)):
            made.line(row, walk.seconds(table.stamp), 1e3 * table.value[:, axis], name, color,
                      width=2.0 if name == "expected" else 1.4)  # fmt: skip
    made.figure.window = COM_WINDOW
    return made.figure


def torso(analysis: Analysis, store: ArrayStore) -> Figure | None:
    walk = analysis.walk
    if len(walk.truth) < 2:
        return None
    made = TimeFigure(
        store, "torso", "Torso: roll, pitch and height",
        "Ground truth; the height is that of the torso's frame.",
        ("roll, pitch [°]", "height [mm]"), 140,
    )  # fmt: skip
    x, y, z, w = walk.truth.value[:, 3:7].T
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2 * (w * y - z * x), -1.0, 1.0))
    time = walk.seconds(walk.truth.stamp)
    made.line(0, time, np.degrees(roll), "roll", BLUE)
    made.line(0, time, np.degrees(pitch), "pitch", RED)
    made.line(1, time, 1e3 * walk.truth.value[:, 2], "height", INK)
    return made.figure
