"""Goal posts and poles: upright bands of one width that rise from the field over its upper edge."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from nao_soccer.vision.colors import BLUE, RED, WHITE, YELLOW
from nao_soccer.vision.frame import Frame
from nao_soccer.vision.percepts import Box, Kind, Percept
from nao_soccer.vision.settings import VisionSettings
from robot_core.types import FloatArray

_CLASSES = {"white": WHITE, "yellow": YELLOW, "blue": BLUE, "red": RED}
"""Colour class by the name of a colour of the field."""
BAND = (1, 9)
"""[px] Rows below the edge of the field in which an upright band is searched."""
MARGIN = 8
"""[px] Least visible part of a column over the field."""
BAND_SHARE = 0.75
"""Least share of them in a column of the band."""
ROW_SHARE = 0.55
"""Least share of the band's columns that a row of it covers."""
GAP = 2
"""[px] Rows that may be missing in a band."""
WIDTH_TOLERANCE = 0.45
"""Largest error of the width at the distance of the foot, of the width."""
WIDTH_ERROR = 0.12
"""Standard deviation of the width by its edges, of the width: one side may be as bright as what is
behind it."""
PATCH = (36, 33)
"""Rows and columns of the rectified image of a band: from its foot to its top, twice as wide."""
EDGE = 9.0
"""Least change of a colour channel across an edge of the band, of 255."""
EDGE_ROWS = 0.6
"""Least share of the rows that have both edges."""
ROBOT_TOP = 0.6
"""[m] Height over which a robot does not reach."""
SEEN_MIN = 0.3
"""[m] Least height that is seen."""
RANGE_MAX = 4.0
"""[m] Largest distance."""


@dataclass(frozen=True, slots=True)
class Upright:
    """What a post or pole looks like.

    Attributes:
        diameter: [m].
        height: [m].
    """

    kind: Kind
    colors: tuple[int, ...]
    diameter: float
    height: float


def uprights_of(settings: VisionSettings) -> list[Upright]:
    """The kinds of posts and poles of a field."""
    found = []
    goals = settings.goals
    if goals is not None:
        for color in dict.fromkeys(goals.colors):
            colors = tuple(_CLASSES[each] for each in (color,) if each in _CLASSES)
            found.append(Upright(Kind.GOAL_POST, colors, goals.post_diameter, goals.height))
    for pole in settings.poles:
        colors = tuple(dict.fromkeys(_CLASSES[each] for each in pole.colors if each in _CLASSES))
        upright = Upright(Kind.POLE, colors, pole.diameter, pole.height)
        if upright not in found:
            found.append(upright)
    return found


def find_uprights(
    frame: Frame, uprights: Sequence[Upright], robots: Sequence[Box]
) -> list[Percept]:
    """Goal posts and poles of an image, whose foot is seen."""
    found: list[Percept] = []
    if not len(frame.boundary):
        return found
    for upright in uprights:
        mask = np.isin(frame.classes, upright.colors)
        for left, right in _columns(frame, mask):
            if any(left <= robot.right and right >= robot.left for robot in robots):
                continue
            percept = _measured(frame, mask, left, right, upright)
            if percept is not None:
                found.append(percept)
    return found


