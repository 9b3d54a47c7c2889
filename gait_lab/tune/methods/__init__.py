"""Search methods behind one interface; each wraps a library."""

from typing import Protocol

from robot_core.errors import NaoGaitError

Point = tuple[float, ...]
"""A point of the search, as shares 0..1 of the ranges of a study."""


class Method(Protocol):
    """A search method. The same seed and the same losses give the same points."""

    def ask(self) -> Point | None:
        """Return the next point to try; None if more losses are needed first."""

    def tell(self, point: Point, loss: float) -> None:
        """Take the loss of an asked point, smaller is better; in the order of asking."""


METHODS = ("surrogate", "pso", "cma")


def make_method(name: str, start: Point, *, seed: int, trials: int) -> Method:
    """Make a search method; its library is imported only here.

    Args:
        name: One of `METHODS`.
        start: First point.
        seed: Seed of the method.
        trials: Number of trials of the study.

    Returns:
        The method.

    Raises:
        NaoGaitError: If the name is unknown or the seed negative.
    """
    if name not in METHODS:
        raise NaoGaitError("method", name, ", ".join(METHODS))
    if seed < 0:
        raise NaoGaitError("seed", seed, "0 or more")
    if name == "surrogate":
        from gait_lab.tune.methods.surrogate import Surrogate

        return Surrogate(start, seed, trials)
    from gait_lab.tune.methods.generations import Evolution, Swarm

    return Swarm(start, seed, trials) if name == "pso" else Evolution(start, seed)
