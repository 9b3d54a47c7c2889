"""A measurement is a row; the JSON, the CSV and the tables are views of the rows."""

import math
import textwrap
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

from gait_lab.bench.options import Options

WIDTH = 100
"""Columns of a terminal at which notes are wrapped."""
COLUMNS = 9
"""Most columns of a table on a terminal."""
Cell = str | float | None
"""A cell of a table; None and NaN, where nothing was measured, are shown as `-`."""
TRUTH, HEADS = "bool", {"counts": "valid speed"}
"""Unit of what is shown as yes or no; quantities with another name in tables."""


class Row(NamedTuple):
    """One measured number.

    Attributes:
        subject: What was measured, e.g. `forward_open_loop`; a line of the table. May be empty.
        quantity: Which quantity of it, e.g. `worst`; a column of the table.
        unit: Its unit; empty for a ratio.
        value: None or NaN if it was not measured or does not count.
        paper: The published value.
        plant: Title of the plant, where a suite changes the one of its options.
    """

    subject: str
    quantity: str
    unit: str
    value: float | None
    paper: float | None = None
    plant: str | None = None

    @property
    def metric(self) -> str:
        """Its name, unique within the suite."""
        return "_".join(filter(None, (self.subject, self.quantity)))


def rows_of(subject: str, *cells: tuple[str, str, float | None]) -> list[Row]:
    """Rows of one subject from quantity, unit and value."""
    return [Row(subject, *cell) for cell in cells]


def as_dicts(
    rows: Iterable[Row], suite: str, options: Options, same_robots: bool = True
) -> list[dict[str, Any]]:
    """The rows as they stand in JSON and CSV.

    Args:
        rows: The rows.
        suite: Name of the suite.
        options: What it ran on.
        same_robots: The robots of the options did everything; else each run has a robot of its own.
    """
    return [
        {
            "suite": suite,
            "metric": each.metric,
            "unit": each.unit,
            "value": finite(each.value),
            "paper": each.paper,
            "engine": options.engine,
            "plant": options.plant_title if each.plant is None else each.plant,
            "robots": options.robots if same_robots else None,
            "seed": options.seed,
        }
        for each in rows
    ]


def finite(value: float | None) -> float | None:
    """The value for JSON, which has no NaN."""
    return value if value is not None and math.isfinite(value) else None


def shown(cell: Cell) -> str:
    """The text of a cell, numbers with three or more significant digits."""
    if isinstance(cell, str):
        return cell
    if cell is None or not math.isfinite(cell):
        return "-"
    if float(cell).is_integer():
        return f"{cell:.0f}"
    size = abs(cell)
    return f"{cell:.{0 if size >= 1000 else 1 if size >= 10 else 2 if size >= 1 else 3}f}"


def tables(rows: Iterable[Row]) -> list[tuple[list[str], list[list[Cell]]]]:
    """Heads and lines of the tables: a line per subject, a column per quantity.

    A subject joins the first table that has more than half of its quantities.
    """
    subjects: dict[str, dict[str, Row]] = {}
    for each in rows:
        subjects.setdefault(each.subject, {})[each.quantity] = each
    groups: list[tuple[dict[str, str], list[tuple[str, dict[str, Row]]]]] = []
    for subject, cells in subjects.items():
        columns, lines = next(
            (each for each in groups if 2 * len(each[0].keys() & cells.keys()) > len(cells)),
            ({}, []),
        )
        if not lines:
            groups.append((columns, lines))
        for name, each in cells.items():
            columns.setdefault(name, each.unit)
            if each.paper is not None:
                columns.setdefault(f"{name} (paper)", each.unit)
        lines.append((subject, cells))
    found = []
    for columns, lines in groups:
        units = {name: {cells[name].unit for _, cells in lines if name in cells}
                 for name in columns}  # fmt: skip
        heads = ["", *(HEADS.get(name, name.replace("_", " ")) + (
                       "" if len(units[name]) != 1 or unit in ("", TRUTH)
                       else f" [{unit}]") for name, unit in columns.items())]  # fmt: skip
        body: list[list[Cell]] = []
        for subject, cells in lines:
            line: list[Cell] = [subject.replace("_", " ")]
            for name in columns:
                beside = cells.get(name.removesuffix(" (paper)"))
                if beside is None:
                    line.append("")
                elif name.endswith(" (paper)"):
                    line.append("" if beside.paper is None else beside.paper)
                elif beside.unit == TRUTH and beside.value is not None:
                    line.append("yes" if beside.value else "no")
                else:
                    unit = f" {beside.unit}" if len(units[name]) > 1 else ""
                    line.append(shown(beside.value) + unit if unit else beside.value)
            body.append(line)
        found.append((heads, body))
    return found


def table_text(
    heads: Sequence[str], lines: Sequence[Sequence[Cell]], markdown: bool = False
) -> str:
    """Aligned columns, for a terminal or in GitHub's Markdown."""
    from tabulate import tabulate

    if not markdown:
        heads = [textwrap.fill(head, 12) for head in heads]
    cells = [[shown(cell) for cell in line] for line in lines]
    form = "pipe" if markdown else "simple"
    sides = ["left", *["right"] * (len(heads) - 1)]
    return tabulate(cells, heads, form, disable_numparse=True, colalign=sides if cells else None)


def as_text(title: str, rows: Iterable[Row], notes: Iterable[str]) -> str:
    """For a terminal."""
    parts = [title, *(table_text(*_narrow(*table)) for table in tables(rows))]
    return "\n\n".join((*parts, "\n".join(textwrap.fill(note, WIDTH) for note in notes))).rstrip()


def _narrow(heads: list[str], lines: list[list[Cell]]) -> tuple[list[str], list[list[Cell]]]:
    """The table, or with a line per quantity where its columns would not fit a terminal."""
    if len(heads) <= COLUMNS or len(lines) >= len(heads):
        return heads, lines
    columns = [str(line[0]) for line in lines]
    return ["", *columns], [
        [head, *(line[place] for line in lines)] for place, head in enumerate(heads) if place
    ]
