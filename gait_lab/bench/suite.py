"""What a suite of `nao_gait bench` is, and how one is declared."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from gait_lab.bench.options import Option, Options, declared
from gait_lab.bench.rows import Row, as_dicts, as_text

Measure = Callable[[Options], Iterable[Row | str]]
"""What runs a suite: it yields rows, and notes for the reader."""


@dataclass(frozen=True, slots=True)
class Suite:
    """A benchmark.

    Attributes:
        name: Its name in `nao_gait bench NAME`.
        quick: Its runs in `all`: option -> value of each where it differs from the default.
        check: Raises NaoGaitError, before any work, for what the suite cannot do.
        applies: Whether `all` runs it with these options.
        gait: Whether a preset and parameters of the gait may be given; without, each robot walks
            with its own preset.
        same_robots: The robots of the options do everything; else each run has its own.
        epilog: The end of its help, in lines.
    """

    name: str
    title: str
    summary: str
    measure: Measure
    options: Mapping[str, Option]
    quick: tuple[Mapping[str, Any], ...] = ({},)
    check: Callable[[Options], object] = lambda options: None
    applies: Callable[[Options], bool] = lambda options: True
    gait: bool = True
    same_robots: bool = True
    epilog: str = ""

    def run(self, options: Options) -> "Result":
        """Measure it."""
        found = list(self.measure(options))
        return Result(
            self, options, [each for each in found if isinstance(each, Row)],
            [each for each in found if isinstance(each, str)],
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Result:
    """What a run of a suite measured: its rows, and notes for the reader."""

    suite: Suite
    options: Options
    rows: Sequence[Row]
    notes: Sequence[str]

    @property
    def text(self) -> str:
        """For a terminal."""
        title = f"{self.suite.title}; {self.options.title}"
        return as_text(title, self.rows, self.notes)

    def as_dicts(self) -> list[dict[str, Any]]:
        """The rows of the JSON."""
        return as_dicts(self.rows, self.suite.name, self.options, self.suite.same_robots)

    @property
    def values(self) -> dict[str, float | None]:
        """Metric -> value."""
        return {row.metric: row.value for row in self.rows}


def suite(
    name: str, title: str, summary: str, *, options: Mapping[str, Any], **more: Any
) -> Callable[[Measure], Suite]:
    """Declare a suite: a decorator of the function that measures it.

    Args:
        name: Its name in `nao_gait bench NAME`.
        title: Heading of its results.
        summary: What it measures, for the help.
        options: Name -> an `Option`, or the suite's default of a shared one (`...` for the usual).
        more: Other attributes of `Suite`.
    """
    return lambda measure: Suite(name, title, summary, measure, declared(options), **more)
