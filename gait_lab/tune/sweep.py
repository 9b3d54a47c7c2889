"""One parameter at a time: what it does to a walk, for the figures of the tuning guide."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from gait_lab.analysis.trace import LEFT, RIGHT, Trace
from gait_lab.trials.parallel import parallel_map
from gait_lab.trials.rollout import RolloutSpec, rollout
from gait_lab.trials.tasks import walk as walk_task
from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.parameters import BY_NAME, GaitParameters


@dataclass(frozen=True, slots=True)
class Sweep:
    """A parameter and the values [SI] that it is tried at."""

    name: str
    values: tuple[float, ...]

    def __post_init__(self) -> None:
        if self.name not in BY_NAME:
            raise NaoGaitError("parameter", self.name, f"one of {', '.join(BY_NAME)}")
        for value in self.values:
            BY_NAME[self.name].check(value)


@dataclass(frozen=True, slots=True)
class Sample:
    """One robot at one value; NaN where nothing was measured."""

    value: float
    robot: int
    fell: bool
    honest: bool
    speed: float
    """[m/s]."""
    error: float
    """Mean |expected - true| CoM along y [m]."""
    step_duration: float
    """[s]."""


@dataclass(frozen=True, slots=True)
class Walked:
    """What all samples share."""

    base: GaitParameters
    speed: float
    """Asked [m/s]."""
    robots: tuple[int, ...]
    engine: str = "mujoco"
    plant: str = "reference"
    window: float = 6.0
    """[s] measured."""


def run_sweep(sweep: Sweep, walked: Walked, jobs: int | None, show: bool = True) -> list[Sample]:
    """Every value on every robot, in this order."""
    calls = [(sweep.name, v, robot, walked) for v in sweep.values for robot in walked.robots]
    found: list[Sample] = parallel_map(_sample, calls, jobs=jobs, label=sweep.name, show=show)
    return found


def _sample(call: tuple[str, float, int, Walked]) -> Sample:
    name, value, robot, walked = call
    task = walk_task("forward", x=walked.speed, axis="x", window=walked.window)
    spec = RolloutSpec(
        task,
        robot_seed=robot,
        parameters=walked.base.replace(**{name: value}),
        plant=walked.plant,
        engine=walked.engine,
        keep_trace=True,
    )
    result = rollout(spec)
    metrics = result.metrics
    duration = float("nan")
    if result.trace is not None and not metrics.fell:
        duration = step_duration(result.trace.between(task.start, task.end))
    return Sample(
        value, robot, metrics.fell, metrics.walks, metrics.speed_x, metrics.com_error_y, duration
    )


def step_duration(trace: Trace) -> float:
    """Mean time [s] from one support change to the next; NaN with fewer than two changes."""
    single = np.isin(trace.support, (LEFT, RIGHT))
    support, time = trace.support[single], trace.time[single]
    changes = time[1:][np.diff(support) != 0]
    return float(np.diff(changes).mean()) if len(changes) > 1 else float("nan")


Values = Callable[[Sample], float]


def column(samples: Sequence[Sample], robot: int, value: Values) -> tuple[list[float], list[float]]:
    """X and y of a line: one robot's upright samples."""
    kept = [s for s in samples if s.robot == robot and not s.fell]
    return [s.value for s in kept], [value(s) for s in kept]
