"""The suite `solo`: a robot alone against an empty goal."""

from collections.abc import Iterator

from gait_lab.bench.options import Option, Options
from gait_lab.bench.rows import Row, rows_of
from gait_lab.bench.suite import suite
from gait_lab.bench.walks import median
from gait_lab.soccer.solo import LIMIT, SoloResult, SoloSpec
from gait_lab.soccer.solo import solo as play_solo


@suite(
    "solo", "Goals of a robot alone", "time in which a robot alone scores, from anywhere",
    options={
        "robots": 20, "attempts": ..., "scene": ...,
        "limit": Option(LIMIT, "a trial ends after this time [s]", "T", minimum=1.0),
        "rendered": Option(False, "robots see rendered images, not percepts by the model"),
    },
    gait=False, quick=({"robots": 6},),
)  # fmt: skip
def solo(options: Options) -> Iterator[Row | str]:
    """Each robot plays from drawn starts until it scores."""
    specs = [
        SoloSpec(seed=seed, draw=attempt, scene=options.scene, limit=options.limit,
                 rendered=options.rendered, **options.play)
        for seed in options.seeds for attempt in range(options.attempts)
    ]  # fmt: skip
    results: list[SoloResult] = options.map(
        play_solo, specs, label="starts",
        note=lambda result: f"robot {result.spec.seed}: {result.goal or 'no goal'}",
    )  # fmt: skip
    times = [result.goal for result in results if result.goal is not None]
    played = [options.limit if result.goal is None else result.goal for result in results]
    yield from rows_of(
        "",
        (f"goal_within_{options.limit:g}s", "%", 100.0 * len(times) / len(results)),
        ("goal_time_median", "s", median(played) if times else None),
        ("goal_time_worst", "s", max(times) if len(times) == len(results) else None),
        ("falls_per_minute", "1/min",
         60.0 * sum(result.falls for result in results) / sum(played)),
        ("outs", "balls", sum(result.outs for result in results)),
        ("kicks", "kicks", sum(len(result.kicks) for result in results)),
    )  # fmt: skip
    yield (
        "Robot and ball start anywhere on the field; no opponents. A ball that leaves the field is "
        "put back inside. Median: a start without a goal counts with the time limit."
    )
