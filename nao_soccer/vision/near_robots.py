"""What vision and its model know of robots that lie, or whose feet are below the image."""

import numpy as np

from nao_soccer.vision.image_geometry import ImageGeometry
from nao_soccer.vision.percepts import Box, Kind, Percept

FEET_MIN = 1.75
"""Least height of a torso's upper edge over feet that the lower edge of the image cuts, of the
torso's height."""
NEAREST = 0.2
"""[m] from the camera to the middle of a robot that touches this one."""
UNSURE = 0.55
"""[m] Largest range of places of a robot whose feet are below the image."""
TORSO_LOW, TORSO_HEIGHT_MAX = 0.2, 0.27
"""[m] Height of a torso's lower edge over the ground, at least, and from there to the upper one."""
LYING_HEIGHT = 0.1
"""[m] Height of the middle of a torso that lies."""
LYING_RANGE = 0.3, 2.0
"""[m] Distances from the camera at which robots that lie are seen; nearer is the own body."""
LYING_SPREAD = 0.1
"""[m] Standard deviation of its place."""


def too_near(geometry: ImageGeometry, torso: Box, kind: Kind, rows: int) -> Percept | None:
    """A robot whose feet are below the image, or None if that says too little of its place.

    It is nearer than the ground at the lower edge of the image, nearer than what is as high as the
    lower edge of its torso if that is below the image too, and nearer than the tallest torso would
    be that is as tall in the image.
    """
    (edge,), (meets,) = geometry.ground(np.array([[0.5 * (torso.left + torso.right), rows - 1.0]]))
    if not meets:
        return None
    if _own_body(geometry, torso):
        return None
    way = edge - geometry.camera[:2]
    reach = float(np.hypot(*way))
    low = TORSO_LOW if torso.bottom >= rows - 1 else 0.0
    far = reach * max(0.0, 1.0 - low / float(geometry.camera[2]))
    far = min(far, TORSO_HEIGHT_MAX * geometry.focal / max(torso.bottom - torso.top, 1.0))
    unsure = max(far - NEAREST, NEAREST)
    if unsure > UNSURE:
        return None
    spot = geometry.camera[:2] + max(0.5 * (NEAREST + far), NEAREST) / reach * way
    a, b, c = geometry.covariance(spot[None])[0].tolist()
    variance = unsure**2 / 12.0
    box = torso._replace(bottom=float(rows))
    return Percept(kind, (float(spot[0]), float(spot[1])), (a + variance, b, c + variance), box=box)


def _own_body(geometry: ImageGeometry, torso: Box) -> bool:
    """Whether a torso is so far below the camera that no other robot could stand there."""
    middle = 0.5 * (torso.left + torso.right)
    (ray,) = geometry.rays(np.array([[middle, torso.top]]))
    ahead = max(float(np.hypot(ray[0], ray[1])), 1e-9)
    height: float = geometry.camera[2] + NEAREST * ray[2] / ahead
    return height < TORSO_LOW
