"""The kicks of the OP3 send the ball where it is meant to go."""

import math

import pytest

from nao_lipm_gait.presets import preset_for
from robot_core.motion.library import shipped_library
from robot_core.robot import load_robot
from sim_bridge.individual import NOMINAL
from sim_bridge.trials.kick import KickSpec, kick


@pytest.mark.parametrize("motion", ["kick_front_right", "kick_side_left"])
@pytest.mark.usefixtures("mujoco_only")
def test_the_ball_rolls_where_it_is_meant_to(motion: str) -> None:
    robot = load_robot("op3")
    meant = shipped_library(robot).find(motion).kick
    assert meant is not None
    spec = KickSpec(
        motion=motion, robot_seed=NOMINAL, urdf="op3", engine="mujoco",
        parameters=preset_for(robot, "default"),
    )  # fmt: skip
    result = kick(spec)
    assert result.stood
    assert result.distance > 0.05
    assert abs(math.remainder(result.direction - meant.direction, math.tau)) < 0.2


@pytest.mark.parametrize("name", ["booster_k1", "booster_t1", "op3"])
def test_every_robot_has_its_stand(name: str) -> None:
    assert shipped_library(load_robot(name)).find("stand").keyframes
