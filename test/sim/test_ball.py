"""The ball in both engines: it rests, rolls, slows down, is kicked, and affects nothing else."""

import math

import numpy as np
import pytest

from robot_core.errors import NaoGaitError
from robot_core.robot import load_robot
from robot_core.types import JointTargets
from sim_bridge.ball import ROLLING_SLOWDOWN, Ball, shoe
from sim_bridge.body import Body
from sim_bridge.individual import draw_individual
from sim_bridge.plant import load_plant, with_options
from sim_bridge.world import World

ROBOT, PLANT = load_robot(), load_plant("reference")
ENGINES = ("pybullet", "mujoco")


def make_world(engine: str, ball: Ball | None = None) -> World:
    return World.single(ROBOT, PLANT, robot_seed=1, engine=engine, ball=ball)


def kick(world: World) -> None:
    """Swing the left leg forward."""
    pose = np.array(ROBOT.stand_pose)
    pose[ROBOT.index("LHipPitch")] -= 0.4
    world.robot.command(JointTargets(0, pose))
    for _ in range(25):
        world.step()


@pytest.mark.parametrize("engine", ENGINES)
def test_ball_rests_on_the_floor_and_can_be_moved(engine: str) -> None:
    with make_world(engine, Ball(0.4, -0.1)) as world:
        for _ in range(30):
            world.step()
        state = world.ball
        assert state is not None
        np.testing.assert_allclose(state.position, (0.4, -0.1, 0.05), atol=5e-4)
        assert np.linalg.norm(state.velocity) < 5e-3
        world.put_ball(0.2, 0.3)
        world.step()
        state = world.ball
        assert state is not None
        assert math.dist(state.position[:2], (0.2, 0.3)) < 1e-3
        with pytest.raises(NaoGaitError, match="ball x: got nan"):
            world.put_ball(math.nan, 0.0)


@pytest.mark.parametrize("engine", ENGINES)
def test_ball_rests_on_uneven_ground(engine: str) -> None:
    options = (("terrain.kind", "hexagons"), ("terrain.height", 0.015))
    plant = with_options(PLANT, options)
    with World.single(ROBOT, plant, robot_seed=1, engine=engine, ball=Ball(0.6, 0.05)) as world:
        for beginning in ("built", "put", "reset"):
            if beginning == "put":
                world.put_ball(0.7, -0.1)
            elif beginning == "reset":
                world.reset()
            heights = []
            for _ in range(20):
                world.step()
                state = world.ball
                assert state is not None
                heights.append(state.position[2])
            assert 0.045 < min(heights) <= max(heights) < 0.07, beginning


@pytest.mark.parametrize("engine", ENGINES)
def test_a_rolling_ball_slows_down_as_it_should(engine: str) -> None:
    """A foot kicks it; measured once it rolls and no longer slides."""
    with make_world(engine, Ball(0.145, 0.05)) as world:
        kick(world)
        speeds = []
        for _ in range(2):
            for _ in range(40):
                world.step()
            ball = world.ball
            assert ball is not None
            speeds.append(float(np.linalg.norm(ball.velocity)))
        assert speeds[0] > 0.15
        assert speeds[0] - speeds[1] == pytest.approx(ROLLING_SLOWDOWN * 0.4, abs=0.02)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_ball_far_away_changes_nothing_about_the_robot(engine: str) -> None:
    ways = []
    for ball in (None, Ball(5.0, 0.0)):
        with make_world(engine, ball) as world:
            for _ in range(20):
                world.step()
            ways.append(world.robot.truth())
    np.testing.assert_allclose(ways[0].torso_position, ways[1].torso_position, atol=1e-6)
    np.testing.assert_allclose(ways[0].joint_torque, ways[1].joint_torque, atol=1e-2)
    assert not ways[1].legs_touch


@pytest.mark.parametrize("engine", ENGINES)
def test_a_foot_meets_the_ball_and_legs_do_not_count_as_touching(engine: str) -> None:
    with make_world(engine, Ball(0.145, 0.05)) as world:
        kick(world)
        state = world.ball
        assert state is not None
        assert state.velocity[0] > 0.1
        assert state.position[0] > 0.16
        assert not world.robot.truth().legs_touch


def test_put_ball_is_refused_without_a_ball() -> None:
    with make_world("mujoco") as world:
        assert world.ball is None
        with pytest.raises(NaoGaitError, match="a world with a ball"):
            world.put_ball(0.0, 0.0)


def test_the_shoe_is_as_high_as_the_shell_and_stands_on_the_sole() -> None:
    body = Body(ROBOT, draw_individual(PLANT, ROBOT, -1))
    for sole in body.soles:
        box = shoe(sole)
        bottom = sole.rotation.T @ (box.position - sole.position)
        assert bottom[2] - box.size[2] / 2.0 == pytest.approx(0.0, abs=1e-9)
        assert box.size[:2] == sole.plate.size[:2]


@pytest.mark.parametrize("engine", ENGINES)
def test_without_gravity_a_ball_floats(engine: str) -> None:
    plant = with_options(PLANT, (("physics.gravity", 0.0),))
    with World.single(ROBOT, plant, robot_seed=1, engine=engine, ball=Ball()) as world:
        world.step()
        assert world.ball is not None
