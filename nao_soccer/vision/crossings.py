"""Crossings of field lines and their kinds: each of their four arms is looked at in the image."""

from collections.abc import Iterable
from itertools import combinations
from math import atan2, cos, hypot, pi, sin

import numpy as np
from numpy.typing import NDArray

from nao_soccer.vision.circle import Circle
from nao_soccer.vision.colors import FIELD
from nao_soccer.vision.frame import Frame
from nao_soccer.vision.percepts import Kind, LineSegment, Percept
from robot_core.types import FloatArray, Point2

ANGLE_MIN = np.radians(65.0)
"""[rad] Least angle between two lines; 90 degrees less what a tilted camera makes of them."""
BEYOND_MAX = 0.3
"""[m] Largest distance of a crossing from the nearer end of each line."""
ARM = (0.13, 0.3)
"""[m] Piece of an arm that is looked at, from the crossing."""
STEPS = np.linspace(*ARM, 9)
"""[m] Places on it."""
ASIDE = np.radians((-34.0, -17.0, 17.0, 34.0))
"""[rad] To either side of an arm that is not there, where there is to be no line either: a chord of
the centre circle leaves it at such angles."""
WHITE_MIN = 0.75
"""Least share of them on a line for an arm that is there."""
GREEN_MIN = 0.7
"""Least share of them on green for an arm that is not there."""
SIDE = 0.11
"""[m] To either side of an arm, where it is to be green."""
BESIDE_MIN = 0.5
"""Least share of places with green on both sides for an arm that is there."""
RANGE_MAX = 3.6
"""[m] Largest distance."""


def find_crossings(
    frame: Frame,
    mask: NDArray[np.bool_],
    segments: Iterable[LineSegment],
    circle: Circle | None,
    free: NDArray[np.bool_],
    line_width: float,
) -> list[Percept]:
    """The crossings whose kind is seen.

    `mask` and `free` (height, width): white pixels of the field; false where an object other than a
    line is.
    """
    segments = list(segments)
    found: list[Percept] = []
    for one, other in combinations(segments, 2):
        meeting = _meeting(one, other)
        if meeting is not None:
            point, yaw, across = meeting
            _add(found, _crossing(frame, mask, point, yaw, across))
    bare = mask & free
    for segment in segments:
        for point, yaw in _ends(segment, line_width):
            crossing = _crossing(frame, bare, point, yaw, yaw + 0.5 * pi)
            if crossing is not None and crossing.kind is Kind.CROSSING_L:
                _add(found, crossing)
    if circle is not None:
        for segment in segments:
            for point, yaw in _on_circle(segment, circle):
                _add(found, _circle_crossing(frame, mask, point, yaw, circle))
    return found


def _add(found: list[Percept], crossing: Percept | None) -> None:
    if crossing is None:
        return
    x, y = crossing.position
    if all(hypot(x - each.position[0], y - each.position[1]) > 0.25 for each in found):
        found.append(crossing)


def _meeting(one: LineSegment, other: LineSegment) -> tuple[Point2, float, float] | None:
    """Where two lines meet [m] and the directions [rad] of both; None if they do not."""
    (ax, ay), (bx, by) = one.start, one.end
    (cx, cy), (dx, dy) = other.start, other.end
    ux, uy, vx, vy = bx - ax, by - ay, dx - cx, dy - cy
    area = ux * vy - uy * vx
    if abs(area) < sin(ANGLE_MIN) * one.length * other.length:
        return None
    t = ((cx - ax) * vy - (cy - ay) * vx) / area
    s = ((cx - ax) * uy - (cy - ay) * ux) / area
    for share, length in ((t, one.length), (s, other.length)):
        if max(-share, share - 1.0) * length > BEYOND_MAX:
            return None
    return (ax + t * ux, ay + t * uy), atan2(uy, ux), atan2(vy, vx)


def _ends(segment: LineSegment, line_width: float) -> list[tuple[Point2, float]]:
    """Where a line may turn away from the camera [m], and the line's direction [rad].

    The other line is then too short in the image to be found. The points end on it or at its edge.
    """
    (ax, ay), (bx, by) = segment.start, segment.end
    yaw = atan2(by - ay, bx - ax)
    found: list[tuple[Point2, float]] = []
    for beyond in (0.0, 0.5 * line_width):
        dx, dy = beyond * cos(yaw), beyond * sin(yaw)
        found += [((ax - dx, ay - dy), yaw), ((bx + dx, by + dy), yaw)]
    return found


def _on_circle(segment: LineSegment, circle: Circle) -> list[tuple[Point2, float]]:
    """Where a line through the centre of the circle meets it [m], and its direction [rad]."""
    (ax, ay), (bx, by) = segment.start, segment.end
    ux, uy = (bx - ax) / segment.length, (by - ay) / segment.length
    rx, ry = circle.centre[0] - ax, circle.centre[1] - ay
    if abs(ux * ry - uy * rx) > 0.15:
        return []
    middle = ux * rx + uy * ry
    places = (middle - circle.radius, middle + circle.radius)
    return [
        ((ax + t * ux, ay + t * uy), atan2(uy, ux))
        for t in places
        if -BEYOND_MAX < t < segment.length + BEYOND_MAX
    ]


