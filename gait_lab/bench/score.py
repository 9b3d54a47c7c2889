"""One task on all robots, scored; the rollouts that give it; and how early falls are detected.

A result counts only if every robot stayed upright and really walked (`Metrics.walks`), and was
calibrated where it should be. A row that does not count is marked with the reason, and its headline
values are null in the JSON.
"""

import math
import statistics
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice

from gait_lab.bench.options import BenchOptions
from gait_lab.bench.result import Measurement, loop_name
from nao_lipm_gait.parameters import GaitParameters
from robot_core.errors import NaoGaitError
from robot_core.robot import RobotDescription
from sim_bridge.plant import PlantOption, option_text
from sim_bridge.trials.metrics import FLIGHT_LIMIT, SLIP_LIMIT, Metrics
from sim_bridge.trials.rollout import RolloutResult, RolloutSpec, run_all
from sim_bridge.trials.tasks import AXES, Task, find_task
from sim_bridge.trials.trial import Walker

RULES = (
    f"x: does not count, because of a fall, flight over {FLIGHT_LIMIT:.0%}, slip over "
    f"{SLIP_LIMIT * 100:g} cm/s, contact of the legs, or a failed calibration."
)
"""Note below a table whose rows have a `Score.mark`."""
Pick = Callable[[Iterable[float]], float]
"""max, mean, ..."""


@dataclass(frozen=True, slots=True)
class Score:
    """One task on all robots, in the units of the tables.

    Attributes:
        task: The task.
        closed_loop: Whether the gait had its feedback.
        results: One per robot.
    """

    task: Task
    closed_loop: bool
    results: tuple[RolloutResult, ...]

    @property
    def name(self) -> str:
        """The task and the loop, as they begin the name of a metric."""
        return self.task.name if self.closed_loop else f"{self.task.name}_open_loop"

    @property
    def unit(self) -> str:
        """Of the speeds; empty for a task without a speed."""
        return AXES[self.task.axis][0] if self.task.axis else ""

    @property
    def upright(self) -> int:
        """Number of robots that did not fall."""
        return sum(not result.metrics.fell for result in self.results)

    @property
    def fallen(self) -> int:
        """Number of robots that fell."""
        return len(self.results) - self.upright

    @property
    def upright_text(self) -> str:
        """The cell of a table: 7/8."""
        return f"{self.upright}/{len(self.results)}"

    @property
    def asked(self) -> float | None:
        """The commanded speed in `unit`; None for a task without a speed."""
        return abs(self.task.asked) * AXES[self.task.axis][1] if self.task.axis else None

    @property
    def asked_cell(self) -> float | str:
        """The commanded speed as a cell, empty for a task without a speed."""
        return "" if self.asked is None else self.asked

    @property
    def speeds(self) -> list[float]:
        """Speed in the commanded direction of each robot that stayed upright."""
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
        """Lowest speed; None where no robot stayed upright."""
        return float(min(self.speeds)) if self.speeds else None

    @property
    def median(self) -> float | None:
        """Median of the speeds; None where no robot stayed upright."""
        return float(statistics.median(self.speeds)) if self.speeds else None

    @property
    def speed_error(self) -> float | None:
        """Mean |speed - commanded speed| of the robots that stayed upright; None for none."""
        if self.asked is None or not self.speeds:
            return None
        return statistics.fmean(abs(speed - self.asked) for speed in self.speeds)

    def speed_rows(self, name: str) -> list[Measurement]:
        """The worst and the median speed, null where they do not count."""
        counts = not self.faults
        return [
            Measurement(f"{name}_worst", self.unit, self.worst if counts else None),
            Measurement(f"{name}_median", self.unit, self.median if counts else None),
        ]

    @property
    def faults(self) -> tuple[str, ...]:
        """Why this does not count; empty if it does."""
        found: dict[str, None] = {}
        for result in self.results:
            found.update(dict.fromkeys(result.faults))
        return tuple(found)

    @property
    def mark(self) -> str:
        """The cell that says why the row does not count; empty if it does."""
        return f"x {', '.join(self.faults)}" if self.faults else ""

    @property
    def short_mark(self) -> str:
        """`x` if a robot fell, `!` if this does not count for another reason, else empty."""
        return "x" if self.fallen else "!" if self.faults else ""

    def over(self, pick: Pick, attribute: str, factor: float = 1.0) -> float:
        """A statistic of the magnitude of a metric over the robots.

        Args:
            pick: `max`, `mean`, ...
            attribute: Attribute of `Metrics`.
            factor: Factor from SI to the unit of the table.

        Returns:
            NaN if no robot has a finite value.
        """
        values = [abs(getattr(result.metrics, attribute)) * factor for result in self.results]
        finite = [value for value in values if math.isfinite(value)]
        return pick(finite) if finite else math.nan

    def worst_of(self, attribute: str, factor: float = 1.0) -> float:
        """Largest magnitude of a metric over the robots; see `over`."""
        return self.over(max, attribute, factor)

    def mean_of(self, attribute: str, factor: float = 1.0) -> float:
        """Mean magnitude of a metric over the robots; see `over`."""
        return self.over(statistics.fmean, attribute, factor)


