"""Encoders, motor torques, gyro and accelerometer, from true states.

No sensor measures the orientation.
"""

import math

import numpy as np

from robot_core.geometry import as_rotation, cross, rotate, rotate_back, rotation_halfway
from robot_core.robot import RobotDescription
from robot_core.types import FloatArray, Point3, SensorFrame
from sim_bridge.body import Body
from sim_bridge.individual import Individual
from sim_bridge.plant import Plant
from sim_bridge.state import TrueState


class Encoders:
    """One encoder per joint, with an offset and a resolution."""

    def __init__(self, plant: Plant, individual: Individual) -> None:
        """Resolution of `plant`, offsets of `individual`."""
        self._zero = individual.joint_zero
        bits = plant.sensors.encoder_bits
        self._step = 2.0 * math.pi / 2**bits if bits else 0.0
        self._steps = 2**bits / (2.0 * math.pi)

    def read(self, angle: FloatArray) -> FloatArray:
        """(n,) [rad] for true angles (n,) [rad]."""
        reading = angle - self._zero
        if self._step:
            reading *= self._steps
            reading = np.rint(reading, out=reading) * self._step
        return reading


class TorqueSensors:
    """The torque of each motor, as from its current, with white noise."""

    def __init__(self, robot: RobotDescription, plant: Plant, noise_seed: int) -> None:
        """Motors of `robot`, noise of `plant`, drawn apart from that of the other sensors."""
        stall = [robot.motors[joint].stall_torque for joint in robot.joint_names]
        self._sigma = plant.sensors.effort_noise * np.array(stall)
        self._seed = noise_seed, 1
        self.restart()

    def restart(self) -> None:
        """Restart the noise, so that a run can be repeated."""
        self._noise = np.random.default_rng(self._seed)

    def read(self, torque: FloatArray) -> FloatArray:
        """(n,) [N m] for true torques (n,) [N m]."""
        reading: FloatArray = torque + self._sigma * self._noise.standard_normal(len(torque))
        return reading


class SensorModel:
    """Samples the sensors once per control period."""

    def __init__(
        self, plant: Plant, individual: Individual, body: Body, noise_seed: int, period: float
    ) -> None:
        """Prepare the sensors.

        Args:
            plant: Noise, ranges and resolution.
            individual: Offsets, biases and the mounting of the IMU.
            body: Place of the IMU in the torso.
            noise_seed: Of the noise.
            period: [s] between two samples.
        """
        self._sensors = plant.sensors
        self._encoders = Encoders(plant, individual)
        self._rate = 1.0 / period
        self._gyro_bias = individual.gyro_bias.tolist()
        self._accel_bias = individual.accel_bias.tolist()
        self._gravity = plant.physics.gravity
        self._imu_position: Point3 = tuple(body.imu_position.tolist())
        self._imu_in_torso = as_rotation(body.imu_rotation @ individual.imu_rotation)
        straight = np.array_equal(body.imu_rotation, np.eye(3))
        self._mount = None if straight else as_rotation(body.imu_rotation)
        self._noise_seed = noise_seed
        self._noise = np.random.default_rng(noise_seed)
        self.joint_velocity: FloatArray = np.zeros(0)
        self._position: FloatArray | None = None
        self._imu_velocity: Point3 = (0.0, 0.0, 0.0)
        self._quaternion = np.zeros(4)

    def reset(self) -> None:
        """Forget earlier samples and restart the noise, so that a run can be repeated."""
        self._noise = np.random.default_rng(self._noise_seed)
        self._position = None

    def sample(self, stamp: int, state: TrueState) -> SensorFrame:
        """Sample all sensors at `stamp` [ns]; call it once per period."""
        position = self._encoders.read(state.joint_position)
        first = self._position is None
        before = position if self._position is None else self._position
        self._position, self.joint_velocity = position, (position - before) * self._rate
        spin: Point3 = tuple(state.torso_angular_velocity.tolist())
        noise = self._noise.standard_normal(6).tolist()
        return SensorFrame(
            stamp=stamp,
            joint_position=position,
            angular_velocity=np.array(self._gyro(spin, noise[:3])),
            linear_acceleration=np.array(self._accelerometer(state, spin, noise[3:], first)),
        )

    def _gyro(self, spin: Point3, noise: list[float]) -> Point3:
        sensors = self._sensors
        rate = rotate_back(self._imu_in_torso, spin)
        x, y, z = _read(rate, self._gyro_bias, noise, sensors.gyro_noise, sensors.gyro_range)
        return self._mounted((x, y, 0.0 if sensors.gyro_axes == 2 else z))

    def _accelerometer(
        self, state: TrueState, spin: Point3, noise: list[float], first: bool
    ) -> Point3:
        """Mean specific force at the IMU since the last sample."""
        sensors, rate, quaternion = self._sensors, self._rate, state.torso_rotation
        torso = as_rotation(state.torso_matrix)
        x, y, z = rotate(torso, cross(spin, self._imu_position))
        vx, vy, vz = state.torso_linear_velocity.tolist()
        velocity = x + vx, y + vy, z + vz
        force = 0.0, 0.0, self._gravity
        if not first:
            (x, y, z), (vx, vy, vz) = velocity, self._imu_velocity
            force = (x - vx) * rate, (y - vy) * rate, (z - vz) * rate + self._gravity
            torso = rotation_halfway(self._quaternion, quaternion)
        self._imu_velocity, self._quaternion = velocity, quaternion
        felt = rotate_back(self._imu_in_torso, rotate_back(torso, force))
        return self._mounted(
            _read(felt, self._accel_bias, noise, sensors.accel_noise, sensors.accel_range)
        )

    def _mounted(self, reading: Point3) -> Point3:
        """From the IMU's axes to the torso's, by the nominal mounting."""
        return reading if self._mount is None else rotate(self._mount, reading)


def _read(
    true: Point3, bias: list[float], noise: list[float], sigma: float, limit: float | None
) -> Point3:
    """Reading of a sensor.

    Args:
        true: True values.
        bias: Constant errors.
        noise: Standard normal samples.
        sigma: Standard deviation of the noise.
        limit: Readings are clipped to +- this; None = no limit.
    """
    (x, y, z), (bx, by, bz), (nx, ny, nz) = true, bias, noise
    reading = x + bx + nx * sigma, y + by + ny * sigma, z + bz + nz * sigma
    if limit is None or (max(reading) <= limit and min(reading) >= -limit):
        return reading
    x, y, z = reading
    return (
        min(max(x, -limit), limit), min(max(y, -limit), limit), min(max(z, -limit), limit)
    )  # fmt: skip
