"""Sequential surrogate optimisation: a Gaussian process over all trials, expected improvement.

It wraps bayesian-optimization. The first points are a space-filling design. Very low scores are
clipped. A point whose trial still runs is assumed to score the mean, so that several workers do not
try the same point.
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
"""Points of the first design per parameter."""
XI = 0.01
"""Smallest expected improvement, in the unit of the score."""


class Surrogate:
    """Search by a Gaussian process.

    Args:
        start: First point.
        seed: Seed of the method.
        trials: Number of trials of the study.
    """

    def __init__(self, start: Point, seed: int, trials: int) -> None:
        self._names = [f"x{i:03d}" for i in range(len(start))]
        design = min(DESIGN_PER_DIMENSION * len(start), max(1, trials // 2))
        rows = qmc.LatinHypercube(len(start), rng=np.random.default_rng(seed)).random(design)
        self._design: list[Point] = [start, *(tuple(map(float, row)) for row in rows)]
        self._seed = seed
        self._scores: list[tuple[Point, float]] = []
        self._running: list[Point] = []
        self._asked = 0

    def ask(self) -> Point | None:
        """Return the next point of the design, then of the process."""
        if self._asked < len(self._design):
            point = self._design[self._asked]
        elif not self._scores:
            return None
        else:
            point = self._suggest()
        self._asked += 1
        self._running.append(point)
        return point

    def tell(self, point: Point, loss: float) -> None:
        """Take the loss of a point."""
        if point in self._running:
            self._running.remove(point)
        self._scores.append((point, -loss))

    def _suggest(self) -> Point:
        """Fit the process to all scores; return the point with the largest expected improvement."""
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
        # Trials are noisy: each has its own robots and sensor noise.
        optimizer.set_gp_params(kernel=kernel, alpha=1e-6, n_restarts_optimizer=2)
        scores = clipped([score for _, score in self._scores])
        known = [(point, score) for (point, _), score in zip(self._scores, scores, strict=True)]
        known += [(point, float(np.mean(scores))) for point in self._running]
        # Such small matrices are slower with many threads, and the workers need the cores.
        with threadpool_limits(1), warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a repeated point is no problem
            for point, score in known:
                optimizer.register(dict(zip(self._names, point, strict=True)), score)
            # A length scale at its bound means that the parameter does not matter.
            warnings.simplefilter("ignore", ConvergenceWarning)
            suggested = optimizer.suggest()
        return tuple(float(suggested[name]) for name in self._names)


def clipped(scores: Sequence[float]) -> list[float]:
    """Return the scores, clipped below the median by as much as the best score is above it.

    The score of a fall contains no information about better walking, but it would dominate the fit
    of a smooth process.
    """
    middle, best = float(np.median(scores)), max(scores)
    return [max(score, 2.0 * middle - best) for score in scores]
