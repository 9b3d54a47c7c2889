"""The suite `soak`: does the process grow while the robot walks on and on?"""

from tqdm import tqdm

from gait_lab.bench.options import BenchOptions
from gait_lab.bench.report import Report, Row
from gait_lab.bench.suites.faults import fault_run
from gait_lab.faults.long_walks import SoakSample, soak

SUITE = "soak"
WARM_UP = 0.2
"""Share of the time in which caches fill."""


def soak_suite(options: BenchOptions) -> Report:
    """Memory of one process over so many minutes of simulated walking."""
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
    rows = (
        Row(SUITE, "minutes", "min", options.minutes),
        Row(SUITE, "memory", "MB", last.memory / 1e6),
        Row(SUITE, "memory_growth", "%", growth),
        Row(SUITE, "memory_spread", "%", spread),
        Row(SUITE, "object_growth", "%", more),
        Row(SUITE, "falls", "falls", last.falls),
        Row(SUITE, "steps", "steps", last.steps),
        Row(SUITE, "violations", "kinds", len(last.violations)),
    )
    text = "\n".join(
        (
            f"{options.minutes:g} simulated minutes of random commands in one process, robot "
            f"{options.seed}, plant {options.plant_title}, {options.engine}",
            f"  memory   {first.memory / 1e6:.1f} MB after {first.seconds:.0f} s, "
            f"{last.memory / 1e6:.1f} MB at the end: {growth:+.2f} %, spread {spread:.2f} %",
            f"  objects  {first.objects} after {first.seconds:.0f} s, {last.objects} at the end: "
            f"{more:+.2f} %",
            f"  {last.steps} steps, {last.falls} falls, {len(last.violations)} kinds of violations",
            *(f"  VIOLATED {text}" for text in last.violations),
        )
    )
    return Report(rows, text)
