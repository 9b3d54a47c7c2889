"""The centre circle, from points on field lines, together with the tilt of the camera.

A tilt of one degree moves a place at 3 m by 33 cm and makes an ellipse of the circle. Its radius is
known, so its shape gives the tilt.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nao_soccer.vision.colors import FIELD
from nao_soccer.vision.frame import Frame
from nao_soccer.vision.image_geometry import ImageGeometry, Tilt, bearing_of
from nao_soccer.vision.lines import best_line
from nao_soccer.vision.scan_lines import LinePoints
from robot_core.types import FloatArray, Point2

TRIALS = 120
"""Triples of points that are tried with each tilt."""
TILTS = (0.0, -1.0, 1.0)
"""Tilts of the camera that are tried, of the standard deviation."""
TILT_MAX = 3.0
"""Largest tilt, of the standard deviation."""
RADIUS_ERROR = 0.15
"""Largest error of the radius of a triple, of the radius."""
TOLERANCE = (0.012, 2.0)
"""Largest distance of a point from the circle: [m], plus what so many pixels [px] are on the ground
along the line of sight."""
STEPS = 4
"""Steps of the fit of circle and tilt."""
POINTS_MIN = 14
"""Least number of points on the circle."""
RANGE_MAX = 4.5
"""[m] Largest distance of a point."""
SAMPLES = 72
"""Places on the circle that are looked at in the image."""
SEEN_MIN = 24
"""Least number of them that are to be seen."""
WHITE_MIN = 0.78
"""Least share of them on a line."""
GREEN_MIN = 0.6
"""Least share of them with green on both sides."""
STRAIGHT_MAX = 0.8
"""Largest share of the points that lie on two straight lines."""
SIDE = 0.09
"""[m] To either side of the line."""


class Circle(NamedTuple):
    """The centre circle.

    Attributes:
        centre: [m] in base_footprint, with the camera lowered by the tilt.
        radius: [m]
        on: (n,) which line points are on it.
    """

    centre: Point2
    radius: float
    on: NDArray[np.bool_]
    tilt: Tilt


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
        radius: [m]; 0 without a circle.
        random: Draws the triples of points.
    """
    geometry = frame.geometry
    away = np.hypot(*(points.places - geometry.camera[:2]).T)
    near = np.nonzero(away < RANGE_MAX)[0]
    if radius <= 0.0 or len(near) < POINTS_MIN:
        return None
    pixels = points.pixels[near]
    drop = float(geometry.camera[2])
    base, slack = TOLERANCE
    tolerance = base + slack * (away[near] ** 2 + drop**2) / (drop * geometry.focal)
    found = _searched(geometry, pixels, tolerance, radius, random)
    if found is None:
        return None
    variance = 0.0
    for _ in range(STEPS):
        on = np.abs(_off(geometry, pixels, found, radius)) <= tolerance
        if on.sum() < POINTS_MIN:
            return None
        found, variance = _refined(geometry, pixels[on], tolerance[on], found, radius)
    x, y, angle = found.tolist()
    if abs(angle) > TILT_MAX * geometry.error.tilt:
        return None
    if _is_wedge(pixels[on], random):
        return None
    if not _is_painted(frame, geometry.lowered(angle), mask, (x, y), radius):
        return None
    all_on = np.zeros(len(points.places), dtype=bool)
    all_on[near[on]] = True
    tilt = Tilt(angle, variance, bearing_of(geometry.view))
    return Circle((x, y), radius, all_on, tilt)


