"""The part of the ground that an image shows."""

import numpy as np

from nao_soccer.vision.visible_ground import RANGE, visible_ground
from pitch_image import camera


def test_corners_are_those_of_the_image_where_it_shows_ground():
    view = camera(0.0, 0.0, 0.3, tilt=0.9)
    corners = visible_ground(view)
    pixels = view.project(np.column_stack((corners, np.zeros(4))))
    width, height = view.intrinsics.width - 1, view.intrinsics.height - 1
    expected = [(0, height), (0, 0), (width, 0), (width, height)]
    assert np.allclose(pixels, expected, atol=1e-6)


def test_it_ends_towards_the_horizon():
    view = camera(0.0, 0.0, 0.3, tilt=0.3)
    away = np.hypot(*(visible_ground(view) - view.pose.position[:2]).T)
    assert np.allclose(away[1:3], RANGE)
    assert away[0] < 3.0


def test_a_camera_that_looks_up_shows_no_ground():
    assert len(visible_ground(camera(0.0, 0.0, 0.3, tilt=-0.6))) == 0
