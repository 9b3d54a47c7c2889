"""What is to be seen in a rendered image, by the truth.

An object is `due` if vision has to report it: on the field, inside the image with what it is
recognised by, and hidden by no robot. One that is not due may be reported or not.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from gait_lab.vision.rendered_frames import FrameTruth
from nao_soccer.vision.percepts import ROBOT_OF, Kind
from nao_soccer.vision.settings import VisionSettings
from robot_core.field import seen_from
from robot_core.geometry import relative
from robot_core.types import FloatArray, Point2

MARGIN = 5.0
"""[px] Between an object that is due and the edge of the image."""
POST_SEEN = 0.6
"""[m] of a post, from its foot, that are to be in the image."""
ROBOT_SEEN = 0.42
"""[m] of a robot, from its feet to its shoulders."""
ROBOT_HALF = 0.13
"""[m] Half of the width of a robot."""
HIDES = 0.25
"""[m] Half of the width that a robot hides, with its arms."""
ARM_SEEN = 0.45
"""[m] of each line of a crossing that are to be in the image."""
SPACING = 0.1
"""[m] between two points of a line."""
LINE_RANGE = 6.5
"""[m] Distance to which points of lines are due."""
CIRCLE_SHARE = 0.5
"""Least share of the centre circle in the image for the circle to be due."""
_CROSSINGS = {"L": Kind.CROSSING_L, "T": Kind.CROSSING_T, "X": Kind.CROSSING_X}


@dataclass(frozen=True, slots=True)
class Expected:
    """An object, where it truly is.

    Attributes:
        kind: What it is.
        position: [m] in the true base_footprint at the time of the image.
        in_image: Its place on the ground is in the image, and no robot hides it.
        due: All that it is recognised by is in the image, and nothing hides it.
    """

    kind: Kind
    position: Point2
    in_image: bool
    due: bool


class View:
    """One image with its truth."""

    def __init__(
        self, truth: FrameTruth, settings: VisionSettings, teams: Mapping[str, str]
    ) -> None:
        self._truth = truth
        self._camera = truth.view
        self._settings = settings
        self._teams = teams
        marks = np.array(settings.field.marks()).reshape(-1, 2)
        self._line_points = np.concatenate((settings.field.points_on_lines(SPACING), marks))
        pieces = [(line.start, line.end) for line in settings.field.lines()]
        pieces += [(mark, mark) for mark in settings.field.marks()]
        start, end = np.array(pieces).transpose(1, 0, 2)
        self._pieces = start, end

    def objects(self) -> Iterator[Expected]:
        """Everything of the scene that may be reported."""
        truth, settings = self._truth, self._settings
        if truth.ball is not None:
            x, y, z = truth.ball.tolist()
            away = float(np.linalg.norm(truth.ball - self._camera.pose.position))
            radius = self._camera.intrinsics.fx * settings.ball_radius / max(away, 0.1)
            on_field = abs(x) < 0.5 * settings.field.length and abs(y) < 0.5 * settings.field.width
            due = on_field and self._seen((x, y, z), margin=radius + 2.0)
            yield self._expected(Kind.BALL, (x, y), due, settings.ball_radius)
        if settings.goals is not None:
            for x, y in settings.field.posts(settings.goals):
                half = 0.5 * settings.goals.post_diameter
                due = all(self._seen_aside((x, y, z), half) for z in (0.0, POST_SEEN))
                yield self._expected(Kind.GOAL_POST, (x, y), due, half)
        for name, (x, y, _) in truth.others.items():
            due = all(self._seen_aside((x, y, z), ROBOT_HALF) for z in (0.0, ROBOT_SEEN))
            yield self._expected(ROBOT_OF[self._teams[name]], (x, y), due, ROBOT_HALF, skip=name)
        ring = [0.25 * math.pi * each for each in range(8)]
        for crossing in settings.field.crossings():
            x, y = crossing.x, crossing.y
            due = all(
                self._seen((x + ARM_SEEN * math.cos(each), y + ARM_SEEN * math.sin(each), 0.0))
                for each in ring
            ) and not self._covered((x, y), ARM_SEEN)
            yield self._expected(_CROSSINGS[crossing.kind.value], (x, y), due, ARM_SEEN)
        if settings.field.circle_diameter:
            radius = 0.5 * settings.field.circle_diameter
            seen = [
                self._seen((radius * math.cos(each), radius * math.sin(each), 0.0))
                for each in np.linspace(0.0, 2.0 * math.pi, 36, endpoint=False)
            ]
            due = sum(seen) >= CIRCLE_SHARE * len(seen)
            yield self._expected(Kind.CENTRE_CIRCLE, (0.0, 0.0), due, radius)

    def due_line_points(self) -> tuple[FloatArray, FloatArray]:
        """Points of lines that are due: pixels (n, 2) and distances (n,) [m]."""
        points = self._line_points
        pixels = self._camera.project(np.column_stack((points, np.zeros(len(points)))))
        away = np.hypot(*(points - np.array(self._truth.footprint[:2])).T)
        index = np.nonzero(self._camera.intrinsics.contains(pixels) & (away < LINE_RANGE))[0]
        keep = [
            each
            for each in index
            if not self._hidden(place := (float(points[each, 0]), float(points[each, 1])), 0.1)
            and not self._covered(place, 0.2)
        ]
        return pixels[keep], away[keep]

    def on_ground(self, pixels: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Where pixels (n, 2) truly are, and the nearest points of lines: (n, 2) each, [m]."""
        places = self._camera.on_plane(pixels)[:, :2]
        footprint = self._truth.footprint
        return seen_from(footprint, places), seen_from(footprint, self._on_lines(places))

    def _on_lines(self, places: FloatArray) -> FloatArray:
        """The nearest point on a line or mark of places (n, 2), in the frame of the field."""
        start, end = self._pieces
        along = end - start
        length2 = np.maximum((along**2).sum(axis=1), 1e-12)
        share = np.einsum("nkj,kj->nk", places[:, None] - start, along) / length2
        on = start + np.clip(share, 0.0, 1.0)[..., None] * along
        radius = 0.5 * self._settings.field.circle_diameter
        away = np.maximum(np.hypot(*places.T), 1e-9)[:, None]
        on = np.concatenate((on, (radius * places / away)[:, None]), axis=1)
        nearest = ((places[:, None] - on) ** 2).sum(axis=2).argmin(axis=1)
        return np.asarray(on[np.arange(len(places)), nearest])

    def _expected(
        self, kind: Kind, place: Point2, due: bool, half_width: float, *, skip: str = ""
    ) -> Expected:
        x, y, _ = relative((*place, 0.0), self._truth.footprint)
        in_image = self._seen((*place, 0.0)) and not self._hidden(place, 0.0, skip)
        due = due and not self._hidden(place, half_width, skip)
        return Expected(kind, (x, y), in_image, due)

    def _seen(self, point: tuple[float, float, float], margin: float = MARGIN) -> bool:
        """Whether a point [m] of the field is in the image, off its edge by a margin [px]."""
        (u, v), pinhole = self._camera.project(np.array(point)), self._camera.intrinsics
        return bool(
            margin <= u <= pinhole.width - 1 - margin and margin <= v <= pinhole.height - 1 - margin
        )

    def _seen_aside(self, point: tuple[float, float, float], half_width: float) -> bool:
        """Whether both sides of something at a point are in the image."""
        x, y, z = point
        cx, cy, _ = self._camera.pose.position
        away = math.hypot(x - cx, y - cy)
        ax, ay = -(y - cy) / away * half_width, (x - cx) / away * half_width
        return self._seen((x + ax, y + ay, z)) and self._seen((x - ax, y - ay, z))

    def _hidden(self, place: Point2, half_width: float, skip: str = "") -> bool:
        """Whether a robot stands before a place [m], at least in part."""
        cx, cy, _ = self._camera.pose.position
        distance = math.hypot(place[0] - cx, place[1] - cy)
        angle = math.atan2(place[1] - cy, place[0] - cx)
        for name, (x, y, _) in self._truth.others.items():
            near = math.hypot(x - cx, y - cy)
            if name == skip or near > distance + 0.15:
                continue
            turn = abs(math.remainder(math.atan2(y - cy, x - cx) - angle, 2.0 * math.pi))
            if turn < math.atan2(HIDES, near) + math.atan2(half_width, distance):
                return True
        return False

    def _covered(self, place: Point2, reach: float) -> bool:
        """Whether the ball, what it hides, a post or a robot is within reach [m] of a place."""
        others = [pose[:2] for pose in self._truth.others.values()]
        if self._truth.ball is not None:
            ball, camera = self._truth.ball[:2], self._camera.pose.position
            top = 2.0 * self._settings.ball_radius
            shadow = (ball - camera[:2]) * top / max(float(camera[2]) - top, 0.05)
            others += [tuple((ball + share * shadow).tolist()) for share in (0.0, 0.5, 1.0)]
        if self._settings.goals is not None:
            others += self._settings.field.posts(self._settings.goals)
        return any(math.hypot(place[0] - x, place[1] - y) < reach for x, y in others)
