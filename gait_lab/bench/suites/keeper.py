"""The suite `keeper`: shots at a goalkeeper, with percepts by the model."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from gait_lab.bench.options import BenchOptions, option
from gait_lab.bench.result import Column, Measurement, SuiteResult, Table
from gait_lab.bench.suite import Suite
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
from sim_bridge.plant import load_plant, with_options
from sim_bridge.trials.parallel import parallel_map


@dataclass(frozen=True)
class Options(BenchOptions):
    """What the suite `keeper` runs on."""

    robots: int = 20
    attempts: int = option(1, "shots of each kind at each robot", "N", minimum=1, maximum=100)
    targets: tuple[str, ...] = option(
        TARGETS, "where shots go; repeatable", "TARGET", flags=("--target",), choices=TARGETS
    )
    scene: str = option("pitch_small", "field and goals: a shipped scene or a YAML file", "S")
    limit: float = option(LIMIT, "time [s] to stand again after a shot", "T", minimum=1.0)


def keeper(options: Options) -> SuiteResult:
    """Shots at corners and middle, and shots that miss the goal."""
    specs = [
        ShotSpec(
            seed=seed,
            target=target,
            draw=attempt,
            scene=options.scene,
            urdf=options.urdf,
            engine=options.engine,
            plant=with_options(load_plant(options.plant), options.plant_options),
            limit=options.limit,
        )
        for seed in options.seeds
        for attempt in range(options.attempts)
        for target in options.targets
    ]
    results: list[ShotResult] = parallel_map(
        shot, specs, jobs=options.jobs, label="shots", show=options.show, note=_note
    )
    lines = [_line(target, _of(results, target)) for target in options.targets]
    at_goal = _of(results, "left", "middle", "right")
    corners = _of(results, "left", "right")
    wide = _of(results, "wide left", "wide right")
    moved = [each for each in results if each.motions]
    rows = (
        Measurement("shots_held", "%", _share(each.held for each in at_goal)),
        Measurement(
            "corners_held", "%", _share(each.held for each in corners)
        ),
        Measurement("motions_at_wide_balls", "shots", sum(bool(each.motions) for each in wide)),
        Measurement("up_again", "%", _share(each.up is not None for each in moved)),
        Measurement("falls", "falls", sum(each.fell for each in results)),
    )
    columns = (
        Column("shot"), Column("shots"), Column("held"), Column("moved"), Column("dived"),
        Column("up again"), Column("falls"),
    )  # fmt: skip
    notes = (
        f"Shots from {DISTANCE:g} m before the goal line at {SPEEDS[0]:g} to {SPEEDS[1]:g} m/s; "
        "slower balls stop before the line. Left and right: at the corners; wide: "
        f"{WIDE:g} m beside the posts. Held: not in the goal. Up again: stands within "
        f"{options.limit:g} s after a shot for which it has moved.",
    )
    title = f"Shots at a keeper; {options.title}, {options.scene}"
    return SuiteResult(rows, title, (Table(columns, lines),), notes)


def _of(results: list[ShotResult], *targets: str) -> list[ShotResult]:
    return [each for each in results if each.spec.target in targets]


def _line(target: str, results: list[ShotResult]) -> Sequence[str | float | None]:
    moved = [each for each in results if each.motions]
    return (
        target,
        len(results),
        sum(each.held for each in results),
        len(moved),
        sum(any("dive" in motion for motion in each.motions) for each in moved),
        sum(each.up is not None for each in moved),
        sum(each.fell for each in results),
    )


def _share(values: Iterable[bool]) -> float | None:
    counted = list(values)
    return 100.0 * sum(counted) / len(counted) if counted else None


def _note(result: ShotResult) -> str:
    doing = ", ".join(result.motions) or "stands"
    end = "held" if result.held else "in"
    return f"robot {result.spec.seed}, {result.spec.target}: {end}, {doing}"


SUITE = Suite(
    name="keeper",
    title="Keeper",
    summary="shots at a goalkeeper: held, dives, up again",
    measure=keeper,
    options=Options,
    takes=("robots",),
    gait=False,
    quick=({"robots": 4},),
)
