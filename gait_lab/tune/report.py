"""The text of a finished study: what won, what it changed, how it does on robots it never saw."""

from collections.abc import Sequence
from statistics import median

from gait_lab.tune.confirm import Comparison, Row, rows
from gait_lab.tune.finals import Candidate
from gait_lab.tune.importance import Importance
from gait_lab.tune.study import Study
from gait_lab.tune.trial import Trial
from nao_lipm_gait.parameters import BY_NAME

UNITS = {"m/s": ("cm/s", 100.0), "rad/s": ("deg/s", 57.29578)}
"""SI to what tables show."""


def comparison_table(study: Study, comparison: Comparison) -> list[str]:
    """Before and after in one place; worst and median over the unseen robots."""
    lines = [
        f"{comparison.place}, {len(comparison.after)} unseen robots, worst / median",
        f"{'':18}{'':8}{'before':>18}{'after':>18}",
    ]
    return lines + [_line(row) for row in rows(study, comparison)]


def _line(row: Row) -> str:
    unit, factor = UNITS.get(row.unit, (row.unit, 1.0))
    if row.unit == "robots":
        return f"{row.name:18}{unit:8}{row.before[0]:>18.0f}{row.after[0]:>18.0f}"
    before, after = (
        f"{worst * factor:.3g} / {mid * factor:.3g}" for worst, mid in (row.before, row.after)
    )
    return f"{row.name:18}{unit:8}{before:>18}{after:>18}"


def winner_lines(study: Study, start: Trial, best: Trial, found: Importance) -> list[str]:
    """The varied parameters before and after, with their importance."""
    after = study.values_at(best.point)
    lines = [f"{'parameter':24}{'unit':6}{'before':>12}{'after':>12}{'importance':>12}"]
    for name, value in after.items():
        before = float(getattr(study.start, name))
        lines.append(
            f"{name:24}{BY_NAME[name].unit:6}{before:>12.4g}{value:>12.4g}"
            f"{found.shares[name]:>11.0%} "
        )
    lines.append(f"{'score':30}{start.score:>12.3f}{best.score:>12.3f}")
    return [line.rstrip() for line in lines]


def finals_lines(study: Study, found: Sequence[Candidate]) -> list[str]:
    """The best trials on further robots; the first one won."""
    if not found:
        return ["no finals: the best trial of the search won"]
    lines = [f"finals on {len(study.finals.robots)} further robots, the first won",
             f"{'trial':>6}{'score in search':>18}{'in finals':>12}{'falls':>8}"]  # fmt: skip
    return lines + [
        f"{c.trial.number:>6}{c.trial.score:>18.3f}{c.score:>12.3f}{c.falls:>8}" for c in found
    ]


def unseen_line(study: Study, comparison: Comparison) -> str:
    """One line for the comments of the preset."""
    fell = sum(m.fell for m in comparison.after)
    parts = [f"{fell} of {len(comparison.after)} fell"]
    for row in rows(study, comparison):
        if row.name in study.objective or row.name == "speed":
            unit, factor = UNITS.get(row.unit, (row.unit, 1.0))
            (_, before), (_, after) = row.before, row.after
            parts.append(
                f"{row.name} {before * factor:.3g} -> {after * factor:.3g} {unit}".rstrip()
            )
    return f"{comparison.place}: " + ", ".join(parts)


def pace_line(walked: Sequence[Trial], seconds: float, workers: int) -> str:
    """Throughput of what was walked now, and what a trial cost its worker beside its walks."""
    if not walked or seconds <= 0.0:
        return "all trials came from the store"
    walking = [trial.seconds for trial in walked]
    beside = (seconds * workers - sum(walking)) / len(walked)
    return (
        f"{len(walked)} trials in {seconds:.1f} s, {workers} at a time: "
        f"{60.0 * len(walked) / seconds:.1f} trials/min; "
        f"a trial walks {median(walking):.2f} s (median) and costs {beside:.2f} s beside that"
    )
