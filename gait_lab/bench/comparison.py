"""Several gaits on the same robots: walks at speed and pushes on the spot."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from gait_lab.bench.options import BenchOptions
from gait_lab.bench.pushes import Cell, push_cells
from gait_lab.bench.result import Measurement
from gait_lab.bench.score import FallDetection, Score, Variant, walk_all
from nao_lipm_gait.parameters import GaitParameters
from robot_core.robot import RobotDescription
from sim_bridge.trials.tasks import Task
from sim_bridge.trials.trial import Walker

Pushes = Sequence[tuple[str, float]]
"""Directions and impulses [N s]."""


@dataclass(frozen=True, slots=True)
class Contender:
    """One gait of a comparison.

    Attributes:
        name: Name as in its metrics.
        parameters: Parameters of the gait.
        walker: Makes what walks in place of the gait; None for the gait with these parameters.
    """

    name: str
    parameters: GaitParameters
    walker: Callable[[RobotDescription, Task, float], Walker] | None = None


@dataclass(frozen=True, slots=True)
class Outcome:
    """How the robots walked and withstood pushes with one gait.

    Attributes:
        name: Name of the gait.
        scores: One per task.
        cells: Direction and impulse [N s] -> pushes on the spot.
        detection: Fall detection over walks and pushes.
    """

    name: str
    scores: tuple[Score, ...]
    cells: Mapping[tuple[str, float], Cell]
    detection: FallDetection

    @property
    def push_rows(self) -> list[Measurement]:
        """The measurements of the pushes."""
        return [
            Measurement(f"{self.name}_push_{direction}_{impulse:g}_survival", "%",
                        100.0 * cell.share)
            for (direction, impulse), cell in self.cells.items()
        ]  # fmt: skip

    @property
    def push_cells(self) -> list[str]:
        """The share of survived pushes as cells of a table."""
        return [f"{100.0 * cell.share:.0f} %" for cell in self.cells.values()]


def compare(
    options: BenchOptions, contenders: Sequence[Contender], tasks: Sequence[Task], pushes: Pushes
) -> list[Outcome]:
    """Walk all tasks with every gait in closed loop, then push each on the spot.

    Args:
        options: Robots, phases, engine, plant.
        contenders: The gaits.
        tasks: The walks.
        pushes: Directions and impulses [N s].

    Returns:
        One outcome per gait.
    """
    closed = replace(options, open_loop="off")
    variants = [Variant(parameters=each.parameters.as_dict(), walker=each.walker)
                for each in contenders]  # fmt: skip
    outcomes = []
    for each, scores in zip(contenders, walk_all(closed, variants, tasks), strict=True):
        pushed = push_cells(
            replace(closed, parameters=each.parameters), "spot", pushes,
            label=each.name, walker=each.walker,
        )  # fmt: skip
        for score in scores:
            for result in score.results:
                pushed.detection.add(result.metrics)
        outcomes.append(Outcome(each.name, tuple(scores), pushed.cells, pushed.detection))
    return outcomes
