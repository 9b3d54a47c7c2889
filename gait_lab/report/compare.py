"""Two walks on one page, A and B: numbers side by side, figures overlaid."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gait_lab.report.analysis import Analysis, Stretch
from gait_lab.report.page import (
    BLUE,
    GREY,
    INK,
    ArrayStore,
    Block,
    Figure,
    TimeFigure,
    escape,
    figure_block,
    list_html,
    page,
    verdict_html,
)
from gait_lab.report.signal_figures import LEG_JOINTS, whiteness
from gait_lab.report.verdict import BAD, FAIR, GOOD, NOTE, Finding, findings, headline, number
from gait_lab.report.walk_figures import origins, speeds

A_COLOR, B_COLOR = BLUE, "#c8553d"
TELLING = 0.1
"""Relative difference from which two numbers count as different."""

Get = Callable[[Analysis], float]


@dataclass(frozen=True, slots=True)
class Compared:
    """A number of both walks.

    Attributes:
        name: Name in the table.
        unit: Unit of both values.
        digits: Digits after the point.
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
    store = ArrayStore()
    rows = compared(before, after)
    names = _names(before, after)
    figures = [
        figure
        for make in (_speeds_over_time, _by_stretch, _durations, _origins, _whiteness, _torques)
        if (figure := make(before, after, store, names)) is not None
    ]
    blocks: list[Block] = [_table(rows, names), *(figure_block(figure) for figure in figures)]
    top = '<div class="card verdict wide">' + verdict_html(*summary(rows, before, after)) + "</div>"
    for name, analysis in zip(names, (before, after), strict=True):
        words = verdict_html(headline(analysis), findings(analysis))
        top += f'<div class="card verdict"><h3>{escape(name)}</h3>{words}</div>'
    for name, analysis in zip(names, (before, after), strict=True):
        lacking = [*analysis.walk.remarks, *analysis.walk.missing]
        box = list_html(f"{name}: what is wrong or missing", lacking, "missing")
        top += f'<div class="wide">{box}</div>' if box else ""
    return page(
        f"Two walks: {before.walk.name} and {after.walk.name}",
        f"{names[0]}: {before.walk.bag.path} · {names[1]}: {after.walk.bag.path}",
        top,
        blocks,
        {"begin": 0.0, "end": max(before.walk.duration, after.walk.duration), "events": []},
        figures,
        store,
    )


