"""The suite `duel`: two robots, the ball between them."""

import math
import statistics
from collections.abc import Iterator, Sequence

from gait_lab.bench.options import Option, Options
from gait_lab.bench.policies import NAMES, POLICIES, policies
from gait_lab.bench.rows import Row, rows_of
from gait_lab.bench.suite import suite
from gait_lab.bench.walks import median
from gait_lab.soccer.duel import DuelResult, DuelSpec, play_duel


@suite(
    "duel", "Duels", "two robots and a ball between them: metres gained, ball at rest, falls",
    options={
        "robots": Option(4, "pairs of robots; each plays from every angle", "N", minimum=1),
        "angles": Option(
            8, "angles between the robots' line and the field, around the clock", "N", minimum=1,
            maximum=360,
        ),
        "window": 20.0, "scene": ..., "resume": ...,
        **POLICIES,
    },
    gait=False, quick=({"robots": 1},),
    check=policies, epilog=NAMES,
)  # fmt: skip
def duel(options: Options) -> Iterator[Row | str]:
    """Each pair plays from every angle; with two policies, each side of the field in turn."""
    mine, other = policies(options)
    sides = (1.0,) if mine == other else (1.0, -1.0)
    specs = [
        DuelSpec(
            seed=2 * seed, angle=math.tau * index / options.angles, seconds=options.window,
            scene=options.scene, red=mine if side > 0.0 else other,
            blue=other if side > 0.0 else mine, **options.play,
        )
        for seed in options.seeds for index in range(options.angles) for side in sides
    ]  # fmt: skip
    results: list[DuelResult] = options.map(
        play_duel, specs, label="duels",
        note=lambda each: f"robots {each.spec.seed}, {each.spec.seed + 1}: {each.gain:+.2f} m",
        restore=DuelResult,
    )  # fmt: skip
    of = [side for _ in options.seeds for _ in range(options.angles) for side in sides]
    gains = [side * each.gain for side, each in zip(of, results, strict=True)]
    seconds = sum(each.seconds for each in results)
    falls = [each.falls if side > 0.0 else each.falls[::-1]
             for side, each in zip(of, results, strict=True)]  # fmt: skip
    yield from rows_of(
        "duel",
        ("gain", "m", statistics.fmean(gains)),
        ("gain_deviation", "m", _error(gains)),
        ("way", "m/min", 60.0 * sum(each.way for each in results) / seconds),
        ("rest", "%", 100.0 * sum(each.rest * each.seconds for each in results) / seconds),
        ("free_median", "s",
         median(options.window if each.free is None else each.free for each in results)),
        ("falls", "falls", sum(map(sum, falls))),
        ("falls_of_policy", "falls", sum(own for own, _ in falls)),
        ("falls_per_robot_minute", "1/min", 30.0 * sum(map(sum, falls)) / seconds),
        ("duels", "duels", len(results)),
    )  # fmt: skip
    yield (
        "gain: of the ball towards the opponents' goal line of the team with --policy, with the "
        "standard error of the mean; of two equal teams it is about 0. rest: share of the time "
        "with the ball slower than 0.03 m/s. free: until the ball is 1 m from its start; else the "
        "whole time."
    )


def _error(values: Sequence[float]) -> float:
    """Standard error of the mean."""
    return statistics.stdev(values) / math.sqrt(len(values)) if len(values) > 1 else 0.0
