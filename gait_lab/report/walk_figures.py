"""Figures of the walk: speeds, CoM, torso, path, odometry and steps.

Each is None if the bag lacks its topics.
"""

import math
from typing import Any

import numpy as np

from gait_lab.report.analysis import Analysis
from gait_lab.report.page import (
    BLUE,
    GOLD,
    GREY,
    INK,
    LEFT_COLOR,
    RED,
    RIGHT_COLOR,
    ArrayStore,
    Figure,
    TimeFigure,
    thin,
)
from robot_core.types import FloatArray
from sim_bridge.trials.metrics import true_com_in_q, velocity_in_heading, yaw_of
from sim_bridge.trials.trace import LEFT, RIGHT

SMOOTHING = 0.5
"""[s] over which speeds are averaged: about two steps."""
COM_WINDOW = 4.0
"""[s] of the CoM shown at a time: the paper's figures show 3 to 5."""
HEAT_COLUMNS = 700


def largest(values: FloatArray) -> float:
    """The largest magnitude but for outliers; 0 where nothing is known."""
    known = np.abs(values[np.isfinite(values)])
    return float(np.percentile(known, 99.5)) if len(known) else 0.0


def smoothed(values: FloatArray, time: FloatArray) -> FloatArray:
    """(n,) values at increasing times (n,) [s], each the mean over `SMOOTHING`."""
    period = float(np.median(np.diff(time)))
    window = max(1, round(SMOOTHING / period)) if period > 0.0 else 1
    if len(values) <= window:
        return values
    padded = np.pad(np.nan_to_num(values), window // 2, mode="edge")
    return np.convolve(padded, np.ones(window) / window, mode="same")[
        window // 2 : window // 2 + len(values)
    ]


def pool(time: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """At most HEAT_COLUMNS rows, each the largest of its rows."""
    size = max(1, -(-len(time) // HEAT_COLUMNS))
    count = len(time) // size
    pooled: Any = np.nan_to_num(values[: count * size]).reshape(count, size, -1).max(axis=1)
    return time[: count * size : size], pooled


def speeds(analysis: Analysis, store: ArrayStore) -> Figure | None:
    """Commanded and achieved speeds over time."""
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
    """The CoM in Q: expected, measured, estimated and true."""
    walk = analysis.walk
    tables = ((walk.measured, "measured", RED), (walk.estimated, "estimated", GOLD),
              (walk.expected, "expected", INK))  # fmt: skip
    if not any(len(table) for table, _, _ in tables):
        return None
    made = TimeFigure(
        store, "com", "Centre of mass in Q: expected, measured, estimated",
        "The quantities of the paper's Figs. 6 (y, on the spot) and 7 (x, forward), of this walk. "
        "Q is the coordinate system of the single support and jumps with each step. Shown are "
        f"{COM_WINDOW:.0f} s around the cursor; play, or click into another plot. True: from "
        "ground truth and the recorded joints, with their zero errors as a constant part.",
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
    """Roll, pitch and height of the torso."""
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


def path(analysis: Analysis, store: ArrayStore) -> Figure | None:
    """The path from above."""
    paths = analysis.paths
    if paths is None:
        return None
    figure = Figure(
        "path", "The path from above",
        "Middle between the soles; both begin at (0, 0) looking along x. The dot is the cursor.",
        470,
    )  # fmt: skip
    part = thin(paths.stamp)
    lines = [(paths.odometry, "odometry", GOLD, "dot")]
    if len(paths.truth):
        lines.insert(0, (paths.truth, "ground truth", BLUE, "solid"))
    for pose, name, color, dash in lines:
        if np.isfinite(pose).any():
            figure.traces.append(
                {"type": "scatter", "mode": "lines", "name": name,
                 "x": store.add(pose[part, 0]), "y": store.add(pose[part, 1]),
                 "line": {"color": color, "width": 2, "dash": dash}}
            )  # fmt: skip
    lead = lines[0][0]
    figure.traces.append(
        {"type": "scatter", "mode": "markers", "name": "now", "showlegend": False,
         "x": [float(lead[0, 0])], "y": [float(lead[0, 1])],
         "marker": {"size": 12, "color": RED, "line": {"color": "white", "width": 2}}}
    )  # fmt: skip
    figure.layout = {
        "xaxis": {"title": {"text": "x [m]"}},
        "yaxis": {"title": {"text": "y [m]"}, "scaleanchor": "x", "scaleratio": 1},
        "meta": {"time": store.add(analysis.walk.seconds(paths.stamp)),
                 "x": store.add(lead[:, 0]), "y": store.add(lead[:, 1])},
    }  # fmt: skip
    return figure


def odometry_error(analysis: Analysis, store: ArrayStore) -> Figure | None:
    """The error of the odometry over time."""
    paths = analysis.paths
    if paths is None or not np.isfinite(paths.error).any():
        return None
    made = TimeFigure(
        store, "odometry", "Odometry against ground truth",
        "Error of the gait's own odometry since the start.",
        ("distance [cm]", "heading [°]"), 130,
    )  # fmt: skip
    time = analysis.walk.seconds(paths.stamp)
    off = 100 * np.hypot(paths.error[:, 0], paths.error[:, 1])
    made.line(0, time, off, "distance", BLUE, width=2.0)
    made.line(1, time, np.degrees(np.unwrap(paths.error[:, 2])), "heading", GOLD, width=2.0)
    return made.figure


def step_series(analysis: Analysis, store: ArrayStore) -> Figure | None:
    """Durations and sizes of the steps."""
    if len(analysis.steps) < 2:
        return None
    sized = any(step.size is not None for step in analysis.steps)
    rows = ("duration [s]", "x [cm]", "y [cm]", "turn [°]") if sized else ("duration [s]",)
    made = TimeFigure(
        store, "steps", "Steps: duration and size",
        "Each single support: its duration, and its step size, the pose of the next Q in this one "
        "as the feet measured it. A side step or a turn opens on one foot and closes on the other.",
        rows, 125,
    )  # fmt: skip
    for side, name, color in ((LEFT, "on the left foot", LEFT_COLOR),
                              (RIGHT, "on the right foot", RIGHT_COLOR)):  # fmt: skip
        steps = [step for step in analysis.steps if step.support == side]
        time = np.array([step.time for step in steps])
        values = [np.array([step.duration for step in steps])]
        if sized:
            sizes = np.array([step.size or (np.nan,) * 3 for step in steps]).reshape(-1, 3)
            values += [100 * sizes[:, 0], 100 * sizes[:, 1], np.degrees(sizes[:, 2])]
        for row, value in enumerate(values):
            made.line(row, time, value, name, color, markers=True)
    return made.figure


def origins(analysis: Analysis, store: ArrayStore) -> Figure | None:
    """The pendulum origins under the soles."""
    if not any(len(points) for points in analysis.origins):
        return None
    figure = Figure(
        "origins", "Pendulum origins under the sole",
        "The paper's Fig. 4: where the pendulum of each single support stands, in the frame of the "
        "sole (0, 0 is below the ankle). Sound steps keep it well inside the outline.",
        440,
    )  # fmt: skip
    figure.layout = {"showlegend": False}
    outline = np.array(analysis.robot.sole_outline) if analysis.robot is not None else None
    for index, (points, side, color) in enumerate(
        zip(analysis.origins, ("left", "right"), (LEFT_COLOR, RIGHT_COLOR), strict=True)
    ):
        number = "" if index == 0 else "2"
        axes = {"xaxis": f"x{number}", "yaxis": f"y{number}"}
        if outline is not None:
            mirror = 1.0 if side == "left" else -1.0
            closed = np.vstack([outline, outline[:1]]) * (100.0, 100.0 * mirror)
            figure.traces.append(
                {"type": "scatter", "mode": "lines", "name": "sole", "hoverinfo": "skip",
                 "x": store.add(-closed[:, 1]), "y": store.add(closed[:, 0]), **axes,
                 "fill": "toself", "fillcolor": "rgba(22,32,42,0.06)",
                 "line": {"color": INK, "width": 1.5}}
            )  # fmt: skip
        figure.traces.append(
            {"type": "scatter", "mode": "markers", "name": f"{side} sole", **axes,
             "x": store.add(-100 * points[:, 2]), "y": store.add(100 * points[:, 1]),
             "text": [f"{time:.2f} s" for time in points[:, 0]],
             "hovertemplate": "%{text}<br>ahead %{y:.1f} cm, right %{x:.1f} cm",
             "marker": {"color": color, "size": 6, "opacity": 0.35}}
        )  # fmt: skip
        figure.traces.append(
            {"type": "scatter", "mode": "markers", "x": [0], "y": [0], **axes, "hoverinfo": "skip",
             "marker": {"symbol": "cross-thin", "size": 12, "line": {"width": 1.5, "color": INK}}}
        )  # fmt: skip
        figure.layout[f"xaxis{number}"] = {
            "domain": [0.54 * index, 0.54 * index + 0.46], "range": [-9, 9],
            "title": {"text": f"{side} sole: to the right [cm]"}, "anchor": f"y{number}",
        }  # fmt: skip
        figure.layout[f"yaxis{number}"] = {
            "scaleanchor": f"x{number}", "range": [-7, 12], "anchor": f"x{number}",
            "title": {"text": "ahead [cm]"},
        }  # fmt: skip
    return figure
