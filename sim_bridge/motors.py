"""Setpoints and torque limits of the motors, the same in every engine."""

from collections.abc import Iterator

import numpy as np

from robot_core.robot import RobotDescription
from robot_core.types import FloatArray
from sim_bridge.individual import Individual
from sim_bridge.plant import Plant


class Setpoints:
    """One setpoint per physics step from one target per control period.

    Targets are limited to the joint limits and joint speeds, then approached linearly. Targets are
    in the angles of the encoders; the setpoints are true angles, with the encoder offsets added.

    Attributes:
        current: (n,) [rad] last setpoints, without encoder offsets.
    """

    def __init__(
        self, robot: RobotDescription, plant: Plant, individual: Individual, substeps: int
    ) -> None:
        """Read the limits.

        Args:
            robot: Joint limits, joint speeds and coupled joints.
            plant: Whether speeds are limited.
            individual: Encoder offsets.
            substeps: Physics steps per control period.
        """
        self._lower = np.asarray(robot.lower, dtype=float)
        self._upper = np.asarray(robot.upper, dtype=float)
        period = substeps * plant.physics.step
        speed = np.asarray(robot.velocity_limit, dtype=float)
        self._stride = speed * period if plant.motor.speed_limit else np.full(len(speed), np.inf)
        # A motor that gives way follows its setpoint as a spring: only its torque limits its speed.
        gives_way = [robot.motors[joint].stiffness is not None for joint in robot.joint_names]
        self._stride[np.array(gives_way)] = np.inf
        self._zero = individual.joint_zero
        self._coupled = [
            (robot.index(leader), robot.index(follower))
            for leader, follower in robot.coupled_joints
        ]
        self._shares = (np.arange(substeps) + 1.0)[:, None] / substeps
        self.current: FloatArray = np.zeros(len(self._lower))

    def reset(self, position: FloatArray) -> None:
        """Begin at (n,) [rad], without encoder offsets."""
        self.current = np.array(position, dtype=float)

    def advance(self, target: FloatArray) -> Iterator[FloatArray]:
        """(n,) [rad] setpoints of true angles, one per physics step of this control period."""
        target = np.minimum(np.maximum(target, self._lower), self._upper)
        for leader, follower in self._coupled:
            target[follower] = target[leader]  # the shared motor follows the leader's target
        change = np.minimum(np.maximum(target - self.current, -self._stride), self._stride)
        setpoints = self.current + self._zero + self._shares * change
        self.current = self.current + change
        return iter(setpoints)


class TorqueLimits:
    """Largest torque of each motor at its present speed.

    A driving motor has `fraction * stall * strength * (1 - |w|/w0)`, a braking one the whole
    standstill torque. Of joints that share a motor the leader has all torque, the followers none.

    Attributes:
        standstill: (n,) [N m] limit at standstill.
        loss: (n,) [N m s/rad] loss of torque with speed while driving.
        top_speed: (n,) [rad/s] speed at which no torque is left to drive.
    """

    def __init__(self, robot: RobotDescription, plant: Plant, individual: Individual) -> None:
        """Motor facts of `robot`, motor model of `plant`, motor strength of `individual`."""
        motors = [robot.motors[joint] for joint in robot.joint_names]
        factor = plant.motor.torque_fraction * individual.motor_strength
        self.standstill: FloatArray = factor * np.array([motor.stall_torque for motor in motors])
        for _, follower in robot.coupled_joints:
            self.standstill[robot.index(follower)] = 0.0
        self._whole = self.standstill.copy()
        no_load_speed = np.array([motor.no_load_speed for motor in motors])
        self._line = plant.motor.torque_speed_line
        self._inverse_no_load_speed = 1.0 / no_load_speed
        self.loss: FloatArray = self.standstill / no_load_speed * self._line
        self.top_speed: FloatArray = no_load_speed if self._line else np.full(len(motors), np.inf)

    def weaken(self, share: FloatArray) -> None:
        """Leave the motors these shares (n,) of their torque from now on, 0 to 1."""
        self.standstill[:] = share * self._whole
        self.loss[:] = self.standstill * self._inverse_no_load_speed * self._line

    def driving(self, velocity: FloatArray) -> FloatArray:
        """(n,) [N m] for motors that drive their joints at `velocity` (n,) [rad/s]."""
        if not self._line:
            return self.standstill
        share = 1.0 - np.abs(velocity) * self._inverse_no_load_speed
        return self.standstill * np.maximum(share, 0.0)

    def now(
        self, velocity: FloatArray, torque: FloatArray, wanted_velocity: FloatArray
    ) -> FloatArray:
        """Limit of each motor (n,) [N m]; a motor that slows its joint, or is about to, brakes.

        Args:
            velocity: (n,) joint velocity [rad/s].
            torque: (n,) last motor torque [N m].
            wanted_velocity: (n,) [rad/s] that the servo demands.
        """
        if not self._line:
            return self.standstill
        brakes = (velocity * torque < 0.0) | (velocity * (wanted_velocity - velocity) < 0.0)
        return np.where(brakes, self.standstill, self.driving(velocity))

    def saturated(
        self, velocity: FloatArray, torque: FloatArray, share: float | FloatArray
    ) -> int:
        """Number of motors whose torque exceeds a share of their limit.

        Args:
            velocity: (n,) joint velocity [rad/s].
            torque: (n,) motor torque [N m].
            share: Of the limit, for all motors or (n,) for each.
        """
        driving = np.maximum(self.standstill - self.loss * np.abs(velocity), 0.0)
        limit = np.where(velocity * torque > 0.0, driving, self.standstill)
        return int(np.count_nonzero(np.abs(torque) > share * limit))

    def span(self, velocity: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Lowest and highest torque (n,) [N m] at `velocity` (n,) [rad/s].

        The same limits as `now`: a motor drives if its torque and velocity have the same sign.
        """
        most, lost = self.standstill, self.loss * velocity
        return np.clip(-most - lost, -most, 0.0), np.clip(most - lost, 0.0, most)
