"""The lowest points of the collision shapes of a URDF, as far as they are primitives."""

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from robot_core.types import FloatArray

FLAT = 0.004
"""[m] Points up to this far above the lowest one belong to the sole."""
ROUND = 12
"""Points of a circle."""


def lowest_points(element: ET.Element, placement: Mapping[str, Any]) -> FloatArray:
    """(n, 3) [m] points that touch the ground.

    Args:
        element: The URDF.
        placement: Pose (an SE3) of each link whose shapes count; in that frame z is up.
    """
    points = [
        place.act(point)
        for link in element.findall("link")
        if (place := placement.get(link.get("name", ""))) is not None
        for collision in link.findall("collision")
        for point in _corners(collision)
    ]
    if not points:
        return np.zeros((0, 3))
    found = np.array(points)
    return np.asarray(found[found[:, 2] < found[:, 2].min() + FLAT])


def _corners(collision: ET.Element) -> Iterator[FloatArray]:
    """Corners of one shape in the frame of its link."""
    import pinocchio as pin

    geometry = collision.find("geometry")
    shape = None if geometry is None or not len(geometry) else geometry[0]
    if shape is None:
        return
    origin = collision.find("origin")
    keys = {} if origin is None else origin.attrib
    xyz, rpy = (
        np.array([float(word) for word in keys.get(key, "0 0 0").split()]) for key in ("xyz", "rpy")
    )
    place = pin.SE3(pin.rpy.rpyToMatrix(rpy), xyz)
    if shape.tag == "box":
        half = [0.5 * float(word) for word in shape.get("size", "0 0 0").split()]
        for signs in np.ndindex(2, 2, 2):
            yield place.act(np.array([(2 * s - 1) * h for s, h in zip(signs, half, strict=True)]))
    elif shape.tag == "cylinder":
        radius, length = float(shape.get("radius", 0)), float(shape.get("length", 0))
        for step in range(ROUND):
            angle = math.tau * step / ROUND
            for end in (-0.5, 0.5):
                point = (radius * math.cos(angle), radius * math.sin(angle), end * length)
                yield place.act(np.array(point))
    elif shape.tag == "sphere":
        centre = place.translation
        yield centre - np.array([0.0, 0.0, float(shape.get("radius", 0))])
