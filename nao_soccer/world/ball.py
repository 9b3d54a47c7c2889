"""The ball: an interacting multiple model Kalman filter of a ball that rests or rolls.

A ball that rests has velocity 0: hundreds of images of it sharpen its place, and the noise of a far
ball is not taken for speed. A ball that rolls slows down by friction. Likelihoods of the images
decide between the two (Blom and Bar-Shalom 1988). A second ball is kept for images that fit neither
(a jump, or a false percept); it takes over if it is seen more often. Where both are seen in turn,
as two real balls are, the first one is kept unless it is seen much less often or not any more.
"""

import math
from copy import copy

import numpy as np

from nao_soccer.vision.percepts import Covariance2, Percept
from nao_soccer.world.odometry import Displacement
from nao_soccer.world.planar_track import PlanarTrack, inside, mixture
from robot_core.types import FloatArray

REST, ROLL = 0, 1
STARTS, STOPS = 0.25, 0.5
"""[1/s] Rates at which a resting ball begins to roll and a rolling one stops."""
SPEED = 0.8
"""[m/s] Deviation of the velocity of a ball that begins to roll."""
ACCELERATION = 0.25
"""[m/s/s^0.5] Unknown changes of the velocity: tufts, light contacts."""
DRIFT = 0.02
"""[m/s/s^0.5] Unknown changes of the place of a resting ball, as a velocity."""
SYSTEMATIC = 0.01
"""Share of the distance that is wrong for many images in a row; more images do not reduce it."""
NOISE_MIN = 0.01
"""[m] Least deviation of a measurement."""
GATE = 16.0
"""Squared standard deviations from which on a measurement is of another ball."""
MEMORY = 0.6
"""[s] Time constant by which earlier sightings count for less."""
LONG_MEMORY = 3.0
"""[s] The same, where two balls are seen in turn."""
MORE_OFTEN = 3.0
"""How many times as often the second of two balls seen in turn is seen when it takes over."""
HOLD = 2.0
"""[s] Time without a sighting, after which a second ball that was seen in turn takes over."""
FORGET = 12.0
"""[s] Time without a sighting after which the ball is forgotten."""
DEVIATION_MAX = 1.5
"""[m] Deviation of the place above which nothing is known."""
MISSES = 5.0
"""Number of images that should show the ball and do not, after which it is forgotten."""
DOUBT = 2.0
"""Number of misses from which on the ball was not seen recently."""
RECENT = 1.0
"""[s]"""
SURE_RANGE = 2.0
"""[m] Distance up to which an image that does not show the ball is a miss."""


class BallTrack:
    """One ball: both models, how likely each is, and how often it was seen.

    Attributes:
        score: Number of sightings, fading with `MEMORY`.
        long_score: The same with `LONG_MEMORY`.
        age: [s] since the last one.
        misses: Number of images since then that should have shown it.
    """

    def __init__(self, ball: Percept, slowdown: float) -> None:
        noise = _noise(ball)
        self._models = [
            PlanarTrack.at(ball.position, noise, 0.0),
            PlanarTrack.at(ball.position, noise, SPEED),
        ]
        self._share = [0.5, 0.5]
        self._slowdown = slowdown
        self.score = self.long_score = 1.0
        self.age = self.misses = 0.0

    def advance(self, motion: Displacement, dt: float) -> None:
        """Carry the ball through a motion of the robot and a time [s]."""
        self.age += dt
        self.score *= math.exp(-dt / MEMORY)
        self.long_score *= math.exp(-dt / LONG_MEMORY)
        for track in self._models:
            track.carry(motion)
        if dt <= 0.0:
            return
        self._mix(dt)
        rest, roll = self._models
        rest.predict(dt, 1.0, DRIFT)
        rest.mean[2:] = 0.0
        rest.covariance[2:, :] = rest.covariance[:, 2:] = 0.0
        # Friction takes its share of the likely speed, not of that of the mean, which may be 0.
        unknown = float(np.trace(roll.covariance[2:, 2:]))
        speed = math.sqrt(roll.mean[2] ** 2 + roll.mean[3] ** 2 + unknown)
        slower = self._slowdown * dt
        roll.predict(dt, max(0.0, 1.0 - slower / max(speed, 1e-9)), ACCELERATION)

    def _mix(self, dt: float) -> None:
        """Interaction: each model begins with what both hold, by the odds of a change."""
        starts, stops = (1.0 - math.exp(-rate * dt) for rate in (STARTS, STOPS))
        moves = ((1.0 - starts, starts), (stops, 1.0 - stops))
        rest, roll = self._models
        starting = rest.copy()  # a resting ball that begins to roll has an unknown velocity
        starting.covariance[2, 2] = starting.covariance[3, 3] = SPEED**2
        stopped = roll.copy()
        mixed, shares = [], []
        for model, sources in ((REST, (rest, stopped)), (ROLL, (starting, roll))):
            parts = [self._share[i] * moves[i][model] for i in (REST, ROLL)]
            total = sum(parts)
            mixed.append(mixture(list(sources), [part / total for part in parts]))
            shares.append(total)
        self._models, self._share = mixed, shares

    def copy(self) -> "BallTrack":
        """An independent copy."""
        other = copy(self)
        other._models = [track.copy() for track in self._models]
        other._share = list(self._share)
        return other

    def fit(self, ball: Percept) -> float:
        """Log-likelihood of a measurement of this ball; minus infinity if it cannot be of it."""
        noise = _noise(ball)
        fits = [track.innovation(ball.position, noise) for track in self._models]
        if all(square >= GATE for square, _ in fits):
            return -math.inf
        most = max(log for _, log in fits)
        odds = (s * math.exp(log - most) for s, (_, log) in zip(self._share, fits, strict=True))
        return most + math.log(max(sum(odds), 1e-300))

    def see(self, ball: Percept) -> None:
        """Use a measurement."""
        noise = _noise(ball)
        logs = [track.innovation(ball.position, noise)[1] for track in self._models]
        most = max(logs)
        odds = [
            max(share, 1e-6) * math.exp(log - most)
            for share, log in zip(self._share, logs, strict=True)
        ]
        self._share = [each / sum(odds) for each in odds]
        for track in self._models:
            track.correct(ball.position, noise)
        self.score += 1.0
        self.long_score += 1.0
        self.age = self.misses = 0.0

    @property
    def estimate(self) -> PlanarTrack:
        """Mean and covariance of both models, with the systematic error of the distance."""
        track = mixture(self._models, self._share)
        place = track.mean[:2]
        track.covariance[:2, :2] += SYSTEMATIC**2 * (place[:, None] * place)
        return track


