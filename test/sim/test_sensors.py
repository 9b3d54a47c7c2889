"""Sensors against first principles: signs, frames, resolution and noise."""

import dataclasses
import math
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path

import attrs
import numpy as np
import pinocchio as pin
import pytest
from scipy import stats

from robot_core.robot import RobotDescription, load_robot
from robot_core.types import FloatArray, SensorFrame
from sim_bridge.body import Body, BodyPose
from sim_bridge.individual import NOMINAL, Individual, draw_individual, rotation_from_vector
from sim_bridge.plant import Plant, load_plant
from sim_bridge.sensors import SensorModel
from sim_bridge.state import TrueState

G = 9.81
PERIOD = 0.01
X, Y, Z = np.eye(3)
IMU = np.array([-0.008, 0.00606, 0.027])
"""[m] where the accelerometer sits in the torso."""


@pytest.fixture(scope="module")
def nominal(robot: RobotDescription) -> Individual:
    return draw_individual(load_plant("ideal"), robot, NOMINAL)


@pytest.fixture(scope="module")
def body(robot: RobotDescription, nominal: Individual) -> Body:
    return Body(robot, nominal)


def with_sensors(plant: Plant, **options: object) -> Plant:
    return attrs.evolve(plant, sensors=attrs.evolve(plant.sensors, **options))


def state(
    rotation: FloatArray | None = None,
    velocity: FloatArray | None = None,
    rate: FloatArray | None = None,
    joints: FloatArray | None = None,
) -> TrueState:
    """Rotation (3, 3) torso to world; velocity in the world, rate in the torso."""
    zero = np.zeros(3)
    angles = np.zeros(22) if joints is None else joints
    wrenches = [np.array([1.0, 2.0, 0.0, 3.0, 4.0, 5.0])] * 2
    turn = np.eye(3) if rotation is None else rotation
    return TrueState(
        torso_position=zero,
        torso_rotation=pin.Quaternion(turn).coeffs(),
        torso_matrix=turn,
        torso_linear_velocity=zero if velocity is None else velocity,
        torso_angular_velocity=zero if rate is None else rate,
        joint_position=angles,
        joint_velocity=np.zeros(22),
        pose=BodyPose(zero, (zero, zero), (np.eye(3), np.eye(3))),
        joint_torque=np.zeros(22),
        sole_wrench=(wrenches[0], wrenches[1]),
        legs_touch=False,
    )


def watch(
    sensors: SensorModel, motion: Callable[[float], TrueState], samples: int = 3
) -> SensorFrame:
    """The last of some samples of a motion, a function of time [s]."""
    for tick in range(samples):
        frame = sensors.sample(round(tick * PERIOD * 1e9), motion(tick * PERIOD))
    return frame


@pytest.fixture
def exact(ideal: Plant, nominal: Individual, body: Body) -> SensorModel:
    return SensorModel(ideal, nominal, body, 0, PERIOD)


def noisy(plant: Plant, individual: Individual, body: Body, seed: int = 0) -> SensorModel:
    return SensorModel(plant, individual, body, seed, PERIOD)


# The accelerometer measures specific force.


@pytest.mark.parametrize(
    ("turn", "felt"),
    [
        (0.0 * X, Z),
        (math.pi / 2 * Y, -X),  # lying on the front: the chest points down
        (-math.pi / 2 * Y, X),  # lying on the back
        (math.pi / 2 * X, Y),  # lying on the right side: the left points up
        (-math.pi / 2 * X, -Y),
        (math.pi * X, -Z),  # head down
        (1.3 * Z, Z),  # turning on the spot changes nothing
    ],
    ids=["upright", "front", "back", "right", "left", "head down", "turned"],
)
def test_at_rest_it_points_up(exact: SensorModel, turn: FloatArray, felt: FloatArray) -> None:
    rotation = rotation_from_vector(turn)
    for samples in (1, 3):  # also the first one, which has no predecessor
        exact.reset()
        frame = watch(exact, lambda _: state(rotation), samples)
        assert frame.linear_acceleration == pytest.approx(G * felt, abs=1e-9)
        assert frame.angular_velocity == pytest.approx(np.zeros(3), abs=1e-12)


