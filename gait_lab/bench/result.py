"""What a suite measured, as data, and its one printer: text for a terminal, Markdown for a page."""

import math
import re
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from gait_lab.bench.options import BenchOptions

WIDTH = 100
"""Columns of a terminal at which notes are wrapped."""
Cell = str | float | None
"""A cell of a table; None and NaN, where nothing was measured, are shown as `-`."""

_NUMBER = re.compile(r"|-|x|[-+~x!<>= ]*\d[-\d./]*( %)?")
"""A cell with a number, perhaps marked, or without one."""


@dataclass(frozen=True, slots=True)
class Measurement:
    """One number of a suite, a row of the JSON.

    Attributes:
        metric: Its name, unique within the suite.
        unit: Its unit; empty for a ratio.
        value: None if it was not measured or does not count.
        paper: The published value.
        plant: Title of the plant, where a suite changes the one of its options.
    """

    metric: str
    unit: str
    value: float | None
    paper: float | None = None
    plant: str | None = None


class Column(NamedTuple):
    """A column of a table.

    Attributes:
        name: Heading.
        unit: Second line of the heading.
        digits: Decimals of its floats.
    """

    name: str
    unit: str = ""
    digits: int = 1


@dataclass(frozen=True, slots=True)
class Table:
    """Rows of cells under columns.

    Attributes:
        columns: The columns.
        rows: One cell per column each.
    """

    columns: Sequence[Column]
    rows: Sequence[Sequence[Cell]]

    def text(self, markdown: bool = False) -> str:
        """Aligned columns, words to the left and numbers to the right.

        Args:
            markdown: A table of GitHub's Markdown instead of one for a terminal.

        Returns:
            Lines without a line feed at the end.
        """
        from tabulate import tabulate

        cells = [
            [shown(cell, column.digits) for cell, column in zip(row, self.columns, strict=True)]
            for row in self.rows
        ]
        sides = [
            "right" if all(_NUMBER.fullmatch(row[index]) for row in cells) else "left"
            for index in range(len(self.columns))
        ]
        if markdown:
            heads = [f"{name} [{unit}]" if name and unit else name or unit
                     for name, unit, _ in self.columns]  # fmt: skip
        else:
            heads = [f"{name}\n{unit}" for name, unit, _ in self.columns]
        return tabulate(
            cells, heads, tablefmt="pipe" if markdown else "simple", disable_numparse=True,
            colalign=sides if cells else None,
        )  # fmt: skip

    def as_dict(self) -> dict[str, Any]:
        """The table for a JSON file."""
        rows = [[finite(cell) if isinstance(cell, float) else cell for cell in row]
                for row in self.rows]  # fmt: skip
        return {"columns": [list(column) for column in self.columns], "rows": rows}

    @classmethod
    def of(cls, data: dict[str, Any]) -> "Table":
        """The inverse of `as_dict`."""
        return cls([Column(*column) for column in data["columns"]], data["rows"])


@dataclass(frozen=True, slots=True)
class SuiteResult:
    """What a suite measured.

    Attributes:
        measurements: Measurements, for machines.
        title: What was done, and on which robots.
        tables: Tables, for people.
        notes: What the tables mean; one paragraph each.
        same_robots: The robots of the options did everything; false if each run has its own.
    """

    measurements: tuple[Measurement, ...]
    title: str
    tables: tuple[Table, ...]
    notes: tuple[str, ...] = ()
    same_robots: bool = True

    @property
    def text(self) -> str:
        """For a terminal."""
        notes = (textwrap.fill(note, WIDTH) for note in self.notes)
        tables = (table.text() for table in self.tables)
        return "\n\n".join((self.title, *tables, "\n".join(notes))).rstrip()

    def as_rows(self, suite: str, options: BenchOptions) -> list[dict[str, Any]]:
        """The rows of the JSON.

        Args:
            suite: Name of the suite.
            options: What it ran on.

        Returns:
            A dictionary per measurement.
        """
        return [
            {
                "suite": suite,
                "metric": each.metric,
                "unit": each.unit,
                "value": each.value,
                "paper": each.paper,
                "engine": options.engine,
                "plant": options.plant_title if each.plant is None else each.plant,
                "robots": options.robots if self.same_robots else None,
                "seed": options.seed,
            }
            for each in self.measurements
        ]


def finite(value: float) -> float | None:
    """The value for JSON, which has no NaN."""
    return value if math.isfinite(value) else None


def shown(cell: Cell, digits: int = 1) -> str:
    """The text of a cell; `digits` are the decimals of a float."""
    if isinstance(cell, str):
        return cell
    if cell is None or not math.isfinite(cell):
        return "-"
    return f"{cell:.{digits}f}" if isinstance(cell, float) else str(cell)


def loop_name(closed: bool) -> str:
    """The cell for closed or open loop."""
    return "closed" if closed else "open"
