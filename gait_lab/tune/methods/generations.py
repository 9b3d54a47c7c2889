"""For methods that think in generations: hands their points out one by one."""

from abc import ABC, abstractmethod

from gait_lab.tune.methods import Point


class Generations(ABC):
    """A `Method` out of two steps: give a generation, take its losses."""

    def __init__(self) -> None:
        self._waiting: list[Point] = []
        self._size = 0
        self._told: list[Point] = []
        self._losses: list[float] = []

    @abstractmethod
    def next_generation(self) -> list[Point]:
        """Points to try."""

    @abstractmethod
    def rate(self, points: list[Point], losses: list[float]) -> None:
        """What they gave; a point may differ from the asked one when a study is resumed."""

    def ask(self) -> Point | None:
        if not self._waiting:
            if self._size:
                return None
            self._waiting = self.next_generation()
            self._size = len(self._waiting)
        return self._waiting.pop(0)

    def tell(self, point: Point, loss: float) -> None:
        self._told.append(point)
        self._losses.append(loss)
        if len(self._told) == self._size:
            self.rate(self._told, self._losses)
            self._told, self._losses, self._size = [], [], 0
