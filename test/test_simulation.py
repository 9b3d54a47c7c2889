"""The simulated robot from outside: time, delay, reset, pushes, setpoints, determinism, truth."""

from __future__ import annotations

import dataclasses
import math
import xml.etree.ElementTree as ET

import numpy as np
import pinocchio as pin
import pytest

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.robot_description import RobotDescription, load_robot
from nao_lipm_gait.signals import FloatArray, JointTargets, SensorFrame
from sim_bridge.individual import NOMINAL
from sim_bridge.plant import Plant, load_plant
from sim_bridge.simulation import GroundTruth, Simulation

MS = 1_000_000
G = 9.81


@pytest.fixture(scope="module")
def robot() -> RobotDescription:
    return load_robot()


@pytest.fixture(scope="module")
def reference() -> Plant:
    return load_plant("reference")


@pytest.fixture(scope="module")
def ideal() -> Plant:
    return load_plant("ideal")


def with_physics(plant: Plant, **options: object) -> Plant:
    return dataclasses.replace(plant, physics=dataclasses.replace(plant.physics, **options))


def targets(simulation: Simulation, stiffness: float = 1.0, **joints: float) -> JointTargets:
    """The stand pose with some joints elsewhere [rad]."""
    position = np.array(simulation.robot.stand_pose)
    for joint, angle in joints.items():
        position[simulation.robot.index(joint)] = angle
    return JointTargets(simulation.time, position, stiffness)


def sway(simulation: Simulation, tick: int) -> JointTargets:
    """Legs in motion."""
    roll = 0.1 * math.sin(0.2 * tick)
    return targets(simulation, LHipRoll=roll, RHipRoll=roll, LKneePitch=0.7 + roll)


def run(simulation: Simulation, ticks: int) -> tuple[FloatArray, FloatArray]:
    """(ticks, ...) truth and sensor frames while swaying and being pushed."""
    truths, frames = [], []
    for tick in range(ticks):
        if tick == ticks // 2:
            simulation.push(np.array([8.0, -5.0, 0.0]), 0.1)
        simulation.step(sway(simulation, tick))
        truths.append(flat(simulation.truth()))
        frame = simulation.sense()
        if frame is not None:
            frames.append(flat_frame(frame))
    return np.array(truths), np.array(frames)


def flat(truth: GroundTruth) -> FloatArray:
    """Everything but the stamp."""
    return np.concatenate(
        [
            truth.torso_position, truth.torso_quaternion, truth.torso_linear_velocity_in_torso,
            truth.torso_angular_velocity_in_torso, truth.com, truth.sole_force, truth.sole_slip,
            truth.joint_position, truth.joint_torque, [truth.torque_saturated, truth.legs_touch],
            *(sole.position for sole in truth.soles),
            *(sole.rotation.ravel() for sole in truth.soles),
        ]
    )  # fmt: skip


def flat_frame(frame: SensorFrame) -> FloatArray:
    assert frame.sole_load is not None
    return np.concatenate(
        [
            frame.joint_position, frame.joint_velocity, frame.angular_velocity,
            frame.linear_acceleration, frame.sole_load,
        ]
    )  # fmt: skip


def tilt(truth: GroundTruth) -> float:
    """[deg] of the torso."""
    return math.degrees(math.acos(pin.Quaternion(truth.torso_quaternion).matrix()[2, 2]))


# Time and delay.


@pytest.mark.parametrize("delay", [0.0, 0.04, 0.015, 0.001])
def test_frames_come_as_late_as_asked(robot: RobotDescription, ideal: Plant, delay: float) -> None:
    with Simulation(robot, ideal, NOMINAL, sensor_delay=delay) as simulation:
        truths = {0: simulation.truth()}
        for tick in range(1, 13):
            simulation.step(sway(simulation, tick))
            assert simulation.time == tick * 10 * MS
            truths[simulation.time] = simulation.truth()
            frame = simulation.sense()
            latest = (simulation.time - round(delay * 1e9)) // (10 * MS) * (10 * MS)
            if latest < 0:
                assert frame is None
                continue
            assert frame is not None and frame.stamp == latest
            # the frame shows that instant, not the present
            assert frame.joint_position == pytest.approx(truths[latest].joint_position, abs=1e-12)
            rate = truths[latest].torso_angular_velocity_in_torso
            assert frame.angular_velocity == pytest.approx(rate, abs=1e-12)
        assert np.abs(truths[latest].joint_position - truths[0].joint_position).max() > 0.05


