"""The suite `keeper`: shots at a goalkeeper, with percepts by the model."""

from collections.abc import Iterator

from gait_lab.bench.options import Option, Options
from gait_lab.bench.rows import Row, rows_of
from gait_lab.bench.suite import suite
from gait_lab.bench.walks import percent
from gait_lab.soccer.keeper import (
    DISTANCE,
    LIMIT,
    SPEEDS,
    TARGETS,
    WIDE,
    ShotResult,
    ShotSpec,
    shot,
)


@suite(
    "keeper", "Shots at a keeper", "shots at a goalkeeper: held, dives, up again",
    options={
        "robots": 20, "attempts": ..., "scene": ...,
        "targets": Option(TARGETS, "where shots go", "TARGET", ("--target",), choices=TARGETS),
        "limit": Option(LIMIT, "time [s] to stand again after a shot", "T", minimum=1.0),
    },
    gait=False, quick=({"robots": 4},),
)  # fmt: skip
def keeper(options: Options) -> Iterator[Row | str]:
    """Shots at corners and middle, and shots that miss the goal."""
    specs = [
        ShotSpec(seed=seed, target=target, draw=attempt, scene=options.scene, limit=options.limit,
                 **options.play)
        for seed in options.seeds for attempt in range(options.attempts)
        for target in options.targets
    ]  # fmt: skip
    results: list[ShotResult] = options.map(
        shot, specs, label="shots",
        note=lambda each: f"robot {each.spec.seed}, {each.spec.target}: "
        + ("held" if each.held else "in"),
    )  # fmt: skip

    def at(*targets: str) -> list[ShotResult]:
        return [each for each in results if each.spec.target in targets]

    wide = at("wide left", "wide right")
    yield from rows_of(
        "",
        ("shots_held", "%", percent(each.held for each in at("left", "middle", "right"))),
        ("corners_held", "%", percent(each.held for each in at("left", "right"))),
        ("motions_at_wide_balls", "shots", sum(bool(each.motions) for each in wide)),
        ("up_again", "%", percent(each.up is not None for each in results if each.motions)),
        ("falls", "falls", sum(each.fell for each in results)),
    )
    yield (
        f"Shots from {DISTANCE:g} m before the goal line at {SPEEDS[0]:g} to {SPEEDS[1]:g} m/s; "
        "slower balls stop before the line. Left and right: at the corners; wide: "
        f"{WIDE:g} m beside the posts. Held: not in the goal. Up again: stands within "
        f"{options.limit:g} s after a shot for which it has moved."
    )
