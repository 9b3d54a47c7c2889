"""The HTML page of a report: figures for plotly.js, tables, and everything in one file."""

import base64
import html
import json
from collections.abc import Mapping, Sequence, Sized
from dataclasses import dataclass, field
from importlib.resources import files
from typing import Any

import numpy as np

from gait_lab.report.verdict import Finding, TextTable
from robot_core.types import FloatArray

INK, RED, BLUE, GREY, GOLD, GREEN = (
    "#16202a", "#d1495b", "#0f7c94", "#9aa3ab", "#e0a030", "#3f8f5b",
)  # fmt: skip
"""Of different lightness, so that they differ also without colour vision."""
LEFT_COLOR, RIGHT_COLOR = "#c8553d", "#2f7f5f"
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


@dataclass(slots=True)
class Figure:
    """One plot with a heading and a sentence below it.

    Attributes:
        identity: Id of the HTML element.
        title: Title above the figure.
        note: Note below the figure.
        height: [pixels].
        traces: Traces for plotly.js.
        layout: Layout for plotly.js.
        over_time: The x axis is the report's time axis, with cursor, marks and common zoom.
        window: [s] that are shown around the cursor; 0: the common zoom.
    """

    identity: str
    title: str
    note: str
    height: int
    traces: list[dict[str, Any]] = field(default_factory=list)
    layout: dict[str, Any] = field(default_factory=dict)
    over_time: bool = False
    window: float = 0.0

    def as_dict(self) -> dict[str, Any]:
        """As the page's script takes it."""
        return {
            "id": self.identity,
            "data": self.traces,
            "layout": {**self.layout, "height": self.height},
            "time": self.over_time,
            "window": self.window,
        }


