"""Sequential surrogate optimisation: a Gaussian process over all trials, expected improvement.

bayesian-optimization does the work. A first design that fills the space comes before it, and
points under way are taken to give the mean, so that several workers do not try the same.
"""

import warnings

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
        self._optimizer = BayesianOptimization(
            f=None,
            pbounds={name: (0.0, 1.0) for name in self._names},
            acquisition_function=acquisition.ConstantLiar(
                acquisition.ExpectedImprovement(xi=XI), strategy="mean"
            ),
            random_state=seed,
            verbose=0,
            allow_duplicate_points=True,
        )
        kernel = ConstantKernel(1.0, (0.05, 50.0)) * Matern(
            np.full(len(start), 0.5), (0.05, 10.0), nu=2.5
        ) + WhiteKernel(0.01, (1e-5, 0.5))
        # Trials are noisy: another robot, another noise, and a fall is a cliff.
        self._optimizer.set_gp_params(kernel=kernel, alpha=1e-6, n_restarts_optimizer=2)
        self._asked = self._told = 0

    def ask(self) -> Point | None:
        if self._asked < len(self._design):
            point = self._design[self._asked]
        elif not self._told:
            return None
        else:
            # So small a matrix is slower on many threads, and the workers want the cores.
            with threadpool_limits(1), warnings.catch_warnings():
                # A length scale at its bound is an answer: the parameter does not matter.
                warnings.simplefilter("ignore", ConvergenceWarning)
                suggested = self._optimizer.suggest()
            point = tuple(float(suggested[name]) for name in self._names)
        self._asked += 1
        return point

    def tell(self, point: Point, loss: float) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a point tried twice is no news here
            self._optimizer.register(dict(zip(self._names, point, strict=True)), -loss)
        self._told += 1


def make(start: Point, seed: int, trials: int) -> Surrogate:
    return Surrogate(start, seed, trials)
