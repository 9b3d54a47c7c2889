"""One trial of a study: all its robots walk at one point, and the result gets a score."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

from gait_lab.tune.methods import Point
from gait_lab.tune.protocols import PROTOCOLS, Measures
from gait_lab.tune.study import Place, Study
from nao_lipm_gait.calibration import Calibration
from nao_lipm_gait.parameters import GaitParameters
from robot_core.errors import NaoGaitError
from sim_bridge.trials.calibration import calibrate
from sim_bridge.trials.trial import TrialSpec


@dataclass(frozen=True, slots=True)
class Trial:
    """Result of a point.

    Attributes:
        number: Number of the trial in its study.
        point: The point, as shares of the ranges.
        score: Mean score of the robots; larger is better.
        measures: Measures of each robot.
        seconds: Wall time of the walks [s].
        error: Why the trial failed; it then scores as a robot that fell at once.
    """

    number: int
    point: Point
    score: float
    measures: tuple[Measures, ...]
    seconds: float
    error: str | None = None

    @property
    def falls(self) -> int:
        """Number of robots that fell."""
        return sum(m.fell for m in self.measures)


def evaluate(study: Study, number: int, point: Point) -> Trial:
    """Run all robots of the study at a point; an exception becomes the `error` of the trial."""
    began = time.perf_counter()
    try:
        measures = walk_all(
            study, study.parameters_at(point), study.robots, Place(study.engine, study.plant)
        )
    except Exception as error:  # the study continues even if a corner of the ranges fails
        reason = f"{type(error).__name__}: {error}"
        return failed(study, number, point, reason, time.perf_counter() - began)
    score = score_of(study, measures)
    return Trial(number, point, score, measures, time.perf_counter() - began)


def failed(study: Study, number: int, point: Point, reason: str, seconds: float = 0.0) -> Trial:
    """Return a failed trial.

    Args:
        study: The study.
        number: Number of the trial.
        point: Its point.
        reason: Why it failed.
        seconds: Wall time of the walks [s].
    """
    return Trial(number, point, -study.penalty.fall, (), seconds, reason)


def walk_all(
    study: Study,
    parameters: GaitParameters,
    robots: Sequence[int],
    place: Place,
    confirm: bool = False,
) -> tuple[Measures, ...]:
    """Run the study's protocol on each robot.

    Args:
        study: The study.
        parameters: Parameters of the gait.
        robots: Seeds of the robots.
        place: Engine and plant.
        confirm: Whether to use the options of the confirmation.

    Returns:
        The measures of each robot.
    """
    protocol = PROTOCOLS[study.protocol]
    options = study.confirm_options if confirm else study.options
    specs = (
        TrialSpec(
            robot_seed=seed,
            parameters=parameters,
            engine=place.engine,
            plant=place.plant,
            urdf=study.urdf,
        )
        for seed in robots
    )
    if study.calibrated:
        specs = (replace(spec, calibration=calibration_of(spec)) for spec in specs)
    return tuple(protocol.run(spec, options) for spec in specs)


def calibration_of(spec: TrialSpec) -> Calibration:
    """The calibration of a robot; NaoGaitError if it fails."""
    calibration = calibrate(spec)
    if calibration is None:
        allowed = f"a robot that can be calibrated in {spec.engine}/{spec.plant}"
        raise NaoGaitError("study.robots", spec.robot_seed, allowed)
    return calibration


def score_of(study: Study, measures: Sequence[Measures]) -> float:
    """Return the mean score of the robots."""
    return sum(robot_score(study, each) for each in measures) / len(measures)


def robot_score(study: Study, measures: Measures) -> float:
    """Return the weighted sum of one robot's measures minus the penalties."""
    score = sum(weight * measures.values[name] for name, weight in study.objective.items())
    if measures.fell:
        score -= study.penalty.fall
    return score - study.penalty.dishonest * measures.excess
