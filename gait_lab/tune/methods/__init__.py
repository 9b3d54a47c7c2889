"""Search methods behind one interface; each is a library's, wrapped thinly."""

from collections.abc import Sequence
from importlib import import_module
from typing import Protocol

from nao_lipm_gait.errors import NaoGaitError

Point = tuple[float, ...]
"""Shares 0..1 of the ranges of a study."""


class Method(Protocol):
    """Asked for points, told their losses. The same seed, asks and tells give the same points."""

    def ask(self) -> Point | None:
        """The next point to try; None = not before more points were told."""

    def tell(self, point: Point, loss: float) -> None:
        """The loss (smaller is better) of an asked point; in the order of asking."""


_MODULES = {"surrogate": "surrogate", "pso": "swarm", "cma": "evolution"}
METHODS: Sequence[str] = tuple(_MODULES)


def make_method(name: str, start: Point, *, seed: int, trials: int) -> Method:
    """A fresh method whose first point is `start`; `trials` is what it has to get along with."""
    if name not in _MODULES:
        raise NaoGaitError("method", name, ", ".join(METHODS))
    if seed < 0:
        raise NaoGaitError("seed", seed, "0 or more")
    made: Method = import_module(f"{__name__}.{_MODULES[name]}").make(start, seed, trials)
    return made
