"""Benchmarks of the gait: the same walk on N robots, closed and open loop in one table.

A result counts only if every robot stayed upright and really walked (`Metrics.walks`); a row that
does not count is marked with the reason and its headline values are null in the JSON.
"""

import math
import re
import statistics
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any

from gait_lab.metrics import FLIGHT_LIMIT, SLIP_LIMIT
from gait_lab.rollout import CONTROL_PERIOD, RolloutResult, RolloutSpec, run_all
from gait_lab.tasks import AXES, SPEED_TASKS, Task, find_task
from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.gait import Gait
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.robot_description import load_robot
from nao_lipm_gait.signals import JointTargets
from sim_bridge.plant import PlantOption, load_plant, option_text, with_options
from sim_bridge.simulation import Simulation

Pick = Callable[[Iterable[float]], float]
"""max, mean, ..."""

PAPER_SPEED = {"forward": 31.0, "back": 22.0, "side": 12.0, "turn": 92.0}
"""Top speeds of the paper's robot [cm/s, deg/s]."""
PAPER_COM_ERROR = {"spot": 4.26, "forward": 7.76}
"""Mean |CoM y error| of the paper, expected against measured [mm]; forward at its top speed."""


@dataclass(frozen=True, slots=True)
class BenchOptions:
    """What a suite runs on."""

    robots: int = 8
    seed: int = 0
    """Seed of the first robot; robots are seed, seed + 1, ..."""
    engine: str = "pybullet"
    plant: str = "reference"
    plant_options: tuple[PlantOption, ...] = ()
    """Options of the plant that are replaced."""
    urdf: str = "nao_h21_v33"
    parameters: GaitParameters = GaitParameters()
    tasks: tuple[str, ...] = SPEED_TASKS
    window: float = 20.0
    """Seconds at speed."""
    open_loop: str = "beside"
    """`beside` the closed loop, `off`, or `only`."""
    hold_heading: bool = False
    jobs: int | None = None
    ingredients: tuple[str, ...] = ()
    """What the suite `plant` varies; empty = every ingredient."""
    show: bool = True
    """Show a progress bar (on a terminal)."""

    def __post_init__(self) -> None:
        if self.robots < 1:
            raise NaoGaitError("robots", self.robots, "at least 1")
        if self.seed < -1:
            raise NaoGaitError("seed", self.seed, "at least -1 (the nominal robot)")
        if not 0.0 < self.window <= 3600.0:
            raise NaoGaitError("seconds", self.window, "over 0 to 3600 s")
        if self.open_loop not in ("beside", "off", "only"):
            raise NaoGaitError("open-loop", self.open_loop, "beside, off or only")

    @property
    def plant_title(self) -> str:
        """The plant with its replaced options."""
        return " ".join((self.plant, *(option_text(option) for option in self.plant_options)))


@dataclass(frozen=True, slots=True)
class Row:
    """One number of a suite, as it goes into the JSON."""

    suite: str
    metric: str
    unit: str
    value: float | None
    paper: float | None = None


@dataclass(frozen=True, slots=True)
class Report:
    """What a suite found: rows for machines, text for people."""

    rows: tuple[Row, ...]
    text: str

    def as_json(self, options: BenchOptions) -> list[dict[str, Any]]:
        return [
            {
                "suite": row.suite,
                "metric": row.metric,
                "unit": row.unit,
                "value": row.value,
                "paper": row.paper,
                "engine": options.engine,
                "plant": options.plant_title,
                "robots": options.robots,
                "seed": options.seed,
            }
            for row in self.rows
        ]


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

    def over(
        self, pick: Pick, attribute: str, factor: float = 1.0
    ) -> float:
        """`pick` (max, mean, ...) over the robots of a metric's magnitude; NaN if none has it."""
        values = [abs(getattr(result.metrics, attribute)) * factor for result in self.results]
        finite = [value for value in values if math.isfinite(value)]
        return pick(finite) if finite else math.nan


def speed(options: BenchOptions) -> Report:
    """20 s at speed in every task, closed and open loop on the same robots."""
    (scores,) = walk_all(options)
    rows = [row for score in scores for row in _speed_rows(score)]
    return Report(tuple(rows), _speed_text(scores, options))