def test_the_plant_s_own_delay_is_the_default(robot: RobotDescription, reference: Plant) -> None:
    with Simulation(robot, reference) as simulation:
        assert simulation.sense() is None
        for _ in range(4):
            assert simulation.sense() is None
            simulation.step(None)
        frame = simulation.sense()
        assert frame is not None and frame.stamp == 0 and simulation.time == 40 * MS


def test_sensing_twice_is_sensing_once(robot: RobotDescription, reference: Plant) -> None:
    with Simulation(robot, reference, sensor_delay=0.0) as simulation:
        simulation.step(None)
        assert simulation.sense() is simulation.sense()
        reading = simulation.read()
        assert reading is not None and reading.frame is simulation.sense()
        assert np.array_equal(reading.joint_effort, simulation.truth().joint_torque)


def test_a_longer_control_period(robot: RobotDescription, ideal: Plant) -> None:
    with Simulation(robot, ideal, control_period=0.02) as simulation:
        assert simulation.control_period == 20 * MS
        simulation.step(None)
        assert simulation.time == simulation.truth().stamp == 20 * MS


# Reset.


def test_reset_goes_back_and_the_clock_goes_on(robot: RobotDescription, reference: Plant) -> None:
    with Simulation(robot, reference, robot_seed=1) as simulation:
        start = flat(simulation.truth())
        first, first_frames = run(simulation, 12)
        simulation.step(targets(simulation, stiffness=0.1, HeadYaw=1.0))
        simulation.push(np.array([50.0, 0.0, 0.0]), 10.0)
        time = simulation.time
        simulation.reset()
        assert simulation.time == time == simulation.truth().stamp
        assert np.array_equal(flat(simulation.truth()), start)
        assert simulation.sense() is None, "frames under way belong to the past"
        again, again_frames = run(simulation, 12)
        assert simulation.time == time + 12 * 10 * MS
        assert np.array_equal(first, again)  # no push, no stiffness and no noise left over
        assert np.array_equal(first_frames, again_frames)
        frame = simulation.sense()
        assert frame is not None and frame.stamp == simulation.time - 40 * MS


# Pushes.


def test_a_push_gives_its_momentum(robot: RobotDescription, ideal: Plant) -> None:
    """Upwards in weightlessness, where the floor gives nothing back."""
    for duration, steps in ((0.1, 50), (0.0301, 15), (0.0001, 1)):
        with Simulation(robot, with_physics(ideal, gravity=0.0), NOMINAL) as simulation:
            force = np.array([3.0, -4.0, 12.0])
            simulation.push(force, duration)
            for _ in range(30):
                simulation.step(None)
            before = simulation.truth()
            for _ in range(20):
                simulation.step(None)
            after = simulation.truth()
            mass = simulation.body.mass
        velocity = (after.com - before.com) / (20 * 0.01)
        assert after.sole_force.sum() == 0.0
        assert mass * velocity == pytest.approx(force * steps * 0.002, abs=2e-3)


def test_a_new_push_replaces_the_old_one(robot: RobotDescription, ideal: Plant) -> None:
    with Simulation(robot, with_physics(ideal, gravity=0.0), NOMINAL) as simulation:
        simulation.push(np.array([0.0, 0.0, 100.0]), 1.0)
        simulation.push(np.array([0.0, 0.0, 10.0]), 0.01)
        for _ in range(10):
            simulation.step(None)
        before = simulation.truth().com
        simulation.step(None)
        speed = (simulation.truth().com - before)[2] / 0.01
        assert speed * simulation.body.mass == pytest.approx(0.1, abs=2e-3)


@pytest.mark.parametrize(
    ("force", "duration", "field"),
    [
        ([1.0, 0.0], 0.1, "push force"),
        ([math.nan, 0.0, 0.0], 0.1, "push force"),
        ([math.inf, 0.0, 0.0], 0.1, "push force"),
        ([1.0, 0.0, 0.0], 0.0, "push duration"),
        ([1.0, 0.0, 0.0], -1.0, "push duration"),
        ([1.0, 0.0, 0.0], math.inf, "push duration"),
        ([1.0, 0.0, 0.0], math.nan, "push duration"),
    ],
)
def test_bad_pushes_are_refused(
    robot: RobotDescription, ideal: Plant, force: list[float], duration: float, field: str
) -> None:
    with Simulation(robot, ideal) as simulation, pytest.raises(NaoGaitError, match=field):
        simulation.push(np.array(force), duration)


