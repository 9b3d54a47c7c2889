"""Field lines and the centre circle, from their points.

Straight lines are straight in the image, where the errors of the points are alike: they are
searched there. The circle is searched on the ground.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nao_lipm_gait.types import FloatArray, Point2
from nao_soccer.vision.colors import FIELD
from nao_soccer.vision.frame import Frame
from nao_soccer.vision.percepts import LineSegment
from nao_soccer.vision.scan_lines import LinePoints

TRIALS = 120
"""Pairs of points that are tried for each line."""
SEGMENTS_MAX = 8
"""Lines that are searched in one image."""
TOLERANCE = 1.2
"""[px] Largest distance of a point from its line."""
POINTS_MIN = 6
"""Least number of points of a line."""
LENGTH_MIN = 0.35
"""[m] Shortest line."""
LENGTH_PIXELS = 11.0
"""[px] Shortest line in the image."""
GAP_MAX = 14.0
"""[px] Longest gap in a line."""
CIRCLE_TRIALS = 250
"""Triples of points that are tried for the circle."""
CIRCLE_RADIUS = 0.15
"""Largest error of the radius of the circle, of the radius."""
CIRCLE_TOLERANCE = (0.012, 2.0)
"""Largest distance of a point from the circle: [m], plus what so many pixels [px] are on the ground
along the line of sight."""
CIRCLE_POINTS = 14
"""Least number of points on the circle."""
CIRCLE_RANGE = 4.5
"""[m] Largest distance of a point of the circle."""
CIRCLE_SAMPLES = 72
"""Places on the circle that are looked at in the image."""
CIRCLE_SEEN = 16
"""Least number of them that are to be seen."""
CIRCLE_WHITE = 0.78
"""Least share of them on a line."""
CIRCLE_GREEN = 0.6
"""Least share of them with green on both sides."""
CIRCLE_SIDE = 0.09
"""[m] To either side of the line."""


class Circle(NamedTuple):
    """The centre circle.

    Attributes:
        centre: [m] in base_footprint.
        radius: [m] as seen.
        on: (n,) which line points are on it.
    """

    centre: Point2
    radius: float
    on: NDArray[np.bool_]


def find_segments(
    frame: Frame, points: LinePoints, random: np.random.Generator
) -> list[LineSegment]:
    """Straight lines, the one with the most points first.

    Args:
        frame: The image.
        points: On lines.
        random: Draws the pairs of points.
    """
    segments: list[LineSegment] = []
    left = points.pixels
    for _ in range(SEGMENTS_MAX):
        if len(left) < POINTS_MIN:
            break
        on = _best_line(left, random)
        if on is None:
            break
        segment, used = _segment(frame, left, on)
        if segment is not None:
            segments.append(segment)
        left = left[~used]
    return segments


def _best_line(pixels: FloatArray, random: np.random.Generator) -> NDArray[np.bool_] | None:
    """Which points (n, 2) are near the line through two of them with the most points."""
    count = len(pixels)
    first = random.integers(0, count, TRIALS)
    # The second one among the neighbours in the order of the scan, or anywhere.
    second = random.integers(0, count, TRIALS)
    near = np.arange(TRIALS) % 2 == 0
    second[near] = (first[near] + random.integers(2, 12, int(near.sum()))) % count
    direction = pixels[second] - pixels[first]
    length = np.hypot(*direction.T)
    fine = length > 4.0
    if not fine.any():
        return None
    normal = np.stack((-direction[fine, 1], direction[fine, 0]), axis=1) / length[fine, None]
    offset = np.einsum("ij,ij->i", normal, pixels[first[fine]])
    near_line = np.abs(pixels @ normal.T - offset) <= TOLERANCE
    best = int(near_line.sum(axis=0).argmax())
    on = near_line[:, best]
    for _ in range(2):
        if on.sum() < POINTS_MIN:
            return None
        middle, axis = _axis(pixels[on])
        away = np.abs((pixels - middle) @ np.array((-axis[1], axis[0])))
        on = away <= TOLERANCE
    return np.asarray(on)


def _axis(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean (2,) and unit direction (2,) of a line through points (n, 2)."""
    middle = points.mean(axis=0)
    dx, dy = (points - middle).T
    angle = 0.5 * np.arctan2(2.0 * (dx @ dy), dx @ dx - dy @ dy)
    return middle, np.array((np.cos(angle), np.sin(angle)))


def _segment(
    frame: Frame, pixels: FloatArray, on: NDArray[np.bool_]
) -> tuple[LineSegment | None, NDArray[np.bool_]]:
    """The longest unbroken piece of a line, and the points that it uses up."""
    index = np.nonzero(on)[0]
    middle, axis = _axis(pixels[index])
    along = (pixels[index] - middle) @ axis
    order = np.argsort(along)
    breaks = np.nonzero(np.diff(along[order]) > GAP_MAX)[0] + 1
    piece = max(np.split(order, breaks), key=len)
    used = np.zeros(len(pixels), dtype=bool)
    used[index[piece]] = True
    ends = middle + np.array((along[piece].min(), along[piece].max()))[:, None] * axis
    places, meets = frame.geometry.ground(ends)
    if len(piece) < POINTS_MIN or not meets.all():
        return None, used
    start, end = places.tolist()
    length = np.hypot(end[0] - start[0], end[1] - start[1])
    if length < LENGTH_MIN or np.hypot(*(ends[1] - ends[0])) < LENGTH_PIXELS:
        return None, used
    segment = LineSegment((start[0], start[1]), (end[0], end[1]), pixels[index[piece]])
    return segment, used