def walk_all(
    options: BenchOptions, changes: Sequence[tuple[PlantOption, ...]] = ((),)
) -> list[list[Score]]:
    """For each change of the plant, the scores of every task and loop on the same robots."""
    tasks = [find_task(name).lasting(options.window) for name in options.tasks]
    if len({task.name for task in tasks}) < len(tasks):
        raise NaoGaitError("task", ", ".join(options.tasks), "each task at most once")
    closed, opened = options.open_loop != "only", options.open_loop != "off"
    loops = [loop for loop, wanted in ((True, closed), (False, opened)) if wanted]
    kinds = [(task, loop) for task in tasks for loop in loops]
    specs = [
        RolloutSpec(
            task=task,
            robot_seed=seed,
            parameters=options.parameters.replace(feedback=options.parameters.feedback and loop),
            plant=options.plant,
            plant_options=(*options.plant_options, *change),
            urdf=options.urdf,
            engine=options.engine,
            hold_heading=options.hold_heading,
        )
        for change in changes
        for task, loop in kinds
        for seed in range(options.seed, options.seed + options.robots)
    ]
    results = iter(run_all(specs, jobs=options.jobs, show=options.show))
    return [
        [Score(task, loop, tuple(islice(results, options.robots))) for task, loop in kinds]
        for _ in changes
    ]


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _speed_rows(score: Score) -> list[Row]:
    name, suite = score.name, "speed"
    counts = not score.faults
    paper = PAPER_SPEED.get(score.task.name)
    rows = []
    if score.task.axis:
        speeds = score.speeds
        for statistic, summary in (("worst", min), ("median", statistics.median)):
            value = float(summary(speeds)) if speeds else None
            rows.append(
                Row(suite, f"{name}_{statistic}", score.unit, value if counts else None, paper)
            )
            rows.append(Row(suite, f"{name}_{statistic}_of_upright", score.unit, value, paper))
    rows.append(Row(suite, f"{name}_upright", "robots", score.upright))
    rows.append(Row(suite, f"{name}_counts", "bool", float(counts)))
    error = PAPER_COM_ERROR.get(score.task.name)
    average: Pick = statistics.fmean
    highest: Pick = max
    quantities: tuple[tuple[str, str, Pick, str, float, float | None], ...] = (
        ("yaw_drift_worst", "deg/s", highest, "turn_rate", math.degrees(1.0), None),
        ("flight_worst", "%", highest, "flight_share", 100.0, None),
        ("slip_worst", "cm/s", highest, "slip_speed", 100.0, None),
        ("contact_ticks_worst", "ticks", highest, "contact_ticks", 1.0, None),
        ("com_y_error_mean", "mm", average, "com_error_y", 1000.0, error),
        ("com_y_error_measured_mean", "mm", average, "com_error_y_measured", 1000.0, error),
        ("com_x_error_mean", "mm", average, "com_error_x", 1000.0, None),
        ("saturated_worst", "%", highest, "saturated_share", 100.0, None),
    )  # fmt: skip
    for metric, unit, pick, attribute, factor, reference in quantities:
        if metric == "yaw_drift_worst" and score.task.axis == "yaw":
            continue
        value = _finite(score.over(pick, attribute, factor))
        rows.append(Row(suite, f"{name}_{metric}", unit, value, reference))
    return rows


def _number(value: float, digits: int = 1) -> str:
    return f"{value:.{digits}f}" if math.isfinite(value) else "-"


def _speed_text(scores: Sequence[Score], options: BenchOptions) -> str:
    header = (
        "task", "loop", "upright", "asked", "worst", "median", "unit", "paper", "drift", "flight",
        "slip", "contact", "CoM y", "(meas)", "sat.", "",
    )  # fmt: skip
    units = (
        "", "", "", "", "", "", "", "", "deg/s", "%", "cm/s", "ticks", "mm", "mm", "%", "",
    )  # fmt: skip
    lines: list[tuple[str, ...]] = [header, units]
    for score in scores:
        axis, speeds = score.task.axis, score.speeds
        turn = axis == "yaw"
        lines.append(
            (
                score.task.name,
                "closed" if score.closed_loop else "open",
                f"{score.upright}/{len(score.results)}",
                _number(abs(score.task.asked) * AXES[axis][1]) if axis else "",
                _number(min(speeds)) if speeds else "-",
                _number(statistics.median(speeds)) if speeds else "-",
                score.unit,
                _number(PAPER_SPEED.get(score.task.name, math.nan), 0),
                "" if turn else _number(score.over(max, "turn_rate", math.degrees(1.0))),
                _number(score.over(max, "flight_share", 100.0)),
                _number(score.over(max, "slip_speed", 100.0)),
                _number(score.over(max, "contact_ticks"), 0),
                _number(score.over(statistics.fmean, "com_error_y", 1000.0)),
                _number(score.over(statistics.fmean, "com_error_y_measured", 1000.0)),
                _number(score.over(max, "saturated_share", 100.0), 0),
                f"x {', '.join(score.faults)}" if score.faults else "",
            )
        )
    last = options.seed + options.robots - 1
    robots = f"robots {options.seed}-{last}" if options.robots > 1 else f"robot {last}"
    title = (
        f"{options.window:g} s at speed, {robots}, plant {options.plant_title}, {options.engine}, "
        f"{options.urdf}{', heading held' if options.hold_heading else ''}"
    )
    notes = (
        "Speeds in the torso's own heading, of the robots that stayed upright. Drift, flight,",
        "slip, contact and saturation: the worst robot. CoM y: mean |expected - true| (meas:",
        "- measured).",
        f"x = does not count: a fall, flight over {FLIGHT_LIMIT:.0%}, slip over "
        f"{SLIP_LIMIT * 100:g} cm/s, or leg against leg.",
    )
    return "\n".join((title, "", table(lines), "", *notes))


