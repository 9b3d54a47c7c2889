"""A ball that rests, rolls and is put somewhere else, for trials of the world model."""

import math
from typing import NamedTuple

import numpy as np

from robot_core.geometry import compose
from robot_core.types import Point2, Pose2
from sim_bridge.ball import ROLLING_SLOWDOWN

RESTS, LASTS = 3.0, 8.0
"""[s] A ball that was put down rests, then rolls; then it is put somewhere else."""
DISTANCE = (0.4, 2.0)
"""[m] From the robot at which it is put down."""
BEARING = math.radians(60.0)
"""[rad] Largest bearing at which it is put down."""
CLEAR = 0.25
"""[m] A ball that comes nearer to the robot is put somewhere else."""
SPEED = (0.3, 1.2)
"""[m/s] At which it begins to roll."""


class BallTruth(NamedTuple):
    """The true ball.

    Attributes:
        position: [m] on the field.
        velocity: [m/s]
        since: [s] since it was put down or kicked.
    """

    position: Point2
    velocity: Point2
    since: float


class BallCourse:
    """Where the ball is at each time; it stays on the carpet of half length and half width [m]."""

    def __init__(self, half: tuple[float, float], seed: int) -> None:
        self._half = half
        self._random = np.random.default_rng((seed, 3))
        self._position: Point2 = (0.0, 0.0)
        self._velocity: Point2 = (0.0, 0.0)
        self._time = self._put = self._kicked = -math.inf
        self._rolls = False

    def at(self, time: float, robot: Pose2) -> BallTruth:
        """The ball at a time [s]; times rise. `robot` is the true base_footprint."""
        if time - self._put >= LASTS or math.dist(self._position, robot[:2]) < CLEAR:
            self._position, self._velocity = self._beside(robot), (0.0, 0.0)
            self._put = self._time = time
            self._rolls = False
        elif not self._rolls and time - self._put >= RESTS:
            angle = self._random.uniform(-math.pi, math.pi)
            speed = self._random.uniform(*SPEED)
            self._velocity = speed * math.cos(angle), speed * math.sin(angle)
            self._rolls, self._kicked = True, time
        self._roll(time - self._time)
        self._time = time
        return BallTruth(self._position, self._velocity, time - max(self._put, self._kicked))

    def _beside(self, robot: Pose2) -> Point2:
        for _ in range(20):
            away = self._random.uniform(*DISTANCE)
            bearing = self._random.uniform(-BEARING, BEARING)
            x, y, _ = compose(robot, (away * math.cos(bearing), away * math.sin(bearing), 0.0))
            if abs(x) < self._half[0] and abs(y) < self._half[1]:
                return x, y
        return 0.0, 0.0

    def _roll(self, dt: float) -> None:
        vx, vy = self._velocity
        speed = math.hypot(vx, vy)
        if speed <= 0.0 or dt <= 0.0:
            return
        after = max(0.0, speed - ROLLING_SLOWDOWN * dt)
        way = 0.5 * (speed + after) * dt if after else speed**2 / ROLLING_SLOWDOWN / 2.0
        x, y = (p + v / speed * way for p, v in zip(self._position, self._velocity, strict=True))
        self._velocity = vx * after / speed, vy * after / speed
        if abs(x) > self._half[0] or abs(y) > self._half[1]:  # it is stopped at the border
            self._velocity = (0.0, 0.0)
            x, y = (min(max(a, -limit), limit) for a, limit in zip((x, y), self._half, strict=True))
        self._position = x, y
