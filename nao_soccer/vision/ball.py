"""The ball: a round region of its colour whose size fits its distance."""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from nao_soccer.vision.colors import BALL, FIELD, WHITE, Image
from nao_soccer.vision.frame import Frame
from nao_soccer.vision.image_geometry import MIN_SLOPE, ImageGeometry, Place
from nao_soccer.vision.percepts import Box, Kind, Percept
from robot_core.types import FloatArray

MIN_AREA = 6
"""[px] Smallest region."""
CANDIDATES = 4
"""Largest regions that are looked at."""
RAYS = 32
"""Directions in which the edge is searched."""
EDGES_MIN = 10
"""Least number of edge points for a fit."""
RESIDUAL_MAX = 0.075
"""Largest deviation of the edge from a circle, of the radius; plus half a pixel."""
FILLED_MIN = 0.6
"""Least share of the circle that has the ball's colour."""
AROUND_MIN = 0.3
"""Least share of the field in what surrounds the lower half of the ball."""
GROUND_MIN = 0.6
"""Least share of field and lines in it."""
SAME_MAX = 0.12
"""Largest share of the ball's colour in what surrounds it."""
BELOW_MIN = 0.2
"""Least share of the field just below the ball, in a flat view: there a line is narrower."""
STEEP = 0.4
"""Least downward component of a unit ray in a steep view, where a line fills what is below."""
SIZE_MIN = 2.5
"""[px] Smallest radius."""
INSIDE_MIN = 0.6
"""Least part of the radius that is in the image on either side of a whole ball."""
CUT_AROUND_MIN = 0.8
"""Least share of the field around a ball that is cut: half of a robot's orange part looks like a
ball, but it has the robot's white beside it."""
FEET_SHARE = 0.18
"""Height of a robot's feet in the image, of the whole robot; a ball may lie in front of them."""
RANGE_MAX = 5.0
"""[m] Largest distance."""


def find_ball(frame: Frame, radius: float, robots: Sequence[Box]) -> Percept | None:
    """The ball of `radius` [m] in an image, or None; robots may have round parts of its colour."""
    mask = (frame.classes == BALL).astype(np.uint8)
    mask[: max(int(frame.horizon.min()) - 2, 0)] = 0
    if cv2.countNonZero(mask) < MIN_AREA:
        return None
    count, _, stats, centres = cv2.connectedComponentsWithStats(mask, connectivity=8)
    if count < 2:
        return None
    areas = stats[1:, cv2.CC_STAT_AREA]
    for index in np.argsort(-areas)[:CANDIDATES] + 1:
        if stats[index, cv2.CC_STAT_AREA] < MIN_AREA:
            break
        found = _measured(frame, mask, stats[index], centres[index], radius)
        if found is not None and (found.box is None or not _is_part(found.box, robots)):
            return found  # the largest
    return None


def _is_part(ball: Box, robots: Sequence[Box]) -> bool:
    """Whether it is within a robot, over its feet."""
    middle = 0.5 * (ball.left + ball.right)
    return any(
        robot.left < middle < robot.right
        and robot.top < ball.bottom < robot.bottom - FEET_SHARE * (robot.bottom - robot.top)
        for robot in robots
    )


def _measured(
    frame: Frame, mask: Image, stats: NDArray[np.int32], centre: FloatArray, radius: float
) -> Percept | None:
    """The ball of one region, or None if it is none."""
    geometry = frame.geometry
    _, _, width, height, _ = stats.tolist()
    guess = 0.5 * max(width, height)
    edges = _edges(frame.image, centre, guess)
    if len(edges) < EDGES_MIN:
        return None
    fit = _cone(geometry, edges)
    if fit is None:
        return None
    axis, sine, residual, kept = fit
    size = geometry.focal * sine
    if size < SIZE_MIN:
        return None
    if residual > RESIDUAL_MAX * size + 0.5 or kept < EDGES_MIN:
        return None
    spot = geometry.view.project((geometry.camera + axis)[None])[0]
    if not 0.0 <= spot[0] < geometry.width:
        return None  # less than half is seen: it may be a part of a robot beside the image
    if not frame.on_field(spot[None] + (0.0, 0.8 * size))[0]:
        return None
    sides = spot + INSIDE_MIN * size * np.array(((-1.0, 0.0), (1.0, 0.0)))
    whole = bool(frame.inside(sides).all())
    if not _looks_round(frame, mask, spot, axis, sine, whole=whole):
        return None
    placed = _place(geometry, axis, sine, kept, radius)
    if placed is None or placed.distance > RANGE_MAX:
        return None
    box = Box(spot[0] - size, spot[1] - size, spot[0] + size, spot[1] + size)
    tilt = placed.tilt if whole else None  # the size of a cut ball is too rough to learn from
    return Percept(Kind.BALL, placed.position, placed.covariance, box=box, tilt=tilt)


