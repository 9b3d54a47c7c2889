"""Shapes as triangles with few facets."""

import math
from typing import NamedTuple

import numpy as np

from robot_core.types import FloatArray
from sim_bridge.shapes import Shape

FACETS = 16
"""Of a round shape around its axis; a sphere has half as many along it."""


class Mesh(NamedTuple):
    """Triangles with corners of their own.

    Attributes:
        vertices: (3 k, 3) [m] corners, three for each triangle, counter-clockwise from outside.
        normals: (3 k, 3) unit vectors.
    """

    vertices: FloatArray
    normals: FloatArray

    def placed(self, position: FloatArray, rotation: FloatArray) -> "Mesh":
        """The mesh in the frame in which it has this pose."""
        return Mesh(self.vertices @ rotation.T + position, self.normals @ rotation.T)


def mesh_of(shape: Shape, facets: int = FACETS) -> Mesh:
    """A shape in the frame of its link; a round one has `facets` around its axis."""
    if shape.kind == "box":
        mesh = _box(np.array(shape.size))
    elif shape.kind == "sphere":
        mesh = _sphere(shape.size[0], facets)
    else:
        radius, length = shape.size
        mesh = _cylinder(radius, length, facets)
    return mesh.placed(shape.position, shape.rotation)


def flat(outline: FloatArray, height: float) -> Mesh:
    """A convex polygon (k, 2) [m], counter-clockwise, that faces up at a height [m]."""
    corners = np.column_stack((outline, np.full(len(outline), height)))
    return faceted(np.array([corners[[0, i, i + 1]] for i in range(1, len(corners) - 1)]))


def faceted(triangles: FloatArray) -> Mesh:
    """Triangles (k, 3, 3), each with one normal."""
    across = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals = across / np.linalg.norm(across, axis=1, keepdims=True)
    return Mesh(triangles.reshape(-1, 3), np.repeat(normals, 3, axis=0))


def joined(meshes: list[Mesh]) -> Mesh:
    """One mesh of several."""
    vertices, normals = zip(*meshes, strict=True)
    return Mesh(np.vstack(vertices), np.vstack(normals))


def wavefront(mesh: Mesh) -> str:
    """The mesh as the text of an OBJ file."""
    corners = range(1, len(mesh.vertices) + 1)
    lines = [f"v {x:.6g} {y:.6g} {z:.6g}" for x, y, z in mesh.vertices.tolist()]
    lines += [f"vn {x:.4f} {y:.4f} {z:.4f}" for x, y, z in mesh.normals.tolist()]
    lines += [f"f {i}//{i} {i + 1}//{i + 1} {i + 2}//{i + 2}" for i in corners[::3]]
    return "\n".join(lines) + "\n"


def _box(size: FloatArray) -> Mesh:
    faces = []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            u, v = np.roll(np.eye(3), axis, axis=1)[1:] * size / 2.0
            w = sign * np.eye(3)[axis] * size / 2.0
            u, v = (u, v) if sign > 0.0 else (v, u)
            a, b, c, d = w - u - v, w + u - v, w + u + v, w - u + v
            faces += [(a, b, c), (a, c, d)]
    return faceted(np.array(faces))


def _sphere(radius: float, facets: int) -> Mesh:
    polar = np.linspace(0.0, math.pi, facets // 2 + 1)
    around = np.linspace(0.0, math.tau, facets + 1)
    grid = np.stack(
        (
            np.outer(np.sin(polar), np.cos(around)),
            np.outer(np.sin(polar), np.sin(around)),
            np.outer(np.cos(polar), np.ones_like(around)),
        ),
        axis=-1,
    )
    a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    upper = np.stack((a, b, c), axis=2)[:-1]  # at the lower pole they have no area
    lower = np.stack((a, c, d), axis=2)[1:]
    normals = np.vstack((upper.reshape(-1, 3), lower.reshape(-1, 3)))
    return Mesh(radius * normals, normals)


def _cylinder(radius: float, length: float, facets: int) -> Mesh:
    angles = np.linspace(0.0, math.tau, facets + 1)
    rim = np.column_stack((np.cos(angles), np.sin(angles), np.zeros_like(angles)))
    up = np.array((0.0, 0.0, length / 2.0))
    a, b = rim[:-1], rim[1:]
    normals = np.stack((a, b, b, a, b, a), axis=1).reshape(-1, 3)
    lift = np.array((-1.0, -1.0, 1.0, -1.0, 1.0, 1.0))[:, None] * up
    sides = np.stack((a, b, b, a, b, a), axis=1) * radius + lift
    top = flat(radius * rim[:-1, :2], length / 2.0)
    bottom = top.placed(np.zeros(3), np.diag((1.0, -1.0, -1.0)))
    return joined([Mesh(sides.reshape(-1, 3), normals), top, bottom])
