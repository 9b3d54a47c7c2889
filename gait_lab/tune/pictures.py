"""Figures of a finished study: convergence, importance, pairs."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from gait_lab.analysis.figures import BLACK, BLUE, GREY, ORANGE, RED, pyplot
from gait_lab.tune.importance import Importance
from gait_lab.tune.search import best_of
from gait_lab.tune.study import Study
from gait_lab.tune.trial import Trial


def convergence_figure(study: Study, trials: Sequence[Trial], title: str, path: Path) -> Path:
    """Every trial, and the best so far; trials with a fall in red."""
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
    """Bars, the most important on top."""
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
    """Each pair of parameters, trials coloured by score; on the diagonal score over parameter."""
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
        # the upper right corner is free
        figure.colorbar(shown, cax=grid[0, -1].inset_axes((0.0, 0.0, 0.15, 1.0)), label="score")
    figure.savefig(path)
    plt.close(figure)
    return path