def _edges(image: Image, centre: FloatArray, guess: float) -> FloatArray:
    """Points (n, 2) on the edge of the region, to a part of a pixel.

    The share of red in a pixel hardly depends on its brightness. Along rays from the centre the
    edge is where it has fallen half way from its value inside to that outside.
    """
    height, width = image.shape[:2]
    reach = 1.7 * guess + 3.0
    steps = np.arange(0.0, reach, 0.5)
    angle = np.arange(RAYS) * (2.0 * np.pi / RAYS)
    u = (centre[0] + np.cos(angle)[:, None] * steps).astype(np.float32)
    v = (centre[1] + np.sin(angle)[:, None] * steps).astype(np.float32)
    left, top = max(int(u.min()) - 1, 0), max(int(v.min()) - 1, 0)
    patch = image[top : int(v.max()) + 3, left : int(u.max()) + 3].astype(np.float32)
    if min(patch.shape[:2]) < 3:
        return np.empty((0, 2))
    share = (patch[..., 0] - patch[..., 2]) / (patch.sum(axis=2) + 20.0)
    values = cv2.remap(share, u - left, v - top, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    inside = np.median(values[:, : max(int(guess), 1)])
    outside = np.median(values[:, -4:])
    if inside - outside < 0.1:
        return np.empty((0, 2))
    half = 0.5 * (inside + outside)
    below = values < half
    index = below.argmax(axis=1)
    found = below.any(axis=1) & (index > 0)
    rows = np.nonzero(found)[0]
    after = index[rows]
    high, low = values[rows, after - 1], values[rows, after]
    distance = steps[after - 1] + 0.5 * (high - half) / np.maximum(high - low, 1e-6)
    points = centre + distance[:, None] * np.stack((np.cos(angle), np.sin(angle)), axis=1)[rows]
    inner = (points[:, 0] > 0.5) & (points[:, 0] < width - 1.5)
    inner &= (points[:, 1] > 0.5) & (points[:, 1] < height - 1.5)
    return np.asarray(points[inner])


def _cone(
    geometry: ImageGeometry, edges: FloatArray
) -> tuple[FloatArray, float, float, int] | None:
    """The cone of rays that touch a sphere: e . x = 1 for each unit ray e of its edges (n, 2) [px].

    Unit axis (3,) in base_footprint, sine of half the opening angle, root mean square deviation
    [px], number of edges that fit; None if there is no such cone.
    """
    rays = geometry.rays(edges)
    for _ in range(3):
        solution, *_rest = np.linalg.lstsq(rays, np.ones(len(rays)), rcond=None)
        length = float(np.linalg.norm(solution))
        if length <= 1.0 + 1e-9:
            return None
        axis = solution / length
        sine = float(np.sqrt(1.0 - 1.0 / length**2))
        # Angle of each edge to the axis, less that of the cone.
        off = (np.sqrt(np.maximum(1.0 - (rays @ axis) ** 2, 0.0)) - sine) * geometry.focal
        limit = max(2.0 * float(np.median(np.abs(off))), 0.6)
        good = np.abs(off) <= limit
        if good.all() or good.sum() < EDGES_MIN:
            break
        rays = rays[good]
    return np.asarray(axis), sine, float(np.sqrt(np.mean(off[good] ** 2))), int(good.sum())


def _looks_round(
    frame: Frame,
    mask: Image,
    spot: FloatArray,
    axis: FloatArray,
    sine: float,
    *,
    whole: bool,
) -> bool:
    """Whether the disc has the ball's colour, and what is around its lower half is field.

    A ball that is cut (not `whole`) has the field all around: parts of a robot are below another
    part. `axis` (3,) is that of the cone of the ball, `sine` that of half its opening angle.
    """
    height, width = mask.shape
    size = frame.geometry.focal * sine
    reach = int(1.8 * size + 3.0)
    step = 1 + int(size) // 12
    column, row = round(float(spot[0])), round(float(spot[1]))
    rows = np.arange(max(row - reach, 0), min(row + reach + 1, height), step)
    columns = np.arange(max(column - reach, 0), min(column + reach + 1, width), step)
    if not len(rows) or not len(columns):
        return False
    u, v = (each.ravel() for each in np.meshgrid(columns, rows))
    rays = frame.geometry.rays(np.stack((u, v), axis=1))
    # Distance from the axis [px]; off the optical axis the disc is an ellipse in the image.
    away = np.sqrt(np.maximum(1.0 - (rays @ axis) ** 2, 0.0)) * frame.geometry.focal
    inner = away <= max(size - 0.5, 0.7)
    same = mask[v, u]
    if not inner.any() or same[inner].mean() < FILLED_MIN:
        return False
    ring = (away > size + 1.2) & (away <= size + 1.2 + max(0.4 * size, 1.5))
    if ring.any() and same[ring].mean() > SAME_MAX:
        return False
    if whole:
        ring &= v > spot[1]
    else:
        ring &= frame.on_field(np.stack((u, v), axis=1))
    if ring.sum() < 4:
        return whole
    around = frame.classes[v[ring], u[ring]]
    if np.isin(around, (FIELD, WHITE)).mean() < GROUND_MIN:
        return False
    below = np.abs(u[ring] - spot[0]) < v[ring] - spot[1]
    if below.sum() >= 4 and axis[2] > -STEEP and (around[below] == FIELD).mean() < BELOW_MIN:
        return False
    return bool((around == FIELD).mean() >= (AROUND_MIN if whole else CUT_AROUND_MIN))


def _place(
    geometry: ImageGeometry, axis: FloatArray, sine: float, edges: int, radius: float
) -> Place | None:
    """Place of the ball by the height of its line of sight and by its size."""
    drop = float(geometry.camera[2]) - radius
    flat = float(np.hypot(axis[0], axis[1]))
    slope = -float(axis[2])
    if flat < 1e-6 or drop <= 0.0:
        return None
    by_size = radius / sine * flat
    pixel = geometry.error.pixel / geometry.focal
    # Half of the edge says where the ball is, half how large it is; 1 % for its shading.
    variance = by_size**2 * (pixel**2 / (0.5 * edges * sine**2) + 0.01**2)
    by_height = drop * flat / slope if slope > MIN_SLOPE else None
    return geometry.place(axis[:2] / flat, drop, by_height, by_size, variance)
