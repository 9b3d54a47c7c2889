"""Two walks on one page, A and B: numbers side by side, figures overlaid."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from html import escape

import numpy as np

from gait_lab.analysis.plots import BLUE, INK, LEFT_COLOR
from gait_lab.report.analysis import Analysis, Stretch
from gait_lab.report.figures import (
    AT_LIMIT,
    BARS,
    COMMANDED,
    MEAN,
    MOTORS,
    ORIGINS,
    SPEEDS,
    WHITENESS,
    percent,
)
from gait_lab.report.page import figure_block, list_html, page, table_block, verdict_html
from gait_lab.report.plot import ArrayStore, Figure, Line
from gait_lab.report.verdict import (
    BAD,
    FAIR,
    GOOD,
    NOTE,
    Finding,
    TextTable,
    findings,
    headline,
    number,
)

A_COLOR, B_COLOR = BLUE, LEFT_COLOR
TELLING = 0.1
"""Relative difference from which two numbers count as different."""

Get = Callable[[Analysis], float]


@dataclass(frozen=True, slots=True)
class Compared:
    """A number of both walks.

    Attributes:
        before: Value of walk A; NaN if unknown.
        after: Value of walk B; NaN if unknown.
        better: +1: more is better, -1: less is, 0: neither.
    """

    name: str
    unit: str
    digits: int
    before: float
    after: float
    better: int

    @property
    def change(self) -> float:
        """Of B against A."""
        return self.after - self.before

    @property
    def judged(self) -> str:
        """`better`, `worse`, or empty for a small or neutral change."""
        if not math.isfinite(self.change) or not self.better:
            return ""
        size = max(abs(self.before), abs(self.after))
        if size == 0.0 or abs(self.change) < TELLING * size:
            return ""
        return "better" if self.change * self.better > 0 else "worse"


def compared(before: Analysis, after: Analysis) -> list[Compared]:
    """The numbers of the whole walks, then those of each stretch that both have."""
    rows = [
        Compared(name, unit, digits, get(before), get(after), better)
        for name, unit, digits, better, get in _NUMBERS
    ]
    for a, b in _matched(before, after):
        for name, unit, digits, better, value in _OF_STRETCHES:
            rows.append(
                Compared(f"{a.name}: {name}", unit, digits, value(a), value(b), better)
            )
    return [row for row in rows if math.isfinite(row.before) or math.isfinite(row.after)]


def compare_page(before: Analysis, after: Analysis) -> str:
    """The HTML of two bags."""
    store, walks = ArrayStore(), (before, after)
    rows = compared(before, after)
    names = f"A {before.walk.name}", f"B {after.walk.name}"
    figures = (figure_block(figure, lines, store) for figure, lines in _overlaid(walks, names))
    blocks = [table_block(_table(rows, names)), *(block for block in figures if block is not None)]
    top = '<div class="card verdict wide">' + verdict_html(*summary(rows, before, after)) + "</div>"
    for name, analysis in zip(names, walks, strict=True):
        words = verdict_html(headline(analysis), findings(analysis))
        top += f'<div class="card verdict"><h3>{escape(name)}</h3>{words}</div>'
    for name, analysis in zip(names, walks, strict=True):
        lacking = [*analysis.walk.remarks, *analysis.walk.missing]
        top += list_html(f"{name}: what is wrong or missing", lacking)
    return page(
        f"Two walks: {before.walk.name} and {after.walk.name}",
        f"{names[0]}: {before.walk.bag.path} · {names[1]}: {after.walk.bag.path}",
        top,
        blocks,
        {"begin": 0.0, "end": max(before.walk.duration, after.walk.duration), "events": []},
        store,
    )


def summary(
    rows: Sequence[Compared], before: Analysis, after: Analysis
) -> tuple[Finding, list[Finding]]:
    """A headline and the largest changes, in words."""
    better = [row for row in rows if row.judged == "better"]
    worse = [row for row in rows if row.judged == "worse"]
    fell = [analysis.fall is not None for analysis in (before, after)]
    if fell == [True, False]:
        head = Finding(GOOD, "B stays up where A fell.")
    elif fell == [False, True]:
        head = Finding(BAD, "B falls, and A did not.")
    elif not better and not worse:
        head = Finding(NOTE, "No number differs by more than a tenth.")
    else:
        head = Finding(NOTE, f"From A to B {len(better)} numbers got better by more than a tenth, "
                             f"and {len(worse)} worse.")  # fmt: skip
    found = [
        Finding(GOOD if row.judged == "better" else FAIR,
                f"{row.name}: {number(row.before, row.digits)} → {number(row.after, row.digits)} "
                f"{row.unit}")
        for row in sorted(worse + better, key=_size, reverse=True)[:8]
    ]  # fmt: skip
    return head, found


def _size(row: Compared) -> float:
    return abs(row.change) / max(abs(row.before), abs(row.after))


def _of(part: str, name: str, factor: float = 1.0, axis: int | None = None) -> Get:
    """An attribute of a part of the analysis, or one axis of it, times a factor."""

    def get(analysis: Analysis) -> float:
        found = getattr(analysis, part)
        if found is None:
            return math.nan
        value = getattr(found, name)
        return factor * float(value if axis is None else value[axis])

    return get


def _step_duration(analysis: Analysis) -> float:
    durations = [step.duration for step in analysis.steps]
    return float(np.median(durations)) if durations else math.nan


def _drift(analysis: Analysis) -> float:
    paths = analysis.paths
    if paths is None or not len(paths.error) or paths.length < 0.2:
        return math.nan
    return 100 * float(np.hypot(*paths.error[-1, :2])) / paths.length


_NUMBERS: tuple[tuple[str, str, int, int, Get], ...] = (
    ("recorded", "s", 1, 0, lambda analysis: analysis.walk.duration),
    ("walked", "m", 2, 0, _of("paths", "length")),
    ("steps", "", 0, 0, lambda analysis: float(len(analysis.steps)) or math.nan),
    ("step duration, median", "s", 3, 0, _step_duration),
    ("CoM |expected − measured| y", "mm", 2, -1, _of("walking", "com_error_y_measured", 1e3)),
    ("CoM |expected − measured| x", "mm", 2, -1, _of("walking", "com_error_x_measured", 1e3)),
    ("CoM |expected − true| y", "mm", 2, -1, _of("walking", "com_error_y", 1e3)),
    ("innovation y, standard deviation", "mm", 2, -1, _of("innovation", "deviation", 1e3, 1)),
    ("innovation x, standard deviation", "mm", 2, -1, _of("innovation", "deviation", 1e3, 0)),
    ("flight", "% of ticks", 2, -1, _of("walking", "flight_share", 100.0)),
    ("a motor at its torque limit", "% of ticks", 2, -1, _of("motors", "saturated_share", 100.0)),
    ("odometry off at the end", "% of the way", 2, -1, _drift),
    ("sensor age", "ms", 1, 0, _of("timing", "age", 1e3)),
    ("joint states missing", "", 0, -1, _of("timing", "missed")),
)

_OF_STRETCHES: tuple[tuple[str, str, int, int, Callable[[Stretch], float]], ...] = (
    ("speed reached", "%", 1, 1, lambda s: 100 * s.reached if s.reached is not None else math.nan),
    ("CoM |expected − measured| y", "mm", 2, -1, lambda s: 1e3 * s.metrics.com_error_y_measured),
)


def _matched(before: Analysis, after: Analysis) -> list[tuple[Stretch, Stretch]]:
    """Pairs of stretches of the same command, in the order of A; each is used once."""
    left = list(after.stretches)
    pairs = []
    for a in before.stretches:
        if a.command is None or a.command.is_zero:
            continue
        b = next((b for b in left if b.command == a.command), None)
        if b is not None:
            left.remove(b)
            pairs.append((a, b))
    return pairs


def _table(rows: Sequence[Compared], names: tuple[str, str]) -> TextTable:
    return TextTable(
        "numbers", "Numbers", "Numbers",
        "Coloured: better or worse by more than a tenth. One walk of one robot proves little; "
        "nao_gait bench measures many.",
        ("", *names, "B − A", ""),
        tuple(
            (row.name, number(row.before, row.digits), number(row.after, row.digits),
             f"{row.judged}\n{number(row.change, row.digits)}", row.unit)
            for row in rows
        ),
    )  # fmt: skip


def _durations(analysis: Analysis) -> Iterator[Line]:
    durations = np.array([step.duration for step in analysis.steps])
    more = {"type": "histogram", "histnorm": "percent", "opacity": 0.65, "hovertemplate": None,
            "xbins": {"start": 0.095, "end": 0.605, "size": 0.01}}  # fmt: skip
    if len(durations):
        yield Line("steps [%]", durations, None, "durations", INK, points=True, more=more)


REACHED = Figure(
    "reached", "Reached", "Speed reached, command by command",
    "Share of the commanded speed along the main axis.",
    lambda _: (), 240, x_label="", layout={"barmode": "group", "bargap": 0.35},
)  # fmt: skip
OVERLAID: tuple[tuple[Figure, dict[str, str], tuple[str, ...]], ...] = (
    (
        replace(SPEEDS, title="Speeds over time", even=(),
                note="Means over 0.5 s, both from the beginning of their bag; dashed: commands "
                "of A."),
        {MEAN: ""}, (COMMANDED,),
    ),
    (REACHED, {}, ()),
    (
        Figure("durations", "Durations", "Step durations", "How often a step took how long.",
               _durations, 220, x_label="duration [s]", layout={"barmode": "overlay"}),
        {"durations": ""}, (),
    ),
    (replace(ORIGINS, layout={}), {"left sole": "", "right sole": ""}, ("",)),
    (
        replace(WHITENESS,
                note="The autocorrelation of both; white noise stays inside the grey band."),
        {"y": ", y", "x": ", x"}, ("",),
    ),
    (
        replace(MOTORS, identity="torques", short="Torque", title="Motors at their torque limit",
                note="Share of the ticks, by joint."),
        {AT_LIMIT: ""}, (),
    ),
)  # fmt: skip
"""Figures of both walks: the names of the lines that both have, with what is added to the name of
the walk in the legend, and those that are drawn for A alone."""


def _overlaid(
    walks: tuple[Analysis, Analysis], names: tuple[str, str]
) -> Iterator[tuple[Figure, list[Line]]]:
    for figure, both, alone in OVERLAID:
        if figure is REACHED:
            yield figure, _reached(*walks, names)
            continue
        of_a, of_b = (list(figure.lines(analysis)) for analysis in walks)
        if not (of_a and of_b):
            continue
        lines = [line for line in of_a if line.name in alone]
        for own, name, color in zip((of_a, of_b), names, (A_COLOR, B_COLOR), strict=True):
            lines += [
                replace(line, name=name + both[line.name], color=color,
                        dash="dot" if line.name == "x" else line.dash)
                for line in own if line.name in both
            ]  # fmt: skip
        yield figure, lines


def _reached(before: Analysis, after: Analysis, names: tuple[str, str]) -> list[Line]:
    pairs = _matched(before, after)
    labels = [f"{index + 1} {a.name}" for index, (a, _) in enumerate(pairs)]
    lines = []
    for side, (name, color) in enumerate(zip(names, (A_COLOR, B_COLOR), strict=True)):
        shares = [percent(pair[side].reached) for pair in pairs]
        lines.append(Line("reached [%]", labels, shares, name, color, points=True, more=BARS))
    return lines if pairs else []
