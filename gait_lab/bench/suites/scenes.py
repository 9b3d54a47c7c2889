"""The suite `scenes`: scenes of the soccer papers."""

import statistics
from dataclasses import dataclass

from gait_lab.bench.options import BenchOptions, option
from gait_lab.bench.result import Column, Measurement, SuiteResult, Table
from gait_lab.bench.suite import Suite
from gait_lab.soccer.abilities import ABILITIES, AbilityResult, AbilitySpec, play_ability
from sim_bridge.plant import load_plant, with_options
from sim_bridge.trials.parallel import parallel_map

NAMES = tuple(ABILITIES)


@dataclass(frozen=True)
class Options(BenchOptions):
    """What the suite `scenes` runs on."""

    robots: int = 20
    scenes: tuple[str, ...] = option(
        NAMES, "which ability", "NAME", flags=("--ability",), choices=NAMES
    )


def scenes(options: Options) -> SuiteResult:
    """Each robot plays each scene once."""
    specs = [
        AbilitySpec(
            name=name,
            seed=seed,
            urdf=options.urdf,
            engine=options.engine,
            plant=with_options(load_plant(options.plant), options.plant_options),
        )
        for name in options.scenes
        for seed in options.seeds
    ]
    results: list[AbilityResult] = parallel_map(
        play_ability, specs, jobs=options.jobs, label="scenes", show=options.show, note=_note
    )
    rows: list[Measurement] = []
    lines = []
    for name in options.scenes:
        mine = [each for each in results if each.spec.name == name]
        done = sum(each.done for each in mine)
        times = [each.seconds for each in mine if each.seconds is not None]
        median, worst = (statistics.median(times), max(times)) if times else (None, None)
        key = name.replace(" ", "_")
        rows.append(Measurement(f"{key}_done", "%", 100.0 * done / len(mine)))
        rows.append(Measurement(f"{key}_seconds_median", "s", median))
        rows.append(
            Measurement(f"{key}_seconds_worst", "s", worst if done == len(mine) else None)
        )
        lines.append((name, len(mine), done, median, worst))
    columns = (
        Column("scene"), Column("robots"), Column("done"), Column("median", "s", 1),
        Column("longest", "s", 1),
    )  # fmt: skip
    notes = (
        "backheel: the goal is behind the robot, unseen; it scores by a kick backwards. two at the "
        "ball: the nearer robot goes on, the other one steps back (judged 4 to 10 s later).",
    )
    return SuiteResult(tuple(rows), f"Scenes; {options.title}", (Table(columns, lines),), notes)


def _note(result: AbilityResult) -> str:
    end = "done" if result.done else "not done"
    took = "" if result.seconds is None else f", {result.seconds:.1f} s"
    return f"{result.spec.name}, robot {result.spec.seed}: {end}{took}; {result.doing}"


SUITE = Suite(
    name="scenes",
    title="Scenes",
    summary="backheel with the goal behind, two at the ball",
    measure=scenes,
    options=Options,
    takes=("robots",),
    gait=False,
    quick=({"robots": 4},),
)
