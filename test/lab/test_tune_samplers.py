"""Search methods: they begin at the start, stay inside, repeat themselves, find a minimum."""

import numpy as np
import pytest

pytest.importorskip("optuna")
pytest.importorskip("cmaes")
pytest.importorskip("sklearn")

import optuna
from optuna.distributions import FloatDistribution

from gait_lab.tune.samplers import PARTICLES, clipped, make_sampler
from gait_lab.tune.study import METHODS

SPACE = {"a": FloatDistribution(-1.0, 1.0), "b": FloatDistribution(0.0, 10.0)}
START = {"a": 0.8, "b": 1.0}
GOAL = {"a": -0.4, "b": 6.0}


def bowl(values: dict[str, float]) -> float:
    return sum(((values[k] - GOAL[k]) / (d.high - d.low)) ** 2 for k, d in SPACE.items())


def search(method: str, trials: int, seed: int = 3, under_way: int = 1) -> list[dict[str, float]]:
    """The points of a search that tells a score when `under_way` trials run."""
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    study = optuna.create_study(direction="maximize")
    study.enqueue_trial(START)
    running = []
    for _ in range(trials):
        number = len(study.get_trials(deepcopy=False))
        study.sampler = make_sampler(method, SPACE, START, seed, number)
        running.append(study.ask(dict(SPACE)))
        if len(running) == under_way:
            trial = running.pop(0)
            study.tell(trial, -bowl(trial.params))
    return [trial.params for trial in study.trials]


@pytest.mark.parametrize("under_way", [1, 3])
@pytest.mark.parametrize("method", METHODS)
def test_a_method_begins_at_the_start_stays_inside_and_repeats_itself(
    method: str, under_way: int
) -> None:
    first, again = (search(method, 11, under_way=under_way) for _ in range(2))
    assert first[0] == START
    assert first == again
    assert first[1:] != search(method, 11, seed=4, under_way=under_way)[1:]
    assert all(d.low <= values[k] <= d.high for values in first for k, d in SPACE.items())
    assert len({tuple(values.values()) for values in first}) == 11  # none twice, though some run


@pytest.mark.parametrize(
    ("method", "trials"), [("surrogate", 14), ("pso", 120), ("cma", 80), ("tpe", 50)]
)
def test_a_method_finds_the_bottom_of_a_bowl(method: str, trials: int) -> None:
    found = min(map(bowl, search(method, trials)))
    assert found < 0.02 * bowl(START)
    # Random points come as close only by luck.
    assert found < np.median([min(map(bowl, search("random", trials, s))) for s in range(5)])


def test_particles_of_a_swarm_gather() -> None:
    points = np.array([list(values.values()) for values in search("pso", 12 * PARTICLES)])
    assert np.all(points[-PARTICLES:].std(axis=0) < 0.4 * points[:PARTICLES].std(axis=0))


def test_scores_of_falls_are_clipped_for_the_surrogate() -> None:
    assert clipped([3.0, 2.0, -9.0, 2.5, 1.8]) == [3.0, 2.0, 1.0, 2.5, 1.8]
    assert clipped([1.0]) == [1.0]
