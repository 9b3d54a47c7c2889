"""What the robot feels: encoders, gyro, accelerometer and sole load, made from true states."""

import math

import numpy as np

from nao_lipm_gait.signals import FloatArray, SensorFrame
from sim_bridge.backend import TrueState, cross, rotation_of
from sim_bridge.body import Body
from sim_bridge.individual import Individual
from sim_bridge.plant import Plant


class SensorModel:
    """Samples the sensors once per control period. No sensor tells the orientation."""

    def __init__(
        self, plant: Plant, individual: Individual, body: Body, noise_seed: int, period: float
    ) -> None:
        """Args: period [s] between two samples."""
        self._sensors = plant.sensors
        self._joint_zero = individual.joint_zero
        self._rate = 1.0 / period
        self._gyro_offset = individual.gyro_bias
        self._accel_offset = individual.accel_bias
        self._gravity = np.array([0.0, 0.0, plant.physics.gravity])
        self._imu_position = body.imu_position
        self._imu_in_torso = body.imu_rotation @ individual.imu_rotation
        straight = np.array_equal(body.imu_rotation, np.eye(3))
        self._mount = None if straight else body.imu_rotation
        bits = plant.sensors.encoder_bits
        self._count = 2.0 * math.pi / 2**bits if bits else 0.0
        self._counts = 2**bits / (2.0 * math.pi)
        self._noise_seed = noise_seed
        self._noise = np.random.default_rng(noise_seed)
        self._position: FloatArray | None = None
        self._imu_velocity = np.zeros(3)
        self._quaternion = np.zeros(4)

    def reset(self) -> None:
        """Forget the past; the noise starts over, so that a run can be repeated."""
        self._noise = np.random.default_rng(self._noise_seed)
        self._position = None

    def sample(self, stamp: int, state: TrueState) -> SensorFrame:
        """The frame of this instant [ns]; to be called once per period."""
        position = state.joint_position - self._joint_zero
        if self._count:
            position *= self._counts
            position = np.rint(position, out=position) * self._count
        first = self._position is None
        before = position if self._position is None else self._position
        velocity = (position - before) * self._rate
        self._position = position
        left, right = state.sole_wrench
        noise = self._noise.standard_normal(6)
        return SensorFrame(
            stamp=stamp,
            joint_position=position,
            joint_velocity=velocity,
            angular_velocity=self._gyro(state, noise[:3]),
            linear_acceleration=self._accelerometer(state, noise[3:], first),
            sole_load=(max(float(left[2]), 0.0), max(float(right[2]), 0.0)),
        )

    def _gyro(self, state: TrueState, noise: FloatArray) -> FloatArray:
        rate: FloatArray = state.torso_angular_velocity @ self._imu_in_torso
        rate += self._gyro_offset
        rate += noise * self._sensors.gyro_noise
        _cut(rate, self._sensors.gyro_range)
        if self._sensors.gyro_axes == 2:
            rate[2] = 0.0
        return self._mounted(rate)

    def _accelerometer(self, state: TrueState, noise: FloatArray, first: bool) -> FloatArray:
        """Mean specific force since the last sample, at the place of the IMU."""
        rotation, quaternion = state.torso_matrix, state.torso_rotation
        velocity: FloatArray = rotation @ cross(state.torso_angular_velocity, self._imu_position)
        velocity += state.torso_linear_velocity
        force = self._gravity
        if not first:
            force = (velocity - self._imu_velocity) * self._rate
            force += self._gravity
            rotation = _between(self._quaternion, quaternion)  # the axes turn meanwhile
        self._imu_velocity, self._quaternion = velocity, quaternion
        reading: FloatArray = (force @ rotation) @ self._imu_in_torso
        reading += self._accel_offset
        reading += noise * self._sensors.accel_noise
        _cut(reading, self._sensors.accel_range)
        return self._mounted(reading)

    def _mounted(self, reading: FloatArray) -> FloatArray:
        """From the IMU's axes to the torso's, as the robot believes them to be."""
        return reading if self._mount is None else self._mount @ reading


def _between(first: FloatArray, second: FloatArray) -> FloatArray:
    """(3, 3) rotation half-way between two quaternions."""
    (a, b, c, d), (x, y, z, w) = first.tolist(), second.tolist()
    sign = 1.0 if a * x + b * y + c * z + d * w >= 0.0 else -1.0
    x, y, z, w = x + sign * a, y + sign * b, z + sign * c, w + sign * d
    size = math.sqrt(x * x + y * y + z * z + w * w)
    return rotation_of(x / size, y / size, z / size, w / size)


def _cut(values: FloatArray, limit: float | None) -> None:
    """Cuts at +- limit, in place."""
    if limit is not None and max(map(abs, values.tolist())) > limit:
        np.maximum(values, -limit, out=values)
        np.minimum(values, limit, out=values)
