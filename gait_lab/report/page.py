"""One HTML page with everything in it: script, style, plotly.js and the numbers. No network."""

import html
import json
from collections.abc import Sequence
from importlib.resources import files
from typing import Any

from gait_lab.report.figure import ArrayStore, Figure
from gait_lab.report.tables import TextTable
from gait_lab.report.verdict import Finding

Block = tuple[str, str, str]
"""Identity, title for the navigation, HTML."""


def asset(name: str) -> str:
    """The text of a file in assets/."""
    return (files("gait_lab.report") / "assets" / name).read_text(encoding="utf-8")


def escape(text: str) -> str:
    return html.escape(text, quote=True)


def verdict_html(headline: Finding, found: Sequence[Finding]) -> str:
    items = "".join(
        f'<li class="{finding.grade}">{escape(finding.text)}</li>' for finding in found
    )
    return f'<h2 class="{headline.grade}">{escape(headline.text)}</h2><ul>{items}</ul>'


def key_numbers_html(numbers: Sequence[tuple[str, str, str]]) -> str:
    return "".join(
        f'<div class="key"><b>{escape(value)}<small> {escape(unit)}</small></b>'
        f"<span>{escape(name)}</span></div>"
        for name, value, unit in numbers
    )


def list_html(title: str, lines: Sequence[str], kind: str) -> str:
    if not lines:
        return ""
    items = "".join(f"<li>{escape(line)}</li>" for line in lines)
    return f'<div class="box {kind}"><h3>{escape(title)}</h3><ul>{items}</ul></div>'


SHORT = {
    "stretches": "Table", "com": "CoM", "path": "Way", "odometry": "Odometry", "steps": "Steps",
    "origins": "Origins", "innovation": "Innovation", "whiteness": "Whiteness", "joints": "Joints",
    "torques": "Torque", "motors": "Saturation", "jointtable": "Joint table", "torso": "Torso",
    "loads": "Load", "timing": "Timing", "speeds": "Speeds", "reached": "Reached",
    "durations": "Durations", "numbers": "Numbers",
}  # fmt: skip
"""Words of the navigation."""


def figure_block(figure: Figure) -> Block:
    return figure.identity, figure.title, (
        f'<section id="s-{figure.identity}"><h3>{escape(figure.title)}</h3>'
        f'<div class="plot" id="{figure.identity}" style="height:{figure.height}px"></div>'
        f'<p class="note">{escape(figure.note)}</p></section>'
    )  # fmt: skip


def table_block(table: TextTable) -> Block:
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
    """The whole page. `top` is HTML above the blocks; `data` goes to the script as it is."""
    from plotly.offline import get_plotlyjs

    everything = {
        **data,
        "figures": [figure.as_dict() for figure in figures],
        "arrays": store.packed,
    }
    # In a script element only "</" could end it early.
    packed = json.dumps(everything, separators=(",", ":"), allow_nan=False).replace("</", "<\\/")
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
        "DATA": packed,
        "PLOTLY": get_plotlyjs() if figures else "",
        "SCRIPT": asset("report.js") + (asset("replay.js") if data.get("replay") else ""),
    }
    text = asset("report.html")
    pieces = []
    # Not one replacement after another: what is put in could hold the next mark.
    while "{{" in text:
        before, _, rest = text.partition("{{")
        name, _, text = rest.partition("}}")
        pieces += [before, parts[name]]
    return "".join([*pieces, text])
