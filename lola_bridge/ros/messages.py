"""LoLA's sensors as ROS messages.

A writer reuses its message objects: publish one before the next call.
"""

import math
from collections.abc import Sequence

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import WrenchStamped
from sensor_msgs.msg import BatteryState, Imu, JointState, Joy

from lola_bridge.codec import JOINTS, LolaSensors
from lola_bridge.joints import JointMap
from lola_bridge.link import DriverStatus, SensorPacket
from robot_core.log import Level, Report
from robot_core.robot import RobotDescription
from robot_core.ros.messages import diagnostic_array, to_time
from robot_core.types import GRAVITY, Point2

GYRO_VARIANCE, ACCEL_VARIANCE = 0.005**2, 0.15**2
"""[(rad/s)^2], [(m/s^2)^2] of one reading, as measured on NAOs."""
_STATUS = ("normal", "hot", "very hot", "critically hot")


class SensorWriter:
    """Messages of one frame.

    Args:
        robot: The robot.
        joints: Its joints.
        period: Time [s] between two frames.
    """

    def __init__(self, robot: RobotDescription, joints: JointMap, period: float) -> None:
        self._map, self._period = joints, period
        self._joints = JointState(name=list(joints.names))
        self._joints.effort = [math.nan] * len(joints.names)  # LoLA gives currents, no torques
        self._before: tuple[int, list[float]] = (0, [])
        self._imu = Imu()
        self._imu.header.frame_id = robot.torso_frame
        self._imu.orientation_covariance[0] = -1.0  # REP-145: no orientation
        for covariance, variance in (
            (self._imu.angular_velocity_covariance, GYRO_VARIANCE),
            (self._imu.linear_acceleration_covariance, ACCEL_VARIANCE),
        ):
            covariance[0] = covariance[4] = covariance[8] = variance
        nowhere = ((0.0, 0.0),) * 4
        self._places = robot.force_sensors or (nowhere, nowhere)
        self._wrenches = (WrenchStamped(), WrenchStamped())
        for wrench, frame in zip(self._wrenches, robot.sole_frames, strict=True):
            wrench.header.frame_id = frame

    def imu(self, stamp: int, sensors: LolaSensors) -> Imu:
        """`imu/data`. LoLA's accelerometer has the opposite sign of REP-145's."""
        message = self._imu
        message.header.stamp = to_time(stamp)
        turn, force = message.angular_velocity, message.linear_acceleration
        turn.x, turn.y, turn.z = map(float, sensors.gyroscope)
        force.x, force.y, force.z = (-float(value) for value in sensors.accelerometer)
        return message

    def joints(self, stamp: int, sensors: LolaSensors) -> JointState:
        """`joint_states`; velocities from two frames."""
        message, position = self._joints, self._map.measured(sensors.position)
        stamp_before, before = self._before
        if stamp - stamp_before > 2e9 * self._period:
            before = position  # frames are missing: no velocities
        message.header.stamp = to_time(stamp)
        message.position = position
        message.velocity = [
            (now - then) / self._period for now, then in zip(position, before, strict=True)
        ]
        self._before = stamp, position
        return message

    def wrench(self, stamp: int, sensors: LolaSensors, side: int) -> WrenchStamped:
        """Load of a sole by its four force sensors; side 0 = left, 1 = right."""
        message = self._wrenches[side]
        message.header.stamp = to_time(stamp)
        loads = [GRAVITY * load for load in sensors.fsr[4 * side : 4 * side + 4]]
        force, torque_x, torque_y = sole_wrench(loads, self._places[side])
        message.wrench.force.z = force
        message.wrench.torque.x, message.wrench.torque.y = torque_x, torque_y
        return message


def sole_wrench(loads: Sequence[float], places: Sequence[Point2]) -> tuple[float, float, float]:
    """Force z [N] and torques x, y [N m] about the sole's origin of four normal forces [N]."""
    return (
        sum(loads),
        sum(y * load for load, (_, y) in zip(loads, places, strict=True)),
        -sum(x * load for load, (x, _) in zip(loads, places, strict=True)),
    )


