"""Pictures of the robot by PyBullet's software renderer: no display and no OpenGL is needed."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from robot_core.geometry import rotation_matrix
from robot_core.robot import RobotDescription
from robot_core.robot.camera import CameraView, Intrinsics, looking
from robot_core.types import FloatArray
from sim_bridge.body import Body
from sim_bridge.individual import Individual
from sim_bridge.shapes import Shape
from sim_bridge.surroundings import Fixture, Surroundings

Image = NDArray[np.uint8]
"""(height, width, 3) red, green, blue."""

_COLORS = (0.80, 0.82, 0.84, 1.0), (0.93, 0.93, 0.91, 1.0)
_TILE_SIZE, _THICKNESS = 0.25, 0.02
"""[m]: progress can be read off the floor."""
TILE_PERIOD = 2.0 * _TILE_SIZE
"""Period of the pattern of the floor along x and y [m]."""
_TILES = 14
"""Tiles along each side of the floor."""
_VIEW = math.radians(42.0)
"""Vertical angle of view."""
_LIGHT = {
    "lightDirection": [1.0, -0.6, 2.2], "lightDistance": 4.0, "lightAmbientCoeff": 0.62,
    "lightDiffuseCoeff": 0.45, "lightSpecularCoeff": 0.05, "shadow": 1,
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Camera:
    """A camera that looks at the robot.

    Attributes:
        distance: [m].
        yaw: [deg] 0 looks along the world's y.
        pitch: [deg].
        height: [m] of the point looked at.
    """

    distance: float = 0.95
    yaw: float = 50.0
    pitch: float = -14.0
    height: float = 0.22


CAMERA = Camera()


def write_gif(path: Path, images: Sequence[Image], period: float, colours: int) -> None:
    """Write a loop of pictures, one each `period` [s]; GIF knows multiples of 10 ms."""
    import PIL.Image

    pictures = [PIL.Image.fromarray(image) for image in images]
    # One palette for all frames, and no dithering, or the floor flickers.
    palette = pictures[0].quantize(colours)
    frames = [each.quantize(palette=palette, dither=PIL.Image.Dither.NONE) for each in pictures]
    frames[0].save(
        path, save_all=True, append_images=frames[1:], duration=round(1000 * period), loop=0,
        optimize=False,
    )  # fmt: skip


class _Floor(Surroundings):
    """A chequered floor around the origin."""

    @property
    def fixtures(self) -> tuple[Fixture, ...]:
        """The tiles."""
        places = (np.arange(_TILES) + 0.5 - 0.5 * _TILES) * _TILE_SIZE
        size = (_TILE_SIZE, _TILE_SIZE, _THICKNESS)
        return tuple(
            Fixture("", "tile", Shape("box", size, np.array((x, y, -0.5 * _THICKNESS)), np.eye(3),
                                      _COLORS[(row + column) % 2]))
            for row, x in enumerate(places) for column, y in enumerate(places)
        )  # fmt: skip


class Renderer:
    """A robot without physics on a chequered floor, posed and photographed."""

    def __init__(self, robot: RobotDescription, individual: Individual) -> None:
        # Imported there without what PyBullet prints.
        from sim_bridge.engines.pybullet.pictures import PyBulletPictures

        self._pictures = PyBulletPictures([Body(robot, individual)], _Floor(), _LIGHT)

    def photograph(
        self, position: FloatArray, quaternion: FloatArray, joints: FloatArray,
        look_at: FloatArray, width: int = 320, height: int = 300, camera: Camera = CAMERA,
    ) -> Image:  # fmt: skip
        """A picture of a pose; far away the robot is near the origin, where the pattern is alike.

        Args:
            position: Of the torso (3,) [m] in the world.
            quaternion: Of the torso, x y z w.
            joints: (n,) [rad]
            look_at: x, y [m] that the camera looks at.
            width: [px]
            height: [px]
            camera: The camera.
        """
        shift = TILE_PERIOD * np.round(np.asarray(look_at) / TILE_PERIOD)
        target = np.array((*(np.asarray(look_at) - shift), camera.height))
        yaw, pitch = math.radians(camera.yaw), math.radians(camera.pitch)
        away = (math.sin(yaw) * math.cos(pitch), -math.cos(yaw) * math.cos(pitch), -math.sin(pitch))
        across = 2.0 * math.atan(width / height * math.tan(0.5 * _VIEW))
        place = target + camera.distance * np.array(away)
        view = CameraView(Intrinsics.from_fov(width, height, across), looking(place, target))
        torso = position - (*shift, 0.0), rotation_matrix(quaternion), joints
        return self._pictures.draw(view, [torso])

    def close(self) -> None:
        """Free the engine."""
        self._pictures.close()
