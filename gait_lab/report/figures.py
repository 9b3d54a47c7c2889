"""What the page shows of a walk, in its order: figures and tables.

The functions give the lines of a figure, and none if the bag lacks its topics.
"""

import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from gait_lab.analysis.plots import (
    BLUE,
    GOLD,
    GREEN,
    GREY,
    INK,
    LEFT_COLOR,
    RED,
    RIGHT_COLOR,
)
from gait_lab.report.analysis import Analysis
from gait_lab.report.plot import Figure, Line
from gait_lab.report.verdict import TextTable, joint_table, percept_table, stretch_table
from robot_core.types import FloatArray
from sim_bridge.trials.metrics import true_com_in_q, velocity_in_heading, yaw_of
from sim_bridge.trials.trace import LEFT, RIGHT

SMOOTHING = 0.5
"""[s] over which speeds are averaged: about two steps."""
MEAN, COMMANDED, AT_LIMIT = f"mean over {SMOOTHING} s", "commanded", "torque at its limit"
COM_WINDOW = 4.0
"""[s] of the CoM shown at a time: the paper's figures show 3 to 5."""
HEAT_COLUMNS = 700
LEG_JOINTS = (
    "HipYawPitch", "HipYaw", "HipRoll", "HipPitch", "KneePitch", "AnklePitch", "AnkleRoll"
)  # fmt: skip
COUNTED = (("crossings", BLUE), ("goal posts", GOLD), ("robots", GREEN))
BARS: dict[str, Any] = {"type": "bar", "hovertemplate": "%{x}: %{y:.1f} %"}

Lines = Iterator[Line]


def speeds(analysis: Analysis) -> Lines:
    """Commanded and achieved."""
    trace = analysis.trace
    if trace is None or len(trace) < 3:
        return
    time = analysis.walk.seconds(trace.stamp)
    velocity = velocity_in_heading(trace.torso_quaternion, trace.torso_velocity)
    turn = np.gradient(np.unwrap(yaw_of(trace.torso_quaternion)), time)
    for column, (panel, factor, achieved) in enumerate((
        ("forward [cm/s]", 100.0, velocity[:, 0]),
        ("left [cm/s]", 100.0, velocity[:, 1]),
        ("turn [°/s]", math.degrees(1.0), turn),
    )):  # fmt: skip
        value = factor * achieved
        asked = factor * trace.command[:, column]
        yield Line(panel, time, value, "each tick", GREY, 0.6, more={"opacity": 0.55})
        yield Line(panel, time, smoothed(value, time), MEAN, BLUE, 2.2)
        yield Line(panel, time, asked, COMMANDED, INK, 1.6, "dash", step=True)


