"""What is believed of a sensor message: as read, or held, or where the joints were told to be."""

import numpy as np

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.robot_description import RobotDescription
from nao_lipm_gait.ros.frame_assembly import ImuSample
from nao_lipm_gait.ros.frozen_sensors import FrozenSensors
from nao_lipm_gait.ros.health import Level
from nao_lipm_gait.ros.inputs import ImuInput, JointInput
from nao_lipm_gait.ros.joint_belief import JointBelief
from nao_lipm_gait.ros.readings import (
    ACCELERATION_ABSURD,
    ROTATION_ABSURD,
    JointReader,
    check_orientation,
    read_vector,
    stamp_of,
)
from nao_lipm_gait.ros.remarks import SENSORS, Remarks
from nao_lipm_gait.ros.spike_filter import SpikeFilter
from nao_lipm_gait.signals import FloatArray, JointTargets

STUCK = 0.06
"""[rad] by which stuck joints are not where they were told to be."""


class SensorBelief:
    """Reads the values of IMU and joints; stamps are not looked at in here."""

    def __init__(self, robot: RobotDescription, remarks: Remarks) -> None:
        self._remarks = remarks
        self._reader = JointReader(robot, "joint_states")
        self._frozen = FrozenSensors()
        self._spikes = SpikeFilter(robot)
        self._joints = JointBelief()
        self._stuck = False
        self.unread_since: int | None = None
        """Stamp of the first of the joint states in a row that could not be read [ns]."""

    def begin_anew(self, steady: bool) -> None:
        """A new time; steady: the robot is where it was."""
        self._frozen.begin_anew()
        self._joints.begin_anew()
        self._stuck = False
        self.unread_since = None
        if not steady:
            self._spikes.begin_anew()

    def told(self, targets: JointTargets) -> None:
        """Targets that were sent."""
        self._joints.told(targets)

    def imu(self, message: ImuInput) -> ImuSample:
        """Raises NaoGaitError for what cannot be used."""
        stamp = stamp_of(message.sec, message.nanosec, "imu/data header.stamp")
        for field, covariance in (
            ("angular_velocity", message.angular_velocity_covariance),
            ("linear_acceleration", message.linear_acceleration_covariance),
        ):
            if covariance == -1.0:
                raise NaoGaitError(
                    f"imu/data {field}_covariance[0]", -1.0, "0 or more: this gait needs the field"
                )
        rotation, force = message.angular_velocity, message.linear_acceleration
        rate = read_vector(rotation, "imu/data angular_velocity", ROTATION_ABSURD, "rad/s")
        pull = read_vector(force, "imu/data linear_acceleration", ACCELERATION_ABSURD, "m/s^2")
        rate, spike = self._spikes.rotation(rate)
        if spike is not None:
            self._remarks.tell(SENSORS, Level.WARN, "gyro spike", spike)
        try:
            check_orientation(message.orientation, message.orientation_covariance, "imu/data")
        except NaoGaitError as error:
            # Not used by the gait, which estimates its own; but someone should know.
            text = f"{error}; the orientation is not used, walking goes on"
            self._remarks.tell(SENSORS, Level.WARN, error.field, text)
        self._frozen.see_imu(rotation, force)
        if self._frozen.imu:
            raise NaoGaitError(
                "imu/data", "the same numbers while joints move", "an IMU that is not stuck"
            )
        return ImuSample(stamp, rate, pull)

    def joints(
        self, stamp: int, message: JointInput, *, delay: int, is_next: bool, on_the_way: bool
    ) -> tuple[FloatArray, FloatArray | None, bool]:
        """Position and velocity; true where they cannot be read, but are those that were told.

        delay: [ns] that targets need to show in the sensors. is_next: the stamp follows the last
        one. on_the_way: the robot walks, so its joints move. Raises NaoGaitError where the joints
        cannot be read and nobody can tell where they are.
        """
        told = self._joints.at(stamp, delay) if is_next else None
        try:
            position, velocity = self._reader.read(
                message.names, message.position, message.velocity
            )
        except NaoGaitError as error:
            if told is None:
                raise
            self._remarks.rejected["joint_states"] += 1
            trouble, key = str(error), error.field
        else:
            self._frozen.see_joints(position)
            # Found on the way, and until they move: also in the stand that the walk ends in.
            self._stuck = self._frozen.joints and (
                self._stuck
                or (on_the_way and told is not None and np.abs(told - position).max() >= STUCK)
            )
            if told is None or not self._stuck:
                return position, velocity, False
            trouble = key = "joint_states position: stuck while the robot walks"
        self.unread_since = self.unread_since or stamp
        text = f"{trouble}; the joints are taken to be where they were told to be"
        self._remarks.tell(SENSORS, Level.WARN, key, text, burst=5)
        return told, None, True

    def without_spikes(
        self, stamp: int, position: FloatArray, *, delay: int, elapsed: float, unread: bool
    ) -> FloatArray:
        """(n,) [rad] what is believed of a position (n,), `elapsed` [s] after the last.

        unread: the position is one that was told.
        """
        position, spike = self._spikes.joints(position, elapsed, self._joints.at(stamp, delay))
        if spike is not None:
            self.unread_since = self.unread_since or stamp
            self._remarks.tell(SENSORS, Level.WARN, "joint spike", spike)
        elif not unread:
            self.unread_since = None
        return position