def touch(stamp: int, sensors: LolaSensors) -> Joy:
    """`touch`: buttons and touch sensors in the order of `codec.TOUCH`, 1 = pressed."""
    message = Joy(buttons=[int(value >= 0.5) for value in sensors.touch])
    message.header.stamp = to_time(stamp)
    return message


def battery_state(stamp: int, sensors: LolaSensors) -> BatteryState:
    """`battery`."""
    charge, _, current, temperature = map(float, sensors.battery)
    message = BatteryState(
        voltage=math.nan, temperature=temperature, current=current, charge=math.nan,
        capacity=math.nan, design_capacity=math.nan, percentage=charge, present=True,
        power_supply_technology=BatteryState.POWER_SUPPLY_TECHNOLOGY_LION,
    )  # fmt: skip
    message.header.stamp = to_time(stamp)
    charging = BatteryState.POWER_SUPPLY_STATUS_CHARGING
    discharging = BatteryState.POWER_SUPPLY_STATUS_DISCHARGING
    message.power_supply_status = charging if current > 0.0 else discharging
    return message


def diagnostics(
    node: str, stamp: int, sensors: LolaSensors, status: DriverStatus, refused: str
) -> DiagnosticArray:
    """State of the bridge, the motors and the battery.

    Args:
        node: Name of the node.
        stamp: [ns] of the last frame.
        sensors: Its sensors.
        status: State of the driver.
        refused: Why no command passes; empty if commands pass.
    """
    worst = max(range(len(JOINTS)), key=lambda i: (sensors.status[i], sensors.temperature[i]))
    code = min(sensors.status[worst], len(_STATUS) - 1)
    charge = sensors.battery[0]
    config = sensors.robot_config
    reports = (
        Report(
            "bridge",
            Level.WARN if refused else Level.OK,
            refused or status.mode.value,
            {
                "mode": status.mode.value,
                "frames": str(status.frames),
                "repeated commands": str(status.repeated),
                "late answers": str(status.late),
                "answer median [ms]": f"{1e3 * status.answer_median:.2f}",
                "answer worst [ms]": f"{1e3 * status.answer_worst:.2f}",
                "body": f"{config.body_id} {config.body_version}",
                "head": f"{config.head_id} {config.head_version}",
            },
        ),
        Report(
            "motors",
            (Level.OK, Level.WARN, Level.WARN, Level.ERROR)[code],
            f"{JOINTS[worst]} {sensors.temperature[worst]:.0f} deg C, {_STATUS[code]}",
            {
                **{f"{joint} [deg C]": f"{value:.0f}"
                   for joint, value in zip(JOINTS, sensors.temperature, strict=True)},
                **{f"{joint} [A]": f"{value:.3f}"
                   for joint, value in zip(JOINTS, sensors.current, strict=True)},
            },
        ),
        Report(
            "battery",
            Level.OK if charge > 0.2 else Level.WARN if charge > 0.1 else Level.ERROR,
            f"{100.0 * charge:.0f} %",
            {
                "current [A]": f"{sensors.battery[2]:.2f}",
                "status": f"{sensors.battery[1]:.0f}",
                "temperature [deg C]": f"{sensors.battery[3]:.0f}",
            },
        ),
    )  # fmt: skip
    return diagnostic_array(node, config.body_id, stamp, reports)


def silence_report(
    node: str, last: tuple[SensorPacket, LolaSensors] | None, silence: float, reason: str
) -> DiagnosticArray:
    """State of a bridge that gets no frames.

    Args:
        node: Name of the node.
        last: The last frame and its sensors; None before the first.
        silence: Time [s] since then.
        reason: What the driver has said last; empty = nothing.
    """
    text = "no frame of LoLA so far" if last is None else f"no frame of LoLA for {silence:.0f} s"
    report = Report("bridge", Level.ERROR, f"{text}; {reason}".rstrip("; "), {})
    if last is None:
        return diagnostic_array(node, "", None, (report,))
    frame, sensors = last
    return diagnostic_array(node, sensors.robot_config.body_id, frame.stamp, (report,))
