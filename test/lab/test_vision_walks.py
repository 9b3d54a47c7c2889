"""Where the random walks of the suite `vision` put robots and ball."""

import math

import pytest

from gait_lab.vision.viewing_walks import KINDS, WAY, random_walk
from sim_bridge.scene import Scene

URDF = "nao_h21_v33"


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(8))
def test_nothing_stands_in_the_way_and_the_ball_is_on_the_field(seed: int, kind: str):
    spec = random_walk(seed, kind, "mujoco", 3.0, URDF)
    assert spec == random_walk(seed, kind, "mujoco", 3.0, URDF)
    scene = spec.scene
    assert isinstance(scene, Scene)
    assert scene.field is not None
    half_length, half_width = 0.5 * scene.field.length, 0.5 * scene.field.width
    seer, *others = scene.robots
    x, y, heading = seer.pose
    for other in others:
        dx, dy = other.pose[0] - x, other.pose[1] - y
        ahead = dx * math.cos(heading) + dy * math.sin(heading)
        aside = dy * math.cos(heading) - dx * math.sin(heading)
        assert abs(aside) >= WAY[0] or not -WAY[0] < ahead < WAY[1]
        assert abs(other.pose[0]) < half_length
        assert abs(other.pose[1]) < half_width
    for ball in spec.balls:
        behind = (ball[0] - x) * math.cos(heading) + (ball[1] - y) * math.sin(heading) < 0.0
        assert behind or (abs(ball[0]) < half_length and abs(ball[1]) < half_width)
