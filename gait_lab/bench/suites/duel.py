"""The suite `duel`: two robots, the ball between them: who gains ground, who falls."""

import math
import statistics
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from gait_lab.bench.options import MOST_ROBOTS, Option, Options
from gait_lab.bench.policies import NAMES, POLICIES, policies
from gait_lab.bench.rows import Row, rows_of
from gait_lab.bench.suite import suite
from gait_lab.bench.walks import median, standard_error
from gait_lab.soccer.match import RESTS
from gait_lab.soccer.pitch import Pitch, PitchSpec, with_robots
from nao_soccer.behavior.duel import DuelSettings
from robot_core.field import BallPlace
from robot_core.types import Pose2
from sim_bridge.scene import load_scene
from sim_bridge.trials.trial import CONTROL_PERIOD

NEAR, FAR = 0.5, 0.7
"""[m] from the ball to a robot at the start; both are drawn."""
AROUND, ASKEW = 0.3, 0.4
"""[rad] Largest deviations from the place opposite the other robot, and from the ball's bearing."""
FREE = 1.0
"""[m] from its start, at which the ball has left the duel."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DuelSpec(PitchSpec):
    """One duel; red plays towards +x.

    Attributes:
        angle: [rad] Bearing of blue from the ball; red is opposite. 0: each is on its own side.
        seconds: [s] Duration, unless the ball leaves the field before.
    """

    angle: float = 0.0
    seconds: float = 20.0
    red: DuelSettings = field(default_factory=DuelSettings)
    blue: DuelSettings = field(default_factory=DuelSettings)


@dataclass(frozen=True, slots=True)
class DuelResult:
    """What came of it.

    Attributes:
        gain: [m] by which the ball came nearer to blue's goal line.
        way: [m] that the ball rolled.
        rest: Share of the time in which the ball rested.
        free: [s] until the ball was `FREE` from its start; None = it was not.
        seconds: [s] that it took.
    """

    spec: DuelSpec
    gain: float
    way: float
    rest: float
    free: float | None
    falls: tuple[int, int]
    seconds: float


def play_duel(spec: DuelSpec) -> DuelResult:
    """Run one duel."""
    random = np.random.default_rng([4423, spec.seed + 1, round(math.degrees(spec.angle))])
    red = _place(spec.angle + math.pi + random.uniform(-AROUND, AROUND), random)
    blue = _place(spec.angle + random.uniform(-AROUND, AROUND), random)
    scene = with_robots(load_scene(spec.scene), [red], [blue], urdf=spec.urdf, seed=spec.seed)
    duel = {"red": spec.red, "blue": spec.blue}
    with Pitch(scene, spec.seed, spec.engine, spec.plant, duel=duel) as pitch:
        pitch.world.put_ball(0.0, 0.0)
        place, free = (0.0, 0.0), None
        way, still, ticks = 0.0, 0, 0
        for _ in pitch.run():
            step = math.dist(pitch.ball, place)
            place, way, ticks = pitch.ball, way + step, ticks + 1
            still += step < RESTS * CONTROL_PERIOD
            if free is None and math.hypot(*place) > FREE:
                free = ticks * CONTROL_PERIOD
            left = pitch.ball_in is not BallPlace.IN_PLAY
            if left or ticks * CONTROL_PERIOD >= spec.seconds:
                break
    red_falls, blue_falls = pitch.falls
    return DuelResult(
        spec, place[0], way, still / ticks, free, (red_falls, blue_falls),
        ticks * CONTROL_PERIOD,
    )  # fmt: skip


def _place(bearing: float, random: np.random.Generator) -> Pose2:
    """A pose at the ball in the middle of the field, about facing it."""
    far = random.uniform(NEAR, FAR)
    heading = bearing + math.pi + random.uniform(-ASKEW, ASKEW)
    return far * math.cos(bearing), far * math.sin(bearing), math.remainder(heading, math.tau)


@suite(
    "duel", "Duels", "two robots and a ball between them: metres gained, ball at rest, falls",
    options={
        "robots": Option(4, "pairs of robots; each plays from every angle", "N", minimum=1,
                         maximum=MOST_ROBOTS),
        "angles": Option(
            8, "angles between the robots' line and the field, around the clock", "N", minimum=1,
            maximum=360,
        ),
        "window": 20.0, "scene": ..., "resume": ...,
        **POLICIES,
    },
    gait=False, quick=({"robots": 1},),
    check=policies, epilog=NAMES,
)  # fmt: skip
def duel(options: Options) -> Iterator[Row | str]:
    """Each pair plays from every angle; with two policies, each side of the field in turn."""
    mine, other = policies(options)
    sides = (1.0,) if mine == other else (1.0, -1.0)
    specs = [
        DuelSpec(
            seed=2 * seed, angle=math.tau * index / options.angles, seconds=options.window,
            scene=options.scene, red=mine if side > 0.0 else other,
            blue=other if side > 0.0 else mine, **options.play,
        )
        for seed in options.seeds for index in range(options.angles) for side in sides
    ]  # fmt: skip
    results: list[DuelResult] = options.map(
        play_duel, specs, label="duels",
        note=lambda each: f"robots {each.spec.seed}, {each.spec.seed + 1}: {each.gain:+.2f} m",
        restore=DuelResult,
    )  # fmt: skip
    of = [side for _ in options.seeds for _ in range(options.angles) for side in sides]
    gains = [side * each.gain for side, each in zip(of, results, strict=True)]
    seconds = sum(each.seconds for each in results)
    falls = [each.falls if side > 0.0 else each.falls[::-1]
             for side, each in zip(of, results, strict=True)]  # fmt: skip
    yield from rows_of(
        "duel",
        ("gain", "m", statistics.fmean(gains)),
        ("gain_deviation", "m", standard_error(gains)),
        ("way", "m/min", 60.0 * sum(each.way for each in results) / seconds),
        ("rest", "%", 100.0 * sum(each.rest * each.seconds for each in results) / seconds),
        ("free_median", "s",
         median(options.window if each.free is None else each.free for each in results)),
        ("falls", "falls", sum(map(sum, falls))),
        ("falls_of_policy", "falls", sum(own for own, _ in falls)),
        ("falls_per_robot_minute", "1/min", 30.0 * sum(map(sum, falls)) / seconds),
        ("duels", "duels", len(results)),
    )  # fmt: skip
    yield (
        "gain: of the ball towards the opponents' goal line of the team with --policy, with the "
        "standard error of the mean; of two equal teams it is about 0. rest: share of the time "
        "with the ball slower than 0.03 m/s. free: until the ball is 1 m from its start; else the "
        "whole time."
    )
