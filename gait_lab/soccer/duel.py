"""Two robots and a ball between them, with percepts by the model: who gains ground, who falls."""

import math
from dataclasses import dataclass, field

import numpy as np

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
RESTS = 0.03
"""[m/s] A slower ball rests."""
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
    doing: str


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
    doing = "; ".join(str(player.path[-1]) if player.path else "" for player in pitch.players)
    red_falls, blue_falls = pitch.falls
    return DuelResult(
        spec, place[0], way, still / ticks, free, (red_falls, blue_falls),
        ticks * CONTROL_PERIOD, doing,
    )  # fmt: skip


def _place(bearing: float, random: np.random.Generator) -> Pose2:
    """A pose at the ball in the middle of the field, about facing it."""
    far = random.uniform(NEAR, FAR)
    heading = bearing + math.pi + random.uniform(-ASKEW, ASKEW)
    return far * math.cos(bearing), far * math.sin(bearing), math.remainder(heading, math.tau)
