"""Random valid and invalid messages and files, drawn and shrunk by Hypothesis, into every input.

An example holds what Hypothesis varies: the invalid messages and requests of some hundred control
ticks, and the seed of all else in them. Of each violation the smallest example is listed.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from hypothesis import HealthCheck, Phase, Verbosity, given, seed, settings
from hypothesis import strategies as st

from gait_lab.faults import fuzz_bytes, fuzz_gait

GAIT, LOLA, FILES = "gait", "LoLA", "files"
TICKS = 500
"""Ticks of one example; one corrupt file is read per so many."""
_EVIDENCE = 2000
"""Longest text of a violation."""


@dataclass(frozen=True, slots=True)
class FuzzRun:
    """What is fuzzed, the seed of all examples, and how many control ticks, frames or files."""

    target: str
    seed: int
    ticks: int


@dataclass(frozen=True, slots=True)
class FuzzResult:
    """Joint commands or files that passed, messages or files that were refused, and violations."""

    run: FuzzRun
    passed: int
    refused: int
    violations: tuple[str, ...]


Target = tuple[st.SearchStrategy[Any], Callable[..., tuple[int, int]], int]
TARGETS: dict[str, Target] = {
    GAIT: (fuzz_gait.EXAMPLES, fuzz_gait.run, TICKS),
    LOLA: (fuzz_bytes.LOLA, fuzz_bytes.exchange, TICKS),
    FILES: (fuzz_bytes.FILES, fuzz_bytes.read_file, 1),
}
"""Strategy of the arguments by name; the function of ticks and these, which returns what passed and
was refused; the ticks of an example."""


def fuzz(run: FuzzRun) -> FuzzResult:
    """Run examples for the ticks of the run, or until one violates an invariant."""
    examples, call, longest = TARGETS[run.target]
    count = -(-run.ticks // longest)
    passed = refused = 0
    violations: list[str] = []

    @seed(run.seed)
    @settings(
        max_examples=count, deadline=None, database=None, verbosity=Verbosity.quiet,
        phases=(Phase.generate, Phase.shrink), report_multiple_bugs=False,
        suppress_health_check=tuple(HealthCheck),
    )  # fmt: skip
    @given(examples)
    def check(example: Any) -> None:
        nonlocal passed, refused
        try:
            found = call(-(-run.ticks // count), **example)
        except Exception as error:
            violations.append(f"{type(error).__name__}: {error}; {example!r}"[:_EVIDENCE])
            raise
        passed, refused = passed + found[0], refused + found[1]

    try:
        check()
    except Exception as error:
        # The last call is that of the smallest example.
        violations[:] = violations[-1:] or [f"{type(error).__name__}: {error}"[:_EVIDENCE]]
    return FuzzResult(run, passed, refused, tuple(violations))
