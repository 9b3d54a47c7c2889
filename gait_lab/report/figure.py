"""Figures as plotly.js takes them: plain dictionaries, and the numbers packed once for a page."""

import base64
from collections.abc import Sequence, Sized
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from nao_lipm_gait.types import FloatArray

INK, RED, BLUE, GREY, GOLD, GREEN = (
    "#16202a", "#d1495b", "#0f7c94", "#9aa3ab", "#e0a030", "#3f8f5b",
)  # fmt: skip
"""Distinguishable also without colour vision: they differ in lightness."""
LEFT_COLOR, RIGHT_COLOR = "#c8553d", "#2f7f5f"
MOST_POINTS = 12000
"""Of one line; a longer one is thinned for drawing alone."""


class ArrayStore:
    """Number arrays of a page, each kept once as base64 of float32."""

    def __init__(self) -> None:
        self._known: dict[bytes, int] = {}
        self.packed: list[str] = []

    def add(self, values: Any) -> dict[str, int]:
        """A reference that the page's script replaces by a Float32Array."""
        data = np.ascontiguousarray(values, dtype="<f4").tobytes()
        if data not in self._known:
            self._known[data] = len(self.packed)
            self.packed.append(base64.b64encode(data).decode("ascii"))
        return {"$": self._known[data]}


@dataclass(slots=True)
class Figure:
    """One plot with a heading and a sentence below it."""

    identity: str
    title: str
    note: str
    height: int
    traces: list[dict[str, Any]] = field(default_factory=list)
    layout: dict[str, Any] = field(default_factory=dict)
    over_time: bool = False
    """The x axis is the report's time axis, with cursor, marks and common zoom."""
    window: float = 0.0
    """[s] that are shown around the cursor; 0: the common zoom."""

    def as_dict(self) -> dict[str, Any]:
        return {
            "id": self.identity,
            "data": self.traces,
            "layout": {**self.layout, "height": self.height},
            "time": self.over_time,
            "window": self.window,
        }


def thin(time: Sized) -> slice:
    """Which points to draw."""
    return slice(None, None, max(1, -(-len(time) // MOST_POINTS)))


class TimeFigure:
    """A figure of rows over one time axis."""

    def __init__(
        self,
        store: ArrayStore,
        identity: str,
        title: str,
        note: str,
        rows: Sequence[str],
        row_height: int = 170,
        columns: int = 1,
    ) -> None:
        """rows: the label of each y axis; with columns, filled row by row."""
        self._store = store
        self._legends: set[str] = set()
        count = -(-len(rows) // columns)
        self.figure = Figure(identity, title, note, 62 + row_height * count, over_time=True)
        layout = self.figure.layout
        gap = 0.028 * 6 / max(count, 3)
        size = (1.0 - gap * (count - 1)) / count
        for index, label in enumerate(rows):
            row, column = divmod(index, columns)
            number = "" if index == 0 else str(index + 1)
            top = 1.0 - row * (size + gap)
            width = (1.0 - 0.07 * (columns - 1)) / columns
            left = column * (width + 0.07)
            last = index + columns >= len(rows)
            layout[f"yaxis{number}"] = {
                "title": {"text": label, "standoff": 6}, "domain": [max(0.0, top - size), top],
                "anchor": f"x{number}",
            }  # fmt: skip
            layout[f"xaxis{number}"] = {
                "domain": [left, left + width], "anchor": f"y{number}", "showticklabels": last,
                **({"matches": "x"} if index else {}),
                **({"title": {"text": "time [s]", "standoff": 4}} if last else {}),
            }  # fmt: skip

    def line(
        self,
        row: int,
        time: FloatArray,
        value: FloatArray,
        name: str,
        color: str,
        *,
        step: bool = False,
        dash: str = "solid",
        width: float = 1.4,
        opacity: float = 1.0,
        markers: bool = False,
    ) -> None:
        """A line (or points) in the row, counted from 0. Times [s]."""
        if not len(time):
            return
        part = thin(time)
        number = "" if row == 0 else str(row + 1)
        trace: dict[str, Any] = {
            "type": "scatter", "mode": "markers" if markers else "lines", "name": name,
            "x": self._store.add(time[part]), "y": self._store.add(value[part]),
            "xaxis": f"x{number}", "yaxis": f"y{number}", "opacity": opacity,
            "legendgroup": name, "showlegend": name not in self._legends and bool(name),
            "hovertemplate": "%{y:.4g}",
        }  # fmt: skip
        if markers:
            trace["marker"] = {"color": color, "size": 5}
        else:
            trace["line"] = {"color": color, "width": width, "dash": dash,
                             "shape": "hv" if step else "linear"}  # fmt: skip
        self._legends.add(name)
        self.figure.traces.append(trace)

    def level(self, row: int, value: float, color: str = GREY) -> None:
        """A dotted horizontal line."""
        number = "" if row == 0 else str(row + 1)
        self.figure.layout.setdefault("shapes", []).append(
            {"type": "line", "xref": f"x{number} domain", "x0": 0, "x1": 1, "yref": f"y{number}",
             "y0": value, "y1": value, "line": {"color": color, "width": 1, "dash": "dot"}}
        )  # fmt: skip

    def y_range(self, row: int, low: float, high: float) -> None:
        number = "" if row == 0 else str(row + 1)
        self.figure.layout[f"yaxis{number}"]["range"] = [low, high]
