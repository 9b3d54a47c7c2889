"""Start and winner side by side on robots that the search never saw, in several places."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import islice
from statistics import median

from gait_lab.tune.measures import Measures
from gait_lab.tune.protocols import PROTOCOLS
from gait_lab.tune.study import Place, Study
from gait_lab.tune.trial import robot_score, walk_all
from gait_lab.tune.workers import Workers, run_all
from nao_lipm_gait.parameters import GaitParameters


@dataclass(frozen=True, slots=True)
class Comparison:
    """One place: what all unseen robots did before and after."""

    place: Place
    before: tuple[Measures, ...]
    after: tuple[Measures, ...]


@dataclass(frozen=True, slots=True)
class Row:
    """One line of the table: worst and median over the robots."""

    name: str
    unit: str
    before: tuple[float, float]
    after: tuple[float, float]


def compare(
    study: Study,
    winner: GaitParameters,
    workers: Workers,
    note: Callable[[], object] = lambda: None,
) -> list[Comparison]:
    """Let both walk on every unseen robot; in each place of the study."""
    calls = [
        (study, parameters, (seed,), place, True)
        for place in study.confirm_places
        for parameters in (study.start, winner)
        for seed in study.unseen
    ]
    walked = iter(run_all(workers, walk_all, calls, note))

    def robots() -> tuple[Measures, ...]:
        return tuple(each for (each,) in islice(walked, len(study.unseen)))

    return [Comparison(place, robots(), robots()) for place in study.confirm_places]


def rows(study: Study, comparison: Comparison) -> list[Row]:
    """The table of one place: score, falls, honesty, then every measure of the protocol."""
    sides = (comparison.before, comparison.after)

    def spread(
        name: str, unit: str, value: Callable[[Measures], float], worst: Callable[..., float] = min
    ) -> Row:
        columns = [[value(measures) for measures in side] for side in sides]
        first, second = ((worst(column), median(column)) for column in columns)
        return Row(name, unit, first, second)

    def count(name: str, is_so: Callable[[Measures], bool]) -> Row:
        first, second = (float(sum(map(is_so, side))) for side in sides)
        return Row(name, "robots", (first, first), (second, second))

    table = [
        spread("score", "", lambda m: robot_score(study, m)),
        count("fell", lambda m: m.fell),
        count("over the limits", lambda m: m.excess > 0.0),
    ]
    for name, unit in PROTOCOLS[study.protocol].measures.items():
        worst = _largest if _smaller_is_better(study, name) else min
        table.append(spread(name, unit, partial(_value, name), worst))
    return table


def _value(name: str, measures: Measures) -> float:
    return measures.values[name]


def _largest(values: Sequence[float]) -> float:
    return max(values, key=abs)


def _smaller_is_better(study: Study, name: str) -> bool:
    weight = study.objective.get(name)
    return weight < 0.0 if weight is not None else name in ("flight", "slip", "drift")
