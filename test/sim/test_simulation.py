"""The simulated robot from outside: time, delay, reset, postures, determinism, end."""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin
import pytest

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.robot import RobotDescription
from sim_bridge.individual import NOMINAL
from sim_bridge.plant import Plant, load_plant
from sim_bridge.world import World
from simulation_runs import MS, G, flat, flat_frame, run, sway, targets, tilt


@pytest.mark.parametrize("delay", [0.0, 0.04, 0.015, 0.001])
def test_frames_come_as_late_as_asked(robot: RobotDescription, ideal: Plant, delay: float) -> None:
    with World.single(robot, ideal, NOMINAL, sensor_delay=delay) as simulation:
        truths = {0: simulation.robot.truth()}
        for tick in range(1, 13):
            simulation.robot.command(sway(simulation, tick))
            simulation.step()
            assert simulation.time == tick * 10 * MS
            truths[simulation.time] = simulation.robot.truth()
            frame = simulation.robot.sense()
            latest = (simulation.time - round(delay * 1e9)) // (10 * MS) * (10 * MS)
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
    with World.single(robot, reference) as simulation:
        assert simulation.robot.sense() is None
        for _ in range(4):
            assert simulation.robot.sense() is None
            simulation.step()
        frame = simulation.robot.sense()
        assert frame is not None
        assert frame.stamp == 0
        assert simulation.time == 40 * MS


def test_sensing_twice_is_sensing_once(robot: RobotDescription, reference: Plant) -> None:
    with World.single(robot, reference, sensor_delay=0.0) as simulation:
        simulation.step()
        assert simulation.robot.sense() is simulation.robot.sense()
        reading = simulation.robot.read()
        assert reading is not None
        assert reading.frame is simulation.robot.sense()
        assert np.array_equal(reading.joint_effort, simulation.robot.truth().joint_torque)


def test_a_longer_control_period(robot: RobotDescription, ideal: Plant) -> None:
    with World.single(robot, ideal, control_period=0.02) as simulation:
        assert simulation.control_period == 20 * MS
        simulation.step()
        assert simulation.time == simulation.robot.truth().stamp == 20 * MS


def test_reset_goes_back_and_the_clock_goes_on(robot: RobotDescription, reference: Plant) -> None:
    with World.single(robot, reference, robot_seed=1) as simulation:
        start = flat(simulation.robot.truth())
        first, first_frames = run(simulation, 12)
        simulation.robot.command(targets(simulation, stiffness=0.1, HeadYaw=1.0))
        simulation.step()
        simulation.robot.push(np.array([50.0, 0.0, 0.0]), 10.0)
        time = simulation.time
        simulation.reset()
        assert simulation.time == time == simulation.robot.truth().stamp
        assert np.array_equal(flat(simulation.robot.truth()), start)
        assert simulation.robot.sense() is None, "frames under way belong to the past"
        again, again_frames = run(simulation, 12)
        assert simulation.time == time + 12 * 10 * MS
        assert np.array_equal(first, again)  # no push, no stiffness and no noise left over
        assert np.array_equal(first_frames, again_frames)
        frame = simulation.robot.sense()
        assert frame is not None
        assert frame.stamp == simulation.time - 40 * MS


def test_two_simulations_do_not_disturb_each_other(
    robot: RobotDescription, reference: Plant
) -> None:
    """Stepped in turns, the same to the last bit as each alone."""
    with World.single(robot, reference, 1) as alone:
        truths, frames = run(alone, 30)
    with World.single(robot, reference, 1) as one, World.single(robot, reference, 2) as other:
        for tick in range(30):
            for simulation in (one, other):
                if tick == 15:
                    simulation.robot.push(np.array([8.0, -5.0, 0.0]), 0.1)
                simulation.robot.command(sway(simulation, tick))
                simulation.step()
            assert np.array_equal(flat(one.robot.truth()), truths[tick])
        assert not np.array_equal(flat(other.robot.truth()), truths[-1])
        last = one.robot.sense()
        assert last is not None
        assert np.array_equal(flat_frame(last), frames[-1])


def test_noise_has_a_seed_of_its_own(robot: RobotDescription, reference: Plant) -> None:
    results = []
    for seed in (0, 0, 7):
        with World.single(robot, reference, robot_seed=1, noise_seed=seed) as simulation:
            results.append(run(simulation, 12))
    (truth, frames), (same_truth, same_frames), (other_truth, other_frames) = results
    assert np.array_equal(truth, same_truth)
    assert np.array_equal(frames, same_frames)
    assert np.array_equal(truth, other_truth), "noise does not move a robot that listens to nobody"
    gyro = slice(44, 46)
    assert not (frames[:, gyro] == other_frames[:, gyro]).any()
    assert np.array_equal(frames[:, :44], other_frames[:, :44])


@pytest.mark.parametrize(("name", "chest"), [("lying_front", -1.0), ("lying_back", 1.0)])
def test_lying(robot: RobotDescription, reference: Plant, name: str, chest: float) -> None:
    with World.single(robot, reference, NOMINAL, start_state=name) as simulation:
        start = simulation.robot.truth()
        forward = pin.Quaternion(start.torso_quaternion).matrix()[:, 0]
        assert forward == pytest.approx([0.0, 0.0, chest], abs=1e-6)
        assert start.torso_position[2] < 0.15
        for _ in range(100):
            simulation.step()
        truth = simulation.robot.truth()
        assert 60.0 < tilt(truth) < 120.0, "it stays down"
        # neither thrown up nor sunk in
        assert abs(truth.torso_position[2] - start.torso_position[2]) < 0.03
        assert truth.sole_force.sum() < simulation.robot.body.mass * G


@pytest.mark.parametrize("seed", [NOMINAL, 0, 1, 2])
def test_standing(robot: RobotDescription, reference: Plant, seed: int) -> None:
    with World.single(robot, reference, seed) as simulation:
        start = simulation.robot.truth()
        lowest = min(
            (sole.position + sole.rotation @ point)[2]
            for sole, contacts in zip(start.soles, simulation.robot.body.soles, strict=True)
            for point in contacts.points
        )
        assert lowest == pytest.approx(0.005, abs=1e-6), "the soles just touch the floor"
        with World.single(robot, reference, seed, sensor_delay=0.0) as prompt:
            frame = prompt.robot.sense()
        assert frame is not None
        count = 2.0 * math.pi / 4096
        assert frame.joint_position == pytest.approx(robot.stand_pose, abs=0.5 * count + 1e-12)
        for _ in range(100):
            simulation.step()
        truth = simulation.robot.truth()
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
    simulation = World.single(robot, ideal)
    simulation.close()
    simulation.close()


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
