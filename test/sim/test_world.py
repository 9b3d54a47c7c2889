"""A world with one robot: time, delay, reset, start states, determinism, end."""

import math

import numpy as np
import pinocchio as pin
import pytest

from robot_core.errors import NaoGaitError
from robot_core.robot import RobotDescription
from sim_bridge.individual import NOMINAL
from sim_bridge.plant import Plant, load_plant
from sim_bridge.world import World
from simulation_runs import MS, G, flat, flat_frame, run, sway, targets, tilt


@pytest.mark.parametrize("delay", [0.0, 0.04, 0.015, 0.001])
def test_frames_are_late_by_the_delay(robot: RobotDescription, ideal: Plant, delay: float) -> None:
    with World.single(robot, ideal, NOMINAL, sensor_delay=delay) as world:
        truths = {0: world.robot.truth()}
        for tick in range(1, 13):
            world.robot.command(sway(world, tick))
            world.step()
            assert world.time == tick * 10 * MS
            truths[world.time] = world.robot.truth()
            frame = world.robot.sense()
            latest = (world.time - round(delay * 1e9)) // (10 * MS) * (10 * MS)
            if latest < 0:
                assert frame is None
                continue
            assert frame is not None
            assert frame.stamp == latest
            # the frame shows that instant, not the present
            assert frame.joint_position == pytest.approx(truths[latest].joint_position, abs=1e-12)
            rate = truths[latest].torso_angular_velocity_in_torso
            assert frame.angular_velocity == pytest.approx(rate, abs=1e-12)
        assert np.abs(truths[latest].joint_position - truths[0].joint_position).max() > 0.05


def test_the_plant_s_own_delay_is_the_default(robot: RobotDescription, reference: Plant) -> None:
    with World.single(robot, reference) as world:
        assert world.robot.sense() is None
        for _ in range(4):
            assert world.robot.sense() is None
            world.step()
        frame = world.robot.sense()
        assert frame is not None
        assert frame.stamp == 0
        assert world.time == 40 * MS


def test_sensing_twice_is_sensing_once(robot: RobotDescription, reference: Plant) -> None:
    with World.single(robot, reference, sensor_delay=0.0) as world:
        world.step()
        assert world.robot.sense() is world.robot.sense()
        reading = world.robot.read()
        assert reading is not None
        assert reading.frame is world.robot.sense()
        stall = np.array([robot.motors[name].stall_torque for name in robot.joint_names])
        off = (reading.joint_effort - world.robot.truth().joint_torque) / stall
        assert 0.003 < np.std(off) < 0.03


def test_a_longer_control_period(robot: RobotDescription, ideal: Plant) -> None:
    with World.single(robot, ideal, control_period=0.02) as world:
        assert world.control_period == 20 * MS
        world.step()
        assert world.time == world.robot.truth().stamp == 20 * MS


def test_reset_goes_back_and_the_clock_goes_on(robot: RobotDescription, reference: Plant) -> None:
    with World.single(robot, reference, robot_seed=1) as world:
        start = flat(world.robot.truth())
        first, first_frames = run(world, 12)
        world.robot.command(targets(world, stiffness=0.1, HeadYaw=1.0))
        world.step()
        world.robot.push(np.array([50.0, 0.0, 0.0]), 10.0)
        time = world.time
        world.reset()
        assert world.time == time == world.robot.truth().stamp
        assert np.array_equal(flat(world.robot.truth()), start)
        assert world.robot.sense() is None, "frames under way belong to the past"
        again, again_frames = run(world, 12)
        assert world.time == time + 12 * 10 * MS
        assert np.array_equal(first, again)  # no push, no stiffness and no noise left over
        assert np.array_equal(first_frames, again_frames)
        frame = world.robot.sense()
        assert frame is not None
        assert frame.stamp == world.time - 40 * MS


def test_two_worlds_do_not_disturb_each_other(
    robot: RobotDescription, reference: Plant
) -> None:
    """Stepped in turns, the same to the last bit as each alone."""
    with World.single(robot, reference, 1) as alone:
        truths, frames = run(alone, 30)
    with World.single(robot, reference, 1) as one, World.single(robot, reference, 2) as other:
        for tick in range(30):
            for world in (one, other):
                if tick == 15:
                    world.robot.push(np.array([8.0, -5.0, 0.0]), 0.1)
                world.robot.command(sway(world, tick))
                world.step()
            assert np.array_equal(flat(one.robot.truth()), truths[tick])
        assert not np.array_equal(flat(other.robot.truth()), truths[-1])
        last = one.robot.sense()
        assert last is not None
        assert np.array_equal(flat_frame(last), frames[-1])