def thin(time: Sized) -> slice:
    """The points to draw of a line over these times."""
    return slice(None, None, max(1, -(-len(time) // MOST_POINTS)))


class TimeFigure:
    """A figure of several plots over one time axis.

    Args:
        store: Takes the numbers.
        identity: Id of the HTML element.
        title: Title above the figure.
        note: Note below the figure.
        rows: The label of the y axis of each plot; with several columns, row by row.
        row_height: [pixels].
        columns: Number of columns of plots.

    Attributes:
        figure: The figure so far.
    """

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
        """Draw a line, or points.

        Args:
            row: The plot, counted from 0.
            time: (t,) [s].
            value: (t,) in the unit of the axis.
            name: Name in the legend; lines of the same name share an entry.
            color: Color of the line.
            step: Hold each value until the next one.
            dash: Dash style of plotly.js.
            width: [pixels].
            opacity: 0 to 1.
            markers: Draw points instead of a line.
        """
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
        """Draw a dotted horizontal line at a value."""
        number = "" if row == 0 else str(row + 1)
        self.figure.layout.setdefault("shapes", []).append(
            {"type": "line", "xref": f"x{number} domain", "x0": 0, "x1": 1, "yref": f"y{number}",
             "y0": value, "y1": value, "line": {"color": color, "width": 1, "dash": "dot"}}
        )  # fmt: skip

    def y_range(self, row: int, low: float, high: float) -> None:
        """Set the range of the y axis of a plot."""
        number = "" if row == 0 else str(row + 1)
        self.figure.layout[f"yaxis{number}"]["range"] = [low, high]


Block = tuple[str, str, str]
"""Identity, title for the navigation, HTML."""


def asset(name: str) -> str:
    """The text of a file in assets/."""
    return (files("gait_lab.report") / "assets" / name).read_text(encoding="utf-8")


def escape(text: str) -> str:
    """The text with the characters escaped that HTML reserves."""
    return html.escape(text, quote=True)


def verdict_html(headline: Finding, found: Sequence[Finding]) -> str:
    """The headline and the list of findings."""
    items = "".join(
        f'<li class="{finding.grade}">{escape(finding.text)}</li>' for finding in found
    )
    return f'<h2 class="{headline.grade}">{escape(headline.text)}</h2><ul>{items}</ul>'


def key_numbers_html(numbers: Sequence[tuple[str, str, str]]) -> str:
    """The numbers at the top: (name, value, unit) each."""
    return "".join(
        f'<div class="key"><b>{escape(value)}<small> {escape(unit)}</small></b>'
        f"<span>{escape(name)}</span></div>"
        for name, value, unit in numbers
    )


def list_html(title: str, lines: Sequence[str], kind: str) -> str:
    """A box with a list, of a CSS class; nothing without lines."""
    if not lines:
        return ""
    items = "".join(f"<li>{escape(line)}</li>" for line in lines)
    return f'<div class="box {kind}"><h3>{escape(title)}</h3><ul>{items}</ul></div>'


SHORT = {
    "stretches": "Table", "com": "CoM", "path": "Way", "odometry": "Odometry", "steps": "Steps",
    "origins": "Origins", "innovation": "Innovation", "whiteness": "Whiteness", "joints": "Joints",
    "torques": "Torque", "motors": "Saturation", "jointtable": "Joint table", "torso": "Torso",
    "loads": "Load", "timing": "Timing", "speeds": "Speeds", "reached": "Reached",
    "durations": "Durations", "numbers": "Numbers", "seen": "Percepts", "percepts": "Seen",
    "world": "World model",
}  # fmt: skip
"""Titles in the navigation."""


def figure_block(figure: Figure) -> Block:
    """A figure with its title and note."""
    return figure.identity, figure.title, (
        f'<section id="s-{figure.identity}"><h3>{escape(figure.title)}</h3>'
        f'<div class="plot" id="{figure.identity}" style="height:{figure.height}px"></div>'
        f'<p class="note">{escape(figure.note)}</p></section>'
    )  # fmt: skip


def table_block(table: TextTable) -> Block:
    """A table with its title and note."""
    head = "".join(f"<th>{escape(cell)}</th>" for cell in table.head)
    rows = "".join(
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>"
        for row in table.rows
    )
    return table.identity, table.title, (
        f'<section id="s-{table.identity}"><h3>{escape(table.title)}</h3><div class="scroll">'
        f'<table id="{table.identity}"><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>'
        f'</div><p class="note">{escape(table.note)}</p></section>'
    )  # fmt: skip


def page(
    title: str,
    subtitle: str,
    top: str,
    blocks: Sequence[Block],
    data: dict[str, Any],
    figures: Sequence[Figure],
    store: ArrayStore,
) -> str:
    """The complete page.

    Args:
        title: Title of the page.
        subtitle: Below the title.
        top: HTML above the blocks.
        blocks: Figures and tables in their order.
        data: Passed to the page's script.
        figures: Drawn by the script.
        store: The numbers of the figures.

    Returns:
        HTML with script, style, plotly.js and all numbers inside.
    """
    from plotly.offline import get_plotlyjs

    everything = {
        **data,
        "figures": [figure.as_dict() for figure in figures],
        "arrays": store.packed,
    }
    links = "".join(
        f'<a href="#s-{identity}">{escape(SHORT.get(identity, name))}</a>'
        for identity, name, _ in blocks
    )
    parts = {
        "TITLE": escape(title),
        "SUBTITLE": escape(subtitle),
        "STYLE": asset("report.css"),
        "NAVIGATION": links,
        "TOP": top,
        "BLOCKS": "".join(block for _, _, block in blocks),
        "DATA": script_json(everything),
        "PLOTLY": get_plotlyjs() if figures else "",
        "SCRIPT": asset("report.js") + (asset("replay.js") if data.get("replay") else ""),
    }
    return filled(asset("report.html"), parts)


def script_json(data: object) -> str:
    """JSON that may stand in a script element."""
    # Only "</" can end the element early.
    return json.dumps(data, separators=(",", ":"), allow_nan=False).replace("</", "<\\/")


def filled(template: str, parts: Mapping[str, str]) -> str:
    """A template whose marks `{{NAME}}` are replaced by the parts of these names."""
    pieces = []
    # One pass, not one replacement per mark: an inserted text may hold another mark.
    while "{{" in template:
        before, _, rest = template.partition("{{")
        name, _, template = rest.partition("}}")
        pieces += [before, parts[name]]
    return "".join([*pieces, template])
