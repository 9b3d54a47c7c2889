"""The suite `behavior`: a robot alone against an empty goal, with percepts by the model."""

import statistics
from dataclasses import dataclass

from gait_lab.bench.options import BenchOptions, option
from gait_lab.bench.result import Column, Measurement, SuiteResult, Table
from gait_lab.bench.suite import Suite
from gait_lab.soccer.solo import LIMIT, SoloResult, SoloSpec, solo
from sim_bridge.plant import load_plant, with_options
from sim_bridge.trials.parallel import parallel_map


@dataclass(frozen=True)
class Options(BenchOptions):
    """What the suite `behavior` runs on."""

    robots: int = 20
    attempts: int = option(1, "starts of each robot", "N", minimum=1, maximum=100)
    scene: str = option("pitch_small", "field and goals: a shipped scene or a YAML file", "S")
    limit: float = option(LIMIT, "a trial ends after this time [s]", "T", minimum=1.0)
    rendered: bool = option(False, "robots see rendered images, not percepts by the model")


def behavior(options: Options) -> SuiteResult:
    """Each robot plays from drawn starts until it scores."""
    specs = [
        SoloSpec(
            seed=seed,
            draw=attempt,
            scene=options.scene,
            urdf=options.urdf,
            engine=options.engine,
            plant=with_options(load_plant(options.plant), options.plant_options),
            limit=options.limit,
            rendered=options.rendered,
        )
        for seed in options.seeds
        for attempt in range(options.attempts)
    ]
    results: list[SoloResult] = parallel_map(
        solo, specs, jobs=options.jobs, label="starts", show=options.show, note=_note
    )
    times = sorted(result.goal for result in results if result.goal is not None)
    count = len(results)
    median = statistics.median(
        options.limit if result.goal is None else result.goal for result in results
    )
    within = 100.0 * sum(time <= LIMIT for time in times) / count
    falls = sum(result.falls for result in results)
    played = sum(options.limit if each.goal is None else each.goal for each in results)
    kicks = sum(len(result.kicks) for result in results)
    outs = sum(result.outs for result in results)
    rows = (
        Measurement("goal_within_120s", "%", within),
        Measurement("goal_time_median", "s", median if times else None),
        Measurement("goal_time_worst", "s", times[-1] if len(times) == count else None),
        Measurement("falls_per_minute", "1/min", 60.0 * falls / played),
        Measurement("outs", "balls", outs),
        Measurement("kicks", "kicks", kicks),
    )
    columns = (
        Column("starts"), Column("goals", f"in {options.limit:g} s"), Column("median", "s", 1),
        Column("longest", "s", 1), Column("falls"), Column("balls", "out"), Column("kicks"),
    )  # fmt: skip
    line = (count, len(times), median, times[-1] if times else None, falls, outs, kicks)
    notes = (
        "Robot and ball start anywhere on the field; no opponents. "
        + ("Vision sees rendered images. " if options.rendered else
           "Percepts have the errors that were measured on rendered images. ")
        + "A ball that leaves the field is put back inside. "
        "median: a start without a goal counts with the time limit.",
    )
    title = f"Goals of a robot alone; {options.title}, {options.scene}"
    return SuiteResult(rows, title, (Table(columns, [line]),), notes)


def _note(result: SoloResult) -> str:
    goal = "no goal" if result.goal is None else f"{result.goal:.0f} s"
    return f"robot {result.spec.seed}: {goal}"


SUITE = Suite(
    name="behavior",
    title="Behaviour",
    summary="time in which a robot alone scores, from anywhere on the pitch",
    measure=behavior,
    options=Options,
    takes=("robots",),
    gait=False,
    quick=({"robots": 6},),
)
