"""One task on all robots, scored; and the walks that give it.

A result counts only if every robot stayed upright and really walked (`Metrics.walks`); a row that
does not count is marked with the reason and its headline values are null in the JSON.
"""

import math
import statistics
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice

from gait_lab.analysis.metrics import FLIGHT_LIMIT, SLIP_LIMIT
from gait_lab.bench.options import BenchOptions
from gait_lab.bench.report import Row, number
from gait_lab.trials.rollout import RolloutResult, RolloutSpec, run_all
from gait_lab.trials.tasks import AXES, Task, find_task
from gait_lab.trials.trial import Walker
from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.robot import RobotDescription
from sim_bridge.plant import PlantOption, option_text

RULES = (
    f"x = does not count: a fall, flight over {FLIGHT_LIMIT:.0%}, slip over "
    f"{SLIP_LIMIT * 100:g} cm/s, or leg against leg."
)
"""What stands under a table whose rows have a `Score.mark`."""
Pick = Callable[[Iterable[float]], float]
"""max, mean, ..."""


@dataclass(frozen=True, slots=True)
class Score:
    """One task on all robots, in the units of the tables."""

    task: Task
    closed_loop: bool
    results: tuple[RolloutResult, ...]

    @property
    def name(self) -> str:
        return self.task.name if self.closed_loop else f"{self.task.name}_open_loop"

    @property
    def unit(self) -> str:
        return AXES[self.task.axis][0] if self.task.axis else ""

    @property
    def upright(self) -> int:
        return sum(not result.metrics.fell for result in self.results)

    @property
    def all_upright(self) -> bool:
        return self.upright == len(self.results)

    @property
    def upright_text(self) -> str:
        return f"{self.upright}/{len(self.results)}"

    @property
    def speeds(self) -> list[float]:
        """Speed in the asked direction of each robot that stayed upright."""
        axis = self.task.axis
        if axis is None:
            return []
        sign = math.copysign(AXES[axis][1], self.task.asked)
        attribute = {"x": "speed_x", "y": "speed_y", "yaw": "turn_rate"}[axis]
        return [
            sign * getattr(result.metrics, attribute)
            for result in self.results
            if not result.metrics.fell
        ]

    @property
    def worst(self) -> float | None:
        """Of the speeds; None where no robot stayed upright."""
        return float(min(self.speeds)) if self.speeds else None

    @property
    def median(self) -> float | None:
        """Of the speeds; None where no robot stayed upright."""
        return float(statistics.median(self.speeds)) if self.speeds else None

    def speed_rows(self, suite: str, name: str, counts: bool) -> list[Row]:
        """The worst and the median speed, null where they do not count."""
        return [
            Row(suite, f"{name}_worst", self.unit, self.worst if counts else None),
            Row(suite, f"{name}_median", self.unit, self.median if counts else None),
        ]

    @property
    def asked_text(self) -> str:
        """The asked speed as a cell of a table."""
        axis = self.task.axis
        return number(abs(self.task.asked) * AXES[axis][1]) if axis else ""

    @property
    def faults(self) -> tuple[str, ...]:
        """Why this does not count; empty if it does."""
        found: dict[str, None] = {}
        for result in self.results:
            found.update(dict.fromkeys(result.metrics.faults))
        return tuple(found)

    @property
    def mark(self) -> str:
        """The cell of a table that says why the row does not count; empty if it does."""
        return f"x {', '.join(self.faults)}" if self.faults else ""

    def over(self, pick: Pick, attribute: str, factor: float = 1.0) -> float:
        """`pick` (max, mean, ...) over the robots of a metric's magnitude; NaN if none has it."""
        values = [abs(getattr(result.metrics, attribute)) * factor for result in self.results]
        finite = [value for value in values if math.isfinite(value)]
        return pick(finite) if finite else math.nan


def _parameters(options: BenchOptions, variant: "Variant", closed: bool) -> GaitParameters:
    changed = options.parameters.replace(**variant.parameters)
    return changed.replace(feedback=changed.feedback and closed)


@dataclass(frozen=True, slots=True)
class Variant:
    """What is different from the options of the bench."""

    plant: tuple[PlantOption, ...] = ()
    """Options of the plant that are replaced."""
    parameters: Mapping[str, float | bool | str] = field(default_factory=dict)
    """Parameters of the gait that are replaced."""
    urdf_effort: bool = False
    """See `RolloutSpec`."""
    walker: Callable[[RobotDescription, Task, float], Walker] | None = None
    """See `RolloutSpec`."""

    def plant_title(self, options: BenchOptions) -> str:
        """The plant of the options with what is different."""
        motors = ("motors at the URDF's effort",) if self.urdf_effort else ()
        return " ".join((options.plant_title, *(option_text(each) for each in self.plant), *motors))


def labelled(text: str) -> Task:
    """The task of `name=speed` with a name that tells it from other speeds: `forward_20`."""
    return replace(find_task(text), name=text.replace("=", "_"))


def labelled_tasks(options: BenchOptions) -> list[Task]:
    """The labelled tasks of the options over their window, each at most once."""
    return _once([labelled(text).lasting(options.window) for text in options.tasks])


def tasks_of(options: BenchOptions) -> list[Task]:
    """The tasks of the options over their window, each at most once."""
    return _once([find_task(text).lasting(options.window) for text in options.tasks])


def _once(tasks: list[Task]) -> list[Task]:
    names = [task.name for task in tasks]
    if len(set(names)) < len(names):
        raise NaoGaitError("task", ", ".join(names), "each task at most once")
    return tasks


def walk_all(
    options: BenchOptions,
    variants: Sequence[Variant] = (Variant(),),
    tasks: Sequence[Task] | None = None,
    *,
    label: str = "rollouts",
) -> list[list[Score]]:
    """For each variant, the scores of every task and loop on the same robots.

    `tasks`: instead of those of the options.
    """
    tasks = tasks_of(options) if tasks is None else tasks
    kinds = [(task, loop) for task in tasks for loop in options.loops]
    specs = [
        RolloutSpec(
            task=task,
            robot_seed=seed,
            parameters=_parameters(options, variant, loop),
            plant=options.plant,
            plant_options=(*options.plant_options, *variant.plant),
            urdf=options.urdf,
            engine=options.engine,
            urdf_effort=variant.urdf_effort,
            walker=variant.walker,
        )
        for variant in variants
        for task, loop in kinds
        for seed in options.seeds
    ]
    results = iter(run_all(specs, jobs=options.jobs, show=options.show, label=label))
    return [
        [Score(task, loop, tuple(islice(results, options.robots))) for task, loop in kinds]
        for _ in variants
    ]