def table(lines: Sequence[Sequence[str]], header: int = 2) -> str:
    """Columns aligned for a fixed-width font: words to the left, numbers to the right."""
    widths = [max(len(cell) for cell in column) for column in zip(*lines, strict=True)]

    def is_text(column: int) -> bool:
        return not any(re.match(r"[-+]?\d", line[column]) for line in lines[header:])

    texts = [is_text(column) for column in range(len(widths))]
    padded = [
        "  ".join(
            cell.ljust(width) if text else cell.rjust(width)
            for cell, width, text in zip(line, widths, texts, strict=True)
        ).rstrip()
        for line in lines
    ]
    rule = "-" * max(len(line) for line in padded)
    return "\n".join((*padded[:header], rule, *padded[header:]))


# -- compute ---------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Timing:
    tick: tuple[int, ...]
    """Duration of every `Gait.step` [ns]."""
    controlled: float
    """Wall time of the closed loop [s]."""
    bare: float
    """Wall time of the same physics with the recorded targets and nothing else [s]."""
    simulated: float
    """[s] of simulated time in either."""


def compute(options: BenchOptions) -> Report:
    """Cost of one tick while walking, and of the rollouts against the same physics alone."""
    timing = _time_walk(options)
    ticks = sorted(timing.tick)
    p50 = ticks[len(ticks) // 2] / 1000.0
    p99 = ticks[min(len(ticks) - 1, math.ceil(len(ticks) * 0.99) - 1)] / 1000.0
    with_control = timing.simulated / timing.controlled
    without = timing.simulated / timing.bare
    suite = "compute"
    rows = (
        Row(suite, "tick_p50", "us", p50),
        Row(suite, "tick_p99", "us", p99),
        Row(suite, "tick_max", "us", ticks[-1] / 1000.0),
        Row(suite, "rollout_speed", "s/s", with_control),
        Row(suite, "physics_speed", "s/s", without),
        Row(suite, "rollout_share", "", with_control / without),
    )
    text = "\n".join(
        (
            f"{timing.simulated:g} s forward walk on robot {options.seed}, one core, "
            f"plant {options.plant_title}, {options.engine}",
            f"  Gait.step           p50 {p50:.0f} us   p99 {p99:.0f} us   "
            f"max {ticks[-1] / 1000.0:.0f} us   ({len(ticks)} ticks)",
            f"  rollout             {with_control:.2f} simulated s per s",
            f"  same physics alone  {without:.2f} simulated s per s   "
            f"(rollout / physics = {with_control / without:.2f})",
        )
    )
    return Report(rows, text)


def _time_walk(options: BenchOptions) -> _Timing:
    robot = load_robot(options.urdf)
    plant = with_options(load_plant(options.plant), options.plant_options)
    task = find_task("forward")
    gait = Gait(robot, options.parameters)
    ticks = round((task.start + options.window) / CONTROL_PERIOD)
    clock = time.perf_counter_ns

    def make() -> Simulation:
        return Simulation(
            robot, plant, options.seed, engine=options.engine, control_period=CONTROL_PERIOD
        )

    # Interleaved in blocks, so that a busy machine slows both alike.
    controlled, bare = make(), make()
    try:
        block = 100
        spans: list[int] = []
        walked = replayed = 0
        targets: JointTargets | None = None
        for first in range(0, ticks, block):
            sent: list[JointTargets | None] = []
            begin = clock()
            for tick in range(first, min(first + block, ticks)):
                sent.append(targets)
                controlled.step(targets)
                frame = controlled.sense()
                if frame is not None:
                    command = task.command_at((tick + 1) * CONTROL_PERIOD)
                    before = clock()
                    targets = gait.step(frame, command)
                    spans.append(clock() - before)
            walked += clock() - begin
            begin = clock()
            for each in sent:
                bare.step(each)
            replayed += clock() - begin
    finally:
        controlled.close()
        bare.close()
    # The first ticks pay for caches and imports.
    return _Timing(
        tuple(spans[50:]), walked * 1e-9, replayed * 1e-9, ticks * CONTROL_PERIOD
    )
