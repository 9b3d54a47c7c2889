"""Straight field lines from their points.

They are straight in the image too, where the errors of the points are alike: they are searched
there.
"""

import numpy as np
from numpy.typing import NDArray

from nao_soccer.vision.frame import Frame
from nao_soccer.vision.percepts import LineSegment
from nao_soccer.vision.scan_lines import COLUMN_STEP, ROW_STEP, LinePoints
from robot_core.types import FloatArray

TRIALS = 120
"""Pairs of points that are tried for each line."""
LINES_MAX = 10
"""Lines that are searched in one image; each may consist of several pieces."""
TOLERANCE = 1.2
"""[px] Largest distance of a point from its line."""
POINTS_MIN = 6
"""Least number of points of a line."""
LENGTH_MIN = 0.2
"""[m] Shortest line; the sum of its pieces."""
LENGTH_PIXELS = 11.0
"""[px] Shortest line in the image."""
GAP_MAX = 14.0
"""[px] Longest gap in a piece of a line."""
DENSITY_MIN = 0.5
"""Least number of points of a piece, of the number of scan lines that it crosses."""


def find_segments(
    frame: Frame, points: LinePoints, random: np.random.Generator
) -> list[LineSegment]:
    """Straight lines, the one with the most points first."""
    segments: list[LineSegment] = []
    left = points.pixels
    for _ in range(LINES_MAX):
        on = best_line(left, random)
        if on is None:
            break
        pieces, used = _pieces(frame, left, on)
        segments += pieces
        left = left[~used]
    return segments


def best_line(pixels: FloatArray, random: np.random.Generator) -> NDArray[np.bool_] | None:
    """Which points (n, 2) are near the line through two of them with the most points."""
    count = len(pixels)
    if count < POINTS_MIN:
        return None
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


def _pieces(
    frame: Frame, pixels: FloatArray, on: NDArray[np.bool_]
) -> tuple[list[LineSegment], NDArray[np.bool_]]:
    """The unbroken pieces of a line, and the points that are used up.

    Points that other lines have near this one are left to them; if there is no piece at all, all
    points are used up, so that the search goes on.
    """
    index = np.nonzero(on)[0]
    middle, axis = _axis(pixels[index])
    along = (pixels[index] - middle) @ axis
    order = np.argsort(along)
    breaks = np.nonzero(np.diff(along[order]) > GAP_MAX)[0] + 1
    segments: list[LineSegment] = []
    used = np.zeros(len(pixels), dtype=bool)
    for piece in np.split(order, breaks):
        first, last = float(along[piece[0]]), float(along[piece[-1]])
        scanned = (last - first) * max(abs(axis[0]) / COLUMN_STEP, abs(axis[1]) / ROW_STEP)
        if len(piece) < max(POINTS_MIN, DENSITY_MIN * scanned):
            continue
        used[index[piece]] = True
        ends = middle + np.array((first, last))[:, None] * axis
        places, meets = frame.geometry.ground(ends)
        if not meets.all() or last - first < LENGTH_PIXELS:
            continue
        start, end = places.tolist()
        segments.append(LineSegment((start[0], start[1]), (end[0], end[1]), pixels[index[piece]]))
    if not used.any():
        used[index] = True
    if sum(each.length for each in segments) < LENGTH_MIN:
        segments = []
    return segments, used
