"""Which part of the ground an image shows: what is not seen there is not there."""

import numpy as np

from robot_core.robot.camera import CameraView
from robot_core.types import FloatArray

RANGE = 6.0
"""[m] Distance from the camera at which the part ends, towards the horizon."""


def visible_ground(view: CameraView) -> FloatArray:
    """The ground that an image shows: corners (4, 2) [m] in base_footprint.

    From the lower left one clockwise in the image; (0, 2) if the camera looks above the horizon.
    """
    pinhole = view.intrinsics
    right, low = pinhole.width - 1.0, pinhole.height - 1.0
    corners = np.array(((0.0, low), (0.0, 0.0), (right, 0.0), (right, low)))
    rays = view.rays(corners)
    camera = view.pose.position
    across = np.maximum(np.hypot(rays[:, 0], rays[:, 1]), 1e-9)
    if camera[2] <= 0.0 or np.any(rays[[0, 3], 2] >= 0.0):
        return np.zeros((0, 2))
    reach = np.full(4, RANGE) / across
    down = rays[:, 2] < 0.0
    reach[down] = np.minimum(reach[down], -camera[2] / rays[down, 2])
    corners = camera[:2] + reach[:, None] * rays[:, :2]
    return corners
