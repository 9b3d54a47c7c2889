"""Figures of the steps: their times and sizes, and where the pendulum stood."""

import numpy as np

from gait_lab.analysis.metrics import LEFT, RIGHT
from gait_lab.report.analysis import Analysis
from gait_lab.report.figure import (
    INK,
    LEFT_COLOR,
    RIGHT_COLOR,
    ArrayStore,
    Figure,
    TimeFigure,
)


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
