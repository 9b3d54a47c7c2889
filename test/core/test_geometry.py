"""Laws of rotations in the plane, and of angles."""

from math import pi, tau

import numpy as np
import pytest

from robot_core.geometry import (
    compose,
    planar_rotation,
    relative,
    rotate_each,
    rotate_planar,
    wrapped,
)

YAWS = (-4.0, -pi / 2.0, 0.0, 0.3, 2.0, 9.0)


@pytest.mark.parametrize("yaw", YAWS)
def test_all_ways_to_rotate_a_vector_agree(yaw: float) -> None:
    x, y = rotate_planar(0.3, -1.2, yaw)
    assert planar_rotation(yaw) @ (0.3, -1.2) == pytest.approx((x, y))
    assert compose((0.0, 0.0, yaw), (0.3, -1.2, 0.0))[:2] == pytest.approx((x, y))
    assert relative((x, y, 0.0), (0.0, 0.0, yaw))[:2] == pytest.approx((0.3, -1.2))
    both = rotate_each(np.full(2, 0.3), np.full(2, -1.2), np.array((yaw, -yaw)))
    assert np.column_stack(both)[0] == pytest.approx((x, y))
    assert np.column_stack(both)[1] == pytest.approx(rotate_planar(0.3, -1.2, -yaw))


def test_wrapped_angles_are_the_same_directions() -> None:
    angles = np.linspace(-20.0, 20.0, 401)
    found = wrapped(angles)
    assert np.abs(found).max() <= pi
    turns = (angles - found) / tau
    assert turns == pytest.approx(np.rint(turns))
