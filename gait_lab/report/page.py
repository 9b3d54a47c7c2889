"""The HTML page of a report: figures, tables, and everything in one file."""

import json
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from importlib.resources import files
from typing import Any, NamedTuple

from gait_lab.report.analysis import Analysis
from gait_lab.report.plot import ArrayStore, Figure, Line, drawn
from gait_lab.report.verdict import Finding, TextTable


class Block(NamedTuple):
    """A part of the page.

    Attributes:
        figure: What the script draws in it; None for a table.
    """

    identity: str
    short: str
    html: str
    figure: dict[str, Any] | None = None


def figure_block(figure: Figure, lines: Iterable[Line], store: ArrayStore) -> Block | None:
    """A figure with these lines; None without lines."""
    lines = list(lines)
    if not lines:
        return None
    made = drawn(figure, lines, store)
    height = made["layout"]["height"]
    plot = f'<div class="plot" id="{figure.identity}" style="height:{height}px"></div>'
    return _block(figure, plot, made)


def table_block(table: TextTable) -> Block:
    """A table; a cell that begins with `better` or `worse` and a line end has that class."""
    head = "".join(f"<th>{escape(cell)}</th>" for cell in table.head)
    rows = "".join(f"<tr>{''.join(map(_cell, row))}</tr>" for row in table.rows)
    return _block(
        table,
        f'<div class="scroll"><table id="{table.identity}"><thead><tr>{head}</tr></thead>'
        f"<tbody>{rows}</tbody></table></div>",
    )


def _cell(cell: str) -> str:
    kind, _, text = cell.rpartition("\n")
    return f'<td class="{kind}">{escape(text)}</td>' if kind else f"<td>{escape(text)}</td>"


def _block(shown: Figure | TextTable, html: str, figure: dict[str, Any] | None = None) -> Block:
    return Block(shown.identity, shown.short, (
        f'<section id="s-{shown.identity}"><h3>{escape(shown.title)}</h3>{html}'
        f'<p class="note">{escape(shown.note)}</p></section>'
    ), figure)  # fmt: skip


def blocks_of(
    analysis: Analysis, sections: Iterable[Any], store: ArrayStore
) -> list[Block]:
    """The figures and tables for which the bag has the topics."""
    made = []
    for section in sections:
        if isinstance(section, Figure):
            block = figure_block(section, section.lines(analysis), store)
        else:
            table = section(analysis)
            block = None if table is None else table_block(table)
        made += [] if block is None else [block]
    return made


def asset(name: str) -> str:
    """The text of a file in assets/."""
    return (files("gait_lab.report") / "assets" / name).read_text(encoding="utf-8")


def verdict_html(headline: Finding, found: Sequence[Finding]) -> str:
    """The headline and the list of findings."""
    items = "".join(f'<li class="{each.grade}">{escape(each.text)}</li>' for each in found)
    return f'<h2 class="{headline.grade}">{escape(headline.text)}</h2><ul>{items}</ul>'


def key_numbers_html(numbers: Sequence[tuple[str, str, str]]) -> str:
    """The numbers at the top: (name, value, unit) each."""
    return "".join(
        f'<div class="key"><b>{escape(value)}<small> {escape(unit)}</small></b>'
        f"<span>{escape(name)}</span></div>"
        for name, value, unit in numbers
    )


def list_html(title: str, lines: Sequence[str], kind: str = "missing") -> str:
    """A box with a list, of a CSS class; nothing without lines."""
    if not lines:
        return ""
    items = "".join(f"<li>{escape(line)}</li>" for line in lines)
    return f'<div class="wide"><div class="box {kind}"><h3>{escape(title)}</h3><ul>{items}</ul></div></div>'  # noqa: E501


def page(
    title: str,
    subtitle: str,
    top: str,
    blocks: Sequence[Block],
    data: Mapping[str, Any],
    store: ArrayStore,
) -> str:
    """The complete page, with script, style, plotly.js and all numbers inside."""
    from plotly.offline import get_plotlyjs

    figures = [block.figure for block in blocks if block.figure is not None]
    parts = {
        "TITLE": escape(title),
        "SUBTITLE": escape(subtitle),
        "STYLE": asset("report.css"),
        "NAVIGATION": "".join(
            f'<a href="#s-{block.identity}">{escape(block.short)}</a>' for block in blocks
        ),
        "TOP": top,
        "BLOCKS": "".join(block.html for block in blocks),
        "DATA": script_json({**data, "figures": figures, "arrays": store.packed}),
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