# Targets.


def test_without_stiffness_it_sinks(robot: RobotDescription, reference: Plant) -> None:
    heights = {}
    for stiffness in (1.0, 0.0):
        with Simulation(robot, reference, NOMINAL) as simulation:
            for _ in range(100):
                simulation.step(targets(simulation, stiffness))
            truth = simulation.truth()
            heights[stiffness] = float(truth.torso_position[2])
            if stiffness == 0.0:
                assert not truth.joint_torque.any()
                assert truth.torque_saturated == 0
    assert heights[1.0] > 0.31
    assert heights[0.0] < heights[1.0] - 0.1


def test_none_holds_the_last_targets(robot: RobotDescription, ideal: Plant) -> None:
    with Simulation(robot, ideal, NOMINAL) as simulation:
        simulation.step(targets(simulation, HeadYaw=0.5))
        for _ in range(20):
            simulation.step(None)
        yaw = simulation.truth().joint_position[robot.index("HeadYaw")]
        assert yaw == pytest.approx(0.5, abs=1e-3)


@pytest.mark.parametrize("joint", ["HeadYaw", "LElbowRoll", "RShoulderRoll"])
def test_targets_are_cut_at_limits_and_speeds(
    robot: RobotDescription, reference: Plant, joint: str
) -> None:
    index = robot.index(joint)
    for target, end in ((10.0, robot.upper[index]), (-10.0, robot.lower[index])):
        with Simulation(robot, reference, NOMINAL) as simulation:
            limit = robot.velocity_limit[index]
            start = before = simulation.truth().joint_position[index]
            fastest, ticks = 0.0, 0
            while abs(before - end) > 0.01 and ticks < 200:
                simulation.step(targets(simulation, **{joint: target}))
                now = simulation.truth().joint_position[index]
                fastest = max(fastest, abs(now - before) / 0.01)
                before, ticks = now, ticks + 1
            for _ in range(20):
                simulation.step(None)
            assert simulation.truth().joint_position[index] == pytest.approx(end, abs=1e-3)
        # a motor that fell behind its setpoint may catch up, up to its no-load speed
        assert fastest <= 1.01 * limit
        quickest = abs(end - start) / limit / 0.01
        assert quickest - 1 < ticks < 1.6 * quickest + 10


def test_the_robot_believes_its_zero_errors(robot: RobotDescription, ideal: Plant) -> None:
    """Asked for 0.5 it goes elsewhere, and its encoder says 0.5."""
    variation = dataclasses.replace(ideal.variation, joint_zero_std=0.01, joint_zero_cut=0.02)
    plant = dataclasses.replace(ideal, variation=variation)
    with Simulation(robot, plant, robot_seed=2) as simulation:
        for _ in range(50):
            simulation.step(targets(simulation, HeadYaw=0.5))
        index = robot.index("HeadYaw")
        zero = simulation.individual.joint_zero[index]
        frame = simulation.sense()
        assert frame is not None and abs(zero) > 1e-3
        assert simulation.truth().joint_position[index] == pytest.approx(0.5 + zero, abs=5e-4)
        assert frame.joint_position[index] == pytest.approx(0.5, abs=5e-4)


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"position": np.zeros(21)}, "targets.position"),
        ({"position": np.zeros((22, 1))}, "targets.position"),
        ({"position": np.full(22, math.nan)}, "targets.position"),
        ({"position": np.array([math.inf, *[0.0] * 21])}, "targets.position"),
        ({"stiffness": 1.5}, "targets.stiffness"),
        ({"stiffness": -0.1}, "targets.stiffness"),
        ({"stiffness": math.nan}, "targets.stiffness"),
    ],
)
def test_bad_targets_are_refused_and_change_nothing(
    robot: RobotDescription, ideal: Plant, change: dict[str, object], field: str
) -> None:
    with Simulation(robot, ideal, NOMINAL) as simulation:
        good = targets(simulation, HeadYaw=0.5)
        bad = dataclasses.replace(good, **change)
        with pytest.raises(NaoGaitError, match=field):
            simulation.step(bad)
        assert simulation.time == 0
        simulation.step(None)
        assert simulation.truth().joint_position == pytest.approx(robot.stand_pose, abs=0.02)


