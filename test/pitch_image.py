"""A pitch drawn by its geometry, for tests of vision: flat colours, no renderer."""

import cv2
import numpy as np

from robot_core.field import Field
from robot_core.geometry import rotation_from_rpy
from robot_core.robot.camera import CameraPose, CameraView, Intrinsics

GREEN, WHITE, ORANGE, SKY = (26, 115, 41), (242, 242, 242), (242, 115, 13), (140, 150, 170)
_OPTICAL = np.array(((0.0, 0.0, 1.0), (-1.0, 0.0, 0.0), (0.0, -1.0, 0.0)))
_FINE = 2
"""Pixels are drawn this much finer and averaged, so that edges are blurred as in a camera."""


def camera(
    x: float, y: float, heading: float, tilt: float = 0.25, roll: float = 0.0, height: float = 0.47
) -> CameraView:
    """A camera on the field: place [m], heading, tilt down and roll [rad]."""
    rotation = np.array(rotation_from_rpy(roll, tilt, heading)) @ _OPTICAL
    pose = CameraPose(np.array((x, y, height)), rotation)
    return CameraView(Intrinsics.from_fov(320, 240, 0.8342), pose)


def picture(
    view: CameraView,
    ball: tuple[float, float] | None = None,
    *,
    brightness: float = 1.0,
    noise: float = 3.0,
    seed: int = 0,
) -> np.ndarray:
    """(h, w, 3) What a camera in the frame of the field sees of the SPL field and a ball."""
    pinhole = view.intrinsics
    height, width = pinhole.height, pinhole.width
    v, u = (np.mgrid[: height * _FINE, : width * _FINE] + 0.5) / _FINE - 0.5
    rays = view.rays(np.stack((u, v), axis=-1))
    position = view.pose.position
    down = rays[..., 2] < -1e-3
    scale = -position[2] / np.where(down, rays[..., 2], -1.0)
    x, y = position[0] + scale * rays[..., 0], position[1] + scale * rays[..., 1]
    field = Field()
    carpet = down & (np.abs(x) < 0.5 * field.length + 0.7) & (np.abs(y) < 0.5 * field.width + 0.7)
    image = np.empty((*u.shape, 3), np.uint8)
    image[:] = SKY
    image[carpet] = GREEN
    half = 0.5 * field.line_width
    white = np.abs(np.hypot(x, y) - 0.5 * field.circle_diameter) < half
    for line in field.lines():
        (x0, y0), (x1, y1) = line.start, line.end
        white |= (
            (x > min(x0, x1) - half) & (x < max(x0, x1) + half)
            & (y > min(y0, y1) - half) & (y < max(y0, y1) + half)
        )  # fmt: skip
    image[carpet & white] = WHITE
    if ball is not None:
        centre = np.array((*ball, 0.05)) - position
        along = rays @ centre
        off2 = centre @ centre - along**2 / np.einsum("...i,...i->...", rays, rays)
        image[(off2 < 0.05**2) & (along > 0.0)] = ORANGE
    small = cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA).astype(float)
    small = small * brightness + np.random.default_rng(seed).normal(0.0, noise, small.shape)
    return np.clip(small, 0, 255).astype(np.uint8)
