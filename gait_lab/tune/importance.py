"""Which parameters mattered: permutation importance of a random forest on the trials."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from sklearn.ensemble import RandomForestRegressor
from sklearn.inspection import permutation_importance

from gait_lab.tune.study import Study
from gait_lab.tune.trial import Trial

TREES = 200
REPEATS = 20


@dataclass(frozen=True, slots=True)
class Importance:
    """Shares of the explained score, by name; they sum to 1 unless nothing was explained."""

    shares: dict[str, float]
    explained: float
    """R^2 of the forest on trials that each tree did not see: near 0, believe nothing."""


def importance(study: Study, trials: Sequence[Trial]) -> Importance:
    """How much worse the score is predicted when one parameter is shuffled among the trials."""
    points = np.array([trial.point for trial in trials])
    scores = np.array([trial.score for trial in trials])
    names = [r.name for r in study.ranges]
    if len(trials) < 2 * len(names) or np.ptp(scores) == 0.0:
        return Importance(dict.fromkeys(names, 0.0), 0.0)
    forest = RandomForestRegressor(TREES, random_state=0, oob_score=True).fit(points, scores)
    found = permutation_importance(forest, points, scores, n_repeats=REPEATS, random_state=0)
    drops = np.maximum(found.importances_mean, 0.0)
    total = float(drops.sum()) or 1.0
    shares = {name: float(drop) / total for name, drop in zip(names, drops, strict=True)}
    return Importance(shares, float(forest.oob_score_))
