"""Robots: a torso in the colour of a team, and the feet below it; or legs that hide the field."""

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from nao_soccer.vision.colors import BLUE, FIELD, RED, WHITE
from nao_soccer.vision.frame import Frame
from nao_soccer.vision.image_geometry import ImageGeometry
from nao_soccer.vision.near_robots import (
    FEET_MIN,
    LYING_HEIGHT,
    LYING_RANGE,
    LYING_SPREAD,
    too_near,
)
from nao_soccer.vision.percepts import Box, Kind, LineSegment, Percept
from nao_soccer.vision.scan_lines import GUARD, GUARD_GREEN
from robot_core.types import FloatArray

TORSO_AREA = 20
"""[px] Smallest region of a team's colour."""
TORSO = (0.04, 0.35)
"""[m] Least and largest width of a torso."""
TORSO_HEIGHT = (0.05, 0.4)
"""[m] Least and largest height of a torso."""
TORSO_MEAN = 0.2
"""[m] Usual height of a torso."""
TORSO_TOP = (0.25, 0.6)
"""[m] Least and largest height of the upper edge of a torso over the ground."""
ASIDE = 0.55
"""Width that is looked at below a torso to either side of its middle, of the torso's height."""
EDGE_BAND = 8
"""[px] Rows below the edge of the field that a robot hides, at least in part."""
EDGE_ROWS, EDGE_COLUMNS = 0.4, 0.25
"""Least share of these rows that are hidden, and of a robot's columns in which they are."""
HEAD, FEET, FEET_MAX = 0.6, 2.2, 3.3
"""Height of the head over a torso's upper edge, and usual and largest height of that edge over the
feet, of its height; Bruno's long legs make it 3.1."""
FEET_SPREAD, CUT_SPREAD = 0.04, 0.1
"""[m] Standard deviations of a robot's middle from its feet, and from feet that are cut."""
ARMS = 0.95
"""Width of the arms to either side of a torso's middle, of its height."""
SPLIT_MAX = 0.4
"""Largest gap between two parts of one torso that an arm divides, of their height."""
LEGS = 1.4
"""Where legs are searched below the upper edge of a torso, of its height: lower than a slim waist,
beside which there is green."""
GAP = 3
"""[px] Least green rows of a column below a foot."""
BREAK = 0.4
"""Longest green in a leg, of the torso's height."""
FOOT_COLUMNS = 0.03
"""[m] Width of what reaches down furthest, for a foot."""
DEPTH = 0.05
"""[m] From the front of the feet to the middle of the robot."""
RANGE_MAX = 4.0
"""[m] Largest distance."""
LYING_SIZE = (0.1, 0.45)
"""[m] Least and largest size of a torso that lies."""
LYING_GREEN = 0.6
"""Least share of green between a torso that lies and the edge of the field."""
STEEP = 0.5
"""Least slope in the image of a line that may lead to a robot's feet; under a flatter one a foot
ends as it does on the field."""
BLUR = 1
"""[px] To either side of a line that it colours too."""


class Torso(NamedTuple):
    """A region in the colour of a team.

    Attributes:
        kind: Robot of which team.
        stats: Left, top, width, height and area [px].
        box: About where body and legs of its robot are in the image.
        reach: The same with the arms.
        lies: The robot lies on the field. Box and reach are all around the torso then.
    """

    kind: Kind
    stats: NDArray[np.int32]
    box: Box
    reach: Box
    lies: bool = False


def find_torsos(frame: Frame) -> list[Torso]:
    """Torsos of both teams, the largest first; one for each robot."""
    regions: list[tuple[int, NDArray[np.int32], Kind]] = []
    for color, kind in ((RED, Kind.ROBOT_RED), (BLUE, Kind.ROBOT_BLUE)):
        mask = (frame.classes == color).astype(np.uint8)
        if cv2.countNonZero(mask) < TORSO_AREA:
            continue
        mask = np.asarray(cv2.morphologyEx(mask, cv2.MORPH_CLOSE, np.ones((5, 5), np.uint8)))
        stats = cv2.connectedComponentsWithStats(mask, connectivity=8)[2]
        parts = [each for each in stats[1:] if each[cv2.CC_STAT_AREA] >= TORSO_AREA]
        regions += [(int(each[cv2.CC_STAT_AREA]), each, kind) for each in _joined(parts)]
    found: list[Torso] = []
    for _, stats, kind in sorted(regions, key=lambda each: -each[0]):
        left, top, across, tall, _ = stats.tolist()
        size, middle = max(tall, across), left + 0.5 * across
        if any(each.box.left < middle < each.box.right for each in found):
            continue  # an arm hides the middle of its torso
        box, reach = (
            Box(middle - side * size, top - HEAD * size, middle + side * size, top + FEET * size)
            for side in (ASIDE, ARMS)
        )
        if _stands_on_field(frame, box):
            found.append(Torso(kind, stats, box, reach))
        elif _lies_on_field(frame, stats):
            around = Box(middle - size, top - 0.5 * size, middle + size, top + tall + 0.5 * size)
            found.append(Torso(kind, stats, around, around, lies=True))
    return found


