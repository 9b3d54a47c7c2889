"""One task on all robots, scored; and the walks that give it.

A result counts only if every robot stayed upright and really walked (`Metrics.walks`); a row that
does not count is marked with the reason and its headline values are null in the JSON.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import islice

from gait_lab.bench.options import BenchOptions
from gait_lab.rollout import RolloutResult, RolloutSpec, run_all
from gait_lab.tasks import AXES, Task, find_task
from nao_lipm_gait.errors import NaoGaitError
from sim_bridge.plant import PlantOption

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
    def faults(self) -> tuple[str, ...]:
        """Why this does not count; empty if it does."""
        found: dict[str, None] = {}
        for result in self.results:
            found.update(dict.fromkeys(result.metrics.faults))
        return tuple(found)

    def over(self, pick: Pick, attribute: str, factor: float = 1.0) -> float:
        """`pick` (max, mean, ...) over the robots of a metric's magnitude; NaN if none has it."""
        values = [abs(getattr(result.metrics, attribute)) * factor for result in self.results]
        finite = [value for value in values if math.isfinite(value)]
        return pick(finite) if finite else math.nan


def walk_all(
    options: BenchOptions, changes: Sequence[tuple[PlantOption, ...]] = ((),)
) -> list[list[Score]]:
    """For each change of the plant, the scores of every task and loop on the same robots."""
    tasks = [find_task(name).lasting(options.window) for name in options.tasks]
    if len({task.name for task in tasks}) < len(tasks):
        raise NaoGaitError("task", ", ".join(options.tasks), "each task at most once")
    kinds = [(task, loop) for task in tasks for loop in options.loops]
    specs = [
        RolloutSpec(
            task=task,
            robot_seed=seed,
            parameters=options.loop_parameters(loop),
            plant=options.plant,
            plant_options=(*options.plant_options, *change),
            urdf=options.urdf,
            engine=options.engine,
            hold_heading=options.hold_heading,
        )
        for change in changes
        for task, loop in kinds
        for seed in options.seeds
    ]
    results = iter(run_all(specs, jobs=options.jobs, show=options.show))
    return [
        [Score(task, loop, tuple(islice(results, options.robots))) for task, loop in kinds]
        for _ in changes
    ]
