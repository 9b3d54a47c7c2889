"""The suite `fuzz`: malformed messages into every input, and broken files into every loader."""

import time
from dataclasses import dataclass

from gait_lab.bench.options import BenchOptions, keep_option, option
from gait_lab.bench.result import Column, Measurement, SuiteResult, Table
from gait_lab.bench.suite import Suite
from gait_lab.faults.fuzz import FILES, GAIT, LOLA, TARGETS, TICKS, FuzzResult, FuzzRun
from gait_lab.faults.fuzz import fuzz as run_fuzz
from sim_bridge.trials.parallel import parallel_map
from sim_bridge.trials.result_cache import ResultCache

STRETCH = 10_000
"""Ticks with one seed."""
_EVIDENCE = 20
"""Violations that are listed one by one."""


@dataclass(frozen=True)
class Options(BenchOptions):
    """What the suite `fuzz` runs on."""

    ticks: int = option(1_000_000, "ticks of the gait", "N", minimum=1, maximum=10**12)
    keep: str = keep_option()


def fuzz(options: Options) -> SuiteResult:
    """All ticks in stretches, each with a seed of its own."""
    kept = ResultCache(options.keep, FuzzResult.restored) if options.keep else None
    count, rest = divmod(options.ticks, STRETCH)
    lengths = [STRETCH] * count + ([rest] if rest else [])
    found: dict[str, list[FuzzResult]] = {}
    began = time.monotonic()
    took = 0.0
    for target in TARGETS:
        share = TICKS if target == FILES else 1
        runs = [
            FuzzRun(target, options.seed + index, max(1, ticks // share))
            for index, ticks in enumerate(lengths)
        ]
        found[target] = parallel_map(
            run_fuzz, runs, jobs=options.jobs, show=options.show, label=target, kept=kept,
            note=lambda one: f"{len(one.violations)} violations",
        )  # fmt: skip
        took = took or time.monotonic() - began
    ticks = {target: sum(one.run.ticks for one in results) for target, results in found.items()}
    passed = {target: sum(one.passed for one in results) for target, results in found.items()}
    refused = {target: sum(one.refused for one in results) for target, results in found.items()}
    broken = [
        f"VIOLATED {target}, seed {one.run.seed}: {text}"
        for target, results in found.items() for one in results for text in one.violations
    ]  # fmt: skip
    rows = (
        ("ticks", "ticks", ticks[GAIT], "ticks of malformed and good messages"),
        ("answers", "commands", passed[GAIT], "joint commands that came out"),
        ("refused", "messages", refused[GAIT], "messages, commands and parameters refused"),
        ("lola_messages", "messages", ticks[LOLA], "LoLA messages each way"),
        ("lola_refused", "messages", refused[LOLA], "LoLA messages refused"),
        ("files", "files", passed[FILES] + refused[FILES], "broken files"),
        ("files_refused", "files", refused[FILES], "broken files refused with a reason"),
        ("violations", "", len(broken), "violations"),
    )
    speed = "" if options.keep else f" in {took:.0f} s ({ticks[GAIT] / took:.0f} per s)"
    return SuiteResult(
        tuple(Measurement(metric, unit, value) for metric, unit, value, _ in rows),
        f"{ticks[GAIT]} ticks of malformed and good messages{speed}",
        (Table((Column("what"), Column("number")), [(what, value) for *_, value, what in rows]),),
        tuple(broken[:_EVIDENCE]),
        same_robots=False,
    )


SUITE = Suite(
    name="fuzz",
    title="Malformed messages and broken files",
    summary="malformed messages into every input, broken files into every loader",
    measure=fuzz,
    options=Options,
    gait=False,
    quick=({"ticks": 20_000},),
)
