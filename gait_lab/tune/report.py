"""Results of a finished study: preset file, tables, importance of the parameters, figures."""

import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from xml.etree import ElementTree

import numpy as np
import yaml
from sklearn.ensemble import RandomForestRegressor
from sklearn.inspection import permutation_importance

from gait_lab.analysis.plots import BLACK, BLUE, GREY, ORANGE, RED, pyplot
from gait_lab.tune.confirm import Candidate, Comparison, ComparisonRow, rows
from gait_lab.tune.evaluation import Trial
from gait_lab.tune.search import best_of
from gait_lab.tune.study import Study
from nao_lipm_gait.parameters import BY_NAME, GaitParameters
from robot_core.resources import share

UNITS = {"m/s": ("cm/s", 100.0), "rad/s": ("deg/s", 57.29578)}
"""Unit in the tables and its factor, by SI unit."""


TREES = 200
"""Number of trees of the forest."""
REPEATS = 20
"""Number of permutations of each parameter."""


@dataclass(frozen=True, slots=True)
class Importance:
    """Importance of the parameters of a study.

    Attributes:
        shares: Share of the explained score by parameter; their sum is 1, or 0 if nothing is
            explained.
        explained: R^2 of the forest on trials that a tree did not see; near 0, the shares are
            meaningless.
    """

    shares: dict[str, float]
    explained: float


def importance(study: Study, trials: Sequence[Trial]) -> Importance:
    """Return the permutation importance of a random forest that predicts the score."""
    points = np.array([trial.point for trial in trials])
    scores = np.array([trial.score for trial in trials])
    names = [r.name for r in study.ranges]
    if len(trials) < 2 * len(names) or np.ptp(scores) == 0.0:
        return Importance(dict.fromkeys(names, 0.0), 0.0)
    forest = RandomForestRegressor(TREES, random_state=0, oob_score=True).fit(points, scores)
    found = permutation_importance(forest, points, scores, n_repeats=REPEATS, random_state=0)
    drops = np.maximum(found.importances_mean, 0.0)
    total = float(drops.sum()) or 1.0
    shares = {name: float(drop) / total for name, drop in zip(names, drops, strict=True)}
    return Importance(shares, float(forest.oob_score_))


# -- the preset ----------------------------------------------------------------------------------


def code_version() -> str:
    """Return the version of the package, with the commit if it runs from a checkout."""
    released = ElementTree.parse(share("package.xml")).findtext("version") or "unknown"
    commit = _commit(Path(__file__).resolve().parents[2])
    return f"{released}, commit {commit}" if commit else released


def _commit(root: Path) -> str | None:
    if not (root / ".git").exists():
        return None
    command = ["git", "-C", str(root), "describe", "--always", "--dirty", "--exclude=*"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=10, check=True)
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip() or None


def write_preset(
    path: Path, parameters: GaitParameters, varied: Mapping[str, float], lines: list[str]
) -> Path:
    """Write the winner as a gait preset.

    The file holds every parameter, so that it stays the same if a default changes.

    Args:
        path: File to write.
        parameters: All parameters.
        varied: The parameters that the study varied; they come first.
        lines: Comments at the top of the file.

    Returns:
        The file.
    """
    values = parameters.as_dict()
    rest = [name for name in values if name not in varied]
    text = "".join(f"# {line}".rstrip() + "\n" for line in lines)
    for title, names in (("tuned", list(varied)), ("unchanged", rest)):
        text += f"\n# -- {title}\n"
        for name in names:
            value = values[name]
            written = value if isinstance(value, bool | str) else round(value, 7)
            unit = f" # [{BY_NAME[name].unit}]" if BY_NAME[name].unit else ""
            text += yaml.safe_dump({name: written}).strip() + unit + "\n"
    path.write_text(text, encoding="utf-8")
    return path


# -- the tables ----------------------------------------------------------------------------------


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


def winner_lines(study: Study, start: Trial, best: Trial, found: Importance) -> list[str]:
    """Return the table of the varied parameters with their importance."""
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
    """Return the table of the finals."""
    if not found:
        return ["no finals: the winner is the best trial of the search"]
    lines = [f"finals on {len(study.finals.robots)} further robots, winner first",
             f"{'trial':>6}{'score in search':>18}{'in finals':>12}{'falls':>8}"]  # fmt: skip
    return lines + [
        f"{c.trial.number:>6}{c.trial.score:>18.3f}{c.score:>12.3f}{c.falls:>8}" for c in found
    ]