def _lies_on_field(frame: Frame, stats: NDArray[np.int32]) -> bool:
    """Whether there is field between the torso and the edge of the field."""
    left, top, across, _, _ = stats.tolist()
    columns = np.arange(left, left + across)
    rows = np.arange(top)[:, None]
    above = rows >= frame.boundary_row[columns]
    green = (frame.classes[:top, columns] == FIELD) & above
    return bool(green.sum() >= max(LYING_GREEN * above.sum(), across))


def _stands_on_field(frame: Frame, box: Box) -> bool:
    """Whether something in the columns of a robot hides the field below its edge."""
    columns = np.arange(max(int(box.left), 0), min(int(box.right) + 1, frame.classes.shape[1]))
    rows = frame.boundary_row[columns] + np.arange(1, EDGE_BAND + 1)[:, None]
    green = frame.classes[np.minimum(rows, len(frame.classes) - 1), columns] == FIELD
    hidden = (~green).mean(axis=0) >= EDGE_ROWS
    return bool(hidden.mean() >= EDGE_COLUMNS)


def _joined(parts: list[NDArray[np.int32]]) -> list[NDArray[np.int32]]:
    """Regions of one colour, in which those beside each other are one; see `Torso.stats`."""
    joined: list[NDArray[np.int32]] = []
    for part in sorted(parts, key=lambda each: int(each[cv2.CC_STAT_LEFT])):
        left, top, across, tall, area = part.tolist()
        for index, other in enumerate(joined):
            o_left, o_top, o_across, o_tall, o_area = other.tolist()
            low, high = max(top, o_top), min(top + tall, o_top + o_tall)
            lower = min(tall, o_tall)
            gap = left - (o_left + o_across)
            if high - low >= 0.5 * max(tall, o_tall) and gap <= SPLIT_MAX * lower:
                right = max(left + across, o_left + o_across)
                bottom = max(top + tall, o_top + o_tall)
                first = min(top, o_top)
                joined[index] = np.array(
                    (o_left, first, right - o_left, bottom - first, area + o_area), dtype=np.int32
                )
                break
        else:
            joined.append(part)
    return joined


def find_robots(
    frame: Frame,
    torsos: list[Torso],
    ball: Percept | None,
    segments: Sequence[LineSegment],
    line_width: float,
) -> list[Percept]:
    """Robots whose feet are seen, at least in part, and those that are too near for that.

    The ball may lie before the feet; lines may lead to them and are as white.
    """
    if not torsos:
        return []
    ground = frame.classes == FIELD
    if ball is not None and ball.box is not None:
        left, top, right, bottom = (int(max(each, 0.0)) for each in ball.box)
        ground[top : bottom + 2, left : right + 2] = True
    for segment in segments:
        _clear_line(frame, ground, segment, line_width)
    found = (
        _lying(frame.geometry, each)
        if each.lies
        else _below(frame, ground, each.stats, each.kind)
        for each in torsos
    )
    return [each for each in found if each is not None]


def _clear_line(
    frame: Frame, ground: NDArray[np.bool_], segment: LineSegment, line_width: float
) -> None:
    """Add a line that leads away to the ground; in place.

    It is followed upwards, over lines that cross it, while there is green on both sides, that is to
    the feet of a robot.
    """
    column, row = segment.pixels.T
    if np.ptp(row) < STEEP * np.ptp(column):
        return
    ends = np.array((segment.start, segment.end))
    along = ends[1] - ends[0]
    side = 0.5 * line_width / np.hypot(*along) * np.array((-along[1], along[0]))
    edges = frame.geometry.pixels_of(np.concatenate((ends - side, ends + side)))
    rows = np.arange(int(row.max()), -1, -1)
    # Both edges are straight in the image.
    sides = [
        start[0] + (rows - start[1]) * (end[0] - start[0]) / (end[1] - start[1])
        for start, end in (edges[:2], edges[2:])
    ]
    left = np.floor(np.minimum(*sides)).astype(int) - BLUR
    right = np.ceil(np.maximum(*sides)).astype(int) + BLUR
    hidden = 0
    for v, first, last in zip(rows.tolist(), left.tolist(), right.tolist(), strict=True):
        before = ground[v, max(first - GUARD, 0) : max(first, 0)]
        after = ground[v, max(last + 1, 0) : max(last + 1 + GUARD, 0)]
        if max((~before).sum(), (~after).sum()) <= GUARD - GUARD_GREEN:
            ground[v, max(first, 0) : max(last + 1, 0)] = True
            hidden = 0
        elif v < row.min():
            hidden += 1
            if hidden > last - first:
                break  # more than a line that crosses it


