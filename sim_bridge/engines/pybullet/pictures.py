"""Images of a PyBullet world, by PyBullet's software renderer.

What is seen is in a PyBullet client of its own, so it costs the physics nothing.
"""

import contextlib
import math
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from robot_core.field import COLORS
from robot_core.robot.camera import CameraView, RgbImage
from robot_core.types import FloatArray
from sim_bridge.ball import BallState
from sim_bridge.body import Body
from sim_bridge.engines.pybullet.library import bullet, silenced
from sim_bridge.meshes import Mesh, faceted, flat, joined, mesh_of, wavefront
from sim_bridge.shapes import Shape
from sim_bridge.state import TrueState
from sim_bridge.surroundings import Surroundings

_NEAR, _FAR = 0.02, 60.0
"""[m] distances between which things are seen."""
_BACKGROUND = (140, 153, 168)
"""Red, green, blue beyond the floor."""
_CARPET_DEPTH = 0.002
"""[m] by which the carpet and the surface around it are drawn below the lines."""
_SURFACE, _SURFACE_COLOR = 20.0, (0.45, 0.45, 0.47, 1.0)
"""[m] half the edge of the surface."""
_TILE = 1.0
"""[m] edge of a tile: the renderer draws no triangle well that reaches behind the camera."""
_TRANSPARENT = 0.5
"""Alpha below which a shape is not drawn; the renderer knows no transparency."""
_LIGHT = {
    "lightDirection": [0.2, -0.1, 1.0],
    "lightColor": [1.0, 1.0, 1.0],
    "lightAmbientCoeff": 0.65,
    "lightDiffuseCoeff": 0.35,
    "lightSpecularCoeff": 0.0,
    "shadow": 0,
}
_TO_OPENGL = np.diag((1.0, -1.0, -1.0))
"""Optical frame to OpenGL's camera frame, y up and z backwards."""


class PyBulletPictures:
    """Renders images of a world."""

    def __init__(
        self, bodies: Sequence[Body], surroundings: Surroundings,
        light: Mapping[str, Any] = _LIGHT,
    ) -> None:  # fmt: skip
        """Build what is seen.

        Args:
            bodies: Of the robots.
            surroundings: What is around them.
            light: As `getCameraImage` takes it.
        """
        self._light = light
        with silenced():
            self._client = bullet.connect(bullet.DIRECT)
        self._bodies = bodies
        with silenced():
            self._links = [
                [self._draw(_opaque(link.visual)) for link in body.links] for body in bodies
            ]
            self._ball: list[int] = []
            if surroundings.ball is not None:
                radius, color = surroundings.ball.radius, surroundings.ball.color
                ball = Shape("sphere", (radius,), np.zeros(3), np.eye(3), (*color, 1.0))
                self._ball = self._draw([(mesh_of(ball), ball.color)])
            self._draw_surroundings(surroundings)

    def render(
        self, view: CameraView, states: Sequence[TrueState], ball: BallState | None
    ) -> RgbImage:
        """The world as a camera in the world frame images it.

        Args:
            view: The camera.
            states: Of the robots.
            ball: None in a world without one.
        """
        torsos = [(s.torso_position, s.torso_matrix, s.joint_position) for s in states]
        return self.draw(view, torsos, ball)

    def draw(
        self, view: CameraView, torsos: Sequence[tuple[FloatArray, FloatArray, FloatArray]],
        ball: BallState | None = None,
    ) -> RgbImage:  # fmt: skip
        """The same with each torso's position (3,) [m], rotation (3, 3) and joints (n,) [rad]."""
        for body, links, torso in zip(self._bodies, self._links, torsos, strict=True):
            for parts, (position, rotation) in zip(links, body.link_poses(*torso), strict=True):
                self._put(parts, position, rotation)
        if ball is not None:
            self._put(self._ball, ball.position, np.eye(3))
        width, height = view.intrinsics.width, view.intrinsics.height
        _, _, colors, depth, _ = bullet.getCameraImage(
            width,
            height,
            _view_matrix(view).ravel(order="F").tolist(),
            _projection(view).ravel(order="F").tolist(),
            renderer=bullet.ER_TINY_RENDERER,
            flags=bullet.ER_NO_SEGMENTATION_MASK,
            physicsClientId=self._client,
            **self._light,
        )
        image = np.array(np.reshape(colors, (height, width, 4))[..., :3], dtype=np.uint8)
        image[np.reshape(depth, (height, width)) >= 1.0] = _BACKGROUND
        return image

    def close(self) -> None:
        """Free the client."""
        with contextlib.suppress(bullet.error):
            bullet.disconnect(self._client)

    def _draw_surroundings(self, surroundings: Surroundings) -> None:
        x, y = (0.5 * edge for edge in surroundings.carpet or (0.0, 0.0))
        far = _SURFACE
        # Not below the carpet: the renderer spends most of its time on pixels.
        around = ((-far, far, y, far), (-far, far, -far, -y), (x, far, -y, y), (-far, -x, -y, y))
        surface = [tile for area in around for tile in _tiles(*area)]
        parts: list[tuple[Mesh, tuple[float, ...]]] = [(joined(surface), _SURFACE_COLOR)]
        if surroundings.carpet is not None:
            parts.append((joined(_tiles(-x, x, -y, y)), (*COLORS["green"], 1.0)))
        lines = [flat(np.array(mark.corners()), 0.0) for mark in surroundings.markings]
        if lines:
            parts.append((joined(lines), (*COLORS["white"], 1.0)))
        parts += [
            (faceted(prism.vertices[np.array(prism.triangles)]), prism.color)
            for prism in surroundings.ground
        ]
        self._draw([*parts, *_opaque(fixture.shape for fixture in surroundings.fixtures)])

    def _draw(self, parts: Iterable[tuple[Mesh, tuple[float, ...]]]) -> list[int]:
        """Add meshes, one body for each color."""
        by_color: dict[tuple[float, ...], list[Mesh]] = {}
        for mesh, color in parts:
            by_color.setdefault(tuple(color), []).append(mesh)
        bodies = []
        for color, meshes in by_color.items():
            # From a file, because PyBullet never frees vertices that are given to it directly.
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder, "mesh.obj")
                path.write_text(wavefront(joined(meshes)), encoding="utf-8")
                shape = bullet.createVisualShape(
                    bullet.GEOM_MESH,
                    fileName=str(path),
                    rgbaColor=color,
                    specularColor=[0.0, 0.0, 0.0],
                    physicsClientId=self._client,
                )
            bodies.append(
                bullet.createMultiBody(
                    0.0, baseVisualShapeIndex=shape, physicsClientId=self._client
                )
            )
        return bodies

    def _put(self, parts: Sequence[int], position: FloatArray, rotation: FloatArray) -> None:
        place, turn = position.tolist(), _quaternion(rotation)
        for part in parts:
            bullet.resetBasePositionAndOrientation(
                part, place, turn, physicsClientId=self._client
            )


