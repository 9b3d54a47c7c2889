"""Percepts against the truth: found, missed, false, and how far off."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, fields
from typing import NamedTuple

import numpy as np

from gait_lab.vision.expected import Expected, View
from gait_lab.vision.rendered_frames import FrameTruth
from nao_soccer.vision.image_geometry import ImageGeometry
from nao_soccer.vision.percepts import CROSSINGS, ROBOTS, Kind, Percept, Percepts
from robot_core.geometry import wrapped
from robot_core.robot.camera import CameraPose
from robot_core.types import FloatArray, Point2

GATE = (0.15, 0.15)
"""[m] and share of the distance within which a percept is that of an object."""
RANGE = 3.0
"""[m] Distance to which recall is counted."""
LINE_GATE = (0.1, 2.0)
"""[m] and [px] along the line of sight: a point farther off every line is false."""
LINE_FOUND = 6.0
"""[px] A point of a line is found if vision has one so near."""
LINE_FALSE = 5
"""Least number of false points in an image for a false line."""
GROUPS: dict[str, tuple[Kind, ...]] = {
    "ball": (Kind.BALL,),
    "posts": (Kind.GOAL_POST,),
    "robots": ROBOTS,
    "crossings": CROSSINGS,
    "circle": (Kind.CENTRE_CIRCLE,),
}
"""Kinds that may be taken for each other."""


class PoseDeviation(NamedTuple):
    """Error of the camera's pose in base_footprint in one image, as vision used it.

    Attributes:
        tilt: [rad] by which its line of sight seems lower.
        pan: [rad] by which it seems farther to the left.
        x: [m] of its position.
        y: [m]
        height: [m] Its true height.
    """

    tilt: float
    pan: float
    x: float
    y: float
    height: float


class Sighting(NamedTuple):
    """An object of one image.

    Attributes:
        position: [m] in the true base_footprint.
        in_image: See `Expected`.
        due: See `Expected`.
        seen_as: Kind of the percept that is nearest to it; None if it was missed.
        percept: [m] Place of that percept.
    """

    kind: Kind
    position: Point2
    in_image: bool
    due: bool
    seen_as: Kind | None
    percept: Point2
    pose: PoseDeviation

    @property
    def distance(self) -> float:
        """[m] from base_footprint."""
        return math.hypot(*self.position)

    @property
    def error(self) -> float:
        """Of the place, of the distance."""
        return math.dist(self.position, self.percept) / max(self.distance, 1e-3)


class LinePoint(NamedTuple):
    """Columns of what is stored of points on lines; one row for each.

    Attributes:
        distance: [m]
        depression: [rad] Own error of its depression; NaN if its line leads away.
        bearing: [rad] Own error of its bearing; NaN if its line lies across.
        off: [m] Of its place in base_footprint from the nearest line.
    """

    distance: FloatArray
    depression: FloatArray
    bearing: FloatArray
    off: FloatArray


@dataclass(slots=True)
class Score:
    """What was seen in some images.

    Attributes:
        images: Their number.
        sightings: Objects that are due, in the image or found.
        false: Percepts of nothing: kind and place [m].
        poses: Errors of the camera's pose, by image.
        line_due: (n, 2) arrays of the points of lines that were due: distance [m], found (0 or 1).
        line_points: Points on lines that were found.
        false_line_points: Number of points on no line.
        false_lines: Number of images with a false line.
        times: [s] of vision, by image.
    """

    images: int = 0
    sightings: list[Sighting] = field(default_factory=list)
    false: list[tuple[Kind, Point2]] = field(default_factory=list)
    poses: list[PoseDeviation] = field(default_factory=list)
    line_due: list[FloatArray] = field(default_factory=list)
    line_points: list[LinePoint] = field(default_factory=list)
    false_line_points: int = 0
    false_lines: int = 0
    times: list[float] = field(default_factory=list)

    def add(self, other: "Score") -> None:
        """Add other images."""
        for each in fields(self):
            setattr(self, each.name, getattr(self, each.name) + getattr(other, each.name))

    def _near(self, group: str) -> list[Sighting]:
        """Objects of a group within `RANGE`."""
        kinds = GROUPS[group]
        return [each for each in self.sightings if each.kind in kinds and each.distance <= RANGE]

    def due(self, group: str) -> list[Sighting]:
        """Objects of a group that had to be reported."""
        return [each for each in self._near(group) if each.due]

    def recall(self, group: str) -> float | None:
        """Share of them that was reported, with its kind [%]; None without any."""
        return _percent([each.seen_as is each.kind for each in self.due(group)])

    def false_per(self, group: str, images: int) -> float | None:
        """Percepts of a group in so many images that are of nothing, or of another kind."""
        kinds = GROUPS[group]
        count = sum(kind in kinds for kind, _ in self.false)
        count += sum(
            each.seen_as is not None and each.seen_as is not each.kind
            for each in self.sightings
            if each.kind in kinds
        )
        return count * images / self.images if self.images else None

    def error_median(self, group: str) -> float | None:
        """Median error of what was reported, of the distance [%]."""
        errors = [each.error for each in self._near(group) if each.seen_as is not None]
        return 100.0 * float(np.median(errors)) if errors else None

    def line_recall(self) -> float | None:
        """Share of the points of lines that was found [%]."""
        parts = [part[part[:, 0] <= RANGE, 1] for part in self.line_due]
        return _percent(np.concatenate(parts)) if parts else None

    def false_lines_share(self) -> float | None:
        """Images with a false line [%]."""
        return 100.0 * self.false_lines / self.images if self.images else None

    def line_error_median(self) -> float | None:
        """Median distance of line points from their line, of the distance [%]."""
        shares = [part.off / part.distance for part in self.line_points]
        near = [part.distance <= RANGE for part in self.line_points]
        if not shares or not np.concatenate(near).any():
            return None
        return 100.0 * float(np.median(np.concatenate(shares)[np.concatenate(near)]))


def _percent(found: Sequence[bool] | FloatArray) -> float | None:
    return 100.0 * float(np.mean(found)) if len(found) else None


def score_image(
    truth: FrameTruth,
    view: View,
    percepts: Percepts,
    geometry: ImageGeometry,
    seconds: float = 0.0,
) -> Score:
    """Score one image."""
    pose = _deviation(truth, geometry)
    score = Score(images=1, poses=[pose], times=[seconds])
    expected = list(view.objects())
    reported = list(percepts.objects)
    if percepts.ball is not None:
        reported.append(percepts.ball)
    for kinds in GROUPS.values():
        _match(
            score,
            [each for each in expected if each.kind in kinds],
            [each for each in reported if each.kind in kinds],
            pose,
        )
    _score_lines(score, view, percepts, geometry, pose)
    return score


def _deviation(truth: FrameTruth, geometry: ImageGeometry) -> PoseDeviation:
    """Error of the camera's pose."""
    x, y, heading = truth.footprint
    c, s = math.cos(heading), math.sin(heading)
    turn = np.array(((c, s, 0.0), (-s, c, 0.0), (0.0, 0.0, 1.0)))
    pose = truth.view.pose
    true = CameraPose(turn @ (pose.position - (x, y, 0.0)), turn @ pose.rotation)
    seen = geometry.view.pose
    tilts = [math.asin(-float(each.rotation[2, 2])) for each in (seen, true)]
    pans = [math.atan2(each.rotation[1, 2], each.rotation[0, 2]) for each in (seen, true)]
    dx, dy, _ = (seen.position - true.position).tolist()
    pan = math.remainder(pans[0] - pans[1], math.tau)
    return PoseDeviation(tilts[0] - tilts[1], pan, dx, dy, float(true.position[2]))


