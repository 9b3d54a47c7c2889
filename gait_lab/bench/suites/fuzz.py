"""The suite `fuzz`: bad messages into every entry, and broken files into every loader."""

import time
from dataclasses import dataclass

from gait_lab.bench.options import BenchOptions
from gait_lab.bench.report import Report, Row
from gait_lab.faults.fuzz_files import fuzz_files
from gait_lab.faults.fuzz_messages import Fuzzer, FuzzResult
from gait_lab.trials.parallel import parallel_map

SUITE = "fuzz"
STRETCH = 10_000
"""Ticks with one seed."""
TICKS_PER_FILE = 500
"""One file is broken and read for so many ticks."""


@dataclass(frozen=True, slots=True)
class _Stretch:
    seed: int
    ticks: int


def fuzz(options: BenchOptions) -> Report:
    """So many ticks in stretches, each with a seed of its own."""
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
    files = fuzz_files(options.seed, max(1, options.ticks // TICKS_PER_FILE))
    broken += [f"VIOLATED file: {text}" for text in files.violations]
    rows = (
        Row(SUITE, "ticks", "ticks", ticks),
        Row(SUITE, "answers", "commands", sum(one.answers for one in found)),
        Row(SUITE, "refused", "messages", sum(one.refused for one in found)),
        Row(SUITE, "files", "files", files.read + files.refused),
        Row(SUITE, "files_refused", "files", files.refused),
        Row(SUITE, "violations", "", len(broken)),
    )
    text = "\n".join(
        (
            f"{ticks} ticks of spoilt and good messages in {took:.0f} s ({ticks / took:.0f} per s)",
            f"  {sum(one.answers for one in found)} joint commands came out, "
            f"{sum(one.refused for one in found)} messages, commands and parameters were refused",
            f"  {files.read + files.refused} broken files: {files.refused} refused with a reason, "
            f"{files.read} read",
            f"  {len(broken)} violations",
            *broken[:20],
        )
    )
    return Report(rows, text, one_set_of_robots=False)


def _run(stretch: _Stretch) -> FuzzResult:
    return Fuzzer(stretch.seed).run(stretch.ticks)
