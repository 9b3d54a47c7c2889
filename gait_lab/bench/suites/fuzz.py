"""The suite `fuzz`: malformed messages into every input, and broken files into every loader."""

import time
from dataclasses import dataclass

from gait_lab.bench.options import BenchOptions, option
from gait_lab.bench.result import Column, Measurement, SuiteResult, Table
from gait_lab.bench.suite import Suite
from gait_lab.faults.fuzz_files import fuzz_files
from gait_lab.faults.fuzz_lola import LolaFuzzer, LolaFuzzResult
from gait_lab.faults.fuzz_messages import Fuzzer, FuzzResult
from gait_lab.trials.parallel import parallel_map

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


@dataclass(frozen=True, slots=True)
class _Stretch:
    seed: int
    ticks: int


def fuzz(options: Options) -> SuiteResult:
    """All ticks in stretches, each with a seed of its own."""
    count, rest = divmod(options.ticks, STRETCH)
    stretches = [_Stretch(options.seed + index, STRETCH) for index in range(count)]
    if rest:
        stretches.append(_Stretch(options.seed + count, rest))
    began = time.monotonic()
    found = parallel_map(
        _run, stretches, jobs=options.jobs, show=options.show, label="fuzz",
        note=lambda one: f"{len(one.violations)} violations",
    )  # fmt: skip
    took = time.monotonic() - began
    ticks = sum(one.ticks for one in found)
    broken = [
        f"VIOLATED seed {stretch.seed}: {text}"
        for stretch, one in zip(stretches, found, strict=True) for text in one.violations
    ]  # fmt: skip
    lola = parallel_map(
        _run_lola, stretches, jobs=options.jobs, show=options.show, label="LoLA",
        note=lambda one: f"{len(one.violations)} violations",
    )  # fmt: skip
    broken += [f"VIOLATED LoLA: {text}" for one in lola for text in one.violations]
    files = fuzz_files(options.seed, max(1, options.ticks // TICKS_PER_FILE))
    broken += [f"VIOLATED file: {text}" for text in files.violations]
    answers, refused = sum(one.answers for one in found), sum(one.refused for one in found)
    lines = [
        ("ticks of malformed and good messages", ticks),
        ("joint commands that came out", answers),
        ("messages, commands and parameters refused", refused),
        ("LoLA messages each way", sum(one.frames for one in lola)),
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
            Measurement("lola_messages", "messages", sum(one.frames for one in lola)),
            Measurement("files", "files", files.read + files.refused),
            Measurement("files_refused", "files", files.refused),
            Measurement("violations", "", len(broken)),
        ),
        f"{ticks} ticks of malformed and good messages in {took:.0f} s ({ticks / took:.0f} per s)",
        (Table((Column("what"), Column("number")), lines),),
        tuple(broken[:_EVIDENCE]),
        same_robots=False,
    )


def _run(stretch: _Stretch) -> FuzzResult:
    return Fuzzer(stretch.seed).run(stretch.ticks)


def _run_lola(stretch: _Stretch) -> LolaFuzzResult:
    return LolaFuzzer(stretch.seed).run(stretch.ticks)


SUITE = Suite(
    name="fuzz",
    title="Malformed messages and broken files",
    summary="malformed messages into every input, broken files into every loader",
    measure=fuzz,
    options=Options,
    gait=False,
    quick=({"ticks": 20_000},),
)