class BallFilter:
    """The ball that this robot has seen itself; a rolling one slows down by `slowdown` [m/s^2]."""

    def __init__(self, slowdown: float) -> None:
        self._slowdown = slowdown
        self._ball: BallTrack | None = None
        self._other: BallTrack | None = None
        self._both_seen = False

    @property
    def ball(self) -> BallTrack | None:
        """The ball; None if nothing is known of it."""
        return self._ball

    def forget(self) -> None:
        """Forget everything."""
        self._ball = self._other = None

    def advance(self, motion: Displacement, dt: float) -> None:
        """Carry the ball to the time of the next image; forget what is too uncertain."""
        for track in (self._ball, self._other):
            if track is not None:
                track.advance(motion, dt)
        if self._ball is not None and _is_unknown(self._ball):
            self._ball, self._other = self._other, None
        if self._other is not None and (self._other.score < 0.2 or _is_unknown(self._other)):
            self._other = None

    def see(self, ball: Percept) -> None:
        """Use a sighting."""
        first, second = (
            -math.inf if track is None else track.fit(ball) for track in (self._ball, self._other)
        )
        if self._ball is not None and first >= second and first > -math.inf:
            self._ball.see(ball)
            self._both_seen = self._both_seen or self._other is not None
        elif self._other is not None and second > -math.inf:
            self._other.see(ball)
        elif self._ball is None:
            self._ball = BallTrack(ball, self._slowdown)
        else:
            self._other, self._both_seen = BallTrack(ball, self._slowdown), False
        if self._other_takes_over():
            self._ball, self._other = self._other, self._ball
            self._both_seen = True

    def _other_takes_over(self) -> bool:
        ball, other = self._ball, self._other
        if ball is None or other is None or other.score <= max(1.5, ball.score):
            return False
        if not self._both_seen:
            return True  # the ball has not been seen since the other was: it has jumped
        return ball.age > HOLD or other.long_score > MORE_OFTEN * ball.long_score

    def miss(self, visible: FloatArray) -> None:
        """An image without a ball; `visible` (k, 2) [m] is its ground, empty = unknown."""
        track = self._ball
        if track is None:
            return
        estimate = track.estimate
        deviation = float(np.sqrt(np.linalg.eigvalsh(estimate.covariance[:2, :2])[-1]))
        if float(np.hypot(*estimate.mean[:2])) < SURE_RANGE and inside(
            visible, estimate.mean[:2], 0.05 + deviation
        ):
            track.misses += 1.0
            if track.misses >= MISSES:
                self._ball, self._other = self._other, None


def _is_unknown(track: BallTrack) -> bool:
    largest = np.linalg.eigvalsh(track.estimate.covariance[:2, :2])[-1]
    return track.age > FORGET or bool(largest > DEVIATION_MAX**2)


def _noise(ball: Percept) -> Covariance2:
    xx, xy, yy = ball.covariance
    return xx + NOISE_MIN**2, xy, yy + NOISE_MIN**2
