"""Particle swarm optimisation (the first paper's) by pymoo."""

from typing import Any

import numpy as np
from pymoo.algorithms.soo.nonconvex.pso import PSO
from pymoo.core.evaluator import Evaluator
from pymoo.core.problem import Problem
from pymoo.core.termination import NoTermination
from pymoo.problems.static import StaticProblem

from gait_lab.tune.methods import Point
from gait_lab.tune.methods.generations import Generations

PARTICLES = 10
"""Few, because trials are dear: a study of 74 gives them seven moves."""


class Swarm(Generations):
    """`Method` on a swarm; the first particle begins at the start."""

    def __init__(self, start: Point, seed: int, trials: int) -> None:
        super().__init__()
        rng = np.random.default_rng(seed)
        first = rng.random((min(PARTICLES, max(2, trials // 2)), len(start)))
        first[0] = start
        self._problem = Problem(n_var=len(start), n_obj=1, xl=0.0, xu=1.0)
        self._swarm = PSO(pop_size=len(first), sampling=first)
        self._swarm.setup(self._problem, termination=NoTermination(), seed=seed, verbose=False)
        self._asked: Any = None

    def next_generation(self) -> list[Point]:
        self._asked = self._swarm.ask()
        return [tuple(map(float, row)) for row in self._asked.get("X")]

    def rate(self, points: list[Point], losses: list[float]) -> None:
        self._asked.set("X", np.array(points))
        known = StaticProblem(self._problem, F=np.array(losses)[:, None])
        Evaluator().eval(known, self._asked)
        self._swarm.tell(infills=self._asked)


def make(start: Point, seed: int, trials: int) -> Swarm:
    return Swarm(start, seed, trials)
