"""The best trials once more, on more robots and for longer: the search's own best is often lucky.

A search that is rewarded for the last centimetre ends at the edge of a fall, and of many trials
there the one whose robots just got through scores best. So some of the best, apart from each other,
walk again; what they score there decides.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from gait_lab.tune.study import Place, Study
from gait_lab.tune.trial import Trial, score_of, walk_all
from gait_lab.tune.workers import Workers, run_all

APART = 0.08
"""Root mean square distance of two candidates, in shares of the ranges."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """A trial in the finals."""

    trial: Trial
    score: float
    falls: int


def candidates(study: Study, trials: Sequence[Trial]) -> list[Trial]:
    """The best trials that are apart from each other, best first."""
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
    """Candidates by their score in the finals, the winner first."""
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