def find_circle(
    frame: Frame,
    mask: NDArray[np.bool_],
    points: LinePoints,
    radius: float,
    random: np.random.Generator,
) -> Circle | None:
    """The centre circle, or None.

    Args:
        frame: The image.
        mask: (height, width) white pixels of the field.
        points: On lines.
        radius: Of the circle [m]; 0 without one.
        random: Draws the triples of points.
    """
    geometry = frame.geometry
    places = points.places
    away = np.hypot(*(places - geometry.camera[:2]).T)
    near = np.nonzero(away < CIRCLE_RANGE)[0]
    if radius <= 0.0 or len(near) < CIRCLE_POINTS:
        return None
    chosen = places[near]
    drop = float(geometry.camera[2])
    base, pixels = CIRCLE_TOLERANCE
    tolerance = base + pixels * (away[near] ** 2 + drop**2) / (drop * geometry.focal)
    a, b, c = (chosen[random.integers(0, len(near), CIRCLE_TRIALS)] for _ in range(3))
    tried = _circumcentres(a, b, c)
    tried = tried[np.abs(tried[:, 2] - radius) <= CIRCLE_RADIUS * radius]
    if not len(tried):
        return None
    off = np.hypot(chosen[:, 0, None] - tried[:, 0], chosen[:, 1, None] - tried[:, 1])
    on = np.abs(off - tried[:, 2]) <= tolerance[:, None]
    x, y, size = tried[int(on.sum(axis=0).argmax())].tolist()
    for _ in range(3):
        on_circle = np.abs(np.hypot(chosen[:, 0] - x, chosen[:, 1] - y) - size) <= tolerance
        if on_circle.sum() < CIRCLE_POINTS:
            return None
        x, y, size = _fit_circle(chosen[on_circle], tolerance[on_circle])
    if abs(size - radius) > CIRCLE_RADIUS * radius:
        return None
    if not _is_painted(frame, mask, (x, y), size):
        return None
    all_on = np.zeros(len(places), dtype=bool)
    all_on[near[on_circle]] = True
    return Circle((x, y), size, all_on)


def _is_painted(frame: Frame, mask: NDArray[np.bool_], centre: Point2, radius: float) -> bool:
    """Whether a circle is white all around, as far as it is seen, with green on both sides."""
    angle = np.arange(CIRCLE_SAMPLES) * (2.0 * np.pi / CIRCLE_SAMPLES)
    direction = np.stack((np.cos(angle), np.sin(angle)), axis=1)
    rings = [
        frame.geometry.pixels_of(np.asarray(centre) + size * direction)
        for size in (radius, radius - CIRCLE_SIDE, radius + CIRCLE_SIDE)
    ]
    seen = np.logical_and.reduce([frame.inside(ring) for ring in rings])
    places = np.asarray(centre) + radius * direction
    seen &= np.hypot(*(places - frame.geometry.camera[:2]).T) < CIRCLE_RANGE
    if seen.sum() < CIRCLE_SEEN:
        return False
    (column, row), *sides = (np.rint(ring[seen]).astype(int).T for ring in rings)
    height = len(mask)
    white = np.zeros(len(row), dtype=bool)
    for shift in (-1, 0, 1):
        white |= mask[np.clip(row + shift, 0, height - 1), column]
    green = [frame.classes[v, u] == FIELD for u, v in sides]
    both = (green[0] & green[1]).mean()
    return bool(white.mean() >= CIRCLE_WHITE and both >= CIRCLE_GREEN)


def _circumcentres(a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
    """Centre and radius (m, 3) of the circles through triples of points (n, 2)."""
    ab, ac = b - a, c - a
    area = 2.0 * (ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0])
    fine = np.abs(area) > 1e-3
    a, ab, ac, area = a[fine], ab[fine], ac[fine], area[fine]
    b2, c2 = np.einsum("ij,ij->i", ab, ab), np.einsum("ij,ij->i", ac, ac)
    x = (ac[:, 1] * b2 - ab[:, 1] * c2) / area
    y = (ab[:, 0] * c2 - ac[:, 0] * b2) / area
    return np.stack((a[:, 0] + x, a[:, 1] + y, np.hypot(x, y)), axis=1)


def _fit_circle(points: FloatArray, sigma: FloatArray) -> tuple[float, float, float]:
    """Centre and radius of the circle through points (n, 2) by weighted least squares (Kasa)."""
    middle = points.mean(axis=0)
    x, y = (points - middle).T
    weight = 1.0 / sigma
    matrix = np.column_stack((2.0 * x, 2.0 * y, np.ones(len(x)))) * weight[:, None]
    (cx, cy, c), *_ = np.linalg.lstsq(matrix, (x * x + y * y) * weight, rcond=None)
    size = float(np.sqrt(max(c + cx * cx + cy * cy, 0.0)))
    return float(cx + middle[0]), float(cy + middle[1]), size
