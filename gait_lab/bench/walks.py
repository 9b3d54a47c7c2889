"""Walks of tasks on the same robots, their metrics, and how early falls are detected.

A result counts only if every robot stayed upright and really walked (`Metrics.walks`), and was
calibrated where it should be; otherwise its headline values are null.
"""

import math
import statistics
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice
from typing import NamedTuple

from gait_lab.bench.options import Options
from gait_lab.bench.published import PAPER_COM_ERROR, PAPER_SPEED
from gait_lab.bench.rows import Row, rows_of
from nao_lipm_gait.parameters import GaitParameters, load_preset
from robot_core.errors import NaoGaitError
from robot_core.robot import RobotDescription
from sim_bridge.plant import PlantOption, option_text
from sim_bridge.trials.metrics import FLIGHT_LIMIT, SLIP_LIMIT, Metrics
from sim_bridge.trials.rollout import RolloutResult, RolloutSpec, run_all
from sim_bridge.trials.tasks import AXES, Task, find_task
from sim_bridge.trials.trial import Walker

RULES = (
    f"A speed counts only without a fall, flight over {FLIGHT_LIMIT:.0%}, slip over "
    f"{SLIP_LIMIT * 100:g} cm/s, contact of the legs, or a failed calibration."
)
"""Note below tables of speeds."""


@dataclass(frozen=True, slots=True)
class Variant:
    """What differs from the options of the bench.

    Attributes:
        preset: Preset of the gait instead of the given parameters.
        urdf_effort: See `RolloutSpec`.
        gains: See `RolloutSpec`.
        walker: See `RolloutSpec`.
    """

    preset: str | None = None
    parameters: Mapping[str, float | bool | str] = field(default_factory=dict)
    plant: tuple[PlantOption, ...] = ()
    urdf_effort: bool = False
    gains: tuple[tuple[str, float, float], ...] = ()
    walker: Callable[[RobotDescription, Task, float], Walker] | None = None

    def of(self, base: GaitParameters) -> GaitParameters:
        """The parameters of the gait, changed."""
        base = base if self.preset is None else load_preset(self.preset)
        return base.replace(**self.parameters)

    def spec(self, options: Options, closed: bool, task: Task, seed: int) -> RolloutSpec:
        """A rollout on the robots, plant and engine of the options."""
        changed = self.of(options.parameters)
        return RolloutSpec(
            task=task, robot_seed=seed,
            parameters=changed.replace(feedback=changed.feedback and closed),
            plant=options.plant, plant_options=(*options.plant_options, *self.plant),
            urdf=options.urdf, engine=options.engine, calibrated=options.calibrated,
            urdf_effort=self.urdf_effort, gains=self.gains, walker=self.walker,
        )  # fmt: skip

    def plant_title(self, options: Options) -> str | None:
        """The plant with what differs; None if nothing does."""
        if not self.plant and not self.urdf_effort:
            return None
        motors = ("motors at the URDF's effort",) if self.urdf_effort else ()
        return " ".join((options.plant_title, *map(option_text, self.plant), *motors))


@dataclass(frozen=True, slots=True)
class Score:
    """One task on all robots, in the units of the tables."""

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
    def metrics(self) -> list[Metrics]:
        """Of each robot."""
        return [result.metrics for result in self.results]

    @property
    def upright(self) -> list[Metrics]:
        """Of the robots that did not fall."""
        return [each for each in self.metrics if not each.fell]

    @property
    def asked(self) -> float:
        """The commanded speed in `unit`; NaN for a task without a speed."""
        return abs(self.task.asked) * AXES[self.task.axis][1] if self.task.axis else math.nan

    @property
    def speeds(self) -> list[float]:
        """Speed in the commanded direction of each robot that stayed upright."""
        axis = self.task.axis
        if axis is None:
            return []
        sign = math.copysign(AXES[axis][1], self.task.asked)
        attribute = {"x": "speed_x", "y": "speed_y", "yaw": "turn_rate"}[axis]
        return [sign * getattr(each, attribute) for each in self.upright]

    @property
    def faults(self) -> tuple[str, ...]:
        """Why this does not count; empty if it does."""
        return tuple(dict.fromkeys(fault for each in self.results for fault in each.faults))

    def over(
        self, pick: Callable[[Iterable[float]], float], attribute: str, factor: float = 1.0
    ) -> float:
        """`pick` (max, mean) of the magnitude of an attribute of `Metrics`; NaN if none is finite.

        Args:
            pick: The statistic over the robots.
            attribute: Attribute of `Metrics`.
            factor: From SI to the unit of the table.
        """
        values = [abs(getattr(each, attribute)) * factor for each in self.metrics]
        finite = [value for value in values if math.isfinite(value)]
        return pick(finite) if finite else math.nan

    def rows(self, *metrics: str, subject: str = "", published: bool = False) -> list[Row]:
        """Rows of these `METRICS` as far as they apply; beside published values if asked."""
        subject = "_".join(filter(None, (subject, self.name)))
        rows = []
        for name in metrics:
            each = METRICS[name]
            if (each.needs_speed and not self.task.axis) or self.task.axis == each.not_along:
                continue
            paper = each.published.get(self.task.name) if published else None
            unit = self.unit if each.unit == "speed" else each.unit
            value = each.of(self) if each.counts or not self.faults else None
            rows.append(Row(subject, each.quantity or name, unit, value, paper))
        return rows


