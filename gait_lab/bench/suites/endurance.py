"""The suite `endurance`: metre after metre of random, smooth, omnidirectional commands.

Each robot walks a given distance. A fall ends a stretch; the next one begins from standing, with
other noise and other commands, until the distance is walked. The distance is that of the torso over
the ground, in pieces of one second, so that its sway does not count.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gait_lab.bench.options import Option, Options
from gait_lab.bench.rows import Row, rows_of
from gait_lab.bench.suite import suite
from gait_lab.bench.walks import FallDetection
from sim_bridge.trials.rollout import RolloutSpec, make_pair, walker_of
from sim_bridge.trials.tasks import STOP_SHARE, TASKS, RandomCommands
from sim_bridge.trials.trace import ALARM_STATES
from sim_bridge.trials.trial import CONTROL_PERIOD, SeesTruth, TimedCommands, run

FALLS_MAX = 100
"""A robot is given up after so many falls."""
SLOWEST = 0.02
"""[m/s] A robot with a lower mean speed is given up."""
PIECE = round(1.0 / CONTROL_PERIOD)
"""Ticks."""


@dataclass(frozen=True, slots=True)
class Stretch:
    """From standing to a fall, or to the end of the distance.

    Attributes:
        metres: Distance [m].
        seconds: Duration [s].
        lead: [s] from the detection to the fall; 0 if not detected before, None without a fall.
        false_alarm: A fall was detected and none happened.
    """

    metres: float
    seconds: float
    fell: bool
    lead: float | None
    false_alarm: bool


def walk_journey(asked: tuple[RolloutSpec, float]) -> list[Stretch]:
    """Stretch after stretch until the distance [m] is walked, or the robot is given up."""
    spec, distance = asked
    stretches: list[Stretch] = []
    metres = seconds = 0.0
    falls = 0
    longest = distance / SLOWEST
    while metres < distance and falls < FALLS_MAX and seconds < longest:
        one = walk_stretch(spec, len(stretches), distance - metres, longest - seconds)
        stretches.append(one)
        metres += one.metres
        seconds += one.seconds
        falls += one.fell
    return stretches


def walk_stretch(spec: RolloutSpec, number: int, metres: float, seconds: float) -> Stretch:
    """Walk from standing until a fall, at most so far [m] and so long [s]."""
    spec = replace(spec, noise_seed=number)
    # The nominal robot has the seed -1; seeds of numpy are not negative.
    commands = RandomCommands((spec.robot_seed + 1, number))
    simulation, gait = make_pair(spec)
    walker = walker_of(spec, gait)
    sees = walker if isinstance(walker, SeesTruth) else None
    walked, alarm, time, fell = 0.0, None, 0.0, False
    corner: np.ndarray | None = None
    timed = TimedCommands(commands.at, ahead=sees is None)
    with simulation:
        for index, tick in enumerate(run(simulation, walker, timed)):
            if sees is not None:
                sees.see(tick.truth)
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
    lead = None
    if fell:
        lead = 0.0 if alarm is None else time - alarm
    return Stretch(walked, time, fell, lead, alarm is not None and not fell)


def loop_rows(name: str, journeys: Sequence[list[Stretch]]) -> list[Row]:
    """The measurements of all robots in closed or in open loop, or of another walk."""
    detection = FallDetection()
    for stretch in (each for journey in journeys for each in journey):
        detection.count(stretch.lead, stretch.false_alarm)
    kilometres = sum(sum(each.metres for each in journey) for journey in journeys) / 1000.0
    seconds = sum(sum(each.seconds for each in journey) for journey in journeys)
    falls = [sum(each.fell for each in journey) for journey in journeys]
    return rows_of(
        name,
        ("falls_per_km", "1/km", sum(falls) / kilometres if kilometres > 0.0 else None),
        ("distance", "km", kilometres),
        ("robots_without_fall", "robots", falls.count(0)),
        ("mean_speed", "cm/s", 1e5 * kilometres / seconds if seconds else None),
    ) + detection.rows(name)


@suite(
    "endurance", "Endurance", "falls per kilometre of random commands in all directions",
    options={
        "robots": 20, "open_loop": ...,
        "metres": Option(50.0, "distance that each robot walks", "M", minimum=0.01, maximum=1e5),
    },
    quick=({"robots": 4, "metres": 5.0},),
)  # fmt: skip
def endurance(options: Options) -> Iterator[Row | str]:
    """The distance with every robot, in closed and open loop."""
    specs = [
        (RolloutSpec(TASKS["stand"], robot_seed=seed,
                     **{**options.trial, "parameters": options.loop_parameters(closed)}),
         options.metres)
        for closed in options.loops for seed in options.seeds
    ]  # fmt: skip
    journeys = options.map(
        walk_journey, specs, label="robots",
        note=lambda journey: f"{sum(each.metres for each in journey):.0f} m",
    )  # fmt: skip
    for closed, mine in zip(options.loops, options.by_robots(journeys), strict=True):
        yield from loop_rows("closed" if closed else "open_loop", mine)
    yield (
        f"{options.metres:g} m for each robot. Commands uniform in all directions up to the full "
        f"speed of the tasks forward, back, side and turn; one in {1 / STOP_SHARE:g} is to stop. "
        "After a fall the robot walks on from standing."
    )
