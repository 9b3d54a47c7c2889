"""The suite `fuzz`: malformed messages into every input, and broken files into every loader."""

import time
from dataclasses import dataclass

from gait_lab.bench.options import BenchOptions, keep_option, option
from gait_lab.bench.result import Column, Measurement, SuiteResult, Table
from gait_lab.bench.suite import Suite
from gait_lab.faults.fuzz_files import fuzz_files
from gait_lab.faults.fuzz_lola import LolaFuzzer, LolaFuzzResult
from gait_lab.faults.fuzz_messages import GAIT, LOLA, Fuzzer, FuzzResult, FuzzRun
from sim_bridge.trials.parallel import parallel_map
from sim_bridge.trials.result_cache import ResultCache

STRETCH = 10_000
"""Ticks with one seed."""
TICKS_PER_FILE = 500
"""One broken file is read per so many ticks."""
_EVIDENCE = 20
"""Violations that are listed one by one."""


@dataclass(frozen=True)
class Options(BenchOptions):
    """What the suite `fuzz` runs on."""

    ticks: int = option(1_000_000, "ticks of the gait", "N", minimum=1, maximum=10**12)
    keep: str = keep_option()


def fuzz(options: Options) -> SuiteResult:
    """All ticks in stretches, each with a seed of its own."""
    count, rest = divmod(options.ticks, STRETCH)
    lengths = [STRETCH] * count + ([rest] if rest else [])
    of_gait, of_lola = (
        [FuzzRun(target, options.seed + index, ticks) for index, ticks in enumerate(lengths)]
        for target in (GAIT, LOLA)
    )
    began = time.monotonic()
    found = parallel_map(
        _run, of_gait, jobs=options.jobs, show=options.show, label="fuzz",
        note=lambda one: f"{len(one.violations)} violations",
        kept=ResultCache(options.keep, FuzzResult) if options.keep else None,
    )  # fmt: skip
    took = time.monotonic() - began
    ticks = sum(one.run.ticks for one in found)
    broken = [f"VIOLATED seed {one.run.seed}: {text}" for one in found for text in one.violations]
    lola = parallel_map(
        _run_lola, of_lola, jobs=options.jobs, show=options.show, label="LoLA",
        note=lambda one: f"{len(one.violations)} violations",
        kept=ResultCache(options.keep, LolaFuzzResult) if options.keep else None,
    )  # fmt: skip
    broken += [
        f"VIOLATED LoLA, seed {one.run.seed}: {text}" for one in lola for text in one.violations
    ]
    frames = sum(one.run.ticks for one in lola)
    files = fuzz_files(options.seed, max(1, options.ticks // TICKS_PER_FILE))
    broken += [f"VIOLATED file: {text}" for text in files.violations]
    answers, refused = sum(one.answers for one in found), sum(one.refused for one in found)
    lines = [
        ("ticks of malformed and good messages", ticks),
        ("joint commands that came out", answers),
        ("messages, commands and parameters refused", refused),
        ("LoLA messages each way", frames),
        ("LoLA messages refused", sum(one.refused for one in lola)),
        ("broken files", files.read + files.refused),
        ("broken files refused with a reason", files.refused),
        ("violations", len(broken)),
    ]
    return SuiteResult(
        (
            Measurement("ticks", "ticks", ticks),
            Measurement("answers", "commands", answers),
            Measurement("refused", "messages", refused),
            Measurement("lola_messages", "messages", frames),
            Measurement("files", "files", files.read + files.refused),
            Measurement("files_refused", "files", files.refused),
            Measurement("violations", "", len(broken)),
        ),
        f"{ticks} ticks of malformed and good messages" + _speed(options, ticks, took),
        (Table((Column("what"), Column("number")), lines),),
        tuple(broken[:_EVIDENCE]),
        same_robots=False,
    )


def _speed(options: Options, ticks: int, took: float) -> str:
    return "" if options.keep else f" in {took:.0f} s ({ticks / took:.0f} per s)"


def _run(run: FuzzRun) -> FuzzResult:
    return Fuzzer(run.seed).run(run.ticks)


def _run_lola(run: FuzzRun) -> LolaFuzzResult:
    return LolaFuzzer(run.seed).run(run.ticks)


SUITE = Suite(
    name="fuzz",
    title="Malformed messages and broken files",
    summary="malformed messages into every input, broken files into every loader",
    measure=fuzz,
    options=Options,
    gait=False,
    quick=({"ticks": 20_000},),
)