def summary(
    rows: list[Compared], before: Analysis, after: Analysis
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


def _names(before: Analysis, after: Analysis) -> tuple[str, str]:
    return f"A {before.walk.name}", f"B {after.walk.name}"


def _walking(name: str, factor: float) -> Get:
    def get(analysis: Analysis) -> float:
        metrics = analysis.walking
        return math.nan if metrics is None else factor * float(getattr(metrics, name))

    return get


def _step_duration(analysis: Analysis) -> float:
    durations = [step.duration for step in analysis.steps]
    return float(np.median(durations)) if durations else math.nan


def _length(analysis: Analysis) -> float:
    return math.nan if analysis.paths is None else analysis.paths.length


def _drift(analysis: Analysis) -> float:
    paths = analysis.paths
    if paths is None or not len(paths.error) or paths.length < 0.2:
        return math.nan
    return 100 * float(np.hypot(*paths.error[-1, :2])) / paths.length


def _saturated(analysis: Analysis) -> float:
    return math.nan if analysis.motors is None else 100 * analysis.motors.saturated_share


def _white(axis: int) -> Get:
    def get(analysis: Analysis) -> float:
        innovation = analysis.innovation
        return math.nan if innovation is None else 1e3 * innovation.deviation[axis]

    return get


def _missed(analysis: Analysis) -> float:
    return math.nan if analysis.timing is None else float(analysis.timing.missed)


def _age(analysis: Analysis) -> float:
    return math.nan if analysis.timing is None else 1e3 * analysis.timing.age


_NUMBERS: tuple[tuple[str, str, int, int, Get], ...] = (
    ("recorded", "s", 1, 0, lambda analysis: analysis.walk.duration),
    ("walked", "m", 2, 0, _length),
    ("steps", "", 0, 0, lambda analysis: float(len(analysis.steps)) or math.nan),
    ("step duration, median", "s", 3, 0, _step_duration),
    ("CoM |expected − measured| y", "mm", 2, -1, _walking("com_error_y_measured", 1e3)),
    ("CoM |expected − measured| x", "mm", 2, -1, _walking("com_error_x_measured", 1e3)),
    ("CoM |expected − true| y", "mm", 2, -1, _walking("com_error_y", 1e3)),
    ("innovation y, standard deviation", "mm", 2, -1, _white(1)),
    ("innovation x, standard deviation", "mm", 2, -1, _white(0)),
    ("flight", "% of ticks", 2, -1, _walking("flight_share", 100.0)),
    ("a motor at its torque limit", "% of ticks", 2, -1, _saturated),
    ("odometry off at the end", "% of the way", 2, -1, _drift),
    ("sensor age", "ms", 1, 0, _age),
    ("joint states missing", "", 0, -1, _missed),
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


def _table(rows: list[Compared], names: tuple[str, str]) -> Block:
    lines = "".join(
        f"<tr><td>{escape(row.name)}</td><td>{number(row.before, row.digits)}</td>"
        f"<td>{number(row.after, row.digits)}</td>"
        f'<td class="{row.judged}">{number(row.change, row.digits)}</td>'
        f"<td>{escape(row.unit)}</td></tr>"
        for row in rows
    )
    return "numbers", "Numbers", (
        '<section id="s-numbers"><h3>Numbers</h3><div class="scroll"><table id="numbers"><thead>'
        f"<tr><th></th><th>{escape(names[0])}</th><th>{escape(names[1])}</th><th>B − A</th>"
        f"<th></th></tr></thead><tbody>{lines}</tbody></table></div>"
        '<p class="note">Coloured: better or worse by more than a tenth. One walk of one robot '
        "proves little; nao_gait bench measures many.</p></section>"
    )  # fmt: skip


def _speeds_over_time(
    before: Analysis, after: Analysis, store: ArrayStore, names: tuple[str, str]
) -> Figure | None:
    made = TimeFigure(
        store, "speeds", "Speeds over time",
        "Means over 0.5 s, both from the beginning of their bag; dashed: commands of A.",
        ("forward [cm/s]", "left [cm/s]", "turn [°/s]"), 150,
    )  # fmt: skip
    for analysis, name, color in ((before, names[0], A_COLOR), (after, names[1], B_COLOR)):
        figure = speeds(analysis, store)
        if figure is None:
            return None
        for trace in figure.traces:
            if trace["name"] == "each tick" or (trace["name"] == "commanded" and color == B_COLOR):
                continue
            own = {**trace, "line": {**trace["line"], "color": color}, "name": name,
                   "legendgroup": name}  # fmt: skip
            made.figure.traces.append(trace if trace["name"] == "commanded" else own)
        for key in ("yaxis", "yaxis2", "yaxis3"):
            low, high = figure.layout[key]["range"]
            known = made.figure.layout[key].get("range", [low, high])
            made.figure.layout[key]["range"] = [min(low, known[0]), max(high, known[1])]
    return made.figure


def _by_stretch(
    before: Analysis, after: Analysis, store: ArrayStore, names: tuple[str, str]
) -> Figure | None:
    pairs = _matched(before, after)
    if not pairs:
        return None
    figure = Figure("reached", "Speed reached, command by command",
                    "Share of the commanded speed along the main axis.", 300)  # fmt: skip
    labels = [f"{index + 1} {a.name}" for index, (a, _) in enumerate(pairs)]
    for side, (name, color) in enumerate(zip(names, (A_COLOR, B_COLOR), strict=True)):
        values = [pair[side].reached for pair in pairs]
        figure.traces.append(
            {"type": "bar", "name": name, "x": labels, "marker": {"color": color},
             "y": [None if v is None or not math.isfinite(v) else 100 * v for v in values]}
        )  # fmt: skip
    figure.layout = {
        "barmode": "group", "bargap": 0.35, "yaxis": {"title": {"text": "reached [%]"}},
        "shapes": [{"type": "line", "xref": "paper", "x0": 0, "x1": 1, "y0": 100, "y1": 100,
                    "line": {"color": INK, "width": 1, "dash": "dot"}}],
    }  # fmt: skip
    return figure


def _durations(
    before: Analysis, after: Analysis, store: ArrayStore, names: tuple[str, str]
) -> Figure | None:
    if not (before.steps and after.steps):
        return None
    figure = Figure("durations", "Step durations", "How often a step took how long.", 280)
    for analysis, name, color in ((before, names[0], A_COLOR), (after, names[1], B_COLOR)):
        durations = np.array([step.duration for step in analysis.steps])
        figure.traces.append(
            {"type": "histogram", "name": name, "x": store.add(durations), "opacity": 0.65,
             "histnorm": "percent", "marker": {"color": color},
             "xbins": {"start": 0.095, "end": 0.605, "size": 0.01}}
        )  # fmt: skip
    figure.layout = {
        "barmode": "overlay", "xaxis": {"title": {"text": "duration [s]"}},
        "yaxis": {"title": {"text": "steps [%]"}},
    }  # fmt: skip
    return figure


def _origins(
    before: Analysis, after: Analysis, store: ArrayStore, names: tuple[str, str]
) -> Figure | None:
    return _laid_over(origins, before, after, store, names)


def _whiteness(
    before: Analysis, after: Analysis, store: ArrayStore, names: tuple[str, str]
) -> Figure | None:
    figure = _laid_over(whiteness, before, after, store, names)
    if figure is not None:
        figure.note = "The autocorrelation of both; white noise stays inside the grey band."
        for trace, axis in zip(figure.traces, "yxyx", strict=False):
            trace["name"] += f", {axis}"
            trace["line"]["dash"] = "solid" if axis == "y" else "dot"
    return figure


def _laid_over(
    make: Callable[[Analysis, ArrayStore], Figure | None],
    before: Analysis,
    after: Analysis,
    store: ArrayStore,
    names: tuple[str, str],
) -> Figure | None:
    """The figure of A with the points and lines of B."""
    figure, other = make(before, store), make(after, store)
    if figure is None or other is None:
        return None
    seen: set[str] = set()
    traces = []
    for made, name, color in ((figure, names[0], A_COLOR), (other, names[1], B_COLOR)):
        for trace in made.traces:
            plain = trace.get("hoverinfo") == "skip"
            if plain and made is other:
                continue
            kind = "marker" if trace.get("mode") == "markers" else "line"
            own = trace if plain else {**trace, "name": name, "legendgroup": name,
                                       kind: {**trace.get(kind, {}), "color": color}}  # fmt: skip
            if kind == "marker" or plain:
                own = {**own, "showlegend": not plain and name not in seen}
            if not plain:
                seen.add(name)
            traces.append(own)
    figure.traces = traces
    figure.layout["showlegend"] = True
    return figure


def _torques(
    before: Analysis, after: Analysis, store: ArrayStore, names: tuple[str, str]
) -> Figure | None:
    figure = Figure("torques", "Motors at their torque limit", "Share of the ticks, by joint.", 300)
    for analysis, name, color in ((before, names[0], A_COLOR), (after, names[1], B_COLOR)):
        if analysis.motors is None:
            return None
        legs = [joint for joint in analysis.motors.joints if joint.name[1:] in LEG_JOINTS]
        shares = [joint.torque_saturated for joint in legs]
        figure.traces.append(
            {"type": "bar", "name": name, "x": [joint.name for joint in legs],
             "y": [100 * share if math.isfinite(share) else None for share in shares],
             "marker": {"color": color}}
        )  # fmt: skip
    figure.layout = {
        "barmode": "group", "bargap": 0.3, "xaxis": {"tickangle": -30, "linecolor": GREY},
        "yaxis": {"title": {"text": "share of ticks [%]"}, "rangemode": "tozero"},
    }  # fmt: skip
    return figure
