"""Pictures of the robot: poses put into a PyBullet scene and drawn by its software renderer."""

from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from robot_core.robot import RobotDescription
from robot_core.types import FloatArray
from sim_bridge.body import Body
from sim_bridge.engines.simulation_urdf import simulation_urdf
from sim_bridge.individual import Individual

Image = NDArray[np.uint8]
"""(height, width, 3) red, green, blue."""

_FLOOR = (0.93, 0.93, 0.91, 1.0)
_TILE = (0.80, 0.82, 0.84, 1.0)
_TILE_SIZE = 0.25
"""[m]: progress can be read off the floor."""
TILE_PERIOD = 2.0 * _TILE_SIZE
"""Period of the pattern of the floor along x and y [m]."""
_TILES = 14
"""Tiles along each side of the floor."""


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


class Renderer(AbstractContextManager["Renderer"]):
    """A robot without physics, posed and photographed."""

    def __init__(self, robot: RobotDescription, individual: Individual) -> None:
        # Imported there without what PyBullet prints.
        from sim_bridge.engines.pybullet.library import bullet as pybullet

        self._bullet = pybullet
        self._client = pybullet.connect(pybullet.DIRECT)
        body = Body(robot, individual)
        with TemporaryDirectory() as folder:
            path = Path(folder, "robot.urdf")
            path.write_text(simulation_urdf(body, visual=True), encoding="utf-8")
            self._robot = pybullet.loadURDF(
                str(path), useFixedBase=True, physicsClientId=self._client
            )
        indices = {}
        for joint in range(pybullet.getNumJoints(self._robot, physicsClientId=self._client)):
            info = pybullet.getJointInfo(self._robot, joint, physicsClientId=self._client)
            indices[info[1].decode()] = joint
        self._joints = [indices[name] for name in robot.joint_names]
        # PyBullet places the base by its centre of mass.
        dynamics = pybullet.getDynamicsInfo(self._robot, -1, physicsClientId=self._client)
        self._inertial = dynamics[3:5]
        self._floor: list[int] = []

    def pose(self, position: FloatArray, quaternion: FloatArray, joints: FloatArray) -> None:
        """Torso link at (3,) [m], xyzw in the world; joints (n,) [rad]."""
        bullet, client = self._bullet, self._client
        base = bullet.multiplyTransforms(list(position), list(quaternion), *self._inertial)
        bullet.resetBasePositionAndOrientation(self._robot, *base, physicsClientId=client)
        for index, angle in zip(self._joints, joints, strict=True):
            bullet.resetJointState(self._robot, index, float(angle), physicsClientId=client)

    def lay_floor(self, center: Sequence[float]) -> None:
        """A chequered floor around a point (x, y) [m], its joints on whole multiples of a tile."""
        bullet, client = self._bullet, self._client
        for body in self._floor:
            bullet.removeBody(body, physicsClientId=client)
        size, count = _TILE_SIZE, _TILES
        x, y = (round(value / (2 * size)) * 2 * size for value in center[:2])
        half = 0.5 * size * count
        whole = bullet.createVisualShape(
            bullet.GEOM_BOX, halfExtents=[half, half, 0.01], rgbaColor=_FLOOR,
            physicsClientId=client,
        )  # fmt: skip
        self._floor = [self._plate(whole, x, y, -0.0105)]
        tile = bullet.createVisualShape(
            bullet.GEOM_BOX, halfExtents=[size / 2, size / 2, 0.01], rgbaColor=_TILE,
            physicsClientId=client,
        )  # fmt: skip
        for row in range(count):
            for column in range(row % 2, count, 2):
                at = (column + 0.5) * size - half, (row + 0.5) * size - half
                self._floor.append(self._plate(tile, x + at[0], y + at[1], -0.01))

    def _plate(self, shape: int, x: float, y: float, z: float) -> int:
        body: int = self._bullet.createMultiBody(
            0.0, -1, shape, basePosition=[x, y, z], physicsClientId=self._client
        )
        return body

    def photograph(
        self,
        look_at: Sequence[float],
        width: int = 320,
        height: int = 300,
        camera: Camera | None = None,
    ) -> Image:
        """A picture of the scene, looking at the point (x, y) [m]."""
        view = camera or Camera()
        bullet, client = self._bullet, self._client
        seen = bullet.computeViewMatrixFromYawPitchRoll(
            [look_at[0], look_at[1], view.height], view.distance, view.yaw, view.pitch, 0.0, 2
        )
        lens = bullet.computeProjectionMatrixFOV(42.0, width / height, 0.05, 6.0)
        _, _, pixels, _, _ = bullet.getCameraImage(
            width, height, seen, lens, lightDirection=[1.0, -0.6, 2.2], lightDistance=4.0,
            lightAmbientCoeff=0.62, lightDiffuseCoeff=0.45, lightSpecularCoeff=0.05, shadow=1,
            renderer=bullet.ER_TINY_RENDERER, physicsClientId=client,
        )  # fmt: skip
        return np.asarray(pixels, dtype=np.uint8).reshape(height, width, 4)[:, :, :3]

    def close(self) -> None:
        """Free the engine."""
        self._bullet.disconnect(physicsClientId=self._client)

    def __exit__(self, *_: object) -> None:
        self.close()
