"""The suite `vision`: what a robot sees of the pitch, on rendered walks, judged by the truth.

Each robot stands, walks, and walks with its head turning fast. What is in the image comes from the
scene: recall counts objects to 3 m that are wholly in the image and hidden by nothing.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gait_lab.bench.options import BenchOptions, option
from gait_lab.bench.result import Column, Measurement, SuiteResult, Table
from gait_lab.bench.suite import Suite
from gait_lab.vision.evaluate import VisionWalk, WalkScores, evaluate_walk
from gait_lab.vision.fit import as_yaml, fit
from gait_lab.vision.score import GATE, GROUPS, RANGE, Score, merged
from gait_lab.vision.viewing_walks import KINDS
from robot_core.errors import NaoGaitError
from sim_bridge.engines.opengl import opengl_libraries
from sim_bridge.plant import load_plant, with_options
from sim_bridge.trials.parallel import parallel_map

TIME_IGNORED = "image time ignored"
"""Walks with the newest pose of the camera in place of that at the time of the image."""


@dataclass(frozen=True)
class Options(BenchOptions):
    """What the suite `vision` runs on."""

    robots: int = 20
    seed: int = 40
    window: float = 3.0
    clutter: bool = option(False, "coloured columns stand around the field")
    percept_errors: str = option("", "also write the fitted errors of percepts to a file", "FILE")


def vision(options: Options) -> SuiteResult:
    """Score all walks of all robots."""
    walks = [
        VisionWalk(
            seed, kind, options.engine, options.window, options.urdf, options.plant,
            options.plant_options, options.clutter,
        )
        for seed in options.seeds
        for kind in KINDS
    ]  # fmt: skip
    results: list[WalkScores] = parallel_map(
        evaluate_walk, walks, jobs=options.jobs, label="vision", show=options.show
    )
    every = merged(score for each in results for score in each.scores.values())
    parts = dict(_parts(results))
    times = np.array(every.times) * 1e3
    rows = [
        Measurement("ball_recall", "%", every.recall("ball")),
        Measurement("ball_false_per_1000", "", every.false_per("ball", 1000)),
        Measurement("ball_error_median", "%", parts["walk"].error_median("ball")),
        *_other_rows(every),
        *_part_rows(parts),
        Measurement("vision_ms_p50", "ms", float(np.median(times)) if times.size else None),
        Measurement("images", "", float(every.images)),
    ]
    if options.percept_errors:
        _write_errors(options, results, float(np.median(times)) * 1e-3)
    return SuiteResult(
        tuple(rows),
        f"Vision on rendered walks{', clutter' if options.clutter else ''}; {options.title}",
        (_objects_table(every), _parts_table(parts)),
        (
            f"Found: within {GATE[0]:g} m + {100 * GATE[1]:g} % of the distance, the nearest "
            f"percept, with its kind. Recall and errors: to {RANGE:g} m. A percept of another kind "
            "counts as false. Errors are those of the place in the true base_footprint at the time "
            "of the image. Each image is seen with its brightness x 0.6, 1 and 1.4. An image "
            f"takes {float(np.median(times)):.1f} ms of CPU time (median, one thread, without "
            "rendering).",
        ),
    )


def _parts(results: Sequence[WalkScores]) -> Iterator[tuple[str, Score]]:
    """Scores by way of walking, by brightness, and with the time of the image ignored."""
    for kind in KINDS:
        chosen = [each for each in results if each.walk.kind == kind]
        yield kind, merged(score for each in chosen for score in each.scores.values())
        yield f"{kind}, {TIME_IGNORED}", merged(each.late for each in chosen)
    for factor in results[0].scores:
        yield f"brightness x {factor:g}", merged(each.scores[factor] for each in results)


def _other_rows(score: Score) -> Iterator[Measurement]:
    for name in GROUPS:
        if name != "ball":
            yield Measurement(f"{name}_recall", "%", score.recall(name))
            yield Measurement(f"{name}_false_per_100", "", score.false_per(name, 100))
            yield Measurement(f"{name}_error_median", "%", score.error_median(name))
    yield Measurement("lines_recall", "%", score.line_recall())
    yield Measurement("lines_false_per_100", "", score.false_lines_per(100))
    yield Measurement("lines_error_median", "%", score.line_error_median())


def _part_rows(parts: dict[str, Score]) -> Iterator[Measurement]:
    for kind in KINDS:
        late = parts[f"{kind}, {TIME_IGNORED}"]
        yield Measurement(f"ball_recall_{kind}", "%", parts[kind].recall("ball"))
        yield Measurement(f"ball_error_median_{kind}", "%", parts[kind].error_median("ball"))
        yield Measurement(f"ball_recall_{kind}_time_ignored", "%", late.recall("ball"))
        yield Measurement(f"ball_error_median_{kind}_time_ignored", "%", late.error_median("ball"))


def _objects_table(score: Score) -> Table:
    columns = (
        Column("object"), Column("due", "", 0), Column("recall", "%"), Column("false", "per 1000"),
        Column("error, median", "% of distance", 2),
    )  # fmt: skip
    rows: list[tuple[str | float | None, ...]] = [
        (name, float(len(score.due(name))), score.recall(name), score.false_per(name, 1000),
         score.error_median(name))
        for name in GROUPS
    ]  # fmt: skip
    points = float(sum(int((part[:, 0] <= RANGE).sum()) for part in score.line_due))
    rows.append(
        ("points of lines", points, score.line_recall(), score.false_lines_per(1000),
         score.line_error_median())
    )  # fmt: skip
    return Table(columns, rows)


def _parts_table(parts: dict[str, Score]) -> Table:
    columns = (
        Column("images"), Column("number", "", 0), Column("ball recall", "%"),
        Column("ball false", "per 1000"), Column("ball error", "%", 2),
        Column("crossings recall", "%"), Column("crossings error", "%", 2),
        Column("lines error", "%", 2),
    )  # fmt: skip
    rows = [
        (name, float(score.images), score.recall("ball"), score.false_per("ball", 1000),
         score.error_median("ball"), score.recall("crossings"), score.error_median("crossings"),
         score.line_error_median())
        for name, score in parts.items()
    ]  # fmt: skip
    return Table(columns, rows)


def _write_errors(options: Options, results: Iterable[WalkScores], seconds: float) -> None:
    """Fit the errors of percepts; the delay is that of the camera and of vision."""
    camera = with_options(load_plant(options.plant), options.plant_options).camera
    scores = [merged(each.scores.values()) for each in results]
    comment = (
        "Errors of vision's percepts, measured on rendered images. Keys and their meaning:\n"
        "gait_lab/vision/percept_errors.py. Common errors and those of each kind are standard\n"
        f"deviations. Written by: {options.title}"
    )
    try:
        Path(options.percept_errors).write_text(
            as_yaml(fit(scores, camera.delay + seconds), comment), encoding="utf-8"
        )
    except OSError as error:
        raise NaoGaitError(
            "percept-errors", options.percept_errors, f"a file that can be written ({error})"
        ) from error


SUITE = Suite(
    name="vision",
    title="Vision",
    summary="what a robot sees of ball, lines, crossings, posts and robots on rendered walks",
    measure=vision,
    options=Options,
    takes=("robots", "window"),
    gait=False,
    quick=({"robots": 1, "window": 1.5},),
    applies=lambda options: options.engine == "pybullet" or bool(opengl_libraries()),
)