def test_leaning_forward_reads_like_slowing_down(exact: SensorModel) -> None:
    frame = watch(exact, lambda _: state(rotation_from_vector(0.1 * Y)))
    assert frame.linear_acceleration == pytest.approx(
        [-G * math.sin(0.1), 0.0, G * math.cos(0.1)], abs=1e-9
    )


def test_free_fall_reads_zero(exact: SensorModel) -> None:
    tumbled = rotation_from_vector(np.array([0.4, -1.0, 2.0]))
    frame = watch(exact, lambda t: state(tumbled, velocity=-G * t * Z))
    assert frame.linear_acceleration == pytest.approx(np.zeros(3), abs=1e-9)


def test_acceleration_is_felt_in_its_direction(exact: SensorModel) -> None:
    frame = watch(exact, lambda t: state(velocity=t * (2.0 * X - 0.5 * Y + 1.0 * Z)))
    assert frame.linear_acceleration == pytest.approx([2.0, -0.5, G + 1.0], abs=1e-9)
    exact.reset()
    turned = rotation_from_vector(math.pi / 2 * Z)  # looks along the world's y
    frame = watch(exact, lambda t: state(turned, velocity=2.0 * t * Y))
    assert frame.linear_acceleration == pytest.approx([2.0, 0.0, G], abs=1e-9)


def test_a_spin_throws_outward(exact: SensorModel) -> None:
    """The accelerometer is away from the axis; the torso's origin does not move."""
    rate = 3.0
    frame = watch(
        exact, lambda t: state(rotation_from_vector(rate * t * Z), rate=rate * Z), samples=4
    )
    inward = -(rate**2) * IMU * [1.0, 1.0, 0.0]
    assert frame.linear_acceleration == pytest.approx(inward + G * Z, abs=1e-4)


def test_a_growing_spin_pulls_along(exact: SensorModel) -> None:
    """From standstill: the samples span the mean over one period."""
    growth = 5.0
    motion = lambda t: state(  # noqa: E731
        rotation_from_vector(0.5 * growth * t * t * Z), rate=growth * t * Z
    )
    frame = watch(exact, motion, samples=2)
    along = growth * np.cross(Z, IMU)
    assert frame.linear_acceleration == pytest.approx(along + G * Z, abs=1e-4)


def test_any_smooth_motion_gives_its_mean_specific_force(exact: SensorModel) -> None:
    """Against second differences of the accelerometer's own path."""

    def rotation(t: float) -> FloatArray:
        return rotation_from_vector(np.array([0.6 * math.sin(5 * t), -0.4 * t, math.cos(4 * t)]))

    def origin(t: float) -> FloatArray:
        return np.array([0.1 * math.sin(6 * t), 0.3 * t * t, 0.05 * math.cos(9 * t)])

    h = 1e-5

    def motion(t: float) -> TrueState:
        turn = pin.log3(rotation(t - h).T @ rotation(t + h)) / (2 * h)
        speed = (origin(t + h) - origin(t - h)) / (2 * h)
        return state(rotation(t), velocity=speed, rate=turn)

    def place(t: float) -> FloatArray:
        return origin(t) + rotation(t) @ IMU

    last = 0.4
    middle = last - PERIOD / 2
    d = 1e-4
    force = (place(middle + d) - 2 * place(middle) + place(middle - d)) / d**2 + G * Z
    frame = watch(exact, motion, samples=round(last / PERIOD) + 1)
    assert frame.linear_acceleration == pytest.approx(rotation(middle).T @ force, abs=0.02)


def test_gravity_is_the_plant_s(ideal: Plant, nominal: Individual, body: Body) -> None:
    moon = attrs.evolve(ideal, physics=attrs.evolve(ideal.physics, gravity=1.62))
    frame = watch(noisy(moon, nominal, body), lambda _: state())
    assert frame.linear_acceleration == pytest.approx([0.0, 0.0, 1.62])


# The gyro measures the rate in the torso frame.


@pytest.mark.parametrize("axis", [X, Y, Z], ids=["roll", "pitch", "yaw"])
def test_gyro_signs_follow_rep_103(exact: SensorModel, axis: FloatArray) -> None:
    frame = watch(exact, lambda _: state(rotation_from_vector(0.7 * Z), rate=0.5 * axis))
    assert frame.angular_velocity == pytest.approx(0.5 * axis)


