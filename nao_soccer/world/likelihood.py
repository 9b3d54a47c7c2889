"""How well an image fits poses on the field. All poses are compared at once.

Every feature has a log-likelihood log((1 - e) exp(-d^2 / 2) + e): d is the distance from what the
map predicts, in standard deviations of the percept, e the share of percepts that are wrong. The
features of one image share the errors of its camera pose and are not independent; their sum is
therefore tempered.
"""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from nao_soccer.vision.percepts import Covariance2, Kind, Percepts
from nao_soccer.world.field_map import PERIODS, FieldMap
from robot_core.types import FloatArray

POINTS = 30
"""Largest number of line points of an image that are used."""
LINE_WEIGHT = 6.0
"""Number of independent points to which all line points of an image are equal, at most."""
PATCH = 0.2
"""[m] All line points in a square of this size count as one: they are right or wrong together."""
LANDMARK_WEIGHT, KNOWN_WEIGHT = 0.6, 1.0
"""Number of independent landmarks to which one is equal that looks like others, or like none."""
WRONG = 0.05
"""Share of percepts that are wrong."""
YAW_ERROR = 0.2
"""[rad] Standard deviation of the orientation of a crossing."""
SIDES_TRIED = 72
"""Number of headings from which a known landmark that is seen alone is tried."""
MAP_VARIANCE = 0.02**2
"""[m^2] Variance of a place on the map: cells, paint, and errors that no percept knows of."""


@dataclass(frozen=True, slots=True)
class Landmark:
    """A percept that has a place on the map.

    Attributes:
        position: (2,) [m] in base_footprint.
        covariance: [m^2]
        yaw: [rad] in base_footprint.
        place: Which one on the map; None if it may be any of its kind.
    """

    kind: Kind
    position: FloatArray
    covariance: Covariance2
    yaw: float
    place: int | None = None

    @property
    def weight(self) -> float:
        """Number of independent landmarks to which it is equal."""
        return LANDMARK_WEIGHT if self.place is None else KNOWN_WEIGHT

    def candidates(self, field: FieldMap) -> FloatArray:
        """(n, 3) places and orientations on the map that it may be."""
        rows = field.landmarks[self.kind]
        return rows if self.place is None else rows[self.place : self.place + 1]


@dataclass(frozen=True, slots=True)
class Evidence:
    """What one image says about the pose.

    Attributes:
        points: (m, 2) points on lines [m] in base_footprint.
        covariances: (m, 3) of the points [m^2].
        line_weight: Number of independent points to which all line points are equal.
    """

    points: FloatArray
    covariances: FloatArray
    landmarks: tuple[Landmark, ...]
    line_weight: float

    @classmethod
    def of(cls, percepts: Percepts, field: FieldMap) -> "Evidence":
        """The evidence of an image; at most `POINTS` points, evenly drawn."""
        count = len(percepts.line_points)
        chosen = np.linspace(0, count - 1, min(count, POINTS)).round().astype(int)
        points = percepts.line_points[chosen]
        patches = {(math.floor(x / PATCH), math.floor(y / PATCH)) for x, y in points.tolist()}
        return cls(
            points,
            percepts.line_covariances[chosen] + (MAP_VARIANCE, 0.0, MAP_VARIANCE),
            tuple(
                Landmark(
                    each.kind,
                    np.array(each.position),
                    (
                        each.covariance[0] + MAP_VARIANCE,
                        each.covariance[1],
                        each.covariance[2] + MAP_VARIANCE,
                    ),
                    each.yaw,
                    each.place,
                )
                for each in percepts.objects
                if each.kind in field.landmarks
            ),
            min(LINE_WEIGHT, float(len(patches))),
        )

    @property
    def weight(self) -> float:
        """Number of independent features to which the evidence is equal."""
        alike = len(self.landmarks) - self.known
        return self.line_weight + LANDMARK_WEIGHT * alike + KNOWN_WEIGHT * self.known

    @property
    def known(self) -> int:
        """Number of landmarks that are known; two have no mirror pose."""
        return sum(each.place is not None for each in self.landmarks)