def _parameters(options: BenchOptions, variant: "Variant", closed: bool) -> GaitParameters:
    changed = options.parameters.replace(**variant.parameters)
    return changed.replace(feedback=changed.feedback and closed)


@dataclass(frozen=True, slots=True)
class Variant:
    """What differs from the options of the bench.

    Attributes:
        plant: Replaced options of the plant.
        parameters: Replaced parameters of the gait.
        urdf_effort: See `RolloutSpec`.
        walker: See `RolloutSpec`.
    """

    plant: tuple[PlantOption, ...] = ()
    parameters: Mapping[str, float | bool | str] = field(default_factory=dict)
    urdf_effort: bool = False
    walker: Callable[[RobotDescription, Task, float], Walker] | None = None

    def plant_title(self, options: BenchOptions) -> str:
        """The plant of the options with what differs."""
        motors = ("motors at the URDF's effort",) if self.urdf_effort else ()
        return " ".join((options.plant_title, *(option_text(each) for each in self.plant), *motors))


def labelled(text: str) -> Task:
    """The task of `name=speed`, with the speed in its name: `forward_20`."""
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
    """Walk every task in every loop with every variant, on the same robots.

    Args:
        options: Robots, engine, plant, parameters.
        variants: What differs.
        tasks: Instead of those of the options.
        label: Label of the progress bar.

    Returns:
        For each variant the scores of all tasks and loops.
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
            calibrated=options.calibrated,
            urdf_effort=variant.urdf_effort,
            walker=variant.walker,
            control_period=options.control_period,
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


@dataclass(slots=True)
class FallDetection:
    """How early the gait detects a fall, over many rollouts.

    Attributes:
        rollouts: Number of rollouts.
        leads: [s] from the detection to the fall, one per fall; 0 for a fall not detected before.
        false_alarms: Rollouts in which a fall was detected and the robot stayed upright.
    """

    rollouts: int = 0
    leads: list[float] = field(default_factory=list)
    false_alarms: int = 0

    def add(self, metrics: Metrics) -> None:
        """Count a rollout."""
        self.count(metrics.fall_lead, metrics.false_alarm)

    def count(self, lead: float | None, false_alarm: bool) -> None:
        """Count a rollout; `lead` [s] is None without a fall."""
        self.rollouts += 1
        if lead is not None:
            self.leads.append(lead)
        self.false_alarms += false_alarm

    @property
    def falls(self) -> int:
        """Number of falls."""
        return len(self.leads)

    @property
    def foreseen(self) -> int:
        """Falls that were detected before they happened."""
        return sum(lead > 0.0 for lead in self.leads)

    @property
    def lead_median(self) -> float | None:
        """[s]; None without a fall."""
        return float(statistics.median(self.leads)) if self.leads else None

    def rows(self, prefix: str) -> list[Measurement]:
        """Its measurements, named `PREFIX_falls` and so on."""
        return [
            Measurement(f"{prefix}_falls", "rollouts", self.falls),
            Measurement(f"{prefix}_falls_foreseen", "rollouts", self.foreseen),
            Measurement(f"{prefix}_fall_lead_median", "s", self.lead_median),
            Measurement(f"{prefix}_false_alarms", "rollouts", self.false_alarms),
        ]

    def note(self, name: str) -> str:
        """A sentence for the notes of a table."""
        lead = self.lead_median
        early = "" if lead is None else (
            f", {self.foreseen} detected before, median lead {1000.0 * lead:.0f} ms"
        )  # fmt: skip
        return (
            f"Fall detection, {name}: {self.falls} falls in {self.rollouts} rollouts{early}; "
            f"{self.false_alarms} false alarms."
        )


class LoopDetection(dict[bool, FallDetection]):
    """Fall detection in closed (true) and open (false) loop over all rollouts of some scores."""

    def __init__(self, scores: Iterable[Score]) -> None:
        super().__init__()
        for score in scores:
            for result in score.results:
                self.setdefault(score.closed_loop, FallDetection()).add(result.metrics)

    @property
    def rows(self) -> list[Measurement]:
        """Measurements `closed_falls`, `open_loop_falls`, ..."""
        return [
            row for closed, detection in self.items()
            for row in detection.rows("closed" if closed else "open_loop")
        ]  # fmt: skip

    @property
    def notes(self) -> tuple[str, ...]:
        """A sentence for each loop."""
        return tuple(each.note(loop_name(closed)) for closed, each in self.items())
