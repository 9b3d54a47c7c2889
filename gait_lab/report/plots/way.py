"""Figures of where the robot went, and where its odometry had it."""

import numpy as np

from gait_lab.report.analysis import Analysis
from gait_lab.report.figure import (
    BLUE,
    GOLD,
    RED,
    ArrayStore,
    Figure,
    TimeFigure,
    thin,
)


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
