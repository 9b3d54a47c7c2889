"""Sequential surrogate optimisation: a Gaussian process over all trials, expected improvement.

bayesian-optimization does the work. A first design that fills the space comes before it, falls are
levelled, and points under way are taken to give the mean, so that several workers do not try the
same.
"""

import warnings
from collections.abc import Sequence

import numpy as np
from bayes_opt import BayesianOptimization, acquisition
from scipy.stats import qmc
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel
from threadpoolctl import threadpool_limits

from gait_lab.tune.methods import Point

DESIGN_PER_DIMENSION = 2
XI = 0.01
"""Improvement that is asked for at least, in the unit of the score."""


class Surrogate:
    """`Method` on a Gaussian process."""

    def __init__(self, start: Point, seed: int, trials: int) -> None:
        self._names = [f"x{i:03d}" for i in range(len(start))]
        design = min(DESIGN_PER_DIMENSION * len(start), max(1, trials // 2))
        rows = qmc.LatinHypercube(len(start), rng=np.random.default_rng(seed)).random(design)
        self._design: list[Point] = [start, *(tuple(map(float, row)) for row in rows)]
        self._seed = seed
        self._scores: list[tuple[Point, float]] = []
        self._under_way: list[Point] = []
        self._asked = 0

    def ask(self) -> Point | None:
        if self._asked < len(self._design):
            point = self._design[self._asked]
        elif not self._scores:
            return None
        else:
            point = self._suggest()
        self._asked += 1
        self._under_way.append(point)
        return point

    def tell(self, point: Point, loss: float) -> None:
        if point in self._under_way:
            self._under_way.remove(point)
        self._scores.append((point, -loss))

    def _suggest(self) -> Point:
        """Where the process, fitted anew to all that is known, expects the largest improvement."""
        optimizer = BayesianOptimization(
            f=None,
            pbounds={name: (0.0, 1.0) for name in self._names},
            acquisition_function=acquisition.ExpectedImprovement(xi=XI),
            random_state=self._seed * 1000 + self._asked,
            verbose=0,
            allow_duplicate_points=True,
        )
        kernel = ConstantKernel(1.0, (0.05, 50.0)) * Matern(
            np.full(len(self._names), 0.5), (0.05, 10.0), nu=2.5
        ) + WhiteKernel(0.01, (1e-5, 0.5))
        # Trials are noisy: another robot, another noise.
        optimizer.set_gp_params(kernel=kernel, alpha=1e-6, n_restarts_optimizer=2)
        scores = levelled([score for _, score in self._scores])
        known = [(point, score) for (point, _), score in zip(self._scores, scores, strict=True)]
        known += [(point, float(np.mean(scores))) for point in self._under_way]
        # So small a matrix is slower on many threads, and the workers want the cores.
        with threadpool_limits(1), warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a point tried twice is no news here
            for point, score in known:
                optimizer.register(dict(zip(self._names, point, strict=True)), score)
            # A length scale at its bound is an answer: the parameter does not matter.
            warnings.simplefilter("ignore", ConvergenceWarning)
            suggested = optimizer.suggest()
        return tuple(float(suggested[name]) for name in self._names)


def levelled(scores: Sequence[float]) -> list[float]:
    """Scores with the depths filled up: no lower than the median by more than the best is above.

    How badly a robot falls says nothing about how to walk better, but a smooth process that has to
    go through such cliffs sees little else.
    """
    middle, best = float(np.median(scores)), max(scores)
    return [max(score, 2.0 * middle - best) for score in scores]


def make(start: Point, seed: int, trials: int) -> Surrogate:
    return Surrogate(start, seed, trials)