def _below(
    frame: Frame, ground: NDArray[np.bool_], stats: NDArray[np.int32], kind: Kind
) -> Percept | None:
    """The robot under a torso, or None if it is none."""
    geometry = frame.geometry
    height, width = frame.classes.shape
    left, top, across, tall, _ = stats.tolist()
    size = max(tall, across)
    centre = left + 0.5 * (across - 1)
    first = max(int(centre - ASIDE * size), 0)
    last = min(int(centre + ASIDE * size) + 1, width)
    torso = Box(float(left), float(top), float(left + across), float(top + tall))
    near = height - top < FEET_MIN * size  # its feet are below the image, or hidden
    start = top + int(LEGS * tall)
    if left <= 0 or left + across >= width or start >= height - GAP - 1:
        # Neither its size nor its middle is seen, or nothing of what is below its torso.
        return too_near(geometry, torso, kind, height) if near else None
    green = ground[start:, first:last]
    # Between the parts of a leg there may be green, but no more of the robot below its feet.
    legs = ~green & (frame.classes[start:, first:last] != WHITE)
    ended = _rows_from(green, GAP) == GAP
    ended &= _rows_from(legs, max(int(BREAK * tall), GAP))[: len(ended)] == 0
    bottoms = np.where(ended.any(axis=0), ended.argmax(axis=0), len(green))
    expected = min(max(int(FOOT_COLUMNS / TORSO_MEAN * tall), 1), len(bottoms))
    foot_depth = int(np.sort(bottoms)[-expected])
    cut = start + foot_depth >= height - 1
    if cut and near:
        return too_near(geometry, torso, kind, height)
    feet = np.nonzero(bottoms >= foot_depth - max(tall // 5, 1))[0]
    centre = 0.5 * (centre + first + float(feet.mean()))
    foot = start + foot_depth - 1
    if foot - top > FEET_MAX * size:
        return None  # it goes on in a line
    (place,), (meets,) = geometry.ground(np.array([[centre, foot + 0.5]]))
    if not meets:
        return None
    away = place - geometry.camera[:2]
    reach = float(np.hypot(*away))
    if not 0.2 < reach < RANGE_MAX:
        return None
    slant = float(np.hypot(reach, geometry.camera[2]))
    metres = slant / geometry.focal
    if not TORSO[0] < across * metres < TORSO[1]:
        return None
    if top > 0 and not TORSO_HEIGHT[0] < tall * metres < TORSO_HEIGHT[1]:
        return None
    if top > 0 and not TORSO_TOP[0] < (foot - top) * metres < TORSO_TOP[1]:
        return None
    spot = place + DEPTH / reach * away
    a, b, c = geometry.covariance(spot[None])[0].tolist()
    spread = (CUT_SPREAD if cut else FEET_SPREAD) ** 2
    box = Box(float(first), float(top), float(last), float(foot))
    return Percept(kind, _point(spot), (a + spread, b, c + spread), box=box)


def _lying(geometry: ImageGeometry, torso: Torso) -> Percept | None:
    """The robot of a torso that lies, or None if it is none."""
    left, top, across, tall, _ = torso.stats.tolist()
    middle = np.array([[left + 0.5 * (across - 1), top + 0.5 * (tall - 1)]])
    (place,), (meets,) = geometry.ground(middle, LYING_HEIGHT)
    if not meets:
        return None
    reach = float(np.hypot(*(place - geometry.camera[:2])))
    slant = float(np.hypot(reach, geometry.camera[2] - LYING_HEIGHT))
    size = max(across, tall) * slant / geometry.focal
    if not LYING_RANGE[0] < reach < LYING_RANGE[1] or not LYING_SIZE[0] < size < LYING_SIZE[1]:
        return None
    a, b, c = geometry.covariance(place[None], LYING_HEIGHT)[0].tolist()
    spread = LYING_SPREAD**2
    return Percept(torso.kind, _point(place), (a + spread, b, c + spread), box=torso.box)


def _rows_from(mask: NDArray[np.bool_], count: int) -> NDArray[np.intp]:
    """How many of `count` rows from each row on are in a mask; (rows - GAP + 1, columns)."""
    padded = np.vstack((np.zeros((1, mask.shape[1]), dtype=int), mask))
    total = np.cumsum(padded, axis=0)
    first = np.arange(len(mask) - GAP + 1)
    return np.asarray(total[np.minimum(first + count, len(mask))] - total[first])


def _point(spot: FloatArray) -> tuple[float, float]:
    return float(spot[0]), float(spot[1])
