"""The pitch in the browser: carpet, lines, goals, poles and the ball."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pinocchio as pin

from robot_core.field import COLORS
from robot_core.types import Point2
from sim_bridge.scene import Scene
from sim_bridge.shapes import Color

PAINT, CARPET = 0.001, -0.001
"""[m] heights at which lines and carpet are drawn."""
NET_OPACITY = 0.25


class PitchScene:
    """What surrounds the robots of a scene.

    Attributes:
        ball: Sphere at the ball; None without one.
    """

    def __init__(self, server: Any, scene: Scene) -> None:
        self._scene = server.scene
        around = scene.surroundings()
        if around.carpet is not None:
            x, y = around.carpet[0] / 2.0, around.carpet[1] / 2.0
            carpet = ((-x, -y), (x, -y), (x, y), (-x, y))
            self._add_quads("/pitch/carpet", [carpet], CARPET, COLORS["green"])
            lines = [marking.corners() for marking in around.markings]
            self._add_quads("/pitch/lines", lines, PAINT, COLORS["white"])
        for fixture in around.fixtures:
            shape, name = fixture.shape, f"/pitch/{fixture.name}"
            x, y, z, w = pin.Quaternion(shape.rotation).coeffs()
            look: dict[str, Any] = {
                "color": _bytes(shape.color[:3]),
                "position": shape.position,
                "wxyz": (w, x, y, z),
            }
            if shape.kind == "box":
                opacity = NET_OPACITY if fixture.kind == "net" else None
                self._scene.add_box(name, dimensions=shape.size, opacity=opacity, **look)
            else:
                radius, height = shape.size
                self._scene.add_cylinder(name, radius=radius, height=height, **look)
        self.ball: Any = None
        if around.ball is not None:
            ball = around.ball
            self.ball = self._scene.add_icosphere(
                "/pitch/ball", radius=ball.radius, color=_bytes(ball.color), position=ball.start
            )

    def put_ball(self, position: Sequence[float]) -> None:
        """Draw the ball at x, y, z [m]."""
        if self.ball is not None:
            self.ball.position = tuple(position)

    def _add_quads(
        self, name: str, quads: Sequence[Sequence[Point2]], height: float, color: Color
    ) -> None:
        """One mesh of quadrangles; the corners x, y [m] of each are counter-clockwise."""
        vertices = np.array([(x, y, height) for quad in quads for x, y in quad], dtype=np.float32)
        first = 4 * np.arange(len(quads))[:, None, None]
        faces = (first + [(0, 1, 2), (0, 2, 3)]).reshape(-1, 3).astype(np.uint32)
        # The browser's light casts shadows on a part of a pitch only, with an edge across it.
        self._scene.add_mesh_simple(
            name, vertices, faces, color=_bytes(color), side="double",
            cast_shadow=False, receive_shadow=False,
        )  # fmt: skip


def _bytes(color: Sequence[float]) -> tuple[int, int, int]:
    """Red, green, blue from 0 to 255."""
    red, green, blue = (round(255 * value) for value in color)
    return red, green, blue