def test_noise_has_a_seed_of_its_own(robot: RobotDescription, reference: Plant) -> None:
    results = []
    for seed in (0, 0, 7):
        with World.single(robot, reference, robot_seed=1, noise_seed=seed) as world:
            results.append(run(world, 12))
    (truth, frames), (same_truth, same_frames), (other_truth, other_frames) = results
    assert np.array_equal(truth, same_truth)
    assert np.array_equal(frames, same_frames)
    message = "noise does not move a robot that ignores its sensors (open loop)"
    assert np.array_equal(truth, other_truth), message
    gyro = slice(22, 24)
    assert not (frames[:, gyro] == other_frames[:, gyro]).any()
    assert np.array_equal(frames[:, :22], other_frames[:, :22])


@pytest.mark.parametrize(("name", "chest"), [("lying_front", -1.0), ("lying_back", 1.0)])
def test_lying(robot: RobotDescription, reference: Plant, name: str, chest: float) -> None:
    with World.single(robot, reference, NOMINAL, start_state=name) as world:
        start = world.robot.truth()
        forward = pin.Quaternion(start.torso_quaternion).matrix()[:, 0]
        assert forward == pytest.approx([0.0, 0.0, chest], abs=1e-6)
        assert start.torso_position[2] < 0.15
        for _ in range(100):
            world.step()
        truth = world.robot.truth()
        assert 60.0 < tilt(truth) < 120.0, "it stays down"
        # neither thrown up nor sunk in
        assert abs(truth.torso_position[2] - start.torso_position[2]) < 0.03
        assert truth.sole_force.sum() < world.robot.body.mass * G


@pytest.mark.parametrize(("name", "left"), [("lying_left", -1.0), ("lying_right", 1.0)])
def test_lying_on_a_side(robot: RobotDescription, reference: Plant, name: str, left: float) -> None:
    with World.single(robot, reference, NOMINAL, start_state=name) as world:
        start = world.robot.truth()
        to_left = pin.Quaternion(start.torso_quaternion).matrix()[:, 1]
        assert to_left == pytest.approx([0.0, 0.0, left], abs=1e-6)
        for _ in range(100):
            world.step()
        truth = world.robot.truth()
        assert 60.0 < tilt(truth) < 120.0, "it stays down, perhaps not on its side"
        assert 0.0 < truth.torso_position[2] < start.torso_position[2]


@pytest.mark.parametrize("seed", [NOMINAL, 0, 1, 2])
def test_standing(robot: RobotDescription, reference: Plant, seed: int) -> None:
    with World.single(robot, reference, seed) as world:
        start = world.robot.truth()
        lowest = min(
            (sole.position + sole.rotation @ point)[2]
            for sole, contacts in zip(start.soles, world.robot.body.soles, strict=True)
            for point in contacts.points
        )
        assert lowest == pytest.approx(0.005, abs=1e-6), "the soles just touch the floor"
        with World.single(robot, reference, seed, sensor_delay=0.0) as prompt:
            frame = prompt.robot.sense()
        assert frame is not None
        count = 2.0 * math.pi / 4096
        assert frame.joint_position == pytest.approx(robot.stand_pose, abs=0.5 * count + 1e-12)
        for _ in range(100):
            world.step()
        truth = world.robot.truth()
        assert tilt(truth) < 5.0
        assert np.abs(truth.torso_position - start.torso_position).max() < 0.02


@pytest.mark.parametrize(
    ("options", "field"),
    [
        ({"start_state": "sitting"}, "start_state: got 'sitting'.*lying_front"),
        ({"noise_seed": -1}, "noise_seed"),
        ({"noise_seed": True}, "noise_seed"),
        ({"noise_seed": 0.5}, "noise_seed"),
        ({"robot_seed": -2}, "robot_seed"),
        ({"sensor_delay": -0.01}, "sensor_delay"),
        ({"sensor_delay": 1.01}, "sensor_delay"),
        ({"sensor_delay": math.nan}, "sensor_delay"),
        ({"control_period": 0.0}, "control_period"),
        ({"control_period": -0.01}, "control_period"),
        ({"control_period": 0.003}, r"control_period: got 0.003; .*multiple of 0.002 s"),
        ({"control_period": math.inf}, "control_period"),
        ({"control_period": math.nan}, "control_period"),
        ({"engine": "bullet"}, "engine: got 'bullet'"),
    ],
)
def test_bad_options_are_refused(
    robot: RobotDescription, reference: Plant, options: dict[str, object], field: str
) -> None:
    with pytest.raises(NaoGaitError, match=field):
        World.single(robot, reference, **options)  # type: ignore[arg-type]


def test_closing_twice_is_allowed(robot: RobotDescription, ideal: Plant) -> None:
    world = World.single(robot, ideal)
    world.close()
    world.close()


def test_closing_gives_the_client_back(robot: RobotDescription, ideal: Plant) -> None:
    """PyBullet has room for so many clients only, and reuses the lowest free number."""
    import pybullet as bullet

    def free() -> int:
        client: int = bullet.connect(bullet.DIRECT)
        bullet.disconnect(physicsClientId=client)
        return client

    before = free()
    with World.single(robot, ideal):
        assert free() != before
    assert free() == before
    with pytest.raises(NaoGaitError):
        World.single(robot, load_plant("worn"))
    assert free() == before