def _columns(frame: Frame, mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Runs of columns (first, last) that have the colour just below the edge of the field."""
    height, width = mask.shape
    column = np.arange(width)
    rows = frame.boundary_row + np.arange(*BAND)[:, None]
    # Where the field fills a column to its top, legs of a robot would look the same.
    seen = (rows < height) & (frame.boundary_row >= MARGIN)
    on = mask[np.minimum(rows, height - 1), column] & seen
    share = on.sum(axis=0) / np.maximum(seen.sum(axis=0), 1)
    on_band = (share >= BAND_SHARE).astype(np.uint8)[None]
    closed = cv2.morphologyEx(on_band, cv2.MORPH_CLOSE, np.ones((1, 5), np.uint8))[0]
    change = np.diff(np.concatenate(([0], closed.astype(np.int8), [0])))
    starts, ends = np.nonzero(change == 1)[0], np.nonzero(change == -1)[0] - 1
    return [(int(a), int(b)) for a, b in zip(starts, ends, strict=True) if a > 0 and b < width - 1]


def _measured(
    frame: Frame,
    mask: NDArray[np.bool_],
    left: int,
    right: int,
    upright: Upright,
) -> Percept | None:
    """The upright in some columns, or None if it is none."""
    geometry = frame.geometry
    centre = 0.5 * (left + right)
    start = float(frame.boundary_row[int(centre)]) + 0.5 * sum(BAND)
    foot = _foot(frame, mask, centre, start, right - left + 1)
    if foot is None:
        return None
    (place,), (meets,) = geometry.ground(np.array([foot]))
    if not meets:
        return None
    away = place - geometry.camera[:2]
    reach = float(np.hypot(*away))
    if not 0.2 < reach < RANGE_MAX:
        return None
    unit = away / reach
    slant = float(np.hypot(reach, geometry.camera[2]))
    expected = geometry.focal * upright.diameter / slant
    if abs(right - left + 1 - expected) > WIDTH_TOLERANCE * expected + 2.0:
        return None
    edges = _edges(frame, place + 0.5 * upright.diameter * unit, unit, upright)
    if edges is None:
        return None
    offset, width = edges
    # By its foot, and by its width; each with its own variance along the line of sight.
    by_foot = reach + 0.5 * upright.diameter
    by_width = by_foot * upright.diameter / width
    drop = float(geometry.camera[2])
    pixels = geometry.focal * width / slant
    variance = by_width**2 * ((1.5 * geometry.error.pixel / pixels) ** 2 + WIDTH_ERROR**2)
    placed = geometry.place(unit, drop, by_foot, by_width, variance)
    if placed is None:
        return None
    spot = np.asarray(placed.position) + offset * np.array((-unit[1], unit[0]))
    box = Box(float(left), max(foot[1] - upright.height * geometry.focal / slant, 0.0),
              float(right), foot[1])  # fmt: skip
    position = float(spot[0]), float(spot[1])
    return Percept(upright.kind, position, placed.covariance, box=box)


def _foot(
    frame: Frame, mask: NDArray[np.bool_], centre: float, start: float, width: int
) -> tuple[float, float] | None:
    """Pixel of the middle of the foot of a band, followed down from a row; None if not seen."""
    height, columns = mask.shape
    geometry = frame.geometry
    # Upright in the world, at a distance at which the direction hardly changes.
    middle = geometry.camera + 2.0 * geometry.rays(np.array([[centre, start]]))[0]
    ends = geometry.view.project(np.array((middle, middle - (0.0, 0.0, 0.2))))
    (u0, v0), (u1, v1) = ends
    slope = (u1 - u0) / (v1 - v0) if v1 > v0 + 1.0 else 0.0
    rows = np.arange(int(start), height)
    middles = centre + slope * (rows - start)
    half = 0.5 * (width - 1)
    across = np.rint(middles[:, None] + np.linspace(-half, half, 9)).astype(int)
    inside = (across >= 0) & (across < columns)
    on = mask[rows[:, None], np.clip(across, 0, columns - 1)] & inside
    off = np.nonzero(on.mean(axis=1) < ROW_SHARE)[0]
    # The first row below which the band does not go on.
    for index in off:
        if index + GAP + 1 >= len(rows):
            break
        if (on[index : index + GAP + 1].mean(axis=1) < ROW_SHARE).all():
            return float(middles[index] - 0.5 * slope), float(rows[index]) - 0.5
    return None


def _edges(
    frame: Frame, place: FloatArray, unit: FloatArray, upright: Upright
) -> tuple[float, float] | None:
    """Offset to the left and width [m] of a band by its edges; None if it has no such edges.

    `place` (2,) [m] is the middle of its foot, `unit` (2,) the direction from the camera to it.
    """
    rows, columns = PATCH
    aside = np.linspace(upright.diameter, -upright.diameter, columns)
    heights = np.linspace(0.03, upright.height - 0.03, rows)
    points = np.empty((rows, columns, 3))
    points[..., 0] = place[0] - unit[1] * aside
    points[..., 1] = place[1] + unit[0] * aside
    points[..., 2] = heights[:, None]
    pixels = frame.geometry.view.project(points.reshape(-1, 3)).astype(np.float32)
    pixels = pixels.reshape(rows, columns, 2)
    height, width = frame.classes.shape
    u, v = pixels[..., 0], pixels[..., 1]
    seen = ((u > 0) & (u < width - 1) & (v > 0) & (v < height - 1)).all(axis=1)
    if seen.sum() * (heights[1] - heights[0]) < SEEN_MIN:
        return None
    patch = cv2.remap(frame.image, u[seen], v[seen], cv2.INTER_LINEAR).astype(np.float32)
    patch = cv2.blur(patch, (3, 5))
    change = np.abs(patch[:, 4:] - patch[:, :-4]).max(axis=2)
    # Column of the change of brightness between columns i and i + 4: i + 2.
    quarter = columns // 4
    reach = 4
    halves = []
    for middle in (quarter - 2, columns - 1 - quarter - 2):
        part = change[:, middle - reach : middle + reach + 1]
        halves.append((part.max(axis=1), part.mean(axis=0), middle - reach + 2))
    both = (halves[0][0] >= EDGE) & (halves[1][0] >= EDGE)
    high = heights[seen] > ROBOT_TOP
    if both.mean() < EDGE_ROWS or (high.sum() >= 3 and both[high].mean() < EDGE_ROWS):
        return None
    ends = []
    for _, mean, first in halves:
        weight = np.maximum(mean - 0.5 * mean.max(), 0.0)
        ends.append(first + float((weight * np.arange(len(mean))).sum() / weight.sum()))
    step = 2.0 * upright.diameter / (columns - 1)
    offset = upright.diameter - step * 0.5 * (ends[0] + ends[1])
    return offset, max((ends[1] - ends[0]) * step, 0.2 * upright.diameter)