class Metric(NamedTuple):
    """A quantity of a `Score`.

    Attributes:
        unit: `speed` for the unit of the task's speed.
        of: Its value; None or NaN without one.
        counts: The value stands also where the result does not count.
        needs_speed: Only for a task with a commanded speed.
        not_along: Not for tasks of this axis.
    """

    unit: str
    of: Callable[[Score], float | None]
    counts: bool = True
    needs_speed: bool = False
    published: Mapping[str, float] = {}
    quantity: str = ""
    not_along: str = ""


def median(values: Iterable[float]) -> float | None:
    """None without values."""
    found = list(values)
    return float(statistics.median(found)) if found else None


def standard_error(values: Sequence[float]) -> float:
    """Of the mean; 0 for a single value."""
    return statistics.stdev(values) / math.sqrt(len(values)) if len(values) > 1 else 0.0


def root_mean_square(values: Iterable[float]) -> float:
    """Of one value or more."""
    return math.sqrt(statistics.fmean(value * value for value in values))


def percent(values: Iterable[float]) -> float | None:
    """The share of values that are true, or the mean of shares [%]; None without values."""
    found = list(values)
    return 100.0 * sum(found) / len(found) if found else None


def worst(values: Iterable[float]) -> float | None:
    """The largest one; None without values."""
    return max(values, default=None)


def _lowest(score: Score) -> float | None:
    return min(score.speeds, default=None)


def _farthest(score: Score) -> float | None:
    """The speed farthest from the commanded one: running away is not walking fast."""
    return max(score.speeds, key=lambda speed: abs(speed - score.asked), default=None)


def deviations(score: Score) -> list[float]:
    """|achieved - commanded| [%] of the commanded speed, of each robot that stayed upright."""
    return [100.0 * abs(achieved / (score.asked or math.nan) - 1.0) for achieved in score.speeds]


def _off(score: Score) -> float | None:
    """Largest difference to the commanded velocity over ground [cm/s]."""
    asked = score.task.command
    off = [math.hypot(each.speed_x - asked.x, each.speed_y - asked.y) for each in score.upright]
    return None if not off else 100.0 * max(off)


def _yaw_off(score: Score) -> float | None:
    """Largest difference to the commanded turn rate [deg/s]."""
    off = worst(abs(each.turn_rate - score.task.command.yaw) for each in score.upright)
    return None if off is None else math.degrees(off)


def _of_speed(of: Callable[[Score], float | None], quantity: str = "") -> dict[str, Metric]:
    """As it counts, and of the robots that stayed upright."""
    more = f"{quantity}_of_upright" if quantity else ""
    return {
        "": Metric("speed", of, False, True, PAPER_SPEED, quantity),
        "_of_upright": Metric("speed", of, True, True, PAPER_SPEED, more),
    }


def _largest(unit: str, attribute: str, factor: float = 1.0) -> Metric:
    return Metric(unit, lambda score: score.over(max, attribute, factor))


def _errors(axis: str, kind: str) -> dict[str, Metric]:
    attribute, published = f"com_error_{axis}{kind}", PAPER_COM_ERROR if axis == "y" else {}
    return {
        f"com_{axis}_error{kind}_{name}": Metric(
            "mm", lambda score, pick=pick: score.over(pick, attribute, 1000.0),  # type: ignore[misc]
            published=published,
        )
        for name, pick in (("mean", statistics.fmean), ("worst", max))
    }  # fmt: skip


def _middle(score: Score) -> float | None:
    return median(score.speeds)


