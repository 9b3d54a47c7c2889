"""Search methods, as samplers of Optuna.

CMA-ES, TPE and random search are Optuna's own. The particle swarm of the first paper and the
surrogate of the second one are here (Optuna's own Gaussian process needs PyTorch). A sampler keeps
nothing between trials: its point depends on the seed, the number of the trial and the stored trials
alone, so that a resumed search goes on as if it had not been interrupted.
"""

import warnings
from abc import abstractmethod
from collections.abc import Sequence
from typing import Any

import numpy as np
import optuna
from numpy.typing import NDArray
from optuna.distributions import BaseDistribution, FloatDistribution
from optuna.samplers import BaseSampler, CmaEsSampler, RandomSampler, TPESampler
from optuna.trial import FrozenTrial, TrialState
from scipy.stats import norm, qmc

SIGMA = 0.25
"""Initial standard deviation of CMA-ES, in shares of the ranges."""
PARTICLES = 10
"""Size of the swarm; small, because trials are expensive: 74 trials give it seven moves."""
INERTIA, PULL = 0.729, 1.494
"""Share of its velocity that a particle keeps, and how strongly it is drawn to its own best and to
the swarm's best (Clerc's constriction)."""
DESIGN_PER_DIMENSION = 2
"""Points of the surrogate's first design per parameter."""
CANDIDATES = 4000
"""Points among which the surrogate looks for the largest expected improvement; then as many more
around the best of them."""
XI = 0.01
"""Smallest expected improvement, in the unit of the score."""

Space = dict[str, FloatDistribution]
Point = NDArray[np.float64]
"""Shares (0..1) of the ranges, in the order of the space."""


def make_sampler(
    method: str, space: Space, start: dict[str, float], seed: int, trial: int
) -> BaseSampler:
    """The sampler of one trial.

    Args:
        method: One of `study.METHODS`.
        space: Range of each varied parameter.
        start: Where CMA-ES begins, by name of the parameter.
        seed: Seed of the search.
        trial: Number of the trial.
    """
    if method == "pso":
        return Swarm(space, seed)
    if method == "surrogate":
        return Surrogate(space, seed)
    own = int(np.random.SeedSequence([seed, trial]).generate_state(1)[0])
    if method == "random":
        return RandomSampler(seed=own)
    with warnings.catch_warnings():
        # Optuna marks these arguments as experimental, and `x0` as one that its version 6 drops.
        warnings.simplefilter("ignore")
        if method == "tpe":
            return TPESampler(seed=own, multivariate=True, constant_liar=True)
        return CmaEsSampler(
            x0=start, sigma0=SIGMA, seed=own, n_startup_trials=1, warn_independent_sampling=False
        )


class _Sampler(BaseSampler):
    """A sampler that sees points as shares of the ranges."""

    def __init__(self, space: Space, seed: int) -> None:
        self._space, self._seed = space, seed

    def infer_relative_search_space(
        self, study: optuna.Study, trial: FrozenTrial
    ) -> dict[str, BaseDistribution]:
        return dict(self._space)

    def sample_independent(
        self, study: optuna.Study, trial: FrozenTrial, param_name: str,
        param_distribution: BaseDistribution,
    ) -> Any:  # fmt: skip
        raise ValueError(f"{param_name} is not in the search space")

    def sample_relative(
        self, study: optuna.Study, trial: FrozenTrial, search_space: dict[str, BaseDistribution]
    ) -> dict[str, Any]:
        earlier = [
            each
            for each in study.get_trials(
                deepcopy=False, states=(TrialState.COMPLETE, TrialState.RUNNING)
            )
            if each.number != trial.number and each.params.keys() >= self._space.keys()
        ]
        rng = np.random.default_rng([self._seed, trial.number])
        point = self._point(trial.number, earlier, rng)
        return {
            name: min(d.high, max(d.low, d.low + float(share) * (d.high - d.low)))
            for (name, d), share in zip(self._space.items(), point, strict=True)
        }

    @abstractmethod
    def _point(
        self, number: int, earlier: Sequence[FrozenTrial], rng: np.random.Generator
    ) -> Point:
        """The point of a trial; earlier trials that still run have no value."""

    def _shares(self, trial: FrozenTrial) -> Point:
        """The point of a trial."""
        return np.array(
            [(trial.params[name] - d.low) / (d.high - d.low) for name, d in self._space.items()]
        )