def test_targets_stay_the_caller_s(robot: RobotDescription, ideal: Plant) -> None:
    with Simulation(robot, ideal, NOMINAL) as simulation:
        given = targets(simulation, HeadYaw=10.0, RHipYawPitch=-0.1)
        copy = given.position.copy()
        simulation.step(given)
        assert np.array_equal(given.position, copy)
        given.position[:] = 0.0  # and what is done to them later does not reach the robot
        for _ in range(100):
            simulation.step(None)
        yaw = simulation.truth().joint_position[robot.index("HeadYaw")]
        assert yaw == pytest.approx(robot.upper[robot.index("HeadYaw")], abs=2e-3)


# Determinism.


def test_two_simulations_do_not_disturb_each_other(
    robot: RobotDescription, reference: Plant
) -> None:
    """Stepped in turns, the same to the last bit as each alone."""
    with Simulation(robot, reference, 1) as alone:
        truths, frames = run(alone, 30)
    with Simulation(robot, reference, 1) as one, Simulation(robot, reference, 2) as other:
        for tick in range(30):
            for simulation in (one, other):
                if tick == 15:
                    simulation.push(np.array([8.0, -5.0, 0.0]), 0.1)
                simulation.step(sway(simulation, tick))
            assert np.array_equal(flat(one.truth()), truths[tick])
        assert not np.array_equal(flat(other.truth()), truths[-1])
        last = one.sense()
        assert last is not None and np.array_equal(flat_frame(last), frames[-1])


def test_noise_has_a_seed_of_its_own(robot: RobotDescription, reference: Plant) -> None:
    results = []
    for seed in (0, 0, 7):
        with Simulation(robot, reference, robot_seed=1, noise_seed=seed) as simulation:
            results.append(run(simulation, 12))
    (truth, frames), (same_truth, same_frames), (other_truth, other_frames) = results
    assert np.array_equal(truth, same_truth) and np.array_equal(frames, same_frames)
    assert np.array_equal(truth, other_truth), "noise does not move a robot that listens to nobody"
    gyro = slice(44, 46)
    assert not (frames[:, gyro] == other_frames[:, gyro]).any()
    assert np.array_equal(frames[:, :44], other_frames[:, :44])


# Ground truth.


def summed_com(simulation: Simulation, truth: GroundTruth) -> FloatArray:
    """Link by link from the URDF, the masses of this individual and the true pose."""
    robot = simulation.robot
    model = pin.buildModelFromXML(robot.urdf, pin.JointModelFreeFlyer())
    data, q = model.createData(), pin.neutral(model)
    q[:3], q[3:7] = truth.torso_position, truth.torso_quaternion
    for joint, angle in zip(robot.joint_names, truth.joint_position, strict=True):
        q[model.joints[model.getJointId(joint)].idx_q] = angle
    pin.framesForwardKinematics(model, data, q)
    mass, moment = 0.0, np.zeros(3)
    for link in ET.fromstring(robot.urdf).iter("link"):
        name = link.attrib["name"]
        value, origin = link.find("inertial/mass"), link.find("inertial/origin")
        assert value is not None and origin is not None
        own = float(value.attrib["value"]) * simulation.individual.mass_scale.get(name, 0.0)
        local = np.array([float(v) for v in origin.attrib["xyz"].split()])
        frame = data.oMf[model.getFrameId(name, pin.FrameType.BODY)]
        mass, moment = mass + own, moment + own * frame.act(local)
    return moment / mass


def test_the_true_com_is_the_sum_over_the_true_links(
    robot: RobotDescription, reference: Plant
) -> None:
    with Simulation(robot, reference, robot_seed=3) as simulation:
        for tick in range(25):
            simulation.step(sway(simulation, tick))
        truth = simulation.truth()
        assert truth.com == pytest.approx(summed_com(simulation, truth), abs=1e-9)


