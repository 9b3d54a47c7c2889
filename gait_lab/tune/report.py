"""Results of a finished study: preset file, tables, and a page with figures."""

import subprocess
from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree

import optuna
import yaml
from optuna.importance import FanovaImportanceEvaluator, get_param_importances
from optuna.trial import FrozenTrial

from gait_lab.tune.confirm import Candidate, Comparison, ComparisonRow, rows
from gait_lab.tune.study import Study
from nao_lipm_gait.parameters import BY_NAME, GaitParameters
from robot_core.resources import share

UNITS = {"m/s": ("cm/s", 100.0), "rad/s": ("deg/s", 57.29578)}
"""Unit in the tables and its factor, by SI unit."""


def code_version() -> str:
    """Return the version of the package, with the commit if it runs from a checkout."""
    released = ElementTree.parse(share("package.xml")).findtext("version") or "unknown"
    root = Path(__file__).resolve().parents[2]
    command = ["git", "-C", str(root), "describe", "--always", "--dirty", "--exclude=*"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=10, check=True)
    except (OSError, subprocess.SubprocessError):
        return released
    in_checkout = (root / ".git").exists() and done.stdout.strip()
    return f"{released}, commit {done.stdout.strip()}" if in_checkout else released


def importance(trials: optuna.Study) -> dict[str, float]:
    """The share of the variance of the score that each parameter explains (fANOVA).

    Empty if there are too few trials, or if all have the same score.
    """
    complete = trials.get_trials(deepcopy=False, states=(optuna.trial.TrialState.COMPLETE,))
    enough = complete and len(complete) >= 2 * len(complete[0].params)
    if not enough or len({t.value for t in complete}) == 1:
        return {}
    return get_param_importances(trials, evaluator=FanovaImportanceEvaluator(seed=0))


def write_preset(
    path: Path, parameters: GaitParameters, varied: Sequence[str], lines: Sequence[str]
) -> None:
    """Write a gait preset with every parameter, so that it stays the same if a default changes.

    Args:
        path: File to write.
        parameters: All parameters.
        varied: The parameters that the study varied; they come first.
        lines: Comments at the top of the file.
    """
    values = parameters.as_dict()
    rest = [name for name in values if name not in varied]
    text = "".join(f"# {line}".rstrip() + "\n" for line in lines)
    for title, names in (("tuned", varied), ("unchanged", rest)):
        text += f"\n# -- {title}\n"
        for name in names:
            value = values[name]
            written = value if isinstance(value, bool | str) else round(value, 7)
            unit = f" # [{BY_NAME[name].unit}]" if BY_NAME[name].unit else ""
            text += yaml.safe_dump({name: written}).strip() + unit + "\n"
    path.write_text(text, encoding="utf-8")


# -- the tables ------------------------------------------------------------------------------------


def comparison_table(study: Study, comparison: Comparison) -> list[str]:
    """Return the table of one place: worst and median over the unseen robots."""
    lines = [
        f"{comparison.place}, {len(comparison.after)} unseen robots, worst / median",
        f"{'':18}{'':8}{'before':>18}{'after':>18}",
    ]
    return lines + [_line(row) for row in rows(study, comparison)]


def _line(row: ComparisonRow) -> str:
    unit, factor = UNITS.get(row.unit, (row.unit, 1.0))
    if row.unit == "robots":
        return f"{row.name:18}{unit:8}{row.before[0]:>18.0f}{row.after[0]:>18.0f}"
    before, after = (
        f"{worst * factor:.3g} / {mid * factor:.3g}" for worst, mid in (row.before, row.after)
    )
    return f"{row.name:18}{unit:8}{before:>18}{after:>18}"


def winner_lines(
    study: Study, start: FrozenTrial, best: FrozenTrial, shares: dict[str, float]
) -> list[str]:
    """Return the table of the varied parameters with their importance."""
    lines = [f"{'parameter':24}{'unit':6}{'before':>12}{'after':>12}{'importance':>12}"]
    for name, before in study.start_values.items():
        share_of = f"{shares[name]:.0%}" if shares else "-"
        after = best.params[name]
        unit = BY_NAME[name].unit
        lines.append(f"{name:24}{unit:6}{before:>12.4g}{after:>12.4g}{share_of:>12}")
    return [*lines, f"{'score':30}{start.value:>12.3f}{best.value:>12.3f}"]


def finals_lines(study: Study, found: Sequence[Candidate]) -> list[str]:
    """Return the table of the finals."""
    if not found:
        return ["no finals: the winner is the best trial of the search"]
    lines = [f"finals on {len(study.file.finals.robots)} further robots, winner first",
             f"{'trial':>6}{'score in search':>18}{'in finals':>12}{'falls':>8}"]  # fmt: skip
    return lines + [
        f"{c.trial.number:>6}{c.trial.value:>18.3f}{c.score:>12.3f}{c.falls:>8}" for c in found
    ]


def unseen_line(study: Study, comparison: Comparison) -> str:
    """Return the confirmation in one place as one line, for the comments of the preset."""
    fell = sum(m.fell for m in comparison.after)
    parts = [f"{fell} of {len(comparison.after)} fell"]
    for row in rows(study, comparison):
        if row.name in study.file.objective or row.name == "speed":
            unit, factor = UNITS.get(row.unit, (row.unit, 1.0))
            (_, before), (_, after) = row.before, row.after
            parts.append(
                f"{row.name} {before * factor:.3g} -> {after * factor:.3g} {unit}".rstrip()
            )
    return f"{comparison.place}: " + ", ".join(parts)


def seeds(robots: Sequence[int]) -> str:
    """Seeds as a short text: `3..9` or `0 2`."""
    consecutive = len(robots) > 2 and list(robots) == list(range(robots[0], robots[-1] + 1))
    return f"{robots[0]}..{robots[-1]}" if consecutive else " ".join(map(str, robots))


# -- the page --------------------------------------------------------------------------------------


def write_page(path: Path, title: str, trials: optuna.Study, text: Sequence[str]) -> None:
    """Write one HTML file: the report, convergence, importance, and the score over each parameter.

    It needs no network.
    """
    from html import escape

    from optuna import visualization

    figures = [visualization.plot_optimization_history(trials)]
    if importance(trials):
        evaluator = FanovaImportanceEvaluator(seed=0)
        figures.append(visualization.plot_param_importances(trials, evaluator=evaluator))
    figures.append(visualization.plot_slice(trials))
    parts = [f"<!DOCTYPE html><meta charset='utf-8'><title>{escape(title)}</title>",
             f"<h1>{escape(title)}</h1><pre>{escape(chr(10).join(text))}</pre>"]  # fmt: skip
    for i, figure in enumerate(figures):
        parts.append(figure.to_html(full_html=False, include_plotlyjs=i == 0))
    path.write_text("\n".join(parts), encoding="utf-8")
