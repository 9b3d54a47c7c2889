"""The suite `soak`: memory of one process over a very long walk."""

from dataclasses import dataclass

from tqdm import tqdm

from gait_lab.bench.options import BenchOptions, option
from gait_lab.bench.result import Column, Measurement, SuiteResult, Table
from gait_lab.bench.suite import Suite
from gait_lab.bench.suites.faults import fault_run
from gait_lab.faults.long_walks import SoakSample, soak

WARM_UP = 0.2
"""Share of the time in which caches fill."""


@dataclass(frozen=True)
class Options(BenchOptions):
    """What the suite `soak` runs on."""

    robots: int = 1
    engine: str = "mujoco"
    minutes: float = option(
        30.0, "simulated minutes in one process", "M", minimum=0.05, maximum=1e5
    )


def soak_suite(options: Options) -> SuiteResult:
    """Memory and objects at the beginning and at the end of a walk of `options.minutes`."""
    samples: list[SoakSample] = []
    run = fault_run(options, "none", options.seed)
    with tqdm(
        total=options.minutes * 60.0, unit="s", disable=None if options.show else True, leave=False
    ) as bar:
        for sample in soak(run, options.minutes, min(10.0, 6.0 * options.minutes)):
            samples.append(sample)
            bar.update(sample.seconds - bar.n)
    kept = samples[int(WARM_UP * len(samples)) :]
    first, last = kept[0], kept[-1]
    growth = 100.0 * (last.memory / first.memory - 1.0)
    spread = 100.0 * (max(s.memory for s in kept) / min(s.memory for s in kept) - 1.0)
    more = 100.0 * (last.objects / first.objects - 1.0)
    columns = (
        Column(""), Column("after", f"{first.seconds:.0f} s"), Column("at the end"),
        Column("growth", "%", 2), Column("spread", "%", 2),
    )  # fmt: skip
    lines = (
        ("memory, MB", first.memory / 1e6, last.memory / 1e6, growth, spread),
        ("objects", first.objects, last.objects, more, ""),
    )
    return SuiteResult(
        (
            Measurement("minutes", "min", options.minutes),
            Measurement("memory", "MB", last.memory / 1e6),
            Measurement("memory_growth", "%", growth),
            Measurement("memory_spread", "%", spread),
            Measurement("object_growth", "%", more),
            Measurement("falls", "falls", last.falls),
            Measurement("steps", "steps", last.steps),
            Measurement("violations", "kinds", len(last.violations)),
        ),
        f"{options.minutes:g} simulated minutes of random commands in one process, robot "
        f"{options.seed}, plant {options.plant_title}, {options.engine}",
        (Table(columns, lines),),
        (
            f"{last.steps} steps, {last.falls} falls, {len(last.violations)} kinds of violations.",
            *(f"VIOLATED {text}" for text in last.violations),
        ),
    )


SUITE = Suite(
    name="soak",
    title="Memory over a long walk",
    summary="growth of one process over minutes or hours of simulated walking",
    measure=soak_suite,
    options=Options,
    quick=({"minutes": 1.0},),
)
