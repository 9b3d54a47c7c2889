"""Figures of what the observer did not expect."""

from gait_lab.report.analysis import Analysis
from gait_lab.report.figure import (
    BLUE,
    INK,
    RED,
    ArrayStore,
    Figure,
    TimeFigure,
)


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