def test_two_axes_know_nothing_of_yaw(ideal: Plant, nominal: Individual, body: Body) -> None:
    plant = with_sensors(ideal, gyro_axes=2, gyro_noise=0.01)
    frame = watch(noisy(plant, nominal, body), lambda _: state(rate=np.array([0.5, -0.4, 3.0])))
    assert frame.angular_velocity[2] == 0.0
    assert frame.angular_velocity[:2] == pytest.approx([0.5, -0.4], abs=0.06)
    assert frame.angular_velocity[0] != 0.5


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_ranges_cut(ideal: Plant, nominal: Individual, body: Body, sign: float) -> None:
    plant = with_sensors(ideal, gyro_range=8.727, accel_range=19.6)
    fast = watch(
        noisy(plant, nominal, body),
        lambda t: state(velocity=sign * 100.0 * t * X, rate=sign * np.array([9.0, -3.0, 100.0])),
        samples=2,
    )
    assert fast.angular_velocity == pytest.approx(sign * np.array([8.727, -3.0, 8.727]))
    assert fast.linear_acceleration[0] == sign * 19.6
    free = watch(noisy(ideal, nominal, body), lambda _: state(rate=100.0 * Z))
    assert free.angular_velocity[2] == 100.0


def test_noise_is_white_and_as_strong_as_the_plant_says(
    ideal: Plant, nominal: Individual, body: Body
) -> None:
    plant = with_sensors(ideal, gyro_noise=0.005, accel_noise=0.15)
    model, count = noisy(plant, nominal, body), 4000
    frames = [model.sample(tick, state()) for tick in range(count)]
    for values, std, mean in (
        (np.array([f.angular_velocity for f in frames]), 0.005, np.zeros(3)),
        (np.array([f.linear_acceleration for f in frames]), 0.15, G * Z),
    ):
        standard = (values - mean) / std
        for axis in standard.T:
            assert stats.kstest(axis, stats.norm.cdf).pvalue > 1e-3
        assert np.abs(np.corrcoef(standard.T) - np.eye(3)).max() < 4.0 / math.sqrt(count)
        following = np.mean(standard[1:] * standard[:-1], axis=0)
        assert np.abs(following).max() < 4.0 / math.sqrt(count)


def test_biases_are_added(ideal: Plant, nominal: Individual, body: Body) -> None:
    biased = dataclasses.replace(
        nominal, gyro_bias=np.array([0.01, -0.02, 0.03]), accel_bias=np.array([0.1, 0.2, -0.3])
    )
    frame = watch(noisy(ideal, biased, body), lambda _: state())
    assert frame.angular_velocity == pytest.approx([0.01, -0.02, 0.03])
    assert frame.linear_acceleration == pytest.approx([0.1, 0.2, G - 0.3])


def test_noise_depends_on_the_seed_and_starts_over(
    ideal: Plant, nominal: Individual, body: Body
) -> None:
    plant = with_sensors(ideal, gyro_noise=0.005, accel_noise=0.15)

    def run(model: SensorModel) -> FloatArray:
        frames = [model.sample(tick, state()) for tick in range(5)]
        return np.array([[*f.angular_velocity, *f.linear_acceleration] for f in frames])

    model = noisy(plant, nominal, body, seed=1)
    first = run(model)
    model.reset()
    assert np.array_equal(run(model), first)
    assert np.array_equal(run(noisy(plant, nominal, body, seed=1)), first)
    assert not (run(noisy(plant, nominal, body, seed=2)) == first).any()


# How the IMU is mounted.