class Swarm(_Sampler):
    """Particle swarm as in the first paper; trial n moves particle n modulo the size of the swarm.

    A particle moves as soon as its last point has been tried, and does not wait for the others.
    """

    def _point(
        self, number: int, earlier: Sequence[FrozenTrial], rng: np.random.Generator
    ) -> Point:
        own = [t for t in earlier if t.number % PARTICLES == number % PARTICLES]
        scored = [t for t in earlier if t.value is not None]
        if not own or not scored:
            return rng.random(len(self._space))
        x = self._shares(own[-1])
        velocity = x - self._shares(own[-2]) if len(own) > 1 else np.zeros_like(x)
        best = self._shares(max(scored, key=_value))
        own_best = self._shares(max((t for t in own if t.value is not None), key=_value,
                                   default=own[-1]))  # fmt: skip
        first, second = PULL * rng.random((2, len(x)))
        moved = x + INERTIA * velocity + first * (own_best - x) + second * (best - x)
        return np.clip(moved, 0.0, 1.0)


class Surrogate(_Sampler):
    """Sequential surrogate optimisation: a Gaussian process, expected improvement.

    The first points are a space-filling design. A point whose trial still runs is assumed to score
    the mean, so that several workers do not try the same point.
    """

    def _point(
        self, number: int, earlier: Sequence[FrozenTrial], rng: np.random.Generator
    ) -> Point:
        size = len(self._space)
        scored = [t for t in earlier if t.value is not None]
        if number <= DESIGN_PER_DIMENSION * size or not scored:
            design = qmc.LatinHypercube(size, rng=np.random.default_rng(self._seed))
            points = design.random(DESIGN_PER_DIMENSION * size)
            return points[(number - 1) % len(points)]
        scores = clipped([_value(t) for t in scored])
        running = [t for t in earlier if t.value is None]
        x = np.array([self._shares(t) for t in (*scored, *running)])
        y = np.array(scores + [float(np.mean(scores))] * len(running))
        scale = float(np.std(y)) or 1.0
        process = _fitted(x, (y - np.mean(y)) / scale, int(rng.integers(2**31)))

        def improvement(points: Point) -> Point:
            mean, sigma = process.predict(points, return_std=True)
            gain = mean - (max(y) - np.mean(y) + XI) / scale
            z = gain / np.maximum(sigma, 1e-9)
            return gain * norm.cdf(z) + sigma * norm.pdf(z)

        anywhere = rng.random((CANDIDATES, size))
        centre = anywhere[np.argmax(improvement(anywhere))]
        near = np.clip(centre + rng.normal(0.0, 0.03, anywhere.shape), 0.0, 1.0)
        return near[np.argmax(improvement(near))]


def _fitted(x: Point, y: Point, seed: int) -> Any:
    """A Gaussian process over standardised scores; noisy, for each trial has its own robots."""
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel
    from threadpoolctl import threadpool_limits

    kernel = ConstantKernel(1.0, (0.05, 50.0)) * Matern(
        np.full(x.shape[1], 0.5), (0.05, 10.0), nu=2.5
    ) + WhiteKernel(0.01, (1e-5, 0.5))
    process = GaussianProcessRegressor(kernel, n_restarts_optimizer=2, random_state=seed)
    # Such small matrices are slower with many threads, and the workers need the cores.
    with threadpool_limits(1), warnings.catch_warnings():
        # A length scale at its bound means that the parameter does not matter.
        warnings.simplefilter("ignore")
        return process.fit(x, y)


def _value(trial: FrozenTrial) -> float:
    """The score of a trial that is complete."""
    assert trial.value is not None
    return trial.value


def clipped(scores: Sequence[float]) -> list[float]:
    """Return the scores, clipped below the median by as much as the best score is above it.

    The score of a fall contains no information about better walking, but it would dominate the fit
    of a smooth process.
    """
    middle, best = float(np.median(scores)), max(scores)
    return [max(score, 2.0 * middle - best) for score in scores]