def unseen_line(study: Study, comparison: Comparison) -> str:
    """Return the confirmation in one place as one line, for the comments of the preset."""
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
    """Return the throughput of new trials, and the overhead per trial [s] beside its walks."""
    if not walked or seconds <= 0.0:
        return "all trials were in the store"
    walking = [trial.seconds for trial in walked]
    beside = (seconds * workers - sum(walking)) / len(walked)
    return (
        f"{len(walked)} trials in {seconds:.1f} s, {workers} at a time: "
        f"{60.0 * len(walked) / seconds:.1f} trials/min; "
        f"a trial takes {median(walking):.2f} s of walking (median) and {beside:.2f} s of overhead"
    )


# -- the figures ---------------------------------------------------------------------------------


def convergence_figure(trials: Sequence[Trial], title: str, path: Path) -> Path:
    """Draw the score of every trial, and the best so far."""
    plt = pyplot()
    figure, axes = plt.subplots(figsize=(8, 3.6), layout="constrained")
    number = np.array([trial.number for trial in trials])
    score = np.array([trial.score for trial in trials])
    fell = np.array([trial.falls > 0 or trial.error is not None for trial in trials])
    axes.plot(number[~fell], score[~fell], "o", ms=4, color=BLUE, label="all robots upright")
    axes.plot(number[fell], score[fell], "x", ms=5, color=RED, label="a robot fell")
    axes.step(number, np.maximum.accumulate(score), where="post", color=BLACK, label="best so far")
    axes.set_xlabel("trial")
    axes.set_ylabel("score")
    axes.set_title(title, loc="left")
    axes.legend(loc="lower right")
    figure.savefig(path)
    plt.close(figure)
    return path


def importance_figure(found: Importance, path: Path) -> Path:
    """Draw the importance as bars, the most important parameter on top."""
    plt = pyplot()
    shares = sorted(found.shares.items(), key=lambda item: item[1])
    height = 1.3 + 0.32 * len(shares)
    figure, axes = plt.subplots(figsize=(7, height), layout="constrained")
    axes.barh([name for name, _ in shares], [share for _, share in shares], color=BLUE)
    axes.set_xlabel("share of the score that the parameter explains")
    axes.set_title(f"Importance (forest explains R² = {found.explained:.2f})", loc="left")
    figure.savefig(path)
    plt.close(figure)
    return path


def pairs_figure(study: Study, trials: Sequence[Trial], path: Path) -> Path:
    """Draw the trials for each pair of parameters, coloured by score; on the diagonal the score."""
    plt = pyplot()
    ranges = study.ranges
    points = np.array([[r.value_at(s) for r, s in zip(ranges, trial.point, strict=True)]
                       for trial in trials])  # fmt: skip
    score = np.array([trial.score for trial in trials])
    order = np.argsort(score)  # the best on top
    best = trials.index(best_of(list(trials)))
    low, high = np.quantile(score, 0.1), score.max()
    count = len(ranges)
    figure, grid = plt.subplots(
        count, count, figsize=(1.0 + 1.9 * count, 1.0 + 1.9 * count), squeeze=False,
        layout="constrained",
    )  # fmt: skip
    shown = None
    for i, row in enumerate(ranges):
        for j, column in enumerate(ranges):
            axes = grid[i, j]
            if j > i:
                axes.axis("off")
                continue
            x = points[order, j]
            if i == j:
                axes.plot(x, score[order], ".", ms=4, color=GREY)
                axes.plot(points[best, j], score[best], "*", ms=11, color=RED)
                axes.yaxis.tick_right()
            else:
                shown = axes.scatter(
                    x, points[order, i], c=score[order], s=14, cmap="viridis", vmin=low, vmax=high,
                    clip_on=False,
                )
                axes.plot(points[best, j], points[best, i], "*", ms=11, color=RED)
                axes.set_ylim(row.low, row.high)
            axes.set_xlim(column.low, column.high)
            axes.tick_params(labelsize=7)
            if i == count - 1:
                axes.set_xlabel(column.name, fontsize=8)
            if j == 0 and i > 0:
                axes.set_ylabel(row.name, fontsize=8)
            elif i == j:
                axes.set_title("score", fontsize=8, loc="right", color=ORANGE)
    if shown is not None:
        # The upper right corner of the grid is free.
        figure.colorbar(shown, cax=grid[0, -1].inset_axes((0.0, 0.0, 0.15, 1.0)), label="score")
    figure.savefig(path)
    plt.close(figure)
    return path
