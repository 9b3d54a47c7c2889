"""The primitive shapes of a URDF as one mesh of triangles, each vertex in the frame of its link."""

import math
import xml.etree.ElementTree as ET
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from nao_lipm_gait.types import FloatArray

IntArray = NDArray[np.int64]
ROUND = 12
"""Corners of a circle."""


@dataclass(frozen=True, slots=True)
class Shapes:
    """v vertices and f triangles."""

    links: tuple[str, ...]
    vertex: FloatArray
    """(v, 3) [m] in the frame of the link."""
    link: IntArray
    """(v,) index into `links`."""
    triangle: IntArray
    """(f, 3) indices of vertices."""
    color: tuple[str, ...]
    """One per triangle, as rgb(r,g,b)."""


def shapes_of(urdf: str) -> Shapes:
    """All boxes, cylinders and spheres that the URDF shows; meshes are left out."""
    root = ET.fromstring(urdf)
    colors = {m.get("name", ""): _rgb(m) for m in root.findall("material")}
    links: list[str] = []
    vertices, owners, triangles, paint = [], [], [], []
    count = 0
    for link in root.findall("link"):
        for visual in link.findall("visual"):
            made = _made(visual.find("geometry"))
            if made is None:
                continue
            points, faces = made
            name = link.get("name", "")
            if name not in links:
                links.append(name)
            rotation, place = _origin(visual.find("origin"))
            vertices.append(points @ rotation.T + place)
            owners.append(np.full(len(points), links.index(name)))
            triangles.append(faces + count)
            paint += [_color(visual.find("material"), colors)] * len(faces)
            count += len(points)
    if not vertices:
        return Shapes((), np.empty((0, 3)), np.empty(0, int), np.empty((0, 3), int), ())
    return Shapes(
        tuple(links),
        np.vstack(vertices),
        np.concatenate(owners),
        np.vstack(triangles),
        tuple(paint),
    )


def _rgb(material: ET.Element | None) -> str | None:
    color = None if material is None else material.find("color")
    if color is None:
        return None
    r, g, b = (round(255 * float(value)) for value in color.get("rgba", "").split()[:3])
    return f"rgb({r},{g},{b})"


def _color(material: ET.Element | None, named: dict[str, str | None]) -> str:
    own = _rgb(material)
    name = "" if material is None else material.get("name", "")
    return own or named.get(name) or "rgb(200,204,210)"


def _origin(origin: ET.Element | None) -> tuple[FloatArray, FloatArray]:
    if origin is None:
        return np.eye(3), np.zeros(3)
    roll, pitch, yaw = (float(value) for value in origin.get("rpy", "0 0 0").split())
    place = np.array([float(value) for value in origin.get("xyz", "0 0 0").split()])
    return np.asarray(pin.rpy.rpyToMatrix(roll, pitch, yaw)), place


def _made(geometry: ET.Element | None) -> tuple[FloatArray, IntArray] | None:
    if geometry is None:
        return None
    if (box := geometry.find("box")) is not None:
        return _box(*(float(value) for value in box.get("size", "").split()))
    if (cylinder := geometry.find("cylinder")) is not None:
        return _lathe(*_cylinder_profile(
            float(cylinder.get("radius", "")), float(cylinder.get("length", ""))
        ))  # fmt: skip
    if (sphere := geometry.find("sphere")) is not None:
        radius = float(sphere.get("radius", ""))
        angles = np.linspace(-0.5 * math.pi, 0.5 * math.pi, ROUND // 2 + 1)
        return _lathe(radius * np.cos(angles), radius * np.sin(angles))
    return None


def _box(x: float, y: float, z: float) -> tuple[FloatArray, IntArray]:
    corners = np.array([(a, b, c) for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)])
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))]
    return 0.5 * corners * (x, y, z), np.array(triangles)


def _cylinder_profile(radius: float, length: float) -> tuple[FloatArray, FloatArray]:
    half = 0.5 * length
    return np.array([0.0, radius, radius, 0.0]), np.array([-half, -half, half, half])


def _lathe(radius: FloatArray, height: FloatArray) -> tuple[FloatArray, IntArray]:
    """A profile turned about z; radii (p,) and heights (p,), from the lower pole to the upper."""
    angle = np.arange(ROUND) * 2.0 * math.pi / ROUND
    rings = [
        np.column_stack([r * np.cos(angle), r * np.sin(angle), np.full(ROUND, z)])
        for r, z in zip(radius, height, strict=True)
    ]
    triangles = []
    for ring in range(len(radius) - 1):
        for a in range(ROUND):
            b = (a + 1) % ROUND
            low, high = ring * ROUND, (ring + 1) * ROUND
            if radius[ring] > 0.0:
                triangles.append((low + a, low + b, high + b))
            if radius[ring + 1] > 0.0:
                triangles.append((low + a, high + b, high + a))
    return np.vstack(rings), np.array(triangles)