METRICS: Mapping[str, Metric] = {
    "upright": Metric("robots", lambda score: len(score.upright)),
    "upright_share": Metric(
        "%", lambda score: 100.0 * len(score.upright) / len(score.results)
    ),
    "counts": Metric("bool", lambda score: float(not score.faults)),
    **{f"worst{name}": each for name, each in _of_speed(_lowest).items()},
    **{f"median{name}": each for name, each in _of_speed(_middle).items()},
    **{f"farthest{name}": each for name, each in _of_speed(_farthest, "worst").items()},
    "speed_worst": Metric("speed", _lowest, False, True),
    "speed_median": Metric("speed", _middle, False, True),
    "speed_error": Metric(
        "speed", lambda score: None if not score.speeds else
        statistics.fmean(abs(speed - score.asked) for speed in score.speeds), True, True,
    ),
    "error_worst": Metric("%", lambda score: worst(deviations(score)), False),
    "error_median": Metric("%", lambda score: median(deviations(score)), False),
    "yaw_drift_worst": _largest("deg/s", "turn_rate", math.degrees(1.0))._replace(not_along="yaw"),
    "flight_worst": _largest("%", "flight_share", 100.0),
    "slip_worst": _largest("cm/s", "slip_speed", 100.0),
    "contact_ticks_worst": _largest("ticks", "contact_ticks"),
    "saturated_worst": _largest("%", "saturated_share", 100.0),
    "off_worst": Metric("cm/s", _off),
    "yaw_off_worst": Metric("deg/s", _yaw_off),
    "drift_worst": Metric(
        "cm/s", lambda score: max(100.0 * math.hypot(each.speed_x, each.speed_y)
                                  for each in score.metrics),
    ),
    **_errors("y", ""), **_errors("y", "_measured"),
    **_errors("x", ""), **_errors("x", "_measured"),
}  # fmt: skip
"""What a suite of walks can report, by name."""


def tasks_of(options: Options, labelled: bool = False) -> list[Task]:
    """The tasks of the options over their window, each at most once.

    Args:
        options: Tasks and window.
        labelled: The speed is part of the name: `forward_20`.
    """
    tasks = [find_task(text).lasting(options.window) for text in options.tasks]
    if labelled:
        tasks = [replace(task, name=text.replace("=", "_"))
                 for task, text in zip(tasks, options.tasks, strict=True)]  # fmt: skip
    names = [task.name for task in tasks]
    if len(set(names)) < len(names):
        raise NaoGaitError("task", ", ".join(names), "each task at most once")
    return tasks


def walk_all(
    options: Options, tasks: Sequence[Task], variants: Sequence[Variant] = (Variant(),)
) -> list[list[Score]]:
    """Walk every task in every loop with every variant, on the same robots.

    Returns:
        For each variant the scores of all tasks and loops.
    """
    kinds = [(task, loop) for task in tasks for loop in options.loops]
    specs = [
        replace(variant.spec(options, loop, task, seed), control_period=options.control_period)
        for variant in variants for task, loop in kinds for seed in options.seeds
    ]  # fmt: skip
    results = iter(run_all(specs, jobs=options.jobs, show=options.show, resume=options.resume))
    return [
        [Score(task, loop, tuple(islice(results, options.robots))) for task, loop in kinds]
        for _ in variants
    ]


@dataclass(slots=True)
class FallDetection:
    """How early the gait detects a fall, over many rollouts.

    Attributes:
        leads: [s] from the detection to the fall, one per fall; 0 for a fall not detected before.
        false_alarms: Rollouts in which a fall was detected and the robot stayed upright.
    """

    leads: list[float] = field(default_factory=list)
    false_alarms: int = 0

    def add(self, *rollouts: Metrics) -> "FallDetection":
        """Count rollouts."""
        for each in rollouts:
            self.count(each.fall_lead, each.false_alarm)
        return self

    def count(self, lead: float | None, false_alarm: bool) -> None:
        """Count a rollout; `lead` [s] is None without a fall."""
        self.leads += [] if lead is None else [lead]
        self.false_alarms += false_alarm

    def rows(self, subject: str) -> list[Row]:
        """Its measurements."""
        return rows_of(
            subject,
            ("falls", "rollouts", len(self.leads)),
            ("falls_foreseen", "rollouts", sum(lead > 0.0 for lead in self.leads)),
            ("fall_lead_median", "s", median(self.leads)),
            ("false_alarms", "rollouts", self.false_alarms),
        )


def loop_detection(scores: Iterable[Score]) -> list[Row]:
    """Fall detection in closed and in open loop over all rollouts of some scores."""
    found: dict[str, FallDetection] = {}
    for score in scores:
        name = "closed" if score.closed_loop else "open_loop"
        found.setdefault(name, FallDetection()).add(*score.metrics)
    return [row for name, each in found.items() for row in each.rows(name)]
