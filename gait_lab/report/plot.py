"""A figure as data: lines in panels, which plotly.js draws on the page."""

import base64
from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np

from gait_lab.report.analysis import Analysis
from robot_core.types import FloatArray

TIME = "time [s]"
MOST_POINTS = 12000
"""Largest number of drawn points of a line; longer ones are thinned for drawing only."""


class ArrayStore:
    """The number arrays of a page, each stored once as base64 of float32."""

    def __init__(self) -> None:
        self._known: dict[bytes, int] = {}
        self.packed: list[str] = []

    def add(self, values: Any) -> dict[str, int]:
        """Store an array; the page's script replaces the reference by a Float32Array."""
        data = np.ascontiguousarray(values, dtype="<f4").tobytes()
        if data not in self._known:
            self._known[data] = len(self.packed)
            self.packed.append(base64.b64encode(data).decode("ascii"))
        return {"$": self._known[data]}


@dataclass(frozen=True, slots=True)
class Line:
    """A line in one panel of a figure; with `points`, points, bars or whatever `more` says.

    Attributes:
        panel: Quantity and unit on the y axis; panels stand in the order of their first lines.
        x: (n,) numbers or names.
        y: (n,) numbers; None if `more` has them.
        name: In the legend, which lines of one name share; "" is not in it.
        more: Further properties of the plotly trace; arrays in it have a row for each point.
    """

    panel: str
    x: FloatArray | Sequence[str]
    y: FloatArray | Sequence[Any] | None
    name: str
    color: str
    width: float = 1.4
    dash: str = "solid"
    step: bool = False
    points: bool = False
    more: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Figure:
    """What a figure shows, and how.

    Attributes:
        lines: Gives the lines of a walk; none if the bag lacks the topics.
        height: [pixels] of a panel.
        x_label: `TIME` for the page's time axis, with cursor, marks and common zoom.
        window: [s] that are shown around the cursor; 0: the common zoom.
        even: Names of lines whose largest values, without outliers, span the panels around 0.
    """

    identity: str
    short: str
    title: str
    note: str
    lines: Callable[[Analysis], Iterable[Line]]
    height: int = 140
    columns: int = 1
    x_label: str = TIME
    window: float = 0.0
    equal: bool = False
    even: tuple[str, ...] = ()
    x_axis: Mapping[str, Any] = field(default_factory=dict)
    y_axis: Mapping[str, Any] = field(default_factory=dict)
    layout: Mapping[str, Any] = field(default_factory=dict)


def drawn(figure: Figure, lines: Sequence[Line], store: ArrayStore) -> dict[str, Any]:
    """The figure with these lines, as the page's script takes it."""
    panels = list(dict.fromkeys(line.panel for line in lines))
    rows, over_time = -(-len(panels) // figure.columns), figure.x_label == TIME
    layout = deepcopy(_grid(rows, figure.columns, over_time))
    for index, panel in enumerate(panels):
        number = _number(index)
        x_axis, y_axis = layout[f"xaxis{number}"], layout[f"yaxis{number}"]
        x_axis.update(figure.x_axis)
        if index + figure.columns >= len(panels):
            x_axis |= {"title": {"text": figure.x_label, "standoff": 4}, "showticklabels": True}
        y_axis |= {"title": {"text": panel, "standoff": 6}, **figure.y_axis}
        if figure.equal:
            y_axis |= {"scaleanchor": f"x{number}", "scaleratio": 1}
        if figure.even:
            mine = [line.y for line in lines if line.panel == panel and line.name in figure.even]
            reach = 1.6 * max([6.0, *map(_largest, mine)])
            y_axis["range"] = [-reach, reach]
    traces, named = [], set[str]()
    for line in lines:
        shown = bool(line.name) and line.name not in named
        named.add(line.name)
        traces.append(_trace(line, _number(panels.index(line.panel)), shown, store))
    return {
        "id": figure.identity,
        "data": traces,
        "layout": {**layout, **figure.layout, "height": 62 + figure.height * rows},
        "time": over_time,
        "window": figure.window,
    }


@cache
def _grid(rows: int, columns: int, one_x_axis: bool) -> dict[str, Any]:
    """The axes of panels. Plotly takes as long for them as for all that a walk has to be read."""
    from plotly.subplots import make_subplots

    layout: dict[str, Any] = make_subplots(
        rows, columns, shared_xaxes="all" if one_x_axis else False,
        vertical_spacing=0.17 / max(rows, 3), horizontal_spacing=0.07,
    ).layout.to_plotly_json()  # fmt: skip
    layout.pop("template", None)
    return layout


def _number(index: int) -> str:
    return "" if index == 0 else str(index + 1)


def _trace(line: Line, axis: str, shown: bool, store: ArrayStore) -> dict[str, Any]:
    every = max(1, -(-len(line.x) // MOST_POINTS))

    def packed(value: Any) -> Any:
        if isinstance(value, np.ndarray):
            return store.add(value[::every])
        return [packed(each) for each in value] if isinstance(value, list) else value

    look: dict[str, Any] = {
        "mode": "lines",
        "line": {"color": line.color, "width": line.width, "dash": line.dash,
                 "shape": "hv" if line.step else "linear"},
    }  # fmt: skip
    if line.points:
        marker = {"color": line.color, "size": 5, **line.more.get("marker", {})}
        look = {"mode": "markers", "marker": marker}
    more = {key: packed(value) for key, value in line.more.items() if key != "marker"}
    return {
        "type": "scatter", "name": line.name, "legendgroup": line.name, "showlegend": shown,
        "x": packed(line.x), "y": packed(line.y), "xaxis": f"x{axis}", "yaxis": f"y{axis}",
        "hovertemplate": "%{y:.4g}", **look, **more,
    }  # fmt: skip


def _largest(values: Any) -> float:
    """The largest magnitude but for outliers; 0 where nothing is known."""
    known = np.abs(values[np.isfinite(values)])
    return float(np.percentile(known, 99.5)) if len(known) else 0.0
