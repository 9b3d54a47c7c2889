"""After the search: the finals choose the winner, and the confirmation compares it with the start.

The best score of a search is often luck: a search that is rewarded for the last centimetre ends at
the edge of a fall. So some of the best trials that differ from each other run again, on further
robots and for longer. The winner then walks beside the start on robots that were not used before,
on several engines and plants.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import islice
from statistics import median

import numpy as np
from optuna.trial import FrozenTrial

from gait_lab.tune.protocols import Measures
from gait_lab.tune.search import walk_robots
from gait_lab.tune.study import Place, Study
from gait_lab.tune.workers import Workers
from nao_lipm_gait.parameters import GaitParameters

APART = 0.08
"""Smallest root mean square distance of two candidates, in shares of the ranges."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """A trial of the search with its score and its number of falls in the finals."""

    trial: FrozenTrial
    score: float
    falls: int


def candidates(study: Study, trials: Sequence[FrozenTrial]) -> list[FrozenTrial]:
    """Return the best trials that differ from each other, best first."""
    widths = {name: high - low for name, (low, high) in study.file.parameters.items()}

    def near(a: FrozenTrial, b: FrozenTrial) -> bool:
        apart = [(a.params[name] - b.params[name]) / width for name, width in widths.items()]
        return float(np.sqrt(np.mean(np.square(apart)))) < APART

    chosen: list[FrozenTrial] = []
    for trial in sorted(trials, key=lambda t: (-(t.value or 0.0), t.number)):
        failed = trial.user_attrs["error"] is not None
        if not failed and not any(near(trial, other) for other in chosen):
            chosen.append(trial)
    return chosen[: study.file.finals.candidates]


def finals(study: Study, trials: Sequence[FrozenTrial], workers: Workers) -> list[Candidate]:
    """Run the finals; the winner is the first. Empty without finals."""
    robots = study.file.finals.robots
    chosen = candidates(study, trials)
    calls = [
        (study, study.start.replace(**trial.params), (seed,), study.place, True)
        for trial in chosen
        for seed in robots
    ]
    walked = iter(_walk(workers, calls, "finals"))
    found = []
    for trial in chosen:
        measures = list(islice(walked, len(robots)))
        found.append(Candidate(trial, study.score(measures), sum(m.fell for m in measures)))
    return sorted(found, key=lambda c: (-c.score, c.trial.number))


def _walk(workers: Workers, calls: Sequence[tuple[object, ...]], label: str) -> list[Measures]:
    """The measures of calls with one robot each."""
    from sim_bridge.trials.progress import Progress

    results = workers.map(walk_robots, calls)
    with Progress(results, total=len(calls), desc=label) as bar:
        return [measures for (measures,) in bar]


@dataclass(frozen=True, slots=True)
class Comparison:
    """Measures of the unseen robots in one place, with the start's parameters and the winner's."""

    place: Place
    before: Sequence[Measures]
    after: Sequence[Measures]


@dataclass(frozen=True, slots=True)
class ComparisonRow:
    """One line of the table.

    Attributes:
        unit: SI unit; `robots` for a count.
        before: Worst and median over the robots, with the parameters of the start.
        after: The same with those of the winner.
    """

    name: str
    unit: str
    before: tuple[float, float]
    after: tuple[float, float]


def compare(study: Study, winner: GaitParameters, workers: Workers) -> list[Comparison]:
    """Run start and winner on every unseen robot, in each place of the study."""
    unseen = study.file.unseen
    calls = [
        (study, parameters, (seed,), place, True)
        for place in study.confirm_places
        for parameters in (study.start, winner)
        for seed in unseen
    ]
    walked = iter(_walk(workers, calls, "unseen robots"))
    return [
        Comparison(place, list(islice(walked, len(unseen))), list(islice(walked, len(unseen))))
        for place in study.confirm_places
    ]


def rows(study: Study, comparison: Comparison) -> list[ComparisonRow]:
    """Return the table of one place: score, falls, excess, then every measure of the protocol."""
    sides = (comparison.before, comparison.after)

    def spread(
        name: str, unit: str, value: Callable[[Measures], float], worst: Callable[..., float] = min
    ) -> ComparisonRow:
        columns = [[value(measures) for measures in side] for side in sides]
        first, second = ((worst(column), median(column)) for column in columns)
        return ComparisonRow(name, unit, first, second)

    def count(name: str, is_so: Callable[[Measures], bool]) -> ComparisonRow:
        first, second = (float(sum(map(is_so, side))) for side in sides)
        return ComparisonRow(name, "robots", (first, first), (second, second))

    table = [
        spread("score", "", study.robot_score),
        count("fell", lambda m: m.fell),
        count("over the limits", lambda m: m.excess > 0.0),
    ]
    for name, unit in study.protocol.measures.items():
        worst = _largest if _smaller_is_better(study, name) else min
        table.append(spread(name, unit, lambda m, name=name: m.values[name], worst))  # type: ignore[misc]
    return table


def _largest(values: Sequence[float]) -> float:
    return max(values, key=abs)


def _smaller_is_better(study: Study, name: str) -> bool:
    weight = study.file.objective.get(name)
    return weight < 0.0 if weight is not None else name in ("flight", "slip", "drift")
