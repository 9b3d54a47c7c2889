"""A Kalman filter of a place and its velocity on the ground, in the frame of a robot that moves."""

import math

import numpy as np

from nao_soccer.vision.percepts import Covariance2
from nao_soccer.world.odometry import Displacement
from robot_core.geometry import planar_rotation
from robot_core.types import FloatArray, Point2


class PlanarTrack:
    """Place [m] and velocity [m/s] (4,) over the ground, in base_footprint at one time."""

    def __init__(self, mean: FloatArray, covariance: FloatArray) -> None:
        self.mean = mean
        self.covariance = covariance

    @classmethod
    def at(cls, position: Point2, covariance: Covariance2, speed: float) -> "PlanarTrack":
        """A place that was seen once; `speed` [m/s] is the deviation of its unknown velocity."""
        full = np.diag((0.0, 0.0, speed**2, speed**2))
        full[:2, :2] = matrix(covariance)
        return cls(np.array((*position, 0.0, 0.0)), full)

    def carry(self, motion: Displacement) -> None:
        """Express the track in base_footprint after a motion of the robot, with its noise."""
        dx, dy, turn = motion.offset
        c, s = math.cos(turn), math.sin(turn)
        full = np.zeros((4, 4))
        full[:2, :2] = full[2:, 2:] = planar_rotation(-turn)
        x, y, vx, vy = (full @ (self.mean - (dx, dy, 0.0, 0.0))).tolist()
        self.mean = np.array((x, y, vx, vy))
        # p' = R'(p - d): an error of d moves p' by -R', one of the turn about the robot.
        noise = np.array(((-c, -s, y), (s, -c, -x), (0.0, 0.0, vy), (0.0, 0.0, -vx)))
        self.covariance = full @ self.covariance @ full.T + noise @ motion.covariance @ noise.T

    def predict(self, dt: float, keep: float, acceleration: float) -> None:
        """The place after `dt` [s]; x F, F P F' + Q.

        `keep` is the share of the velocity that is left at the end, `acceleration` [m/s/s^0.5] its
        deviation by what is not known.
        """
        f = np.eye(4)
        f[0, 2] = f[1, 3] = 0.5 * (1.0 + keep) * dt
        f[2, 2] = f[3, 3] = keep
        q = acceleration**2 * dt
        self.mean = f @ self.mean
        self.covariance = f @ self.covariance @ f.T
        self.covariance.flat[::5] += (q * dt * dt / 3.0, q * dt * dt / 3.0, q, q)  # diagonal

    def innovation(self, position: Point2, covariance: Covariance2) -> tuple[float, float]:
        """Squared distance of a measurement in standard deviations, and its log-likelihood."""
        total = self.covariance[:2, :2] + matrix(covariance)
        error = np.asarray(position) - self.mean[:2]
        square = float(error @ np.linalg.solve(total, error))
        return square, -0.5 * (square + math.log(float(np.linalg.det(total)))) - math.log(math.tau)

    def correct(self, position: Point2, covariance: Covariance2) -> None:
        """Use a measurement of the place: K = P H' (H P H' + R)^-1."""
        p = self.covariance
        gain = p[:, :2] @ np.linalg.inv(p[:2, :2] + matrix(covariance))
        self.mean = self.mean + gain @ (np.asarray(position) - self.mean[:2])
        # Joseph's form keeps the covariance symmetric and positive.
        rest = np.eye(4)
        rest[:, :2] -= gain
        self.covariance = rest @ p @ rest.T + gain @ matrix(covariance) @ gain.T

    def copy(self) -> "PlanarTrack":
        """An independent copy."""
        return PlanarTrack(self.mean.copy(), self.covariance.copy())


def mixture(tracks: list[PlanarTrack], share: list[float]) -> PlanarTrack:
    """One track with the mean and covariance of several with these shares."""
    mean = sum((w * track.mean for w, track in zip(share, tracks, strict=True)), np.zeros(4))
    covariance = np.zeros((4, 4))
    for w, track in zip(share, tracks, strict=True):
        error = track.mean - mean
        covariance += w * (track.covariance + error[:, None] * error)
    return PlanarTrack(mean, covariance)


def matrix(covariance: Covariance2) -> FloatArray:
    """The matrix (2, 2)."""
    xx, xy, yy = covariance
    return np.array(((xx, xy), (xy, yy)))


def triple(covariance: FloatArray) -> Covariance2:
    """The inverse of `matrix`."""
    return float(covariance[0, 0]), float(covariance[0, 1]), float(covariance[1, 1])


def point(values: FloatArray) -> Point2:
    """The first two values."""
    return float(values[0]), float(values[1])


def inside(polygon: FloatArray, place: FloatArray, margin: float) -> bool:
    """Whether a place (2,) is in a convex polygon (k, 2), this far [m] from all edges."""
    if len(polygon) < 3:
        return False
    edge = np.concatenate((polygon[1:], polygon[:1])) - polygon
    area = float(np.sum(edge[:, 0] * polygon[:, 1] - edge[:, 1] * polygon[:, 0]))
    offset = place - polygon
    across = edge[:, 0] * offset[:, 1] - edge[:, 1] * offset[:, 0]
    distance = across / np.maximum(np.hypot(edge[:, 0], edge[:, 1]), 1e-9)
    return bool(np.all(-math.copysign(1.0, area) * distance > margin))
