"""Figures of the signals: innovation, joints, motors, loads and timing.

Each is None if the bag lacks its topics.
"""

import math
from collections.abc import Callable

import numpy as np

from gait_lab.report.analysis import Analysis
from gait_lab.report.page import (
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
from gait_lab.report.vision_figures import percepts, world
from gait_lab.report.walk_figures import (
    COM_WINDOW,
    com,
    odometry_error,
    origins,
    path,
    pool,
    speeds,
    step_series,
    torso,
)


def innovation_series(analysis: Analysis, store: ArrayStore) -> Figure | None:
    """The innovation of the observer over time."""
    innovation = analysis.innovation
    if innovation is None:
        return None
    made = TimeFigure(
        store, "innovation", "Observer innovation",
        "Measured minus expected CoM.",
        ("y [mm]", "x [mm]"), 140,
    )  # fmt: skip
    time = analysis.walk.seconds(innovation.stamp)
    for row, axis in ((0, 1), (1, 0)):
        made.line(row, time, 1e3 * innovation.value[:, axis], "xy"[axis], (BLUE, RED)[row])
        made.level(row, 1e3 * innovation.mean[axis], INK)
    return made.figure


def whiteness(analysis: Analysis, store: ArrayStore) -> Figure | None:
    """The autocorrelation of the innovation."""
    innovation = analysis.innovation
    if innovation is None or not len(innovation.correlation):
        return None
    inside = [f"{100 * share:.0f} %" for share in innovation.inside]
    figure = Figure(
        "whiteness", "Is the innovation white?",
        "Its autocorrelation. White noise stays inside the grey band at 95 % of the lags; here it "
        f"does at {inside[1]} (y) and {inside[0]} (x). Waves with the period of "
        "the steps show what the model lacks.",
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


LEG_JOINTS = (
    "HipYawPitch", "HipYaw", "HipRoll", "HipPitch", "KneePitch", "AnklePitch", "AnkleRoll"
)  # fmt: skip


def joints(analysis: Analysis, store: ArrayStore) -> Figure | None:
    """Targets and measured angles of the leg joints."""
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
    """Torques of the leg joints as shares of their limits."""
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
    pooled_time, pooled = pool(time, use.torque[:, columns])
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
    """Shares of the ticks at a limit, by joint."""
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


def loads(analysis: Analysis, store: ArrayStore) -> Figure | None:
    """Normal forces on the soles."""
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
    """Intervals and ages of the sensors, and computing time."""
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


def all_figures(analysis: Analysis, store: ArrayStore) -> list[Figure]:
    """All figures for which the bag has the topics, in the order of the page."""
    makers: tuple[Callable[[Analysis, ArrayStore], Figure | None], ...] = (
        speeds, com, path, odometry_error, step_series, origins, innovation_series,
        whiteness, joints, torques, motors, torso, loads, timing,
        percepts, world,
    )  # fmt: skip
    return [figure for make in makers if (figure := make(analysis, store)) is not None]
