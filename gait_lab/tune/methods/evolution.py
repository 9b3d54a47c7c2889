"""CMA-ES by the cma package, around the start."""

import numpy as np
from cma import CMAEvolutionStrategy

from gait_lab.tune.methods import Point
from gait_lab.tune.methods.generations import Generations

SIGMA = 0.25
"""First spread, in shares of the ranges."""


class Evolution(Generations):
    """`Method` on CMA-ES; the first point of the first generation is the start itself."""

    def __init__(self, start: Point, seed: int) -> None:
        super().__init__()
        # To cma, seed 0 means the clock.
        options = {"bounds": [0.0, 1.0], "seed": seed + 1, "verbose": -9}
        self._strategy = CMAEvolutionStrategy(list(start), SIGMA, options)
        self._first: Point | None = start

    def next_generation(self) -> list[Point]:
        points = [tuple(map(float, point)) for point in self._strategy.ask()]
        if self._first is not None:
            points[0], self._first = self._first, None
        return points

    def rate(self, points: list[Point], losses: list[float]) -> None:
        self._strategy.tell([np.array(point) for point in points], losses)


def make(start: Point, seed: int, trials: int) -> Evolution:
    return Evolution(start, seed)
