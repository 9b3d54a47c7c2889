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
        self._mount = body.imu_rotation
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
            position = np.round(position / self._count) * self._count
        first = self._position is None
        velocity = np.zeros_like(position)
        if self._position is not None:
            velocity = (position - self._position) / self._period
        self._position = position
        load = tuple(max(float(wrench[2]), 0.0) for wrench in state.sole_wrench)
        return SensorFrame(
            stamp=stamp,
            joint_position=position,
            joint_velocity=velocity,
            angular_velocity=self._gyro(state),
            linear_acceleration=self._accelerometer(state, first),
            sole_load=(load[0], load[1]),
        )

    def _gyro(self, state: TrueState) -> FloatArray:
        sensors = self._sensors
        rate = self._imu_in_torso.T @ state.torso_angular_velocity
        rate = rate + self._individual.gyro_bias + self._noise.normal(0.0, sensors.gyro_noise, 3)
        if sensors.gyro_range is not None:
            rate = np.clip(rate, -sensors.gyro_range, sensors.gyro_range)
        if sensors.gyro_axes == 2:
            rate[2] = 0.0
        return self._mount @ rate

    def _accelerometer(self, state: TrueState, first: bool) -> FloatArray:
        """Mean specific force since the last sample, at the place of the IMU."""
        sensors = self._sensors
        rotation = rotation_matrix(state.torso_rotation)
        velocity = state.torso_linear_velocity + rotation @ cross(
            state.torso_angular_velocity, self._imu_position
        )
        force = self._gravity
        if not first:
            force = force + (velocity - self._imu_velocity) / self._period
            # the axes turn meanwhile: take them half-way
            sign = 1.0 if float(self._quaternion @ state.torso_rotation) >= 0.0 else -1.0
            middle = self._quaternion * sign + state.torso_rotation
            rotation = rotation_matrix(middle / np.linalg.norm(middle))
        self._imu_velocity, self._quaternion = velocity, state.torso_rotation
        reading = self._imu_in_torso.T @ (rotation.T @ force) + self._individual.accel_bias
        reading = reading + self._noise.normal(0.0, sensors.accel_noise, 3)
        if sensors.accel_range is not None:
            reading = np.clip(reading, -sensors.accel_range, sensors.accel_range)
        return self._mount @ reading
