"""Temperatures of the motors, and the battery that feeds them.

A DC motor that gives the torque t (before the losses of its gear) at the speed w takes the copper
loss w0 t^2 / t_stall and the mechanical power t w, where w0 is its no-load speed: both follow from
V i_stall = w0 t_stall and hold at the joint as at the motor, because the gear ratio cancels. Its
temperature follows the copper loss with one time constant; the loss at the nominal torque leads to
the rise that the plant names.
"""

from typing import NamedTuple

import numpy as np

from robot_core.errors import NaoGaitError
from robot_core.robot import RobotDescription
from robot_core.types import FloatArray
from sim_bridge.plant import Plant


class MotorState(NamedTuple):
    """Motors and battery at one instant.

    Attributes:
        temperature: (n,) [deg C] of each joint's motor.
        current: (n,) [A].
        share: (n,) share of its torque that a motor has left, by temperature and voltage.
        charge: Of the battery, 0 to 1.
        voltage: [V] of the battery.
        power: [W] that robot and electronics take.
    """

    temperature: FloatArray
    current: FloatArray
    share: FloatArray
    charge: float
    voltage: float
    power: float


class HeatModel:
    """Heat and battery of one robot.

    Attributes:
        energy: [J] taken from the battery since the start.
        final: (n,) [deg C] to which the load of the last step would lead in the end.
    """

    def __init__(self, robot: RobotDescription, plant: Plant) -> None:
        """Read the facts.

        Raises:
            NaoGaitError: This robot's nominal torques or its battery are not known.
        """
        motors = [robot.motors[joint] for joint in robot.joint_names]
        nominal = [motor.nominal_torque for motor in motors]
        if None in nominal or robot.battery is None:
            allowed = f"false: nominal torques and battery of {robot.name} are not known"
            raise NaoGaitError("heat.enabled", True, allowed)
        self._heat, self._battery = plant.heat, robot.battery
        self._efficiency = plant.motor.torque_fraction
        stall = np.array([motor.stall_torque for motor in motors])
        speed = np.array([motor.no_load_speed for motor in motors])
        self._loss = speed / stall  # [W / (N m)^2]
        self._amperes = speed / self._battery.nominal_voltage  # per N m before the gear's losses
        self._rise = self._heat.rise / np.square(np.array(nominal, dtype=float))
        self.restart()

    def restart(self) -> None:
        """Cold motors, and the battery as charged at the start."""
        heat = self._heat
        count = len(self._loss)
        self._temperature: FloatArray = np.full(count, heat.ambient)
        self._charge, self.energy = heat.charge, 0.0
        self.final = self._temperature.copy()
        self.state = self._state(np.zeros(count), heat.electronics)

    def step(self, torque: FloatArray, velocity: FloatArray, seconds: float) -> MotorState:
        """Advance by a control period.

        Args:
            torque: (n,) [N m] at the joints.
            velocity: (n,) [rad/s] of the joints.
            seconds: [s].
        """
        heat = self._heat
        driven = np.abs(torque) / self._efficiency
        self.final = heat.ambient + self._rise * np.square(driven)
        decay = -np.expm1(-seconds / heat.time_constant)
        self._temperature += decay * (self.final - self._temperature)
        # Braking feeds nothing back into the battery.
        mechanical = np.maximum(np.sign(torque) * velocity, 0.0) * driven
        loss = self._loss * np.square(driven)
        power = float(mechanical.sum() + loss.sum()) + heat.electronics
        self.energy += power * seconds
        self._charge = max(0.0, self._charge - power * seconds / self._battery.energy)
        self.state = self._state(self._amperes * driven, power)
        return self.state

    def _state(self, current: FloatArray, power: float) -> MotorState:
        heat, battery = self._heat, self._battery
        left = (heat.limit - self._temperature) / (heat.limit - heat.fade_from)
        span = battery.full_voltage - battery.empty_voltage
        voltage = battery.empty_voltage + span * self._charge
        share = np.clip(left, 0.0, 1.0) * min(1.0, voltage / battery.nominal_voltage)
        if self._charge == 0.0:
            share = np.zeros_like(share)
        return MotorState(
            self._temperature.copy(), current, share, self._charge, voltage, power
        )


def status(temperature: float, plant: Plant) -> int:
    """What a NAO reports of a motor: 0 normal, 1 hot, 2 less than 70 % torque left, 3 none."""
    heat = plant.heat
    if temperature < heat.fade_from:
        return 0
    left = (heat.limit - temperature) / (heat.limit - heat.fade_from)
    return 1 if left >= 0.7 else 2 if left > 0.0 else 3