def test_true_velocities_are_the_rates_of_the_true_poses_in_the_torso(
    robot: RobotDescription, reference: Plant
) -> None:
    """Falling over, because an upright torso hides a wrong frame."""
    plant = with_physics(reference, step=0.001)
    with Simulation(robot, plant, NOMINAL, control_period=0.001) as simulation:
        simulation.push(np.array([60.0, 40.0, 0.0]), 0.1)
        for _ in range(350):
            simulation.step(None)
        before = simulation.truth()
        simulation.step(None)
        truth = simulation.truth()
    rotation = pin.Quaternion(truth.torso_quaternion).matrix()
    earlier = pin.Quaternion(before.torso_quaternion).matrix()
    moved = (truth.torso_position - before.torso_position) / 0.001
    assert tilt(truth) > 20.0
    assert np.linalg.norm(moved) > 0.3
    assert truth.torso_linear_velocity_in_torso == pytest.approx(rotation.T @ moved, abs=0.02)
    turned = pin.log3(earlier.T @ rotation) / 0.001
    assert np.linalg.norm(turned) > 1.0
    assert truth.torso_angular_velocity_in_torso == pytest.approx(turned, abs=0.05)


def test_a_robot_that_stands_does_not_slip(robot: RobotDescription, reference: Plant) -> None:
    with Simulation(robot, reference, NOMINAL) as simulation:
        for _ in range(50):
            simulation.step(None)
        truth = simulation.truth()
        assert truth.sole_slip.max() < 1e-3
        assert truth.sole_force == pytest.approx([simulation.body.mass * G / 2] * 2, rel=0.05)
        simulation.push(np.array([0.0, 0.0, 400.0]), 0.1)  # off the floor
        for _ in range(12):
            simulation.step(None)
        assert not simulation.truth().sole_slip.any()
        assert not simulation.truth().sole_force.any()


def test_a_motor_at_its_limit_is_counted(robot: RobotDescription, reference: Plant) -> None:
    motor = dataclasses.replace(reference.motor, torque_fraction=0.03)
    with Simulation(robot, dataclasses.replace(reference, motor=motor), NOMINAL) as simulation:
        for _ in range(20):
            simulation.step(None)
        truth = simulation.truth()
        standstill = 0.03 * robot.motors["LKneePitch"].stall_torque
        torque = abs(truth.joint_torque[robot.index("LKneePitch")])
        assert torque <= standstill * (1 + 1e-9)
        assert truth.torque_saturated > 0


# Start states.


@pytest.mark.parametrize(("name", "chest"), [("lying_front", -1.0), ("lying_back", 1.0)])
def test_lying(robot: RobotDescription, reference: Plant, name: str, chest: float) -> None:
    with Simulation(robot, reference, NOMINAL, start_state=name) as simulation:
        start = simulation.truth()
        forward = pin.Quaternion(start.torso_quaternion).matrix()[:, 0]
        assert forward == pytest.approx([0.0, 0.0, chest], abs=1e-6)
        assert start.torso_position[2] < 0.15
        for _ in range(100):
            simulation.step(None)
        truth = simulation.truth()
        assert 60.0 < tilt(truth) < 120.0, "it stays down"
        # neither thrown up nor sunk in
        assert abs(truth.torso_position[2] - start.torso_position[2]) < 0.03
        assert truth.sole_force.sum() < simulation.body.mass * G


@pytest.mark.parametrize("seed", [NOMINAL, 0, 1, 2])
def test_standing(robot: RobotDescription, reference: Plant, seed: int) -> None:
    with Simulation(robot, reference, seed) as simulation:
        start = simulation.truth()
        lowest = min(
            (sole.position + sole.rotation @ point)[2]
            for sole, contacts in zip(start.soles, simulation.body.soles, strict=True)
            for point in contacts.points
        )
        assert lowest == pytest.approx(0.005, abs=1e-6), "the soles just touch the floor"
        with Simulation(robot, reference, seed, sensor_delay=0.0) as prompt:
            frame = prompt.sense()
        assert frame is not None
        count = 2.0 * math.pi / 4096
        assert frame.joint_position == pytest.approx(robot.stand_pose, abs=0.5 * count + 1e-12)
        for _ in range(100):
            simulation.step(None)
        truth = simulation.truth()
        assert tilt(truth) < 5.0
        assert np.abs(truth.torso_position - start.torso_position).max() < 0.02


# Construction.


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
        Simulation(robot, reference, **options)  # type: ignore[arg-type]


def test_closing_twice_is_allowed(robot: RobotDescription, ideal: Plant) -> None:
    simulation = Simulation(robot, ideal)
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
    with Simulation(robot, ideal):
        assert free() != before
    assert free() == before
    with pytest.raises(NaoGaitError):
        Simulation(robot, load_plant("worn"))
    assert free() == before
