"""Search methods behind one interface: repeatable, inside the box, and they find a minimum."""

import pytest

pytest.importorskip("bayes_opt")
pytest.importorskip("cma")
pytest.importorskip("pymoo")

from gait_lab.tune.methods import METHODS, Method, Point, make_method
from gait_lab.tune.methods.surrogate import clipped
from robot_core.errors import NaoGaitError

START = (0.9, 0.1, 0.8)
GOAL = (0.3, 0.6, 0.5)


def bowl(point: Point) -> float:
    return sum((x - g) ** 2 for x, g in zip(point, GOAL, strict=True))


def ask_and_tell(method: Method, trials: int, window: int) -> list[Point]:
    """As the search does: tell in order, at most `window` under way."""
    asked: list[Point] = []
    told = 0
    while told < trials:
        while len(asked) < trials and len(asked) - told < window:
            point = method.ask()
            if point is None:
                break
            asked.append(point)
        method.tell(asked[told], bowl(asked[told]))
        told += 1
    return asked


@pytest.mark.parametrize("window", [1, 3])
@pytest.mark.parametrize("name", METHODS)
def test_a_method_begins_at_the_start_stays_inside_and_repeats_itself(
    name: str, window: int
) -> None:
    first = ask_and_tell(make_method(name, START, seed=3, trials=11), 11, window)
    again = ask_and_tell(make_method(name, START, seed=3, trials=11), 11, window)
    other = ask_and_tell(make_method(name, START, seed=4, trials=11), 4, window)
    assert first[0] == pytest.approx(START)
    assert first == again
    assert first[:4] != other
    assert all(0.0 <= x <= 1.0 for point in first for x in point)
    assert len(set(first)) == 11  # points under way are not asked for again


@pytest.mark.parametrize(("name", "trials"), [("surrogate", 20), ("pso", 200), ("cma", 150)])
def test_a_method_finds_the_bottom_of_a_bowl(name: str, trials: int) -> None:
    asked = ask_and_tell(make_method(name, START, seed=0, trials=trials), trials, 2)
    assert min(map(bowl, asked)) < 0.05 * bowl(START)


def test_an_unknown_method_and_a_bad_seed_are_refused() -> None:
    with pytest.raises(NaoGaitError, match="surrogate, pso, cma"):
        make_method("annealing", START, seed=0, trials=5)
    with pytest.raises(NaoGaitError, match="seed"):
        make_method("cma", START, seed=-1, trials=5)


def test_scores_of_falls_are_clipped_for_the_surrogate() -> None:
    assert clipped([3.0, 2.0, -9.0, 2.5, 1.8]) == [3.0, 2.0, 1.0, 2.5, 1.8]
    assert clipped([1.0]) == [1.0]
