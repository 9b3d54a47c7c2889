"""The suite `solo`: a robot alone against an empty goal, from anywhere on the pitch."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from gait_lab.bench.options import Option, Options
from gait_lab.bench.rows import Row, rows_of
from gait_lab.bench.suite import suite
from gait_lab.bench.walks import median
from gait_lab.soccer.pitch import PitchSpec, parts_of
from nao_soccer.referee.rules import Rules
from robot_core.field import BallPlace
from robot_core.types import Point2, Pose2
from sim_bridge.scene import load_scene
from sim_bridge.trials.trial import CONTROL_PERIOD, Tick

LIMIT = 120.0
"""[s] after which a trial ends."""
MARGIN = 0.35
"""[m] between the lines and the places at which robot and ball start."""
APART = 0.4
"""[m] between robot and ball at the start."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SoloSpec(PitchSpec):
    """One trial.

    Attributes:
        draw: Draws the starts that are not given, together with the seed.
        start: Pose of the robot in the world; None = drawn.
        ball: x, y [m] of the ball in the world; None = drawn.
        limit: [s] after which the trial ends.
    """

    draw: int = 0
    start: Pose2 | None = None
    ball: Point2 | None = None
    limit: float = LIMIT
    rendered: bool = False


@dataclass(frozen=True, slots=True)
class SoloResult:
    """What came of it.

    Attributes:
        goal: [s] until the ball was in the opponents' goal; None = it was not.
        outs: Number of times that the ball left the field; it was put back as the referee does.
    """

    spec: SoloSpec
    goal: float | None
    outs: int
    falls: int
    kicks: tuple[str, ...]
    path: str


def play_solo(spec: SoloSpec) -> SoloResult:
    """Run one trial."""
    start, ball = _start(spec)
    with spec.practice([start], ball=ball, rendered=spec.rendered) as pitch:
        goal, outs, place = None, 0, BallPlace.IN_PLAY
        x, y = pitch.field.length / 2.0 - Rules().inside, pitch.field.width / 2.0 - Rules().inside

        def watch(_: Sequence[Tick]) -> None:
            nonlocal outs, place
            place = pitch.ball_in
            if place not in (BallPlace.IN_PLAY, BallPlace.IN_BLUE_GOAL):
                outs += 1
                bx, by = pitch.ball
                pitch.world.put_ball(min(max(bx, -x), x), min(max(by, -y), y))

        for _ in pitch.run(watch):
            time = pitch.count * CONTROL_PERIOD
            if place is BallPlace.IN_BLUE_GOAL:
                goal = time
            if goal is not None or time >= spec.limit:
                break
    (player,) = pitch.players
    path = " > ".join(map(str, player.path))
    return SoloResult(spec, goal, outs, pitch.falls[0], tuple(player.kicks), path)


def _start(spec: SoloSpec) -> tuple[Pose2, Point2]:
    """Where the robot and the ball are put."""
    field, _, _ = parts_of(load_scene(spec.scene))
    random = np.random.default_rng([2323, spec.draw, spec.seed + 1])
    half = np.array((field.length, field.width)) / 2.0 - MARGIN
    while True:
        place, ball = random.uniform(-half, half), random.uniform(-half, half)
        if np.hypot(*(place - ball)) > APART:
            break
    drawn = (float(place[0]), float(place[1]), float(random.uniform(-math.pi, math.pi)))
    x, y = ball.tolist()
    return spec.start or drawn, spec.ball or (x, y)


@suite(
    "solo", "Goals of a robot alone", "time in which a robot alone scores, from anywhere",
    options={
        "robots": 20, "attempts": ..., "scene": ...,
        "limit": Option(LIMIT, "a trial ends after this time [s]", "T", minimum=1.0,
                        maximum=3600.0),
        "rendered": Option(False, "robots see rendered images, not percepts by the model"),
    },
    gait=False, quick=({"robots": 6},),
)  # fmt: skip
def solo(options: Options) -> Iterator[Row | str]:
    """Each robot plays from drawn starts until it scores."""
    specs = [
        SoloSpec(seed=seed, draw=attempt, scene=options.scene, limit=options.limit,
                 rendered=options.rendered, **options.play)
        for seed in options.seeds for attempt in range(options.attempts)
    ]  # fmt: skip
    results: list[SoloResult] = options.map(
        play_solo, specs, label="starts",
        note=lambda result: f"robot {result.spec.seed}: {result.goal or 'no goal'}",
    )  # fmt: skip
    times = [result.goal for result in results if result.goal is not None]
    played = [options.limit if result.goal is None else result.goal for result in results]
    yield from rows_of(
        "",
        (f"goal_within_{options.limit:g}s", "%", 100.0 * len(times) / len(results)),
        ("goal_time_median", "s", median(played) if times else None),
        ("goal_time_worst", "s", max(times) if len(times) == len(results) else None),
        ("falls_per_minute", "1/min",
         60.0 * sum(result.falls for result in results) / sum(played)),
        ("outs", "balls", sum(result.outs for result in results)),
        ("kicks", "kicks", sum(len(result.kicks) for result in results)),
    )  # fmt: skip
    yield (
        "Robot and ball start anywhere on the field; no opponents. A ball that leaves the field is "
        "put back inside. Median: a start without a goal counts with the time limit."
    )
