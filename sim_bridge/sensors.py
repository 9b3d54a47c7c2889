"""What the robot feels: encoders, gyro, accelerometer and sole load, made from true states."""

import math

import numpy as np

from nao_lipm_gait.signals import FloatArray, SensorFrame
from sim_bridge.backend import TrueState, cross, rotation_matrix
from sim_bridge.body import Body
from sim_bridge.individual import Individual
from sim_bridge.plant import Plant


class SensorModel:
    """Samples the sensors once per control period. No sensor of a NAO tells the orientation."""

    def __init__(
        self, plant: Plant, individual: Individual, body: Body, noise_seed: int, period: float
    ) -> None:
        """Args: period [s] between two samples."""
        self._sensors = plant.sensors
        self._individual = individual
        self._period = period
        self._gravity = np.array([0.0, 0.0, plant.physics.gravity])
        self._imu_position = body.imu_position
        self._imu_in_torso = body.imu_rotation @ individual.imu_rotation
        straight = np.array_equal(body.imu_rotation, np.eye(3))
        self._mount = None if straight else body.imu_rotation
        bits = plant.sensors.encoder_bits
        self._count = 2.0 * math.pi / 2**bits if bits else 0.0
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
        position = state.joint_position - self._individual.joint_zero
        if self._count:
            position = np.rint(position / self._count) * self._count
        first = self._position is None
        before = position if self._position is None else self._position
        velocity = (position - before) / self._period
        self._position = position
        left, right = state.sole_wrench
        return SensorFrame(
            stamp=stamp,
            joint_position=position,
            joint_velocity=velocity,
            angular_velocity=self._gyro(state),
            linear_acceleration=self._accelerometer(state, first),
            sole_load=(max(float(left[2]), 0.0), max(float(right[2]), 0.0)),
        )

    def _gyro(self, state: TrueState) -> FloatArray:
        sensors = self._sensors
        rate: FloatArray = state.torso_angular_velocity @ self._imu_in_torso
        rate = rate + self._individual.gyro_bias + self._noise.normal(0.0, sensors.gyro_noise, 3)
        _cut(rate, sensors.gyro_range)
        if sensors.gyro_axes == 2:
            rate[2] = 0.0
        return self._mounted(rate)

    def _accelerometer(self, state: TrueState, first: bool) -> FloatArray:
        """Mean specific force since the last sample, at the place of the IMU."""
        rotation, quaternion = state.torso_matrix, state.torso_rotation
        spin = cross(state.torso_angular_velocity, self._imu_position)
        velocity = state.torso_linear_velocity + rotation @ spin
        force = self._gravity
        if not first:
            force = force + (velocity - self._imu_velocity) / self._period
            # the axes turn meanwhile: take them half-way
            sign = 1.0 if float(self._quaternion @ quaternion) >= 0.0 else -1.0
            middle = self._quaternion * sign + quaternion
            rotation = rotation_matrix(middle / math.sqrt(float(middle @ middle)))
        self._imu_velocity, self._quaternion = velocity, quaternion
        reading = (force @ rotation) @ self._imu_in_torso + self._individual.accel_bias
        reading = reading + self._noise.normal(0.0, self._sensors.accel_noise, 3)
        _cut(reading, self._sensors.accel_range)
        return self._mounted(reading)

    def _mounted(self, reading: FloatArray) -> FloatArray:
        """From the IMU's axes to the torso's, as the robot believes them to be."""
        return reading if self._mount is None else self._mount @ reading


def _cut(values: FloatArray, limit: float | None) -> None:
    """Cuts at +- limit, in place."""
    if limit is not None:
        np.maximum(values, -limit, out=values)
        np.minimum(values, limit, out=values)
