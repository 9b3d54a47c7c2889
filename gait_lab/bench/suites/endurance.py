"""The suite `endurance`: metre after metre of random, smooth, omnidirectional commands.

Each robot walks a given way. A fall ends a stretch; the next one begins from standing, with the
next noise and other commands, until the way is walked. The way is that of the torso over the
ground, in pieces of one second, so that its sway does not count.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from gait_lab.analysis.trace import ALARM_STATES
from gait_lab.bench.falls import FallDetection
from gait_lab.bench.options import BenchOptions
from gait_lab.bench.report import Report, Row, loop_name, number, table
from gait_lab.trials.parallel import parallel_map
from gait_lab.trials.rollout import RolloutSpec, make_pair
from gait_lab.trials.tasks import STOP_SHARE, TASKS, RandomCommands
from gait_lab.trials.trial import CONTROL_PERIOD, TimedCommands, run

SUITE = "endurance"
FALLS_MAX = 100
"""A robot that fell this often is not made to walk on."""
SLOWEST = 0.02
"""[m/s] A robot that is slower on the whole is not made to walk on."""
PIECE = round(1.0 / CONTROL_PERIOD)
"""Ticks."""


@dataclass(frozen=True, slots=True)
class Stretch:
    """From standing to a fall, or to the end of the way."""

    metres: float
    seconds: float
    fell: bool
    lead: float | None
    """[s] from the gait's word to the fall; 0 without a word, None without a fall."""
    false_alarm: bool


@dataclass(frozen=True, slots=True)
class Way:
    """What one robot walked."""

    stretches: tuple[Stretch, ...]

    @property
    def metres(self) -> float:
        return sum(stretch.metres for stretch in self.stretches)

    @property
    def seconds(self) -> float:
        return sum(stretch.seconds for stretch in self.stretches)

    @property
    def falls(self) -> int:
        return sum(stretch.fell for stretch in self.stretches)


@dataclass(frozen=True, slots=True)
class _Asked:
    spec: RolloutSpec
    metres: float


def endurance(options: BenchOptions) -> Report:
    """Every robot its way, in closed and open loop."""
    asked = [
        _Asked(
            RolloutSpec(
                task=TASKS["stand"],
                robot_seed=seed,
                parameters=options.loop_parameters(closed),
                plant=options.plant,
                plant_options=options.plant_options,
                urdf=options.urdf,
                engine=options.engine,
            ),
            options.metres,
        )
        for closed in options.loops
        for seed in options.seeds
    ]
    ways = parallel_map(
        walk_way, asked, jobs=options.jobs, show=options.show, label="robots",
        note=lambda way: f"{way.metres:.0f} m, {way.falls} falls",
    )  # fmt: skip
    totals = [
        Total(closed, tuple(ways[index * options.robots : (index + 1) * options.robots]))
        for index, closed in enumerate(options.loops)
    ]
    rows = [row for total in totals for row in total.rows]
    return Report(tuple(rows), _text(totals, options))


def walk_way(asked: _Asked) -> Way:
    """Stretch after stretch until the way is walked, or the robot clearly cannot."""
    stretches: list[Stretch] = []
    metres = seconds = 0.0
    falls = 0
    longest = asked.metres / SLOWEST
    while metres < asked.metres and falls < FALLS_MAX and seconds < longest:
        one = _stretch(asked.spec, len(stretches), asked.metres - metres, longest - seconds)
        stretches.append(one)
        metres += one.metres
        seconds += one.seconds
        falls += one.fell
    return Way(tuple(stretches))


def _stretch(spec: RolloutSpec, number: int, metres: float, seconds: float) -> Stretch:
    spec = replace(spec, noise_seed=number)
    # Robot -1 is a robot too; seeds of numpy are not negative.
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
    """All robots in closed or in open loop."""

    closed_loop: bool
    ways: tuple[Way, ...]
    detection: FallDetection = field(default_factory=FallDetection)

    def __post_init__(self) -> None:
        for way in self.ways:
            for stretch in way.stretches:
                self.detection.count(stretch.lead, stretch.false_alarm)

    @property
    def kilometres(self) -> float:
        return sum(way.metres for way in self.ways) / 1000.0

    @property
    def falls(self) -> int:
        return sum(way.falls for way in self.ways)

    @property
    def falls_per_km(self) -> float | None:
        return self.falls / self.kilometres if self.kilometres > 0.0 else None

    @property
    def without_fall(self) -> int:
        return sum(way.falls == 0 for way in self.ways)

    @property
    def speed(self) -> float:
        """Mean speed over the ground, stops and turns included [cm/s]."""
        seconds = sum(way.seconds for way in self.ways)
        return 1e5 * self.kilometres / seconds if seconds else math.nan

    @property
    def rows(self) -> list[Row]:
        name = "closed" if self.closed_loop else "open_loop"
        return [
            Row(SUITE, f"{name}_falls_per_km", "1/km", self.falls_per_km),
            Row(SUITE, f"{name}_distance", "km", self.kilometres),
            Row(SUITE, f"{name}_robots_without_fall", "robots", self.without_fall),
            Row(SUITE, f"{name}_mean_speed", "cm/s", self.speed),
            *self.detection.rows(SUITE, name),
        ]


def _text(totals: Sequence[Total], options: BenchOptions) -> str:
    lines: list[tuple[str, ...]] = [
        ("loop", "falls", "distance", "falls", "robots without", "mean speed"),
        ("", "", "m", "per km", "a fall", "cm/s"),
    ]
    for total in totals:
        lines.append(
            (
                loop_name(total.closed_loop),
                str(total.falls),
                number(1000.0 * total.kilometres),
                number(total.falls_per_km),
                f"{total.without_fall}/{len(total.ways)}",
                number(total.speed),
            )
        )
    title = f"{options.metres:g} m of random smooth commands for each robot; {options.title}"
    notes = [
        "Uniform in all directions up to the full speed of the tasks forward, back, side and turn;",
        f"one in {1 / STOP_SHARE:g} is to stop. After a fall the robot walks on from standing.",
        *(f"Fall detection, {loop_name(total.closed_loop)}: {total.detection.text}."
          for total in totals),
    ]  # fmt: skip
    return "\n".join((title, "", table(lines), "", *notes))
