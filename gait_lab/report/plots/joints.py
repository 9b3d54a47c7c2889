"""Figures of the joints: angles, torques, how near the motors came to their limits."""

import math

import numpy as np

from gait_lab.report.analysis import Analysis
from gait_lab.report.figure import (
    GOLD,
    INK,
    RED,
    ArrayStore,
    Figure,
    TimeFigure,
)
from gait_lab.report.plots.sampling import COM_WINDOW, pool

LEG_JOINTS = (
    "HipYawPitch", "HipYaw", "HipRoll", "HipPitch", "KneePitch", "AnklePitch", "AnkleRoll"
)  # fmt: skip


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
