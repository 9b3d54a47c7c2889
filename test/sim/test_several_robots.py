"""Several robots in one world, the same in both engines."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from robot_core.errors import NaoGaitError
from robot_core.field import BallPlace, Field, Goals
from robot_core.types import JointTargets, Pose2
from sim_bridge.plant import Plant
from sim_bridge.robot import SimulatedRobot
from sim_bridge.scene import Scene, SceneBall, SceneRobot
from sim_bridge.world import World

MakeWorld = Callable[..., World]


def scene(
    *poses: Pose2, urdfs: tuple[str, ...] = (), states: tuple[str, ...] = (), **more: object
) -> Scene:
    """Robots named a, b, ... at these poses."""
    robots = [
        SceneRobot(
            name="abcd"[i],
            team="red" if i % 2 else "blue",
            number=i + 1,
            urdf=urdfs[i] if urdfs else "nao_h21_v33",
            pose=pose,
            seed=i,
            start_state=states[i] if states else "stand",
        )
        for i, pose in enumerate(poses)
    ]
    return Scene(name="test", robots=tuple(robots), **more)


@pytest.fixture
def make(engine: str, reference: Plant) -> MakeWorld:
    return lambda *poses, plant=reference, **more: World.of_scene(
        scene(*poses, **more), plant, engine=engine
    )


def run(world: World, ticks: int) -> None:
    for _ in range(ticks):
        world.step()


def tilt(robot: SimulatedRobot) -> float:
    """[rad] of the torso against the vertical."""
    x, y, _, _ = robot.truth().torso_quaternion.tolist()
    return 2.0 * math.asin(min(1.0, math.hypot(x, y)))


def swing_leg(world: World, index: int) -> None:
    """Swing the left leg of a robot forward."""
    robot = world.robots[index]
    description = robot.description
    pose = np.array(description.stand_pose)
    pose[description.index(description.left_leg.hip_pitch)] -= 0.4
    robot.command(JointTargets(world.time, pose, 1.0))
    run(world, 25)


def test_robots_start_where_they_are_told_and_stand(make: MakeWorld) -> None:
    poses = ((0.0, 0.0, 0.0), (1.0, -0.5, math.pi / 2.0), (-0.7, 0.4, -2.0))
    with make(*poses) as world:
        for steps in (0, 100):
            run(world, steps)
            for (x, y, heading), robot in zip(poses, world.robots, strict=True):
                truth = robot.truth()
                assert truth.torso_position[:2] == pytest.approx((x, y), abs=0.02)
                qx, qy, qz, qw = truth.torso_quaternion.tolist()
                yaw = math.atan2(2.0 * (qw * qz + qx * qy), 1.0 - 2.0 * (qy * qy + qz * qz))
                assert math.remainder(yaw - heading, math.tau) == pytest.approx(0.0, abs=0.05)
                weight = robot.body.mass * 9.81
                if steps:
                    assert truth.sole_force.sum() == pytest.approx(weight, rel=0.05)


def test_a_robot_stands_alone_as_it_stands_in_company(
    engine: str, reference: Plant, make: MakeWorld
) -> None:
    with make((0.0, 0.0, 0.0), (2.0, 0.0, 0.0)) as world:
        run(world, 50)
        together = world.robots[0].truth()
        spec = world.robots[0].spec
    with World.single(spec.robot, reference, spec.seed, spec.noise_seed, engine=engine) as alone:
        run(alone, 50)
        single = alone.robot.truth()
    assert together.torso_position == pytest.approx(single.torso_position, abs=1e-4)
    assert together.joint_position == pytest.approx(single.joint_position, abs=1e-3)


def test_sensors_depend_on_nothing_of_another_robot(make: MakeWorld) -> None:
    frames = []
    for force in (0.0, 60.0):
        with make((0.0, 0.0, 0.0), (2.0, 0.0, 0.0)) as world:
            run(world, 20)
            if force:
                world.robots[1].push(np.array((force, 20.0, 0.0)), 0.1)
            run(world, 80)
            frame = world.robots[0].sense()
            assert frame is not None
            frames.append(frame)
            fallen = tilt(world.robots[1]) > 1.0
            assert fallen == bool(force)
    quiet, beside = frames
    assert beside.stamp == quiet.stamp
    assert beside.joint_position == pytest.approx(quiet.joint_position, abs=1e-3)
    assert beside.angular_velocity == pytest.approx(quiet.angular_velocity, abs=0.02)
    assert beside.linear_acceleration == pytest.approx(quiet.linear_acceleration, abs=0.1)


def test_robots_have_noise_and_errors_of_their_own(make: MakeWorld) -> None:
    with make((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)) as world:
        run(world, 10)
        a, b = (robot.sense() for robot in world.robots)
        assert a is not None
        assert b is not None
        assert a.stamp == b.stamp
        assert not np.allclose(a.angular_velocity, b.angular_velocity, atol=1e-4)
        assert not np.allclose(*(robot.individual.joint_zero for robot in world.robots))


def test_a_robot_that_is_pushed_into_another_pushes_it(make: MakeWorld) -> None:
    with make((0.0, 0.0, 0.0), (0.35, 0.0, 0.0)) as world:
        run(world, 20)
        a, b = world.robots
        before = b.truth().torso_position[0]
        a.push(np.array((50.0, 0.0, 0.0)), 0.1)
        run(world, 60)
        assert b.truth().torso_position[0] > before + 0.02
        # bodies do not pass through each other
        assert b.truth().torso_position[0] > a.truth().torso_position[0]


def test_a_robot_falls_over_one_that_lies(make: MakeWorld) -> None:
    """The one that lies across the way keeps the falling one off the floor."""
    heights = {}
    for lying in ((0.42, -0.1, math.pi / 2.0), (3.0, 0.0, 0.0)):
        with make((0.0, 0.0, 0.0), lying, states=("stand", "lying_front")) as world:
            run(world, 20)
            world.robots[0].push(np.array((60.0, 0.0, 0.0)), 0.1)
            run(world, 180)
            assert tilt(world.robots[0]) > 0.7
            heights[lying[0]] = float(world.robots[0].truth().com[2])
    assert heights[0.42] > heights[3.0] + 0.02


def test_two_robots_kick_one_ball(make: MakeWorld) -> None:
    """The one kicks it towards the other, who kicks it back."""
    with make(
        (0.0, 0.0, 0.0), (1.0, 0.1, math.pi), ball=SceneBall(x=0.145, y=0.05)
    ) as world:
        swing_leg(world, 0)
        ball = world.ball
        assert ball is not None
        assert ball.velocity[0] > 0.1
        world.put_ball(0.855, 0.05)
        swing_leg(world, 1)
        ball = world.ball
        assert ball is not None
        assert ball.velocity[0] < -0.1


def test_nao_and_bruno_stand_in_one_world(make: MakeWorld) -> None:
    urdfs = ("nao_h21_v33", "bruno")
    with make((0.0, 0.0, 0.0), (0.8, 0.0, math.pi), urdfs=urdfs) as world:
        run(world, 100)
        assert [robot.description.name for robot in world.robots] == ["nao_h21", "bruno"]
        for robot in world.robots:
            assert tilt(robot) < 0.1
            frame = robot.sense()
            assert frame is not None
            assert len(frame.joint_position) == len(robot.description.joint_names)


def test_one_robot_is_reset_and_the_other_goes_on(make: MakeWorld) -> None:
    poses = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.5))
    with make(*poses, ball=SceneBall(x=0.5, y=1.0)) as world:
        world.put_ball(-0.5, -0.5)
        run(world, 10)
        for robot in world.robots:
            robot.push(np.array((60.0, 0.0, 0.0)), 0.1)
        run(world, 90)
        assert min(map(tilt, world.robots)) > 1.0
        moved = world.robots[1].truth().torso_position
        world.reset_robot("a")
        assert world.robots[0].truth().torso_position == pytest.approx(
            world.robots[0].start.torso_position, abs=1e-6
        )
        assert world.robots[0].sense() is None
        assert world.robots[1].truth().torso_position == pytest.approx(moved)
        run(world, 60)
        assert tilt(world.robots[0]) < 0.1
        assert tilt(world.robots[1]) > 1.0
        assert world.ball is not None
        assert world.ball.position[:2] == pytest.approx((-0.5, -0.5), abs=1e-3)
        assert world.time == 1_600_000_000
        world.reset_robot("a", (-1.0, 1.0, -math.pi / 2.0))
        x, y, yaw = world.robots[0].truth().base_footprint
        assert (x, y) == pytest.approx((-1.0, 1.0), abs=0.03)
        assert yaw == pytest.approx(-math.pi / 2.0, abs=0.05)
        run(world, 60)
        assert tilt(world.robots[0]) < 0.1
        with pytest.raises(NaoGaitError, match="robot: got 'c'; allowed: one of a, b"):
            world.reset_robot("c")


def test_a_robot_is_not_reset_into_another_or_the_ball(make: MakeWorld) -> None:
    ball = SceneBall(x=0.0, y=2.0)
    with make((0.0, 0.0, 0.0), (0.6, 0.0, math.pi), ball=ball) as world:
        run(world, 5)
        world.put_ball(0.6, 0.1)
        with pytest.raises(NaoGaitError, match=r"b at x .* overlaps the ball"):
            world.reset_robot("b")
        world.put_ball(0.0, 2.0)
        for robot, force in zip(world.robots, (-60.0, -60.0), strict=True):
            robot.push(np.array((force, 0.0, 0.0)), 0.1)
        run(world, 150)
        assert tilt(world.robots[1]) > 1.0  # lies where the first one stood
        with pytest.raises(NaoGaitError, match=r"a at x .* overlaps b"):
            world.reset_robot("a")
        world.reset()
        run(world, 50)
        assert max(map(tilt, world.robots)) < 0.1


@pytest.mark.parametrize("speed", [1.0, 3.0])
def test_the_net_stops_the_ball(make: MakeWorld, speed: float) -> None:
    field, goals = Field(), Goals()
    with make((0.0, 0.0, 0.0), ball=SceneBall(x=4.2, y=0.2), field=field, goals=goals) as world:
        assert world.ball_place is BallPlace.IN_PLAY
        world.put_ball(4.2, 0.2, (speed, 0.1 * speed))
        places = []
        for _ in range(150):
            world.step()
            places.append(world.ball_place)
        ball = world.ball
        assert ball is not None
        assert places[-1] is BallPlace.IN_BLUE_GOAL
        assert BallPlace.OUT not in places
        assert ball.position[0] < field.length / 2.0 + goals.depth
        assert np.linalg.norm(ball.velocity) < 0.3


def test_a_post_turns_the_ball_back(make: MakeWorld) -> None:
    post_y = Field().posts(Goals())[3][1]
    ball = SceneBall(x=4.0, y=post_y)
    with make((0.0, 0.0, 0.0), ball=ball, field=Field(), goals=Goals()) as world:
        world.put_ball(4.0, post_y, (2.0, 0.0))
        run(world, 60)
        state = world.ball
        assert state is not None
        assert state.position[0] < 4.4
        assert state.velocity[0] < 0.0


def test_a_robot_does_not_walk_through_a_post(make: MakeWorld) -> None:
    post_x, post_y = Field().posts(Goals())[3]
    pose = (post_x - 0.3, post_y, 0.0)
    with make(pose, field=Field(), goals=Goals()) as world:
        run(world, 10)
        world.robots[0].push(np.array((50.0, 0.0, 0.0)), 0.1)
        run(world, 120)
        assert world.robots[0].truth().torso_position[0] < post_x