def _opaque(shapes: Iterable[Shape]) -> list[tuple[Mesh, tuple[float, ...]]]:
    return [(mesh_of(each), each.color) for each in shapes if each.color[3] >= _TRANSPARENT]


def _tiles(left: float, right: float, rear: float, front: float) -> list[Mesh]:
    """A rectangle x from `left` to `right`, y from `rear` to `front` [m], in tiles."""
    along = np.linspace(left, right, math.ceil((right - left) / _TILE) + 1)
    across = np.linspace(rear, front, math.ceil((front - rear) / _TILE) + 1)
    return [
        flat(np.array(((x0, y0), (x1, y0), (x1, y1), (x0, y1))), -_CARPET_DEPTH)
        for x0, x1 in pairwise(along)
        for y0, y1 in pairwise(across)
    ]


def _view_matrix(view: CameraView) -> FloatArray:
    """(4, 4) world to OpenGL's camera frame."""
    position, rotation = view.pose
    matrix = np.eye(4)
    matrix[:3, :3] = _TO_OPENGL @ rotation.T
    matrix[:3, 3] = -matrix[:3, :3] @ position
    return matrix


def _projection(view: CameraView) -> FloatArray:
    """(4, 4) OpenGL's camera frame to clip coordinates."""
    pinhole = view.intrinsics
    matrix = np.zeros((4, 4))
    matrix[0, 0] = 2.0 * pinhole.fx / pinhole.width
    matrix[1, 1] = 2.0 * pinhole.fy / pinhole.height
    # This renderer evaluates a pixel at its left lower corner, half a pixel from its centre.
    matrix[0, 2] = (pinhole.width - 2.0 * pinhole.cx) / pinhole.width
    matrix[1, 2] = (2.0 * pinhole.cy - pinhole.height + 2.0) / pinhole.height
    matrix[2, 2] = -(_FAR + _NEAR) / (_FAR - _NEAR)
    matrix[2, 3] = -2.0 * _FAR * _NEAR / (_FAR - _NEAR)
    matrix[3, 2] = -1.0
    return matrix


def _quaternion(rotation: FloatArray) -> list[float]:
    """Quaternion xyzw of a (3, 3) rotation."""
    quaternion: list[float] = pin.Quaternion(rotation).coeffs().tolist()
    return quaternion