def _match(
    score: Score, expected: Sequence[Expected], reported: Sequence[Percept], pose: PoseDeviation
) -> None:
    """Pair objects with percepts, nearest first, and count."""
    pairs = sorted(
        (math.dist(one.position, other.position), i, j)
        for i, one in enumerate(expected)
        for j, other in enumerate(reported)
        if math.dist(one.position, other.position)
        < GATE[0] + GATE[1] * math.hypot(*one.position)
    )
    percept_of: dict[int, Percept] = {}
    used: set[int] = set()
    for _, i, j in pairs:
        if i not in percept_of and j not in used:
            percept_of[i] = reported[j]
            used.add(j)
    for i, one in enumerate(expected):
        found = percept_of.get(i)
        if found is None and not (one.due or one.in_image):
            continue
        score.sightings.append(
            Sighting(
                one.kind, one.position, one.in_image, one.due,
                None if found is None else found.kind,
                (math.nan, math.nan) if found is None else found.position, pose,
            )
        )  # fmt: skip
    score.false += [
        (each.kind, each.position) for j, each in enumerate(reported) if j not in used
    ]


def _score_lines(
    score: Score, view: View, percepts: Percepts, geometry: ImageGeometry, pose: PoseDeviation
) -> None:
    due, away = view.due_line_points()
    points = percepts.line_points
    found = np.zeros(len(due), dtype=bool)
    if len(points):
        pixels = geometry.pixels_of(points)
        if len(due):
            off = due[:, None] - pixels[None]
            found = (off**2).sum(axis=2).min(axis=1) < LINE_FOUND**2
        true, on_line = view.on_ground(pixels)
        reach = np.hypot(*true.T)
        drop = pose.height
        base, slack = LINE_GATE
        gate = base + slack * (reach**2 + drop**2) / (drop * geometry.focal)
        good = np.hypot(*(true - on_line).T) <= gate
        score.line_points.append(
            own_line_errors(true[good], on_line[good], points[good], drop)
        )
        false = int(np.count_nonzero(~good))
        score.false_line_points += false
        score.false_lines += false >= LINE_FALSE
    score.line_due.append(np.column_stack((away, found.astype(float))))


def own_line_errors(
    true: FloatArray, on_line: FloatArray, points: FloatArray, height: float
) -> LinePoint:
    """Errors of points on lines (n, 2) [m] that are not those of the camera's pose.

    `true` is where their pixels truly are in base_footprint, `on_line` the nearest points on lines;
    `height` [m] is that of the camera.
    """
    off = true - on_line
    reach, line_reach = np.hypot(*true.T), np.hypot(*on_line.T)
    radial = np.abs(np.einsum("ij,ij->i", off, true)) / np.maximum(reach, 1e-6)
    across = radial > 0.7 * np.hypot(*off.T)
    depression = np.arctan2(height, reach) - np.arctan2(height, line_reach)
    bearing = np.arctan2(true[:, 1], true[:, 0]) - np.arctan2(on_line[:, 1], on_line[:, 0])
    return LinePoint(
        np.maximum(reach, 1e-3),
        np.where(across, depression, math.nan),
        np.where(across, math.nan, wrapped(bearing)),
        np.hypot(*(points - on_line).T),
    )


def merged(scores: Iterable[Score]) -> Score:
    """All images of several scores."""
    total = Score()
    for score in scores:
        total.add(score)
    return total
