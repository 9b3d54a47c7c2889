"""A standing robot kicks a ball: one attempt."""

import math
from dataclasses import dataclass

import numpy as np

from nao_lipm_gait.gait import Gait
from robot_core.errors import NaoGaitError
from robot_core.motion.library import shipped_library
from robot_core.types import FloatArray, GaitState
from sim_bridge.ball import Ball
from sim_bridge.trials.metrics import yaw_of
from sim_bridge.trials.motions import FAR_AWAY, spot_in_world
from sim_bridge.trials.trial import (
    CONTROL_PERIOD,
    HeldCommand,
    Tick,
    TrialSpec,
    loaded_robot,
    make_gait,
    make_world,
    run,
)
from sim_bridge.world import World

SETTLE = 1.5
"""[s] of standing before the ball is put down."""
AFTERWARDS = 2.0
"""[s] for which the robot has to stand after the kick."""
PLACEMENT = 0.005
"""[m] standard deviation of where the ball is put, in x and in y."""
STOPPED = 0.01
"""[m/s] below which the ball has come to rest."""
ROLL_LIMIT = 8.0
"""[s] after the kick for which the ball may roll."""


@dataclass(frozen=True, slots=True)
class KickSpec(TrialSpec):
    """Everything that an attempt depends on; the noise seed also draws where the ball is put.

    Attributes:
        motion: Name of the kick.
    """

    motion: str


@dataclass(frozen=True, slots=True)
class KickResult:
    """Result of an attempt.

    Attributes:
        spec: The specification.
        distance: [m] from where the ball was put to where it came to rest.
        direction: [rad] of its way, counter-clockwise from the robot's heading before the kick.
        speed: [m/s] largest of the ball.
        stood: The robot never fell.
        seconds: [s] from the request to the stand of the gait.
    """

    spec: KickSpec
    distance: float
    direction: float
    speed: float
    stood: bool
    seconds: float


def kick_directions(urdf: str) -> dict[str, float]:
    """Where each kick of a robot is meant to send the ball, by name [rad].

    Raises:
        NaoGaitError: The robot has no kicks.
    """
    motions = sorted(shipped_library(loaded_robot(urdf)).motions.items())
    found = {name: motion.kick.direction for name, motion in motions if motion.kick is not None}
    if not found:
        raise NaoGaitError("urdf", urdf, "a robot with kicks in config/motions/")
    return found


def kick(spec: KickSpec) -> KickResult:
    """Run one attempt.

    Raises:
        NaoGaitError: The motion is no kick.
    """
    motion = shipped_library(loaded_robot(spec.urdf)).find(spec.motion)
    if motion.kick is None:
        raise NaoGaitError("motion", spec.motion, "a kick")
    with make_world(spec, ball=Ball(*FAR_AWAY)) as world:
        return _attempt(spec, world, make_gait(spec), (motion.kick.x, motion.kick.y))


def _attempt(
    spec: KickSpec, world: World, gait: Gait, spot: tuple[float, float]
) -> KickResult:
    ticks = run(world, gait, HeldCommand(), past_falls=True)
    next(ticks)  # at rest
    up = True

    def advance() -> Tick:
        nonlocal up
        tick = next(ticks)
        up = up and not tick.fallen
        return tick

    for _ in range(round(SETTLE / CONTROL_PERIOD)):
        before = advance()
    lay = _put_ball(spec, world, before, spot)
    heading = float(yaw_of(before.truth.torso_quaternion))
    gait.request_motion(spec.motion)
    advance()
    count, fastest = 1, 0.0
    while gait.state is GaitState.MOTION and up:
        advance()
        count += 1
        fastest = max(fastest, _ball_speed(world))
    waited = 0.0
    while waited < ROLL_LIMIT and (waited < AFTERWARDS or _ball_speed(world) > STOPPED):
        advance()
        waited += CONTROL_PERIOD
        fastest = max(fastest, _ball_speed(world))
        if not up and waited > AFTERWARDS:
            break
    ball = world.ball
    way = np.zeros(2) if ball is None else ball.position[:2] - lay
    direction = math.remainder(math.atan2(way[1], way[0]) - heading, math.tau)
    return KickResult(
        spec, float(np.hypot(*way)), direction, fastest, up, count * CONTROL_PERIOD
    )


def _put_ball(
    spec: KickSpec, world: World, tick: Tick, spot: tuple[float, float]
) -> FloatArray:
    """Put the ball near the kick's spot; (2,) [m] in the world."""
    random = np.random.default_rng([spec.robot_seed + 1, spec.noise_seed])
    x, y = np.array(spot) + random.normal(0.0, PLACEMENT, 2)
    lay = spot_in_world(tick.truth, float(x), float(y))
    world.put_ball(float(lay[0]), float(lay[1]))
    return lay


def _ball_speed(world: World) -> float:
    ball = world.ball
    return 0.0 if ball is None else float(np.hypot(*ball.velocity[:2]))