@pytest.mark.parametrize("turn", [0.1 * Y, -0.05 * X, np.array([0.03, -0.06, 0.2])])
def test_a_tilted_mounting_reads_like_a_tilted_torso(
    ideal: Plant, nominal: Individual, body: Body, turn: FloatArray
) -> None:
    mount = rotation_from_vector(turn)
    crooked = dataclasses.replace(nominal, imu_rotation=mount)
    rate = np.array([0.3, -0.2, 0.1])
    standing = watch(noisy(ideal, crooked, body), lambda _: state(rate=rate), samples=1)
    leaning = watch(
        noisy(ideal, nominal, body), lambda _: state(mount, rate=mount.T @ rate), samples=1
    )
    assert standing.linear_acceleration == pytest.approx(leaning.linear_acceleration, abs=1e-9)
    assert standing.angular_velocity == pytest.approx(leaning.angular_velocity, abs=1e-9)
    assert abs(standing.linear_acceleration[0]) > 0.3 or abs(standing.linear_acceleration[1]) > 0.3


def test_the_axes_of_the_imu_come_from_the_urdf_and_readings_are_in_the_torso(
    tmp_path: Path, ideal: Plant, nominal: Individual, robot: RobotDescription
) -> None:
    """An IMU mounted on its side: readings are in torso axes, its missing axis stays missing."""
    root = ET.fromstring(robot.urdf)
    origin = root.find("joint[@name='imu_link_fixed']/origin")
    assert origin is not None
    origin.set("rpy", f"{math.pi / 2} 0 0")  # its z axis is the torso's -y
    path = tmp_path / "turned_imu.urdf"
    path.write_text(ET.tostring(root, encoding="unicode"))
    body = Body(load_robot(path), nominal)
    assert body.imu_position == pytest.approx(IMU)
    rate = np.array([0.3, -0.2, 0.1])
    leaning = rotation_from_vector(0.2 * Y)
    for axes, felt in ((3, rate), (2, rate * [1.0, 0.0, 1.0])):
        frame = watch(
            noisy(with_sensors(ideal, gyro_axes=axes), nominal, body),
            lambda _: state(leaning, rate=rate),
            samples=1,
        )
        assert frame.angular_velocity == pytest.approx(felt, abs=1e-9)
        assert frame.linear_acceleration == pytest.approx(
            [-G * math.sin(0.2), 0.0, G * math.cos(0.2)], abs=1e-9
        )


# Encoders and soles.


def test_exact_encoders(exact: SensorModel) -> None:
    angles = np.linspace(-1.0, 1.0, 22)
    frame = watch(exact, lambda t: state(joints=angles * (1.0 + t)))
    assert frame.joint_position == pytest.approx(angles * 1.02, abs=1e-12)
    assert exact.joint_velocity == pytest.approx(angles, abs=1e-9)


def test_velocity_starts_at_zero(exact: SensorModel) -> None:
    angles = np.linspace(-1.0, 1.0, 22)
    for _ in range(2):
        exact.sample(0, state(joints=angles))
        assert not exact.joint_velocity.any()
        exact.sample(1, state(joints=angles + 0.1))
        exact.reset()


def test_encoders_count(ideal: Plant, nominal: Individual, body: Body) -> None:
    model = noisy(with_sensors(ideal, encoder_bits=12), nominal, body)
    count = 2.0 * math.pi / 4096
    angles = np.random.default_rng(4).uniform(-2.0, 2.0, (40, 22))
    largest = 0.0
    before = None
    for tick, row in enumerate(angles):
        frame = model.sample(tick, state(joints=row))
        counts = frame.joint_position / count
        assert counts == pytest.approx(np.round(counts), abs=1e-9)
        largest = max(largest, float(np.abs(frame.joint_position - row).max()))
        if before is not None:  # velocities are made of counts as well
            assert model.joint_velocity * PERIOD == pytest.approx(frame.joint_position - before)
        before = frame.joint_position
    assert 0.48 * count < largest <= 0.5 * count + 1e-12


def test_encoders_do_not_know_their_zero_error(
    ideal: Plant, nominal: Individual, body: Body
) -> None:
    zero = np.linspace(-0.01, 0.01, 22)
    model = noisy(ideal, dataclasses.replace(nominal, joint_zero=zero), body)
    truth = np.linspace(0.5, 1.0, 22)
    assert model.sample(0, state(joints=truth)).joint_position == pytest.approx(truth - zero)


def test_the_stamp_is_the_time_of_sampling(exact: SensorModel) -> None:
    assert exact.sample(123_456_789, state()).stamp == 123_456_789
