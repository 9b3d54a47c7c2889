"""Motions of the OP3 and of Booster's robots: kicks that go where they are meant to, get-ups."""

import math

import pytest

from nao_lipm_gait.presets import preset_for
from robot_core.motion.library import shipped_library
from robot_core.robot import load_robot
from sim_bridge.individual import NOMINAL
from sim_bridge.trials.get_up import GetUpSpec, get_up
from sim_bridge.trials.kick import KickSpec, kick


@pytest.mark.parametrize(
    ("name", "motion"),
    [("op3", "kick_front_right"), ("op3", "kick_side_left"), ("booster_t1", "kick_front_left")],
)
@pytest.mark.usefixtures("mujoco_only")
def test_the_ball_rolls_where_it_is_meant_to(name: str, motion: str) -> None:
    robot = load_robot(name)
    meant = shipped_library(robot).find(motion).kick
    assert meant is not None
    spec = KickSpec(
        motion=motion, robot_seed=NOMINAL, urdf=name, engine="mujoco",
        parameters=preset_for(robot, "default"),
    )  # fmt: skip
    result = kick(spec)
    assert result.stood
    assert result.distance > 0.05
    assert abs(math.remainder(result.direction - meant.direction, math.tau)) < 0.2


@pytest.mark.parametrize("name", ["booster_k1", "booster_t1", "op3"])
def test_every_robot_has_its_stand(name: str) -> None:
    assert shipped_library(load_robot(name)).find("stand").keyframes


@pytest.mark.parametrize(
    ("name", "side", "seed"),
    [
        ("booster_k1", "front", 40),
        pytest.param("booster_k1", "back", 41, marks=pytest.mark.slow),
        ("booster_t1", "front", 40),
        pytest.param("booster_t1", "back", 42, marks=pytest.mark.slow),
        pytest.param("op3", "front", 42, marks=pytest.mark.slow),
        pytest.param("op3", "back", 43, marks=pytest.mark.slow),
        pytest.param("op3", "left", 0, marks=pytest.mark.slow),
    ],
)
@pytest.mark.usefixtures("mujoco_only")
def test_it_gets_up_and_walks(name: str, side: str, seed: int) -> None:
    spec = GetUpSpec(
        side=side, robot_seed=seed, urdf=name, engine="mujoco",
        parameters=preset_for(load_robot(name), "default"),
    )  # fmt: skip
    result = get_up(spec)
    assert result.walked
    assert result.time is not None
    assert result.time < 15.0  # the referee of RoboCup's simulator waits no longer