def log_likelihood(
    evidence: Evidence, poses: FloatArray, field: FieldMap, tilt: FloatArray | None = None
) -> tuple[FloatArray, FloatArray]:
    """Log-likelihoods (n,) of an image for poses (n, 3) of base_footprint in `field`.

    And the share of the evidence (n,) that each pose explains. `tilt` (n,): by how many standard
    deviations all percepts are too far away, because the camera looks lower than it is thought to.
    """
    c, s = np.cos(poses[:, 2])[:, None], np.sin(poses[:, 2])[:, None]
    total = np.zeros(len(poses))
    explained = np.zeros(len(poses))
    count = len(evidence.points)
    if count:
        each = _points(evidence, poses, c, s, field, tilt)
        share = evidence.line_weight / count
        total += share * _mixed(each, explained, share)
    for landmark in evidence.landmarks:
        each = _landmark(landmark, poses, c, s, field, tilt)[:, None]
        total += landmark.weight * _mixed(each, explained, landmark.weight)
    return total, explained / max(evidence.weight, 1e-9)


def _mixed(square: FloatArray, explained: FloatArray, weight: float) -> FloatArray:
    """Sum of the log-likelihoods of features by their squared distances (n, m) in deviations.

    `explained` (n,) is increased by the share of right percepts.
    """
    fit = (1.0 - WRONG) * np.exp(-0.5 * square)
    mixed = fit + WRONG
    explained += weight * np.sum(fit / mixed, axis=1)
    result: FloatArray = np.sum(np.log(mixed), axis=1)
    return result


def _nearer(
    position: FloatArray, covariance: FloatArray, tilt: FloatArray | None
) -> tuple[FloatArray, FloatArray]:
    """x, y of percepts (m, 2) without the error that makes them seem further away: (m,) or (n, m).

    Their covariances (m, 3) hold the map's variance.
    """
    x, y = position.T
    if tilt is None:
        return x, y
    xx, xy, yy = covariance.T
    square = np.maximum(x * x + y * y, 1e-6)
    variance = (x * x * xx + 2.0 * x * y * xy + y * y * yy) / square - MAP_VARIANCE
    scale = 1.0 - tilt[:, None] * np.sqrt(np.maximum(variance, 0.0) / square)
    return scale * x, scale * y


def _points(
    evidence: Evidence,
    poses: FloatArray,
    c: FloatArray,
    s: FloatArray,
    field: FieldMap,
    tilt: FloatArray | None,
) -> FloatArray:
    """(n, m) squared distances of the line points from the nearest line."""
    px, py = _nearer(evidence.points, evidence.covariances, tilt)
    xx, xy, yy = evidence.covariances.T
    distance, nx, ny = field.nearest(
        poses[:, 0:1] + c * px - s * py, poses[:, 1:2] + s * px + c * py
    )
    # Only the error across the line counts; its normal is turned into base_footprint.
    bx, by = c * nx + s * ny, c * ny - s * nx
    variance = bx * bx * xx + 2.0 * bx * by * xy + by * by * yy
    result: FloatArray = distance * distance / np.maximum(variance, MAP_VARIANCE)
    return result


def _landmark(
    landmark: Landmark,
    poses: FloatArray,
    c: FloatArray,
    s: FloatArray,
    field: FieldMap,
    tilt: FloatArray | None,
) -> FloatArray:
    """(n,) squared distance of a landmark from the nearest one of its kind on the map."""
    candidates = landmark.candidates(field)
    dx = candidates[:, 0] - poses[:, 0:1]
    dy = candidates[:, 1] - poses[:, 1:2]
    px, py = _nearer(landmark.position[None], np.array((landmark.covariance,)), tilt)
    ex = c * dx + s * dy - px
    ey = c * dy - s * dx - py
    xx, xy, yy = landmark.covariance
    determinant = xx * yy - xy * xy
    square = (yy * ex * ex - 2.0 * xy * ex * ey + xx * ey * ey) / determinant
    period = PERIODS.get(landmark.kind)
    if period is not None:
        turn = candidates[:, 2] - poses[:, 2:3] - landmark.yaw
        turn -= period * np.rint(turn / period)
        square += (turn / YAW_ERROR) ** 2
    result: FloatArray = square.min(axis=1)
    return result


