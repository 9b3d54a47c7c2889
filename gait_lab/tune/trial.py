"""One trial: a point of the study walked by all its robots, and the score of that."""

import time
from collections.abc import Sequence
from dataclasses import dataclass

from gait_lab.tune.measures import Measures
from gait_lab.tune.methods import Point
from gait_lab.tune.protocols import PROTOCOLS
from gait_lab.tune.study import Place, Study
from gait_lab.tune.walker import Setting
from nao_lipm_gait.parameters import GaitParameters


@dataclass(frozen=True, slots=True)
class Trial:
    """What came out of a point; larger scores are better."""

    number: int
    point: Point
    score: float
    measures: tuple[Measures, ...]
    seconds: float
    """Wall time of the walks."""
    error: str | None = None
    """Why it failed; a failed trial scores as a robot that fell where it stood."""

    @property
    def falls(self) -> int:
        return sum(m.fell for m in self.measures)


def evaluate(study: Study, number: int, point: Point) -> Trial:
    """Let all robots of the study walk at a point. Never raises: what goes wrong is in `error`."""
    began = time.perf_counter()
    try:
        measures = walk_all(
            study, study.parameters_at(point), study.robots, Place(study.engine, study.plant)
        )
    except Exception as error:  # a study goes on whatever a corner of the ranges does
        reason = f"{type(error).__name__}: {error}"
        return failed(study, number, point, reason, time.perf_counter() - began)
    score = score_of(study, measures)
    return Trial(number, point, score, measures, time.perf_counter() - began)


def failed(study: Study, number: int, point: Point, reason: str, seconds: float = 0.0) -> Trial:
    return Trial(number, point, -study.penalty.fall, (), seconds, reason)


def walk_all(
    study: Study,
    parameters: GaitParameters,
    robots: Sequence[int],
    place: Place,
    confirm: bool = False,
) -> tuple[Measures, ...]:
    """The study's protocol on each robot; `confirm`: with the options of the confirmation."""
    protocol = PROTOCOLS[study.protocol]
    options = study.confirm_options if confirm else study.options
    return tuple(
        protocol.run(Setting(parameters, seed, place.engine, place.plant, study.urdf), options)
        for seed in robots
    )


def score_of(study: Study, measures: Sequence[Measures]) -> float:
    """Mean over the robots of the weighted measures, less the penalties."""
    return sum(robot_score(study, each) for each in measures) / len(measures)


def robot_score(study: Study, measures: Measures) -> float:
    """Weighted sum of one robot's measures, less what a fall and dishonest walking cost."""
    score = sum(weight * measures.values[name] for name, weight in study.objective.items())
    if measures.fell:
        score -= study.penalty.fall
    return score - study.penalty.dishonest * measures.excess
