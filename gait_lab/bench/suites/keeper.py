"""The suite `keeper`: shots at a goal with a keeper alone in it, with percepts by the model."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from gait_lab.bench.options import Option, Options
from gait_lab.bench.rows import Row, rows_of
from gait_lab.bench.suite import suite
from gait_lab.bench.walks import percent
from gait_lab.soccer.pitch import Pitch, PitchSpec, is_upright, parts_of
from nao_soccer.behavior.basic import KEEPER_OUT
from nao_soccer.game_state import GameState
from robot_core.field import BallPlace
from robot_core.types import Point2
from sim_bridge.scene import load_scene
from sim_bridge.trials.trial import CONTROL_PERIOD, Tick

DISTANCE = 2.0
"""[m] from the goal line to the ball before the shot."""
ACROSS = 0.5
"""[m] from the middle up to which the ball lies before the shot."""
INSIDE = 0.1
"""[m] from the post to a shot at a corner."""
WIDE = 0.6
"""[m] from the post to a shot that misses."""
TARGETS = ("left", "middle", "right", "wide left", "wide right")
"""Where a shot goes, as the keeper sees it."""
SPEEDS = (1.2, 2.0)
"""[m/s] at which the ball rolls at first; a slower one stops before the line."""
SLIDING = 1.4
"""Speed of a ball without spin over that at which it rolls, once it does not slide any longer."""
LOOK = 3.0
"""[s] for which the ball lies still before the shot."""
ROLL = 5.0
"""[s] after which the ball is out, in the goal, or held."""
LIMIT = 40.0
"""[s] after a shot, until which the keeper has to stand again."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ShotSpec(PitchSpec):
    """One shot.

    Attributes:
        target: One of `TARGETS`.
        draw: Draws place and speed, together with the seed and the target.
        limit: [s] after the shot, until which the keeper has to stand again.
    """

    target: str
    draw: int = 0
    limit: float = LIMIT


@dataclass(frozen=True, slots=True)
class ShotResult:
    """What came of it.

    Attributes:
        speed: [m/s] at which the ball began to roll.
        fell: It fell, other than by a dive.
        up: [s] after the shot at which it stood or walked again; None = not within the limit.
    """

    spec: ShotSpec
    speed: float
    held: bool
    motions: tuple[str, ...]
    fell: bool
    up: float | None


def shot(spec: ShotSpec) -> ShotResult:
    """Shoot once."""
    field, goals, _ = parts_of(load_scene(spec.scene))
    start = (KEEPER_OUT - field.length / 2.0, 0.0, 0.0)
    random = np.random.default_rng([4646, spec.draw, TARGETS.index(spec.target), spec.seed + 1])
    ball = (DISTANCE - field.length / 2.0, float(random.uniform(-ACROSS, ACROSS)))
    speed = float(random.uniform(*SPEEDS))
    half = goals.width / 2.0
    across = half + WIDE if spec.target.startswith("wide") else half - INSIDE
    side = {"left": 1.0, "right": -1.0}.get(spec.target.split()[-1], 0.0)
    way = (-DISTANCE, side * across - ball[1])
    launch = SLIDING * speed / math.hypot(*way)
    velocity = (launch * way[0], launch * way[1])
    with spec.practice([start]) as pitch:
        pitch.players[0].player.game = GameState(goalkeeper=True)
        pitch.world.put_ball(*ball)
        return _Shot(spec, pitch, ball, velocity).run(speed)


class _Shot:
    """Watches ball and keeper."""

    def __init__(self, spec: ShotSpec, pitch: Pitch, ball: Point2, velocity: Point2) -> None:
        self._spec = spec
        self._pitch = pitch
        self._start = ball, velocity
        self._motions: list[str] = []
        self._scored = self._fell = False

    def run(self, speed: float) -> ShotResult:
        up = None
        for ticks in self._pitch.run(self._watch):
            since = self._pitch.count * CONTROL_PERIOD - LOOK
            status = ticks[0].status
            if status is None:
                continue
            running = status.motion
            if running and (not self._motions or self._motions[-1] != running):
                self._motions.append(running)
            lies = not is_upright(ticks[0])
            self._fell = self._fell or (lies and not any("dive" in each for each in self._motions))
            if lies or running:
                up = None
            elif up is None and since > 0.0:
                up = since
            limit = self._spec.limit
            if since > min(ROLL, limit) and (up is not None or since > limit):
                break
        return ShotResult(self._spec, speed, not self._scored, tuple(self._motions), self._fell, up)

    def _watch(self, ticks: Sequence[Tick]) -> None:
        pitch = self._pitch
        if pitch.count == round(LOOK / CONTROL_PERIOD):
            place, velocity = self._start
            pitch.world.put_ball(*place, velocity)
        self._scored = self._scored or pitch.ball_in is BallPlace.IN_RED_GOAL


@suite(
    "keeper", "Shots at a keeper", "shots at a goalkeeper: held, dives, up again",
    options={
        "robots": 20, "attempts": ..., "scene": ...,
        "targets": Option(TARGETS, "where shots go", "TARGET", ("--target",), choices=TARGETS),
        "limit": Option(LIMIT, "time [s] to stand again after a shot", "T", minimum=1.0,
                        maximum=3600.0),
    },
    gait=False, quick=({"robots": 4},),
)  # fmt: skip
def keeper(options: Options) -> Iterator[Row | str]:
    """Shots at corners and middle, and shots that miss the goal."""
    specs = [
        ShotSpec(seed=seed, target=target, draw=attempt, scene=options.scene, limit=options.limit,
                 **options.play)
        for seed in options.seeds for attempt in range(options.attempts)
        for target in options.targets
    ]  # fmt: skip
    results: list[ShotResult] = options.map(
        shot, specs, label="shots",
        note=lambda each: f"robot {each.spec.seed}, {each.spec.target}: "
        + ("held" if each.held else "in"),
    )  # fmt: skip

    def at(*targets: str) -> list[ShotResult]:
        return [each for each in results if each.spec.target in targets]

    wide = at("wide left", "wide right")
    yield from rows_of(
        "",
        ("shots_held", "%", percent(each.held for each in at("left", "middle", "right"))),
        ("corners_held", "%", percent(each.held for each in at("left", "right"))),
        ("motions_at_wide_balls", "shots", sum(bool(each.motions) for each in wide)),
        ("up_again", "%", percent(each.up is not None for each in results if each.motions)),
        ("falls", "falls", sum(each.fell for each in results)),
    )
    yield (
        f"Shots from {DISTANCE:g} m before the goal line at {SPEEDS[0]:g} to {SPEEDS[1]:g} m/s; "
        "slower balls stop before the line. Left and right: at the corners; wide: "
        f"{WIDE:g} m beside the posts. Held: not in the goal. Up again: stands within "
        f"{options.limit:g} s after a shot for which it has moved."
    )
