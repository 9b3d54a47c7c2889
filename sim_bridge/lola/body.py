"""A simulated robot as LoLA shows it: sensor messages of its sensors, joint targets of commands."""

import math

import numpy as np

from lola_bridge.codec import JOINTS, TOUCH, LolaCommand, LolaSensors, RobotConfig
from lola_bridge.joints import JointMap
from robot_core.types import GRAVITY, JointTargets
from sim_bridge.force_sensors import sole_loads
from sim_bridge.heat import status
from sim_bridge.robot import Reading, SimulatedRobot

HOLD_CYCLES = 10
"""Cycles without a command in which the robot keeps the last one; after them it has no stiffness.
Chosen: LoLA's own number is not published."""
CARRIED = 0.5
"""Stiffness of the legs from which on the robot stands by itself. Until it was commanded once, the
robot is held in its start pose, as by a person's hands."""
CONFIG = RobotConfig("P0000000S00S00S00000", "6.0.0", "P0000000S00S00S00000", "6.0.0")
"""A made-up robot; the lengths are those of real ones."""
TILT_TIME = 0.5
"""[s] Time constant with which the robot's own tilt follows the accelerometer."""
COLD = 25.0
"""[deg C] of motors and battery in a plant without heat."""


class LolaBody:
    """One robot behind LoLA.

    Args:
        robot: The simulated robot.
        period: Time [s] of a cycle.

    Attributes:
        touch: (14,) Buttons and touch sensors in the order of `codec.TOUCH`, to be set by hand.
    """

    def __init__(self, robot: SimulatedRobot, period: float) -> None:
        self._robot, self._period = robot, period
        self._map = JointMap(robot.description)
        self._legs = [
            robot.description.index(joint)
            for leg in (robot.description.left_leg, robot.description.right_leg)
            for joint in leg.names
        ]
        self.touch = [0.0] * len(TOUCH)
        self.restart()

    def restart(self) -> None:
        """Begin at the start pose, held."""
        self.held = True
        self._silent = 0
        self._position = self._map.from_gait(self._robot.description.stand_pose)
        self._stiffness = [0.0] * len(JOINTS)
        self._angles: tuple[float, float] | None = None

    def command(self, command: LolaCommand | None) -> None:
        """Take the command of a cycle; None = none has come."""
        if command is None:
            self._silent += 1
            if self._silent <= HOLD_CYCLES:
                return
            self._stiffness = [0.0] * len(JOINTS)
        else:
            self._silent = 0
            if command.position is not None:
                self._position = [float(angle) for angle in command.position]
            if command.stiffness is not None:
                self._stiffness = [min(max(float(each), 0.0), 1.0) for each in command.stiffness]
        shares = np.array(self._map.to_gait(self._stiffness))
        self.held = self.held and bool(shares[self._legs].min() < CARRIED)
        if not self.held:
            position = np.array(self._map.to_gait(self._position))
            self._robot.command(JointTargets(0, position, float(shares.min()), shares))

    def sensors(self) -> LolaSensors | None:
        """The sensor message of this cycle; None before the first reading."""
        reading = self._robot.read()
        if reading is None:
            return None
        frame, motors = reading.frame, reading.motors
        x, y, z = frame.linear_acceleration.tolist()
        temperature = [COLD] * len(JOINTS)
        if motors is not None:
            temperature = self._map.from_gait(motors.temperature, rest=COLD)
        return LolaSensors(
            stiffness=self._stiffness,
            position=self._map.from_gait(frame.joint_position),
            temperature=temperature,
            battery=(0.9, 0.0, -1.0, COLD)
            if motors is None
            else (motors.charge, 0.0, -motors.power / motors.voltage, COLD),
            current=[0.0] * len(JOINTS) if motors is None else self._map.from_gait(motors.current),
            status=[status(each, self._robot.plant) for each in temperature],
            accelerometer=(-x, -y, -z),
            gyroscope=frame.angular_velocity.tolist(),
            angles=self._tilt(reading),
            sonar=(0.0, 0.0),
            fsr=self._loads(reading),
            touch=self.touch,
            robot_config=CONFIG,
        )

    def _tilt(self, reading: Reading) -> tuple[float, float]:
        """Roll and pitch [rad]: the gyroscope, slowly corrected by the accelerometer."""
        x, y, z = reading.frame.linear_acceleration.tolist()
        turn_x, turn_y, _ = reading.frame.angular_velocity.tolist()
        roll, pitch = math.atan2(y, z), math.atan2(-x, math.hypot(y, z))
        if self._angles is not None:
            share = self._period / TILT_TIME
            roll_before, pitch_before = self._angles
            roll = (1 - share) * (roll_before + turn_x * self._period) + share * roll
            pitch = (1 - share) * (pitch_before + turn_y * self._period) + share * pitch
        self._angles = roll, pitch
        return self._angles

    def _loads(self, reading: Reading) -> list[float]:
        """[kg] of the eight force sensors."""
        places = self._robot.description.force_sensors
        if places is None:
            return [0.0] * 8
        return [
            load / GRAVITY
            for side in (0, 1)
            for load in sole_loads(reading.sole_wrench[side], places[side])
        ]
