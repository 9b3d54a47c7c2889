"""The suite `challenges`: technical challenges of the RoboCup SPL, with its published rules."""

import statistics
from collections.abc import Sequence
from dataclasses import dataclass

from gait_lab.bench.options import BenchOptions, option
from gait_lab.bench.result import Cell, Column, Measurement, SuiteResult, Table
from gait_lab.bench.suite import Suite
from gait_lab.soccer.challenge_rules import LIMIT, PENALTY
from gait_lab.soccer.challenges import (
    CHALLENGES,
    ChallengeResult,
    ChallengeSpec,
    play_challenge,
)
from sim_bridge.plant import load_plant, with_options
from sim_bridge.trials.parallel import parallel_map

NAMES = tuple(CHALLENGES)
WALKS = "walk straight", "walk slalom"
CONTROL, KICK = "ball control", "best kick"
TARGETS = "centre mark", "penalty mark", "corner"


@dataclass(frozen=True)
class Options(BenchOptions):
    """What the suite `challenges` runs on."""

    robots: int = 20
    challenges: tuple[str, ...] = option(
        NAMES, "which one", "NAME", flags=("--challenge",), choices=NAMES
    )
    limit: float = option(LIMIT, "time [s] for one attempt", "T", minimum=1.0)


def challenges(options: Options) -> SuiteResult:
    """Each robot has one attempt at each challenge."""
    specs = [
        ChallengeSpec(
            name=name,
            seed=seed,
            urdf=options.urdf,
            engine=options.engine,
            plant=with_options(load_plant(options.plant), options.plant_options),
            limit=options.limit,
        )
        for name in options.challenges
        for seed in options.seeds
    ]
    results: list[ChallengeResult] = parallel_map(
        play_challenge, specs, jobs=options.jobs, label="challenges", show=options.show, note=_note
    )
    of = {name: [each for each in results if each.spec.name == name] for name in options.challenges}
    rows: list[Measurement] = []
    lines: list[Sequence[Cell]] = []

    def add(
        name: str, unit: str, scores: Sequence[float | None], penalties: float | None = None
    ) -> None:
        done = [each for each in scores if each is not None]
        median = statistics.median(done) if done else None
        worst = max(done) if len(done) == len(scores) else None
        key = name.replace(" ", "_")
        score = f"{key}_seconds" if unit == "s" else key
        rows.append(Measurement(f"{key}_done", "%", 100.0 * len(done) / len(scores)))
        rows.append(Measurement(f"{score}_median", unit, median))
        rows.append(Measurement(f"{score}_worst", unit, worst))
        if penalties is not None:
            rows.append(Measurement(f"{key}_penalties_median", "penalties", penalties))
        lines.append((name, len(scores), len(done), unit, median, worst, penalties))

    for name in options.challenges:
        mine = of[name]
        penalties = statistics.median(each.penalties for each in mine) if name == CONTROL else None
        key = f"{name} sum" if name == KICK else name
        add(key, "m" if name == KICK else "s", [each.score for each in mine], penalties)
    if set(WALKS) <= set(options.challenges):
        both = zip(*(of[name] for name in WALKS), strict=True)
        add("walk sum", "s", [_sum(one.score, other.score) for one, other in both])
    for index, target in enumerate(TARGETS if KICK in of else ()):
        add(f"kick to {target}", "m", [each.parts[index] for each in of[KICK]])
    columns = (
        Column("challenge"), Column("robots"), Column("done"), Column("score in"),
        Column("median", digits=2), Column("worst", digits=2), Column("penalties", digits=1),
    )  # fmt: skip
    notes = (
        "One attempt each. Walks: from touchline to touchline, in line with the penalty mark; "
        "slalom: around four standing robots, which must not be touched. Ball control: until robot "
        f"and ball are beyond the other touchline, with {PENALTY:g} s for each penalty (median "
        "number). Best kick: sum of the distances from the resting ball to three targets, 3.9, 7.1 "
        "and 8.9 m away. Median of those who have done it; worst only if all have.",
    )
    title = f"Technical challenges; {options.title}"
    return SuiteResult(tuple(rows), title, (Table(columns, lines),), notes)


def _sum(*scores: float | None) -> float | None:
    """None if one of them is."""
    done = [each for each in scores if each is not None]
    return sum(done) if len(done) == len(scores) else None


def _note(result: ChallengeResult) -> str:
    end = "not done" if result.score is None else f"{result.score:.2f}"
    return f"{result.spec.name}, robot {result.spec.seed}: {end}; {result.doing}"


SUITE = Suite(
    name="challenges",
    title="Technical challenges",
    summary="fastest walk (straight and slalom), ball control and best kick by the SPL's rules",
    measure=challenges,
    options=Options,
    takes=("robots",),
    gait=False,
    quick=({"robots": 4},),
)