def poses_from(evidence: Evidence, field: FieldMap) -> FloatArray:
    """Poses (k, 3) on the carpet that explain a crossing, two posts or known landmarks."""
    found = [_from_crossing(each, field) for each in evidence.landmarks if each.kind in PERIODS]
    known = [each for each in evidence.landmarks if each.place is not None]
    found += [_from_known(first, second, field) for first, second in pairwise(known)]
    if len(known) == 1:
        found.append(_around(known[0], field))
    posts = [each.position for each in evidence.landmarks if each.kind is Kind.GOAL_POST]
    for index, first in enumerate(posts):
        for second in posts[index + 1 :]:
            found.append(_from_goal(first, second, field))
    if not found:
        return np.zeros((0, 3))
    poses = np.concatenate(found)
    return poses[field.contains(poses)]


def _from_crossing(landmark: Landmark, field: FieldMap) -> FloatArray:
    candidates = field.landmarks[landmark.kind]
    turns = round(math.tau / PERIODS[landmark.kind])
    yaw = candidates[:, 2] - landmark.yaw
    yaw = (yaw[:, None] + math.tau / turns * np.arange(turns)).ravel()
    places = np.repeat(candidates[:, :2], turns, axis=0)
    return _standing(places, yaw, landmark.position)


def _from_goal(first: FloatArray, second: FloatArray, field: FieldMap) -> FloatArray:
    apart = second - first
    if abs(float(np.hypot(*apart)) - field.goal_width) > 0.2 * field.goal_width:
        return np.zeros((0, 3))
    posts = field.landmarks[Kind.GOAL_POST]
    found = []
    for a, b in ((0, 1), (1, 0), (2, 3), (3, 2)):
        on_map = posts[b, :2] - posts[a, :2]
        yaw = math.atan2(on_map[1], on_map[0]) - math.atan2(apart[1], apart[0])
        middle = 0.5 * (posts[a, :2] + posts[b, :2])
        found.append(_standing(middle[None], np.array([yaw]), 0.5 * (first + second)))
    return np.concatenate(found)


def _from_known(first: Landmark, second: Landmark, field: FieldMap) -> FloatArray:
    a, b = (each.candidates(field)[0, :2] for each in (first, second))
    on_map, apart = b - a, second.position - first.position
    yaw = math.atan2(on_map[1], on_map[0]) - math.atan2(apart[1], apart[0])
    middle = 0.5 * (first.position + second.position)
    return _standing(0.5 * (a + b)[None], np.array([yaw]), middle)


def _around(landmark: Landmark, field: FieldMap) -> FloatArray:
    """Poses (k, 3) on the circle around a known landmark from which it is seen so."""
    place = landmark.candidates(field)[:, :2]
    yaw = np.linspace(0.0, math.tau, SIDES_TRIED, endpoint=False)
    return _standing(np.repeat(place, SIDES_TRIED, axis=0), yaw, landmark.position)


def _standing(places: FloatArray, yaw: FloatArray, seen: FloatArray) -> FloatArray:
    """Poses (k, 3) of these yaws (k,) from which places (k, 2) are seen at `seen` (2,)."""
    c, s = np.cos(yaw), np.sin(yaw)
    x = places[:, 0] - c * seen[0] + s * seen[1]
    y = places[:, 1] - s * seen[0] - c * seen[1]
    return np.column_stack((x, y, yaw))
