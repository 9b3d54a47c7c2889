"""One robot of the many that a plant describes."""

import math
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass
from zlib import crc32

import numpy as np

from robot_core.errors import NaoGaitError
from robot_core.robot import RobotDescription
from robot_core.schema import Number
from robot_core.types import FloatArray
from sim_bridge.plant import Plant

NOMINAL = -1
"""Seed of the robot without errors."""


@dataclass(frozen=True, slots=True)
class Individual:
    """Errors of one robot. The gait has no access to them.

    Attributes:
        seed: Number of the robot; -1 = nominal.
        joint_zero: (n,) [rad] encoder offsets: true angle = commanded angle + offset, encoder
            reading = true angle - offset.
        imu_rotation: (3, 3) orientation of the IMU's axes in the IMU frame of the URDF.
        gyro_bias: (3,) [rad/s] in the IMU's axes.
        accel_bias: (3,) [m/s^2] in the IMU's axes.
        mass_scale: Factor on mass and inertia, for each link of the URDF that has a mass.
        friction: Coulomb coefficient of the pair sole and floor.
        stiffness_scale: Factor on the contact stiffness.
        motor_strength: Factor on every motor's torque.
        force_gain: (2, 4) factor on the readings of the force sensors, left and right sole.
        force_offset: (2, 4) [N] added to them.
    """

    seed: int
    joint_zero: FloatArray
    imu_rotation: FloatArray
    gyro_bias: FloatArray
    accel_bias: FloatArray
    mass_scale: Mapping[str, float]
    friction: float
    stiffness_scale: float
    motor_strength: float
    force_gain: FloatArray
    force_offset: FloatArray


def stream(seed: int, name: str) -> np.random.Generator:
    """The random stream of one property of the robot number `seed`."""
    return np.random.default_rng([seed, crc32(name.encode())])


def draw_individual(plant: Plant, robot: RobotDescription, seed: int) -> Individual:
    """Draw the robot number `seed` of this plant; -1 is the nominal robot.

    Each property has a random stream of its own, seeded with its name. A property that is added
    later leaves the others, and so all published robots, as they are.

    Raises:
        NaoGaitError: The seed is not a whole number from -1.
    """
    try:
        seed = int(Number(NOMINAL, whole=True).check("robot_seed", seed))
    except NaoGaitError:
        allowed = "a whole number from 0, or -1 for the nominal robot"
        raise NaoGaitError("robot_seed", seed, allowed) from None
    variation, sensors = plant.variation, plant.sensors
    nominal = seed == NOMINAL

    def normal(name: str, std: float, size: int) -> FloatArray:
        return np.zeros(size) if nominal else stream(seed, name).normal(0.0, std, size)

    def uniform(name: str, span: tuple[float, float] | None, otherwise: float) -> float:
        return otherwise if nominal or span is None else float(stream(seed, name).uniform(*span))

    if variation.wrong_joint and variation.wrong_joint not in robot.joint_names:
        allowed = f"a joint of {robot.name}: {', '.join(robot.joint_names)}"
        raise NaoGaitError("variation.wrong_joint", variation.wrong_joint, allowed)
    zero = {
        joint: float(normal(f"joint_zero/{joint}", variation.joint_zero_std, 1)[0])
        for joint in robot.joint_names
    }
    wrong = {variation.wrong_joint: variation.wrong_zero}
    for leader, follower in robot.coupled_joints:  # one motor has one encoder and one offset
        zero[follower] = zero[leader]
        wrong[follower] = wrong.get(leader, 0.0)
    joint_zero = np.clip(
        [zero[joint] for joint in robot.joint_names],
        -variation.joint_zero_cut,
        variation.joint_zero_cut,
    )
    joint_zero += [wrong.get(joint, 0.0) for joint in robot.joint_names]
    def spread(name: str, largest: float) -> FloatArray:
        size = (2, 4)
        return np.zeros(size) if nominal else stream(seed, name).uniform(-largest, largest, size)

    scale = variation.stiffness_scale
    log_span = None if scale is None else (math.log(scale[0]), math.log(scale[1]))
    mass_span = (1.0 - variation.mass, 1.0 + variation.mass)
    imu_rotation = rotation_from_vector(normal("imu_mounting", variation.imu_mounting_std, 3))
    gyro_bias = normal("gyro_bias", sensors.gyro_bias, 3)
    accel_bias = normal("accel_bias", sensors.accel_bias, 3)
    force_gain = 1.0 + spread("force_gain", plant.force_sensors.gain)
    force_offset = spread("force_offset", plant.force_sensors.offset)
    for array in (
        joint_zero, imu_rotation, gyro_bias, accel_bias, force_gain, force_offset,
    ):  # fmt: skip
        array.setflags(write=False)
    return Individual(
        seed=seed,
        joint_zero=joint_zero,
        imu_rotation=imu_rotation,
        gyro_bias=gyro_bias,
        accel_bias=accel_bias,
        mass_scale={
            link: uniform(f"mass/{link}", mass_span, 1.0) for link in _links_with_mass(robot.urdf)
        },
        friction=uniform("friction", variation.friction, plant.contact.friction),
        stiffness_scale=math.exp(uniform("stiffness_scale", log_span, 0.0)),
        motor_strength=uniform("motor_strength", variation.motor_strength, 1.0),
        force_gain=force_gain,
        force_offset=force_offset,
    )


def rotation_from_vector(vector: FloatArray) -> FloatArray:
    """(3, 3) rotation by |vector| [rad] about `vector` (Rodrigues)."""
    angle = float(np.linalg.norm(vector))
    if angle < 1e-12:
        return np.eye(3)
    x, y, z = vector / angle
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * (cross @ cross)


def _links_with_mass(urdf: str) -> list[str]:
    return [
        link.attrib["name"]
        for link in ET.fromstring(urdf).findall("link")
        if (mass := link.find("inertial/mass")) is not None and float(mass.get("value", 0)) > 0.0
    ]
