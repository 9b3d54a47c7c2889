"""Where the robot went: odometry laid over ground truth."""

from dataclasses import dataclass

import numpy as np

from gait_lab.report.body import BodyTrack, yaw_of_pose
from gait_lab.report.walk import IntArray, Walk
from nao_lipm_gait.types import FloatArray


@dataclass(frozen=True, slots=True)
class Paths:
    """Both begin at (0, 0), looking along x; t rows."""

    stamp: IntArray
    truth: FloatArray
    """(t, 3) x, y [m], yaw [rad] of the middle between the soles; empty without ground truth."""
    odometry: FloatArray
    """(t, 3) of base_footprint."""
    length: float
    """[m] walked, by truth if there is one."""

    @property
    def error(self) -> FloatArray:
        """(t, 3) odometry minus truth; empty without ground truth."""
        if not len(self.truth):
            return np.empty((0, 3))
        difference = self.odometry - self.truth
        difference[:, 2] = (difference[:, 2] + np.pi) % (2 * np.pi) - np.pi
        return difference


SMOOTHING = 0.5
"""[s] over which the way is straightened before its length is taken: the torso sways."""


def find_paths(walk: Walk, body: BodyTrack | None) -> Paths | None:
    """None without odometry and without ground truth."""
    odometry = _from_start(_unwrapped(walk.odometry.value))
    stamp = walk.odometry.stamp
    truth = np.empty((0, 3))
    if body is not None and body.from_truth:
        known = np.isfinite(body.sole[:, 0, 0, 3])
        poses = body.sole[known]
        yaw = np.unwrap(yaw_of_pose(poses), axis=0).mean(axis=1)
        middle = np.column_stack([poses[:, :, 0, 3].mean(axis=1), poses[:, :, 1, 3].mean(axis=1),
                                  np.unwrap(yaw)])  # fmt: skip
        if not len(stamp):
            stamp = body.stamp[known]
            odometry = np.full((len(stamp), 3), np.nan)
        shared, rows, own = np.intersect1d(stamp, body.stamp[known], return_indices=True)
        if len(shared):
            stamp, truth = shared, _from_start(middle[own])
            odometry = _from_start(odometry[rows])
    if len(stamp) < 2:
        return None
    return Paths(stamp, truth, odometry, _length(walk, truth if len(truth) else odometry))


def _unwrapped(pose: FloatArray) -> FloatArray:
    pose = pose.copy()
    pose[:, 2] = np.unwrap(pose[:, 2])
    return pose


def _from_start(pose: FloatArray) -> FloatArray:
    """(t, 3) poses seen from the first one."""
    if not len(pose):
        return pose
    dx, dy = pose[:, 0] - pose[0, 0], pose[:, 1] - pose[0, 1]
    c, s = np.cos(pose[0, 2]), np.sin(pose[0, 2])
    return np.column_stack([c * dx + s * dy, c * dy - s * dx, pose[:, 2] - pose[0, 2]])


def _length(walk: Walk, pose: FloatArray) -> float:
    every = max(1, round(SMOOTHING * 1e9 / max(1, walk.period)))
    points = pose[::every, :2]
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
