"""After the search: the finals choose the winner, and the confirmation compares it with the start.

The best score of a search is often luck: a search that is rewarded for the last centimetre ends at
the edge of a fall. So some of the best trials that differ from each other run again, on further
robots and for longer. The winner then walks beside the start on robots that were not used before,
on several engines and plants.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import islice
from statistics import median

import numpy as np

from gait_lab.tune.evaluation import Trial, robot_score, score_of, walk_all
from gait_lab.tune.protocols import PROTOCOLS, Measures
from gait_lab.tune.study import Place, Study
from gait_lab.tune.workers import Workers, run_all
from nao_lipm_gait.parameters import GaitParameters

APART = 0.08
"""Smallest root mean square distance of two candidates, in shares of the ranges."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """A trial in the finals.

    Attributes:
        trial: The trial of the search.
        score: Its score in the finals.
        falls: Number of robots that fell in the finals.
    """

    trial: Trial
    score: float
    falls: int


def candidates(study: Study, trials: Sequence[Trial]) -> list[Trial]:
    """Return the best trials that differ from each other, best first."""
    chosen: list[Trial] = []
    for trial in sorted(trials, key=lambda t: (-t.score, t.number)):
        near = (np.sqrt(np.mean(np.square(np.subtract(trial.point, c.point)))) < APART
                for c in chosen)  # fmt: skip
        if trial.error is None and not any(near):
            chosen.append(trial)
        if len(chosen) == study.finals.candidates:
            break
    return chosen


def finals(
    study: Study,
    trials: Sequence[Trial],
    workers: Workers,
    note: Callable[[], object] = lambda: None,
) -> list[Candidate]:
    """Run the finals.

    Args:
        study: The study.
        trials: All trials of the search.
        workers: Processes that run the trials.
        note: Called after each walk.

    Returns:
        The candidates by their score in the finals, the winner first; empty without finals.
    """
    place = Place(study.engine, study.plant)
    robots = study.finals.robots
    if not study.finals.candidates:
        return []
    chosen = candidates(study, trials)
    calls = [
        (study, study.parameters_at(trial.point), (seed,), place, True)
        for trial in chosen
        for seed in robots
    ]
    walked = run_all(workers, walk_all, calls, note)
    found = []
    for i, trial in enumerate(chosen):
        measures = [each for (each,) in walked[i * len(robots) : (i + 1) * len(robots)]]
        found.append(Candidate(trial, score_of(study, measures), sum(m.fell for m in measures)))
    return sorted(found, key=lambda c: (-c.score, c.trial.number))


@dataclass(frozen=True, slots=True)
class Comparison:
    """Measures of the unseen robots in one place.

    Attributes:
        place: Engine and plant.
        before: Measures with the parameters of the start.
        after: Measures with the parameters of the winner.
    """

    place: Place
    before: tuple[Measures, ...]
    after: tuple[Measures, ...]


@dataclass(frozen=True, slots=True)
class ComparisonRow:
    """One line of the table.

    Attributes:
        name: Name of the value.
        unit: SI unit; `robots` for a count.
        before: Worst and median over the robots, with the parameters of the start.
        after: The same with those of the winner.
    """

    name: str
    unit: str
    before: tuple[float, float]
    after: tuple[float, float]


def compare(
    study: Study,
    winner: GaitParameters,
    workers: Workers,
    note: Callable[[], object] = lambda: None,
) -> list[Comparison]:
    """Run start and winner on every unseen robot, in each place of the study.

    Args:
        study: The study.
        winner: Parameters of the winner.
        workers: Processes that run the walks.
        note: Called after each walk.

    Returns:
        One comparison per place.
    """
    calls = [
        (study, parameters, (seed,), place, True)
        for place in study.confirm_places
        for parameters in (study.start, winner)
        for seed in study.unseen
    ]
    walked = iter(run_all(workers, walk_all, calls, note))

    def robots() -> tuple[Measures, ...]:
        return tuple(each for (each,) in islice(walked, len(study.unseen)))

    return [Comparison(place, robots(), robots()) for place in study.confirm_places]


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
        spread("score", "", lambda m: robot_score(study, m)),
        count("fell", lambda m: m.fell),
        count("over the limits", lambda m: m.excess > 0.0),
    ]
    for name, unit in PROTOCOLS[study.protocol].measures.items():
        worst = _largest if _smaller_is_better(study, name) else min
        table.append(spread(name, unit, partial(_value, name), worst))
    return table


def _value(name: str, measures: Measures) -> float:
    return measures.values[name]


def _largest(values: Sequence[float]) -> float:
    return max(values, key=abs)


def _smaller_is_better(study: Study, name: str) -> bool:
    weight = study.objective.get(name)
    return weight < 0.0 if weight is not None else name in ("flight", "slip", "drift")
