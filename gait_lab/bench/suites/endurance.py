"""The suite `endurance`: metre after metre of random, smooth, omnidirectional commands.

Each robot walks a given distance. A fall ends a stretch; the next one begins from standing, with
other noise and other commands, until the distance is walked. The distance is that of the torso over
the ground, in pieces of one second, so that its sway does not count.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from gait_lab.bench.options import BenchOptions, option
from gait_lab.bench.result import Column, Measurement, SuiteResult, Table, loop_name
from gait_lab.bench.score import FallDetection
from gait_lab.bench.suite import Suite
from sim_bridge.trials.parallel import parallel_map
from sim_bridge.trials.rollout import RolloutSpec, make_pair
from sim_bridge.trials.tasks import STOP_SHARE, TASKS, RandomCommands
from sim_bridge.trials.trace import ALARM_STATES
from sim_bridge.trials.trial import CONTROL_PERIOD, TimedCommands, run

FALLS_MAX = 100
"""A robot is given up after so many falls."""
SLOWEST = 0.02
"""[m/s] A robot with a lower mean speed is given up."""
PIECE = round(1.0 / CONTROL_PERIOD)
"""Ticks."""


@dataclass(frozen=True)
class Options(BenchOptions):
    """What the suite `endurance` runs on."""

    robots: int = 20
    metres: float = option(50.0, "distance that each robot walks", "M", above=0.0, maximum=1e5)


@dataclass(frozen=True, slots=True)
class Stretch:
    """From standing to a fall, or to the end of the distance.

    Attributes:
        metres: Distance [m].
        seconds: Duration [s].
        fell: Whether it ended with a fall.
        lead: [s] from the detection to the fall; 0 if not detected before, None without a fall.
        false_alarm: A fall was detected and none happened.
    """

    metres: float
    seconds: float
    fell: bool
    lead: float | None
    false_alarm: bool


@dataclass(frozen=True, slots=True)
class Journey:
    """What one robot walked.

    Attributes:
        stretches: Stretches in their order.
    """

    stretches: tuple[Stretch, ...]

    @property
    def metres(self) -> float:
        """Distance [m]."""
        return sum(stretch.metres for stretch in self.stretches)

    @property
    def seconds(self) -> float:
        """Duration [s]."""
        return sum(stretch.seconds for stretch in self.stretches)

    @property
    def falls(self) -> int:
        """Number of falls."""
        return sum(stretch.fell for stretch in self.stretches)


@dataclass(frozen=True, slots=True)
class JourneySpec:
    """Everything that a journey depends on.

    Attributes:
        spec: Robot, gait, plant and engine.
        metres: Distance [m].
    """

    spec: RolloutSpec
    metres: float


def endurance(options: Options) -> SuiteResult:
    """The distance with every robot, in closed and open loop."""
    specs = []
    for closed in options.loops:
        trial = {**options.trial, "parameters": options.loop_parameters(closed)}
        for seed in options.seeds:
            spec = RolloutSpec(TASKS["stand"], robot_seed=seed, **trial)
            specs.append(JourneySpec(spec, options.metres))
    journeys = parallel_map(
        walk_journey, specs, jobs=options.jobs, show=options.show, label="robots",
        note=lambda journey: f"{journey.metres:.0f} m, {journey.falls} falls",
    )  # fmt: skip
    totals = [
        Total(closed, tuple(journeys[index * options.robots : (index + 1) * options.robots]))
        for index, closed in enumerate(options.loops)
    ]
    notes = (
        "Commands uniform in all directions up to the full speed of the tasks forward, back, side "
        f"and turn; one in {1 / STOP_SHARE:g} is to stop. After a fall the robot walks on from "
        "standing.",
        *(total.detection.note(loop_name(total.closed_loop)) for total in totals),
    )
    title = f"{options.metres:g} m of random smooth commands for each robot; {options.title}"
    rows = tuple(row for total in totals for row in total.rows)
    return SuiteResult(rows, title, (_table(totals),), notes)


def walk_journey(asked: JourneySpec) -> Journey:
    """Stretch after stretch until the distance is walked, or the robot is given up."""
    stretches: list[Stretch] = []
    metres = seconds = 0.0
    falls = 0
    longest = asked.metres / SLOWEST
    while metres < asked.metres and falls < FALLS_MAX and seconds < longest:
        one = walk_stretch(asked.spec, len(stretches), asked.metres - metres, longest - seconds)
        stretches.append(one)
        metres += one.metres
        seconds += one.seconds
        falls += one.fell
    return Journey(tuple(stretches))


def walk_stretch(spec: RolloutSpec, number: int, metres: float, seconds: float) -> Stretch:
    """Walk from standing until a fall.

    Args:
        spec: Robot, gait, plant and engine.
        number: Seed of the noise and of the commands.
        metres: Distance [m] after which to stop.
        seconds: Duration [s] after which to stop.

    Returns:
        What was walked.
    """
    spec = replace(spec, noise_seed=number)
    # The nominal robot has the seed -1; seeds of numpy are not negative.
    commands = RandomCommands((spec.robot_seed + 1, number))
    simulation, gait = make_pair(spec)
    walked, alarm, time, fell = 0.0, None, 0.0, False
    corner: np.ndarray | None = None
    try:
        for index, tick in enumerate(run(simulation, gait, TimedCommands(commands.at))):
            time = index * CONTROL_PERIOD
            fell = tick.fallen
            if alarm is None and tick.status is not None:
                alarm = time if tick.status.state.value in ALARM_STATES else None
            if index % PIECE == 0 or fell:
                here = np.array(tick.truth.torso_position[:2])
                if corner is not None and not fell:
                    walked += float(np.linalg.norm(here - corner))
                corner = here
                if walked >= metres or time >= seconds:
                    break
    finally:
        simulation.close()
    lead = None
    if fell:
        lead = 0.0 if alarm is None else time - alarm
    return Stretch(walked, time, fell, lead, alarm is not None and not fell)


@dataclass(frozen=True, slots=True)
class Total:
    """All robots in closed or in open loop.

    Attributes:
        closed_loop: Whether the gait had its feedback.
        journeys: One per robot.
        detection: Fall detection over all stretches.
    """

    closed_loop: bool
    journeys: tuple[Journey, ...]
    detection: FallDetection = field(default_factory=FallDetection)

    def __post_init__(self) -> None:
        for journey in self.journeys:
            for stretch in journey.stretches:
                self.detection.count(stretch.lead, stretch.false_alarm)

    @property
    def kilometres(self) -> float:
        """Distance [km]."""
        return sum(journey.metres for journey in self.journeys) / 1000.0

    @property
    def falls(self) -> int:
        """Number of falls."""
        return sum(journey.falls for journey in self.journeys)

    @property
    def falls_per_km(self) -> float | None:
        """None if nothing was walked."""
        return self.falls / self.kilometres if self.kilometres > 0.0 else None

    @property
    def without_fall(self) -> int:
        """Number of robots that did not fall."""
        return sum(journey.falls == 0 for journey in self.journeys)

    @property
    def speed(self) -> float:
        """Mean speed over the ground, stops and turns included [cm/s]."""
        seconds = sum(journey.seconds for journey in self.journeys)
        return 1e5 * self.kilometres / seconds if seconds else math.nan

    @property
    def rows(self) -> list[Measurement]:
        """The measurements."""
        name = "closed" if self.closed_loop else "open_loop"
        return [
            Measurement(f"{name}_falls_per_km", "1/km", self.falls_per_km),
            Measurement(f"{name}_distance", "km", self.kilometres),
            Measurement(f"{name}_robots_without_fall", "robots", self.without_fall),
            Measurement(f"{name}_mean_speed", "cm/s", self.speed),
            *self.detection.rows(name),
        ]


def _table(totals: Sequence[Total]) -> Table:
    columns = (
        Column("loop"), Column("falls"), Column("distance", "m"), Column("falls", "per km"),
        Column("robots without", "a fall"), Column("mean speed", "cm/s"),
    )  # fmt: skip
    rows = [
        (
            loop_name(total.closed_loop), total.falls, 1000.0 * total.kilometres,
            total.falls_per_km, f"{total.without_fall}/{len(total.journeys)}", total.speed,
        )
        for total in totals
    ]  # fmt: skip
    return Table(columns, rows)


SUITE = Suite(
    name="endurance",
    title="Endurance",
    summary="falls per kilometre of random commands in all directions",
    measure=endurance,
    options=Options,
    takes=("robots", "open_loop"),
    quick=({"robots": 4, "metres": 5.0},),
)