def _crossing(
    frame: Frame, mask: NDArray[np.bool_], point: Point2, first: float, second: float
) -> Percept | None:
    """The crossing at a point [m] of lines in two directions [rad]; None if its kind is unsure."""
    place = np.array(point)
    if np.hypot(*(place - frame.geometry.camera[:2])) > RANGE_MAX:
        return None
    directions = (first, second, first + pi, second + pi)
    arms = []
    for angle in directions:
        arm = _arm(frame, mask, _straight(place, angle))
        if arm is False and any(
            _touches(frame, mask, _straight(place, angle + side)) for side in ASIDE
        ):
            arm = None  # perhaps the circle, whose arms are bent
        if arm is None:
            return None
        arms.append(arm)
    there = [angle for angle, arm in zip(directions, arms, strict=True) if arm]
    if len(there) == 4:
        return _percept(frame, Kind.CROSSING_X, point, first)
    if len(there) == 3:
        return _percept(frame, Kind.CROSSING_T, point, directions[arms.index(False)] + pi)
    if len(there) == 2 and arms[0] != arms[2]:
        yaw = atan2(sin(there[0]) + sin(there[1]), cos(there[0]) + cos(there[1]))
        return _percept(frame, Kind.CROSSING_L, point, yaw)
    return None


def _circle_crossing(
    frame: Frame, mask: NDArray[np.bool_], point: Point2, yaw: float, circle: Circle
) -> Percept | None:
    """The crossing of a line in a direction [rad] and the circle; None if an arm is not seen."""
    place = np.array(point)
    if np.hypot(*(place - frame.geometry.camera[:2])) > RANGE_MAX:
        return None
    arms = [_straight(place, yaw), _straight(place, yaw + pi)]
    spoke = place - circle.centre
    start, size = atan2(spoke[1], spoke[0]), hypot(spoke[0], spoke[1])
    for side in (-1.0, 1.0):
        angles = start + side * STEPS / size
        arms.append(circle.centre + size * np.stack((np.cos(angles), np.sin(angles)), axis=1))
    if not all(_arm(frame, mask, arm) for arm in arms):
        return None
    return _percept(frame, Kind.CROSSING_X, point, yaw)


def _percept(frame: Frame, kind: Kind, point: Point2, yaw: float) -> Percept:
    a, b, c = frame.geometry.covariance(np.array([point]))[0].tolist()
    return Percept(kind, point, (a, b, c), (yaw + pi) % (2.0 * pi) - pi)


def _straight(place: FloatArray, angle: float) -> FloatArray:
    """Places (n, 2) [m] along a straight arm."""
    return np.asarray(place + STEPS[:, None] * np.array((cos(angle), sin(angle))))


def _touches(frame: Frame, mask: NDArray[np.bool_], arm: FloatArray) -> bool:
    """Whether there is anything white on an arm (n, 2) [m] but its beginning."""
    pixels = frame.geometry.pixels_of(arm)[len(arm) // 3 :]
    if not frame.inside(pixels).all():
        return False
    column, row = np.rint(pixels).astype(int).T
    return bool(mask[row, column].any())


def _arm(frame: Frame, mask: NDArray[np.bool_], arm: FloatArray) -> bool | None:
    """Whether a line is painted along an arm (n, 2) [m]; None if that is not seen."""
    along = arm[-1] - arm[0]
    across = np.array((-along[1], along[0])) / np.hypot(*along)
    every = frame.geometry.pixels_of(
        np.concatenate((arm, arm - SIDE * across, arm + SIDE * across))
    )
    pixels, sides = every[: len(arm)], every[len(arm) :]
    if not frame.inside(pixels).all():
        return None
    column, row = np.rint(pixels).astype(int).T
    # A far line is thinner than the error of its place: one pixel to each side counts too.
    du, dv = pixels[-1] - pixels[0]
    size = hypot(du, dv)
    if size < 3.0:
        return None
    upright = abs(dv) > abs(du)
    white = _near(mask, row, column, 0 if upright else 1, 1 if upright else 0)
    seen = frame.inside(sides)
    u, v = np.rint(np.where(seen[:, None], sides, 0.0)).astype(int).T
    clear = (seen & (frame.classes[v, u] == FIELD) & ~mask[v, u]).reshape(2, -1).all(axis=0)
    if white.mean() >= WHITE_MIN and clear.mean() >= BESIDE_MIN:
        return True
    green = frame.classes[row, column] == FIELD
    if green.mean() >= GREEN_MIN and white[len(row) // 3 :].mean() <= 0.2:
        return False
    return None


def _near(
    mask: NDArray[np.bool_], row: NDArray[np.intp], column: NDArray[np.intp], dv: int, du: int
) -> NDArray[np.bool_]:
    """Whether the mask is set at pixels (n,) or beside them."""
    height, width = mask.shape
    found = np.zeros(len(row), dtype=bool)
    for side in (-1, 0, 1):
        v = np.clip(row + side * dv, 0, height - 1)
        found |= mask[v, np.clip(column + side * du, 0, width - 1)]
    return found