def _searched(
    geometry: ImageGeometry,
    pixels: FloatArray,
    tolerance: FloatArray,
    radius: float,
    random: np.random.Generator,
) -> FloatArray | None:
    """Centre [m] and tilt [rad] (3,) of the circle through three points that has the most."""
    best, found = POINTS_MIN - 1, None
    for share in TILTS:
        tilt = share * geometry.error.tilt
        places, _ = geometry.lowered(tilt).ground(pixels)
        a, b, c = (places[random.integers(0, len(places), TRIALS)] for _ in range(3))
        tried = _circumcentres(a, b, c)
        tried = tried[np.abs(tried[:, 2] - radius) <= RADIUS_ERROR * radius]
        if not len(tried):
            continue
        off = np.hypot(places[:, 0, None] - tried[:, 0], places[:, 1, None] - tried[:, 1])
        count = (np.abs(off - tried[:, 2]) <= tolerance[:, None]).sum(axis=0)
        index = int(count.argmax())
        if count[index] > best:
            best, found = int(count[index]), np.array((*tried[index, :2], tilt))
    return found


def _off(
    geometry: ImageGeometry, pixels: FloatArray, circle: FloatArray, radius: float
) -> FloatArray:
    """Distances (n,) [m] of pixels (n, 2) from a circle: centre and tilt (3,); positive outside."""
    places, _ = geometry.lowered(float(circle[2])).ground(pixels)
    return np.asarray(np.hypot(*(places - circle[:2]).T) - radius)


def _refined(
    geometry: ImageGeometry,
    pixels: FloatArray,
    tolerance: FloatArray,
    circle: FloatArray,
    radius: float,
) -> tuple[FloatArray, float]:
    """One Gauss-Newton step of the circle (3,), centre [m] and tilt; variance of the tilt [rad^2].

    `pixels` (n, 2) lie on it; `tolerance` (n,) [m] is two standard deviations of each.
    """
    off = _off(geometry, pixels, circle, radius)
    steps = np.diag((1e-3, 1e-3, 1e-4))
    jacobian = np.stack(
        [(_off(geometry, pixels, circle + step, radius) - off) / step.sum() for step in steps],
        axis=1,
    )
    weighted = jacobian * (2.0 / tolerance)[:, None]
    information = weighted.T @ weighted
    gradient = weighted.T @ (off * 2.0 / tolerance)
    alone = np.linalg.inv(information + 1e-9 * np.eye(3))
    prior = 1.0 / geometry.error.tilt**2
    information[2, 2] += prior
    gradient[2] += prior * circle[2]
    return circle - np.linalg.solve(information, gradient), float(alone[2, 2])


def _is_wedge(pixels: FloatArray, random: np.random.Generator) -> bool:
    """Whether points (n, 2) [px] lie on two straight lines, which meet where a circle would end."""
    left = pixels
    for _ in range(2):
        on = best_line(left, random)
        if on is not None:
            left = left[~on]
    return len(left) < (1.0 - STRAIGHT_MAX) * len(pixels)


def _is_painted(
    frame: Frame,
    geometry: ImageGeometry,
    mask: NDArray[np.bool_],
    centre: Point2,
    radius: float,
) -> bool:
    """Whether a circle is white all around, as far as it is seen, with green on both sides."""
    angle = np.arange(SAMPLES) * (2.0 * np.pi / SAMPLES)
    direction = np.stack((np.cos(angle), np.sin(angle)), axis=1)
    rings = [
        geometry.pixels_of(np.asarray(centre) + size * direction)
        for size in (radius, radius - SIDE, radius + SIDE)
    ]
    seen = np.logical_and.reduce([frame.inside(ring) for ring in rings])
    places = np.asarray(centre) + radius * direction
    seen &= np.hypot(*(places - geometry.camera[:2]).T) < RANGE_MAX
    if seen.sum() < SEEN_MIN:
        return False
    (column, row), *sides = (np.rint(ring[seen]).astype(int).T for ring in rings)
    height = len(mask)
    white = np.zeros(len(row), dtype=bool)
    for shift in (-1, 0, 1):
        white |= mask[np.clip(row + shift, 0, height - 1), column]
    green = [frame.classes[v, u] == FIELD for u, v in sides]
    both = (green[0] & green[1]).mean()
    return bool(white.mean() >= WHITE_MIN and both >= GREEN_MIN)


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
