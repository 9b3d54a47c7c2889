"""The figures of a report. Each takes what it needs from the analysis; without that, there is none.

A comparison lays the second walk over the first in the figures that do not run over time.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from gait_lab.metrics import LEFT, RIGHT, true_com_in_q, velocity_in_heading, yaw_of
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
    thin,
)
from nao_lipm_gait.signals import FloatArray

SMOOTHING = 0.5
"""[s] over which speeds are averaged: about two steps."""
COM_WINDOW = 4.0
"""[s] of the CoM shown at a time: the paper's figures show 3 to 5."""
LEG_JOINTS = (
    "HipYawPitch", "HipYaw", "HipRoll", "HipPitch", "KneePitch", "AnklePitch", "AnkleRoll"
)  # fmt: skip
HEAT_COLUMNS = 700
LEFT_COLOR, RIGHT_COLOR = "#c8553d", "#2f7f5f"


def all_figures(analysis: Analysis, store: ArrayStore) -> list[Figure]:
    """Those for which the bag has the topics, in the order of the page."""
    makers: tuple[Callable[[Analysis, ArrayStore], Figure | None], ...] = (
        speeds, com, path, odometry_error, step_series, origins, innovation_series,
        whiteness, joints, torques, motors, torso, loads, timing,
    )  # fmt: skip
    return [figure for make in makers if (figure := make(analysis, store)) is not None]


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
        smooth = _smoothed(value, time)
        made.line(row, time, value, "each tick", GREY, width=0.6, opacity=0.55)
        made.line(row, time, smooth, f"mean over {SMOOTHING} s", BLUE, width=2.2)
        asked = trace.command[:, row] * factors[row]
        made.line(row, time, asked, "commanded", INK, step=True, dash="dash", width=1.6)
        reach = 1.6 * max(
            float(np.nanmax(np.abs(asked), initial=0.0)), _largest(smooth), 6.0 * (1 + row // 2)
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


def path(analysis: Analysis, store: ArrayStore) -> Figure | None:
    paths = analysis.paths
    if paths is None:
        return None
    figure = Figure(
        "path", "The way from above",
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
    paths = analysis.paths
    if paths is None or not np.isfinite(paths.error).any():
        return None
    made = TimeFigure(
        store, "odometry", "Odometry against ground truth",
        "How far the gait's own odometry is off, both having begun together.",
        ("distance [cm]", "heading [°]"), 130,
    )  # fmt: skip
    time = analysis.walk.seconds(paths.stamp)
    off = 100 * np.hypot(paths.error[:, 0], paths.error[:, 1])
    made.line(0, time, off, "distance", BLUE, width=2.0)
    made.line(1, time, np.degrees(np.unwrap(paths.error[:, 2])), "heading", GOLD, width=2.0)
    return made.figure


def step_series(analysis: Analysis, store: ArrayStore) -> Figure | None:
    if len(analysis.steps) < 2:
        return None
    sized = any(step.size is not None for step in analysis.steps)
    rows = ("duration [s]", "x [cm]", "y [cm]", "turn [°]") if sized else ("duration [s]",)
    made = TimeFigure(
        store, "steps", "Steps: how long and how far",
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


def innovation_series(analysis: Analysis, store: ArrayStore) -> Figure | None:
    innovation = analysis.innovation
    if innovation is None:
        return None
    made = TimeFigure(
        store, "innovation", "Observer innovation",
        "Measured minus expected CoM: what the model did not foresee.",
        ("y [mm]", "x [mm]"), 140,
    )  # fmt: skip
    time = analysis.walk.seconds(innovation.stamp)
    for row, axis in ((0, 1), (1, 0)):
        made.line(row, time, 1e3 * innovation.value[:, axis], "xy"[axis], (BLUE, RED)[row])
        made.level(row, 1e3 * innovation.mean[axis], INK)
    return made.figure


def whiteness(analysis: Analysis, store: ArrayStore) -> Figure | None:
    innovation = analysis.innovation
    if innovation is None or not len(innovation.correlation):
        return None
    inside = [f"{100 * share:.0f} %" for share in innovation.inside]
    figure = Figure(
        "whiteness", "Is the innovation white?",
        "Its autocorrelation. White noise stays inside the grey band at 95 % of the lags; here it "
        f"does at {inside[1]} (y) and {inside[0]} (x). Waves show what the model leaves out: their "
        "period is that of the steps.",
        300,
    )  # fmt: skip
    for axis, name, color in ((1, "y", BLUE), (0, "x", RED)):
        figure.traces.append(
            {"type": "scatter", "mode": "lines", "name": name, "x": store.add(innovation.lag),
             "y": store.add(innovation.correlation[:, axis]), "line": {"color": color, "width": 2}}
        )  # fmt: skip
    figure.layout = {
        "xaxis": {"title": {"text": "lag [s]"}},
        "yaxis": {"title": {"text": "autocorrelation"}, "range": [-1.05, 1.05]},
        "shapes": [{"type": "rect", "xref": "paper", "x0": 0, "x1": 1, "y0": -innovation.band,
                    "y1": innovation.band, "fillcolor": "rgba(22,32,42,0.14)",
                    "line": {"width": 0}, "layer": "below"}],
    }  # fmt: skip
    return figure


def joints(analysis: Analysis, store: ArrayStore) -> Figure | None:
    walk = analysis.walk
    names = [side + joint for joint in LEG_JOINTS for side in "LR"]
    names = [name for name in names if name in walk.joint_names]
    if not names or len(walk.position) < 2:
        return None
    made = TimeFigure(
        store, "joints", "Joints: targets and measured",
        "Targets at the time at which they were sent, angles at the time of their sampling: the "
        f"distance in time is the motor's lag. Shown are {COM_WINDOW:.0f} s around the cursor.",
        [f"{name} [°]" for name in names], 112, columns=2,
    )  # fmt: skip
    time = walk.seconds(walk.position.stamp)
    for row, name in enumerate(names):
        angle = walk.position.value[:, walk.joint_names.index(name)]
        if name in walk.target_names:
            target = walk.targets.value[:, walk.target_names.index(name)]
            sent = walk.seconds(walk.targets.stamp + walk.age)
            made.line(row, sent, np.degrees(target), "target", INK, width=1.2)
        made.line(row, time, np.degrees(angle), "measured", RED, width=1.4)
    made.figure.window = COM_WINDOW
    return made.figure


def torques(analysis: Analysis, store: ArrayStore) -> Figure | None:
    use, robot = analysis.motors, analysis.robot
    if use is None or robot is None or not np.isfinite(use.torque).any():
        return None
    names = [j for side in "LR" for joint in LEG_JOINTS if (j := side + joint) in robot.joint_names]
    names = [name for name in names if name in {joint.name for joint in use.joints}]
    made = TimeFigure(
        store, "torques", "Torque in the legs",
        "Share of the torque that a nominal motor of the reference plant has at its speed; dark "
        "red is the limit. Each column shows the largest value of its time.",
        ("",), 300,
    )  # fmt: skip
    time = analysis.walk.seconds(use.stamp)
    columns = [robot.index(name) for name in names][::-1]
    pooled_time, pooled = _pooled(time, use.torque[:, columns])
    made.figure.traces.append(
        {"type": "heatmap", "x": store.add(pooled_time),
         "y": names[::-1], "z": [store.add(row) for row in 100 * pooled.T],
         "zmin": 0, "zmax": 100, "hovertemplate": "%{y}: %{z:.0f} %",
         "colorscale": [[0, "#f4f6f7"], [0.4, "#f6d9a8"], [0.75, "#e0843a"], [1, "#8c1c2b"]],
         "colorbar": {"title": {"text": "%"}, "thickness": 12, "len": 0.9}}
    )  # fmt: skip
    made.figure.layout["yaxis"]["title"] = {"text": ""}
    made.figure.layout["margin"] = {"l": 110}
    return made.figure


def motors(analysis: Analysis, store: ArrayStore) -> Figure | None:
    use = analysis.motors
    if use is None:
        return None
    legs = [joint for joint in use.joints if joint.name[1:] in LEG_JOINTS]
    if not legs:
        return None
    figure = Figure(
        "motors", "Saturation by joint",
        "Share of the ticks with the motor at its torque limit, and with a target that asks for "
        "more than the joint's top speed.",
        300,
    )  # fmt: skip
    names = [joint.name for joint in legs]
    for name, color, values in (
        ("torque at its limit", RED, [joint.torque_saturated for joint in legs]),
        ("target faster than the joint", GOLD, [joint.speed_saturated for joint in legs]),
    ):
        shares = [None if not math.isfinite(value) else 100 * value for value in values]
        figure.traces.append(
            {"type": "bar", "name": name, "x": names, "y": shares, "marker": {"color": color},
             "hovertemplate": "%{x}: %{y:.1f} %"}
        )  # fmt: skip
    figure.layout = {
        "barmode": "group", "bargap": 0.3,
        "yaxis": {"title": {"text": "share of ticks [%]"}, "rangemode": "tozero"},
        "xaxis": {"tickangle": -30},
    }  # fmt: skip
    return figure


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
    made.y_range(0, 0.0, 1e3 * max(float(timing.interval.max()), 2 * timing.period) * 1.1)
    age = 1e-6 * (walk.position.arrived - walk.position.stamp).astype(float)
    made.line(1, walk.seconds(walk.position.stamp), age, "age", GOLD)
    made.y_range(1, min(0.0, float(age.min())), max(1.0, 1.2 * float(age.max())))
    if len(timing.tick):
        made.line(2, timing.tick_time, timing.tick[:, 0], "p50", INK, width=1.8)
        made.line(2, timing.tick_time, timing.tick[:, 1], "p99", RED, width=1.8)
    return made.figure


def _largest(values: FloatArray) -> float:
    known = np.abs(values[np.isfinite(values)])
    return float(np.percentile(known, 99.5)) if len(known) else 0.0


def _smoothed(values: FloatArray, time: FloatArray) -> FloatArray:
    period = float(np.median(np.diff(time)))
    window = max(1, round(SMOOTHING / period)) if period > 0.0 else 1
    if len(values) <= window:
        return values
    padded = np.pad(np.nan_to_num(values), window // 2, mode="edge")
    return np.convolve(padded, np.ones(window) / window, mode="same")[
        window // 2 : window // 2 + len(values)
    ]


def _pooled(time: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """At most HEAT_COLUMNS rows, each the largest of its rows."""
    size = max(1, -(-len(time) // HEAT_COLUMNS))
    count = len(time) // size
    pooled: Any = np.nan_to_num(values[: count * size]).reshape(count, size, -1).max(axis=1)
    return time[: count * size : size], pooled
