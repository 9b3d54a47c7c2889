"""The suite `vision`: what a robot sees of the pitch, on rendered walks, judged by the truth.

Each robot stands, walks, and walks with its head turning fast. What is in the image comes from the
scene: recall counts objects to 3 m that are wholly in the image and hidden by nothing.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from gait_lab.bench.options import Option, Options
from gait_lab.bench.rows import Row, rows_of
from gait_lab.bench.suite import suite
from gait_lab.vision.evaluate import SETTLE, WalkScores, evaluate_walk
from gait_lab.vision.fit import as_yaml, fit
from gait_lab.vision.score import GATE, GROUPS, RANGE, merged
from gait_lab.vision.viewing_walks import KINDS, random_walk
from robot_core.schema import write_text
from sim_bridge.engines.opengl import opengl_libraries


def can_render(options: Options) -> bool:
    """Whether the engine can render images here."""
    return options.engine == "pybullet" or bool(opengl_libraries())


@suite(
    "vision", "Vision",
    "what a robot sees of ball, lines, crossings, posts and robots on rendered walks",
    options={
        "robots": 20, "seed": 40, "window": 3.0,
        "percept_errors": Option("", "also write the fitted errors of percepts to a file", "FILE",
                                 writes="file"),
    },
    gait=False, quick=({"robots": 1, "window": 1.5},), applies=can_render,
)  # fmt: skip
def vision(options: Options) -> Iterator[Row | str]:
    """Score all walks of all robots."""
    seconds = SETTLE + options.window
    walks = [
        replace(
            random_walk(seed, kind, options.engine, seconds, options.urdf), plant=options.plant,
            plant_options=options.plant_options,
        )
        for seed in options.seeds for kind in KINDS
    ]  # fmt: skip
    results: list[WalkScores] = options.map(evaluate_walk, walks, label="vision")
    every = merged(score for each in results for score in each.scores.values())
    of = {kind: results[index :: len(KINDS)] for index, kind in enumerate(KINDS)}
    times = np.array(every.times) * 1e3
    for name in GROUPS:
        yield Row(name, "recall", "%", every.recall(name))
        if name == "ball":
            yield Row(name, "false_per_1000", "", every.false_per(name, 1000))
            walked = merged(score for each in of["walk"] for score in each.scores.values())
            yield Row(name, "error_median", "%", walked.error_median(name))
        else:
            yield Row(name, "false_per_100", "", every.false_per(name, 100))
            yield Row(name, "error_median", "%", every.error_median(name))
    yield from rows_of(
        "lines",
        ("recall", "%", every.line_recall()),
        ("false_per_100", "", every.false_lines_share()),
        ("error_median", "%", every.line_error_median()),
    )
    for kind, chosen in of.items():
        usual = merged(score for each in chosen for score in each.scores.values())
        late = merged(each.late for each in chosen)
        for score, suffix in ((usual, ""), (late, "_time_ignored")):
            yield Row("ball", f"recall_{kind}{suffix}", "%", score.recall("ball"))
            yield Row("ball", f"error_median_{kind}{suffix}", "%", score.error_median("ball"))
    middle = float(np.median(times)) if times.size else None
    yield from rows_of("", ("vision_ms_p50", "ms", middle), ("images", "", float(every.images)))
    if options.percept_errors:
        _write_errors(options, results, 1e-3 * (middle or 0.0))
    yield (
        f"Found: within {GATE[0]:g} m + {100 * GATE[1]:g} % of the distance, the nearest percept, "
        f"with its kind. Recall and errors (of the distance): to {RANGE:g} m. A percept of another "
        "kind counts as false. Errors are those of the place in the true base_footprint at the "
        "time of the image. Each image is seen with its brightness x 0.6, 1 and 1.4. time ignored: "
        "with the newest pose of the camera in place of that at the time of the image."
    )


def _write_errors(options: Options, results: list[WalkScores], seconds: float) -> None:
    """Fit the errors of percepts; the delay is that of the camera and of vision."""
    scores = [merged(each.scores.values()) for each in results]
    comment = (
        "Errors of vision's percepts, measured on rendered images. Keys and their meaning:\n"
        "gait_lab/vision/percept_errors.py. Common errors and those of each kind are standard\n"
        f"deviations. Written by: {options.title}"
    )
    fitted = fit(scores, options.made_plant.camera.delay + seconds)
    write_text(Path(options.percept_errors), as_yaml(fitted, comment), "percept-errors")
