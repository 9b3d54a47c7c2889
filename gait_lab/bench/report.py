"""What a suite found: rows for machines, text tables for people."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from gait_lab.bench.options import BenchOptions


@dataclass(frozen=True, slots=True)
class Row:
    """One number of a suite, as it goes into the JSON."""

    suite: str
    metric: str
    unit: str
    value: float | None
    paper: float | None = None
    plant: str | None = None
    """Where a suite changes the plant; None = the one of its options."""


@dataclass(frozen=True, slots=True)
class Report:
    """What a suite found: rows for machines, text for people."""

    rows: tuple[Row, ...]
    text: str
    one_set_of_robots: bool = True
    """Walked by the robots of the options; else every attempt has its own."""

    def as_json(self, options: BenchOptions) -> list[dict[str, Any]]:
        return [
            {
                "suite": row.suite,
                "metric": row.metric,
                "unit": row.unit,
                "value": row.value,
                "paper": row.paper,
                "engine": options.engine,
                "plant": options.plant_title if row.plant is None else row.plant,
                "robots": options.robots if self.one_set_of_robots else None,
                "seed": options.seed,
            }
            for row in self.rows
        ]


def finite(value: float) -> float | None:
    """The value for the JSON, which knows no NaN."""
    return value if math.isfinite(value) else None


def number(value: float | None, digits: int = 1) -> str:
    """A cell of a table; `-` where nothing was measured."""
    return f"{value:.{digits}f}" if value is not None and math.isfinite(value) else "-"


def loop_name(closed: bool) -> str:
    return "closed" if closed else "open"


def table(lines: Sequence[Sequence[str]], header: int = 2) -> str:
    """Columns aligned for a fixed-width font: words to the left, numbers to the right."""
    widths = [max(len(cell) for cell in column) for column in zip(*lines, strict=True)]

    def is_text(column: int) -> bool:
        return not any(re.match(r"[-+]?\d", line[column]) for line in lines[header:])

    texts = [is_text(column) for column in range(len(widths))]
    padded = [
        "  ".join(
            cell.ljust(width) if text else cell.rjust(width)
            for cell, width, text in zip(line, widths, texts, strict=True)
        ).rstrip()
        for line in lines
    ]
    rule = "-" * max(len(line) for line in padded)
    return "\n".join((*padded[:header], rule, *padded[header:]))