def smoothed(values: FloatArray, time: FloatArray) -> FloatArray:
    """(n,) values at increasing times (n,) [s], each the mean over `SMOOTHING`."""
    period = float(np.median(np.diff(time)))
    window = max(1, round(SMOOTHING / period)) if period > 0.0 else 1
    if len(values) <= window:
        return values
    padded = np.pad(np.nan_to_num(values), window // 2, mode="edge")
    mean = np.convolve(padded, np.ones(window) / window, mode="same")
    return mean[window // 2 : window // 2 + len(values)]


def com(analysis: Analysis) -> Lines:
    """In Q: true, measured, estimated and expected."""
    walk, trace = analysis.walk, analysis.trace
    panels = (("y [mm]", 1), ("x [mm]", 0))
    if trace is not None and np.isfinite(true := true_com_in_q(trace)).any():
        known = trace.status_stamp >= 0
        time = walk.seconds(trace.status_stamp)[known]
        for panel, axis in panels:
            yield Line(panel, time, 1e3 * true[known, axis], "true", BLUE, dash="dot")
    for table, name, color, width in (
        (walk.measured, "measured", RED, 1.4), (walk.estimated, "estimated", GOLD, 1.4),
        (walk.expected, "expected", INK, 2.0),
    ):  # fmt: skip
        for panel, axis in panels if len(table) else ():
            value = 1e3 * table.value[:, axis]
            yield Line(panel, walk.seconds(table.stamp), value, name, color, width)


def path(analysis: Analysis) -> Lines:
    """From above; the page moves the last point along the first line by its `customdata`."""
    paths = analysis.paths
    if paths is None:
        return
    panel, more = "y [m]", {"customdata": analysis.walk.seconds(paths.stamp), "hovertemplate": ""}
    lines = [
        Line(panel, pose[:, 0], pose[:, 1], name, color, 2.0, dash, more=more)
        for pose, name, color, dash in (
            (paths.truth, "ground truth", BLUE, "solid"), (paths.odometry, "odometry", GOLD, "dot"),
        )
        if np.isfinite(pose).any()
    ]  # fmt: skip
    if lines:
        yield from lines
        dot = {"size": 12, "color": RED, "line": {"color": "white", "width": 2}}
        yield Line(panel, lines[0].x[:1], [0.0], "", RED, points=True, more={"marker": dot})


def odometry(analysis: Analysis) -> Lines:
    """Its errors."""
    paths = analysis.paths
    if paths is None or not np.isfinite(paths.error).any():
        return
    time = analysis.walk.seconds(paths.stamp)
    x, y, yaw = paths.error.T
    yield Line("distance [cm]", time, 100 * np.hypot(x, y), "distance", BLUE, 2.0)
    yield Line("heading [°]", time, np.degrees(np.unwrap(yaw)), "heading", GOLD, 2.0)


def steps(analysis: Analysis) -> Lines:
    """Durations and sizes."""
    if len(analysis.steps) < 2:
        return
    sized = any(step.size is not None for step in analysis.steps)
    for side, name, color in ((LEFT, "on the left foot", LEFT_COLOR),
                              (RIGHT, "on the right foot", RIGHT_COLOR)):  # fmt: skip
        mine = [step for step in analysis.steps if step.support == side]
        time = np.array([step.time for step in mine])
        size = np.array([step.size or (np.nan,) * 3 for step in mine]).reshape(-1, 3)
        values = [("duration [s]", np.array([step.duration for step in mine]))]
        if sized:
            values += [("x [cm]", 100 * size[:, 0]), ("y [cm]", 100 * size[:, 1]),
                       ("turn [°]", np.degrees(size[:, 2]))]  # fmt: skip
        for panel, value in values:
            yield Line(panel, time, value, name, color, points=True)


def origins(analysis: Analysis) -> Lines:
    """Of the pendulum, under the soles."""
    if not any(len(points) for points in analysis.origins):
        return
    plain = {"hoverinfo": "skip", "hovertemplate": None}
    cross = {"symbol": "cross-thin", "size": 12, "line": {"width": 1.5, "color": INK}}
    for points, side, color, mirror in zip(
        analysis.origins, ("left", "right"), (LEFT_COLOR, RIGHT_COLOR), (1.0, -1.0), strict=True
    ):
        panel, name = f"{side} sole: ahead [cm]", f"{side} sole"
        if analysis.robot is not None:
            outline = 100.0 * np.array(analysis.robot.sole_outline)
            outline = np.vstack([outline, outline[:1]])
            inside = {"fill": "toself", "fillcolor": "rgba(22,32,42,0.06)", **plain}
            yield Line(panel, -mirror * outline[:, 1], outline[:, 0], "", INK, 1.5, more=inside)
        more = {"text": [f"{time:.2f} s" for time in points[:, 0]],
                "hovertemplate": "%{text}<br>ahead %{y:.1f} cm, right %{x:.1f} cm",
                "marker": {"size": 6, "opacity": 0.35}}  # fmt: skip
        x, y = -100 * points[:, 2], 100 * points[:, 1]
        yield Line(panel, x, y, name, color, points=True, more=more)
        zero = np.zeros(1)
        yield Line(panel, zero, zero, "", INK, points=True, more={"marker": cross, **plain})


def innovation(analysis: Analysis) -> Lines:
    """Over time, with its mean."""
    found = analysis.innovation
    if found is None:
        return
    time = analysis.walk.seconds(found.stamp)
    for axis, name, color in ((1, "y", BLUE), (0, "x", RED)):
        panel, mean = f"{name} [mm]", np.full(2, 1e3 * found.mean[axis])
        yield Line(panel, time, 1e3 * found.value[:, axis], name, color)
        yield Line(panel, time[[0, -1]], mean, "", INK, 1.0, "dot")


def whiteness(analysis: Analysis) -> Lines:
    """The autocorrelation of the innovation."""
    found = analysis.innovation
    if found is None or not len(found.correlation):
        return
    panel, end, band = "autocorrelation", found.lag[-1], found.band
    inside = {"fill": "toself", "fillcolor": "rgba(22,32,42,0.14)", "hoverinfo": "skip",
              "hovertemplate": None}  # fmt: skip
    yield Line(panel, np.array((0.0, end, end, 0.0)), np.array((-band, -band, band, band)), "",
               INK, 0.0, more=inside)  # fmt: skip
    for axis, name, color in ((1, "y", BLUE), (0, "x", RED)):
        yield Line(panel, found.lag, found.correlation[:, axis], name, color, 2.0)


def joints(analysis: Analysis) -> Lines:
    """Targets and measured angles of the legs."""
    walk = analysis.walk
    names = [side + joint for joint in LEG_JOINTS for side in "LR"]
    if len(walk.position) < 2:
        return
    for name in (name for name in names if name in walk.joint_names):
        panel = f"{name} [°]"
        if name in walk.target_names:
            target = np.degrees(walk.targets.value[:, walk.target_names.index(name)])
            sent = walk.seconds(walk.targets.stamp + walk.age)
            yield Line(panel, sent, target, "target", INK, 1.2)
        angle = np.degrees(walk.position.value[:, walk.joint_names.index(name)])
        yield Line(panel, walk.seconds(walk.position.stamp), angle, "measured", RED)


def torques(analysis: Analysis) -> Lines:
    """Shares of their limits, as a map over time."""
    use, robot = analysis.motors, analysis.robot
    if use is None or robot is None or not np.isfinite(use.torque).any():
        return
    driven = {joint.name for joint in use.joints}
    names = [side + joint for side in "RL" for joint in LEG_JOINTS[::-1] if side + joint in driven]
    size = max(1, -(-len(use.stamp) // HEAT_COLUMNS))
    count = len(use.stamp) // size
    torque = np.nan_to_num(use.torque[: count * size, [robot.index(name) for name in names]])
    largest: Any = torque.reshape(count, size, -1).max(axis=1)
    more = {
        "type": "heatmap", "z": list(100 * largest.T), "zmin": 0, "zmax": 100,
        "hovertemplate": "%{y}: %{z:.0f} %",
        "colorscale": [[0, "#f4f6f7"], [0.4, "#f6d9a8"], [0.75, "#e0843a"], [1, "#8c1c2b"]],
        "colorbar": {"title": {"text": "%"}, "thickness": 12, "len": 0.9},
    }  # fmt: skip
    time = analysis.walk.seconds(use.stamp)[: count * size : size]
    yield Line("", time, names, "", INK, more=more)


def motors(analysis: Analysis) -> Lines:
    """Shares of the ticks at a limit, by joint."""
    if analysis.motors is None:
        return
    legs = [joint for joint in analysis.motors.joints if joint.name[1:] in LEG_JOINTS]
    for name, color, values in (
        (AT_LIMIT, RED, [joint.torque_saturated for joint in legs]),
        ("target faster than the joint", GOLD, [joint.speed_saturated for joint in legs]),
    ):
        bars, shares = [joint.name for joint in legs], [percent(value) for value in values]
        if bars:
            yield Line("share of ticks [%]", bars, shares, name, color, points=True, more=BARS)


def percent(share: float | None) -> float | None:
    """A share in percent; None if it is unknown."""
    return None if share is None or not math.isfinite(share) else 100 * share


def torso(analysis: Analysis) -> Lines:
    """Roll, pitch and height."""
    truth = analysis.walk.truth
    if len(truth) < 2:
        return
    x, y, z, w = truth.value[:, 3:7].T
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2 * (w * y - z * x), -1.0, 1.0))
    time = analysis.walk.seconds(truth.stamp)
    yield Line("roll, pitch [°]", time, np.degrees(roll), "roll", BLUE)
    yield Line("roll, pitch [°]", time, np.degrees(pitch), "pitch", RED)
    yield Line("height [mm]", time, 1e3 * truth.value[:, 2], "height", INK)


def loads(analysis: Analysis) -> Lines:
    """Normal forces on the soles."""
    walk = analysis.walk
    if not all(len(table) > 1 for table in walk.wrenches):
        return
    for table, name, color in zip(
        walk.wrenches, ("left", "right"), (LEFT_COLOR, RIGHT_COLOR), strict=True
    ):
        yield Line("force [N]", walk.seconds(table.stamp), table.value[:, 2], name, color, 1.1)


def timing(analysis: Analysis) -> Lines:
    """Intervals and ages of the sensors, and computing time."""
    found, sensors = analysis.timing, analysis.walk.position
    if found is None:
        return
    yield Line("sensors every [ms]", found.interval_time, 1e3 * found.interval, "interval", BLUE)
    age = 1e-6 * (sensors.arrived - sensors.stamp).astype(float)
    yield Line("sensors' age [ms]", analysis.walk.seconds(sensors.stamp), age, "age", GOLD)
    for column, name, color in ((0, "p50", INK), (1, "p99", RED)):
        if len(found.tick):
            value = found.tick[:, column]
            yield Line("gait's tick [µs]", found.tick_time, value, name, color, 1.8)


def percepts(analysis: Analysis) -> Lines:
    """Place and error of the ball, and how much else each image showed."""
    seen = analysis.percepts
    if seen is None:
        return
    ball = seen.group("ball")
    if ball is not None:
        time = analysis.walk.seconds(ball.stamp)
        x, y = ball.position.T
        for panel, value in (
            ("ball distance [m]", np.hypot(x, y)),
            ("ball bearing [°]", np.degrees(np.arctan2(y, x))),
            ("ball error [cm]", 100.0 * ball.error),
        ):  # fmt: skip
            if np.isfinite(value).any():
                yield Line(panel, time, value, "ball", RED, points=True)
    for name, color in COUNTED:
        group = seen.group(name)
        if group is not None:
            count = group.count.astype(float)
            yield Line("number", analysis.walk.seconds(seen.stamp), count, name, color, step=True)


def world(analysis: Analysis) -> Lines:
    """Errors of what the player estimated, beside the deviations that it stated."""
    found = analysis.world
    if found is None:
        return
    time = analysis.walk.seconds(found.stamp)
    for panel, scale, error, stated in (
        ("place [cm]", 100.0, found.place_error, found.place_deviation),
        ("heading [°]", math.degrees(1.0), found.heading_error, found.heading_deviation),
    ):
        yield Line(panel, time, scale * stated, "stated", GOLD)
        yield Line(panel, time, scale * error, "error", BLUE)
        yield Line(panel, time, np.where(found.valid, np.nan, scale * error), "not valid", RED)
    if len(found.ball_error):
        ball_time = analysis.walk.seconds(found.ball_stamp)
        yield Line("ball [cm]", ball_time, 100.0 * found.ball_error, "ball", GREEN)


SPEEDS = Figure(
    "speeds", "Speeds", "Speeds: commanded and achieved",
    "In the torso's own heading, from ground truth if the bag has it, else from odometry; thin: "
    f"every tick, thick: mean over {SMOOTHING} s, that is about two steps.",
    speeds, 150, even=(MEAN, COMMANDED),
)  # fmt: skip
ORIGINS = Figure(
    "origins", "Origins", "Pendulum origins under the sole",
    "The paper's Fig. 4: where the pendulum of each single support stands, in the frame of the "
    "sole (0, 0 is below the ankle). Sound steps keep it well inside the outline.",
    origins, 380, 2, "to the right [cm]", equal=True, x_axis={"range": [-9, 9]},
    y_axis={"range": [-7, 12]}, layout={"showlegend": False},
)  # fmt: skip
WHITENESS = Figure(
    "whiteness", "Whiteness", "Is the innovation white?",
    "Its autocorrelation. White noise stays inside the grey band at 95 % of the lags. Waves with "
    "the period of the steps show what the model lacks.",
    whiteness, 240, x_label="lag [s]", y_axis={"range": [-1.05, 1.05]},
)  # fmt: skip
MOTORS = Figure(
    "motors", "Saturation", "Saturation by joint",
    "Share of the ticks with the motor at its torque limit, and with a target that asks for more "
    "than the joint's top speed.",
    motors, 240, x_label="", x_axis={"tickangle": -30}, y_axis={"rangemode": "tozero"},
    layout={"barmode": "group", "bargap": 0.3},
)  # fmt: skip

SECTIONS: tuple[Figure | Callable[[Analysis], TextTable | None], ...] = (
    stretch_table,
    Figure(
        "world", "World model", "What the robot estimated",
        "Errors of its own pose and of the ball's place on the field, and the deviations that it "
        "stated. Red: it held its pose for not valid.",
        world, 120,
    ),
    percept_table,
    Figure(
        "percepts", "Seen", "What the robot saw",
        "At the time of each image. The ball in base_footprint, and how far it is from the truth; "
        "below, how many crossings, goal posts and robots an image showed.",
        percepts, 120,
    ),
    SPEEDS,
    Figure(
        "com", "CoM", "Centre of mass in Q: expected, measured, estimated",
        "The quantities of the paper's Figs. 6 (y, on the spot) and 7 (x, forward), of this walk. "
        "Q is the coordinate system of the single support and jumps with each step. Shown are "
        f"{COM_WINDOW:.0f} s around the cursor; play, or click into another plot. True: from "
        "ground truth and the recorded joints, with their zero errors as a constant part.",
        com, 220, window=COM_WINDOW,
    ),
    Figure(
        "path", "Way", "The path from above",
        "Middle between the soles; both begin at (0, 0) looking along x. The dot is the cursor.",
        path, 410, x_label="x [m]", equal=True,
    ),
    Figure(
        "odometry", "Odometry", "Odometry against ground truth",
        "Error of the gait's own odometry since the start.",
        odometry, 130,
    ),
    Figure(
        "steps", "Steps", "Steps: duration and size",
        "Each single support: its duration, and its step size, the pose of the next Q in this one "
        "as the feet measured it. A side step or a turn opens on one foot and closes on the other.",
        steps, 125,
    ),
    ORIGINS,
    Figure(
        "innovation", "Innovation", "Observer innovation",
        "Measured minus expected CoM; dotted: its mean.",
        innovation,
    ),
    WHITENESS,
    Figure(
        "joints", "Joints", "Joints: targets and measured",
        "Targets at the time at which they were sent, angles at the time of their sampling: the "
        f"distance in time is the motor's lag. Shown are {COM_WINDOW:.0f} s around the cursor.",
        joints, 112, 2, window=COM_WINDOW,
    ),
    Figure(
        "torques", "Torque", "Torque in the legs",
        "Share of the torque that a nominal motor of the reference plant has at its speed; dark "
        "red is the limit. Each column shows the largest value of its time.",
        torques, 300, layout={"margin": {"l": 110}},
    ),
    MOTORS,
    joint_table,
    Figure(
        "torso", "Torso", "Torso: roll, pitch and height",
        "Ground truth; the height is that of the torso's frame.",
        torso,
    ),
    Figure("loads", "Load", "Load on the soles", "Force along the sole's normal.", loads, 180),
    Figure(
        "timing", "Timing", "Timing",
        "Time between two joint states (a missing one shows as a double step), their age when "
        "they were recorded, and how long the gait computes, second by second.",
        timing, 120, y_axis={"rangemode": "tozero"},
    ),
)  # fmt: skip
"""Of the page, from top to bottom."""
