"""Search methods that work in generations: CMA-ES and a particle swarm."""

from abc import ABC, abstractmethod
from typing import Any

import numpy as np

from gait_lab.tune.methods import Point

SIGMA = 0.25
"""Initial standard deviation of CMA-ES, in shares of the ranges."""
PARTICLES = 10
"""Size of the swarm; small, because trials are expensive: 74 trials give it seven moves."""


class Generations(ABC):
    """A `Method` that hands out the points of a generation one by one."""

    def __init__(self) -> None:
        self._waiting: list[Point] = []
        self._size = 0
        self._told: list[Point] = []
        self._losses: list[float] = []

    @abstractmethod
    def next_generation(self) -> list[Point]:
        """Return the points of the next generation."""

    @abstractmethod
    def rate(self, points: list[Point], losses: list[float]) -> None:
        """Process a generation; its points may differ from the asked ones in a resumed study."""

    def ask(self) -> Point | None:
        """Return the next point; None until the generation is complete."""
        if not self._waiting:
            if self._size:
                return None
            self._waiting = self.next_generation()
            self._size = len(self._waiting)
        return self._waiting.pop(0)

    def tell(self, point: Point, loss: float) -> None:
        """Take the loss of a point; process the generation when it is complete."""
        self._told.append(point)
        self._losses.append(loss)
        if len(self._told) == self._size:
            self.rate(self._told, self._losses)
            self._told, self._losses, self._size = [], [], 0


class Evolution(Generations):
    """CMA-ES of the cma package; the first point of the first generation is the start.

    Args:
        start: First point.
        seed: Seed of the method.
    """

    def __init__(self, start: Point, seed: int) -> None:
        super().__init__()
        from cma import CMAEvolutionStrategy

        # For cma, seed 0 means the clock.
        options = {"bounds": [0.0, 1.0], "seed": seed + 1, "verbose": -9}
        self._strategy = CMAEvolutionStrategy(list(start), SIGMA, options)
        self._first: Point | None = start

    def next_generation(self) -> list[Point]:
        """Return the points of the next generation."""
        points = [tuple(map(float, point)) for point in self._strategy.ask()]
        if self._first is not None:
            points[0], self._first = self._first, None
        return points

    def rate(self, points: list[Point], losses: list[float]) -> None:
        """Process the losses of a generation."""
        self._strategy.tell([np.array(point) for point in points], losses)


class Swarm(Generations):
    """Particle swarm of pymoo, as in the first paper; the first particle begins at the start.

    Args:
        start: First point.
        seed: Seed of the method.
        trials: Number of trials of the study.
    """

    def __init__(self, start: Point, seed: int, trials: int) -> None:
        super().__init__()
        from pymoo.algorithms.soo.nonconvex.pso import PSO
        from pymoo.core.problem import Problem
        from pymoo.core.termination import NoTermination

        rng = np.random.default_rng(seed)
        first = rng.random((min(PARTICLES, max(2, trials // 2)), len(start)))
        first[0] = start
        self._problem = Problem(n_var=len(start), n_obj=1, xl=0.0, xu=1.0)
        self._swarm = PSO(pop_size=len(first), sampling=first)
        self._swarm.setup(self._problem, termination=NoTermination(), seed=seed, verbose=False)
        self._asked: Any = None

    def next_generation(self) -> list[Point]:
        """Return the points of the next generation."""
        self._asked = self._swarm.ask()
        return [tuple(map(float, row)) for row in self._asked.get("X")]

    def rate(self, points: list[Point], losses: list[float]) -> None:
        """Process the losses of a generation."""
        from pymoo.core.evaluator import Evaluator
        from pymoo.problems.static import StaticProblem

        self._asked.set("X", np.array(points))
        known = StaticProblem(self._problem, F=np.array(losses)[:, None])
        Evaluator().eval(known, self._asked)
        self._swarm.tell(infills=self._asked)
