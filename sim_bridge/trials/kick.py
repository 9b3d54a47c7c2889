"""A standing robot kicks a ball: one attempt."""

import math
from dataclasses import dataclass

import numpy as np

from robot_core.errors import NaoGaitError
from robot_core.motion.library import shipped_library
from robot_core.types import FloatArray, GaitState
from sim_bridge.ball import Ball
from sim_bridge.robot import GroundTruth
from sim_bridge.trials.metrics import yaw_of
from sim_bridge.trials.motions import FAR_AWAY, spot_in_world
from sim_bridge.trials.trial import CONTROL_PERIOD, Trial, TrialSpec, loaded_robot

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
    with Trial(spec, ball=Ball(*FAR_AWAY)) as trial:
        before = trial.advance(SETTLE).truth
        ball = BallWay(trial, _spot(spec, before, motion.kick.x, motion.kick.y))
        trial.gait.request_motion(spec.motion)
        trial.step()
        count = 1
        while trial.gait.state is GaitState.MOTION and trial.stood:
            trial.step()
            ball.look()
            count += 1
        waited = 0.0
        while waited < ROLL_LIMIT and (waited < AFTERWARDS or ball.speed > STOPPED):
            trial.step()
            waited += CONTROL_PERIOD
            ball.look()
            if not trial.stood and waited > AFTERWARDS:
                break
        heading = float(yaw_of(before.torso_quaternion))
        return KickResult(
            spec, ball.distance, ball.direction(heading), ball.fastest, trial.stood,
            count * CONTROL_PERIOD,
        )  # fmt: skip


class BallWay:
    """The way of a ball from where it is put down now.

    Attributes:
        way: (2,) [m] from there to where it was seen last.
        speed: [m/s] when it was seen last.
        fastest: [m/s] the largest of these.
    """

    def __init__(self, trial: Trial, lay: FloatArray) -> None:
        self._world, self._lay = trial.world, lay
        self._world.put_ball(float(lay[0]), float(lay[1]))
        self.way, self.speed, self.fastest = np.zeros(2), 0.0, 0.0

    def look(self) -> None:
        """See where it is."""
        ball = self._world.ball
        assert ball is not None
        self.way = ball.position[:2] - self._lay
        self.speed = float(np.hypot(*ball.velocity[:2]))
        self.fastest = max(self.fastest, self.speed)

    @property
    def distance(self) -> float:
        """[m] that it has come."""
        return float(np.hypot(*self.way))

    def direction(self, heading: float) -> float:
        """[rad] of its way, counter-clockwise from a heading [rad]."""
        return math.remainder(math.atan2(self.way[1], self.way[0]) - heading, math.tau)


def _spot(spec: KickSpec, truth: GroundTruth, x: float, y: float) -> FloatArray:
    """(2,) [m] in the world, near the place x, y of the kick in front of the robot."""
    random = np.random.default_rng([spec.robot_seed + 1, spec.noise_seed])
    x, y = np.array((x, y)) + random.normal(0.0, PLACEMENT, 2)
    return spot_in_world(truth, float(x), float(y))
