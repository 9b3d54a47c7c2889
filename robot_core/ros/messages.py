"""Stamps, arrays and reports as ROS messages: what every node writes."""

import math
from array import array
from collections.abc import Sequence
from typing import Any

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from sensor_msgs.msg import Temperature
from std_msgs.msg import Header

from robot_core.geometry import yaw_of_quaternion
from robot_core.log import Report
from robot_core.message_checks import stamp_of
from robot_core.types import FloatArray, Pose2

ODOM = "odom"


BASE_FOOTPRINT = "base_footprint"


_NANOSECONDS = 1_000_000_000


def with_prefix(prefix: str, message: Any) -> Any:
    """The message, with a prefix before the names of its frames."""
    message.header.frame_id = prefix + message.header.frame_id
    if hasattr(message, "child_frame_id"):
        message.child_frame_id = prefix + message.child_frame_id
    return message


def stamp_in(header: Header, topic: str) -> int:
    """The stamp [ns] of a header.

    Raises:
        NaoGaitError: It is no time; the error names the topic.
    """
    return stamp_of(header.stamp.sec, header.stamp.nanosec, f"{topic} header.stamp")


def to_time(stamp: int) -> Time:
    """A stamp [ns] as a message."""
    sec, nanosec = divmod(stamp, _NANOSECONDS)
    return Time(sec=sec, nanosec=nanosec)


def set_planar(place: Any, turn: Any, pose: Pose2) -> None:
    """Set a position or translation, and an orientation or rotation, to a planar pose."""
    place.x, place.y, yaw = pose
    turn.z, turn.w = math.sin(0.5 * yaw), math.cos(0.5 * yaw)


def diagonal(*values: float) -> list[float]:
    """The rows of a covariance without correlations, one after the other."""
    size = len(values)
    matrix = [0.0] * (size * size)
    matrix[:: size + 1] = values
    return matrix


def planar_of(place: Any, turn: Any) -> Pose2:
    """The planar pose of a position or translation, and an orientation or rotation."""
    return place.x, place.y, yaw_of_quaternion(turn.x, turn.y, turn.z, turn.w)


def temperature_messages(
    stamp: int, joints: Sequence[str], degrees: Sequence[float]
) -> list[Temperature]:
    """`temperature`: one for each motor, whose joint is the frame_id; degrees [deg C]."""
    messages = []
    for joint, each in zip(joints, degrees, strict=True):
        message = Temperature(temperature=float(each))
        message.header.stamp, message.header.frame_id = to_time(stamp), joint
        messages.append(message)
    return messages


def to_doubles(values: FloatArray) -> array:
    """A float64 array in the type that ROS messages take without checking each element."""
    doubles = array("d")
    doubles.frombytes(values.tobytes())
    return doubles


def diagnostic_array(
    node: str, hardware: str, stamp: int | None, reports: Sequence[Report]
) -> DiagnosticArray:
    """The reports of one second.

    Args:
        node: Name of the node; it precedes the name of each report.
        hardware: The robot's name.
        stamp: Stamp of the last tick [ns]; None before the first.
        reports: One for each status.

    Returns:
        The message for `diagnostics`.
    """
    array = DiagnosticArray()
    if stamp is not None:
        array.header.stamp = to_time(stamp)
    array.status = [
        DiagnosticStatus(
            level=bytes((report.level,)),
            name=f"{node}: {report.name}",
            message=report.message,
            hardware_id=hardware,
            values=[KeyValue(key=key, value=value) for key, value in report.values.items()],
        )
        for report in reports
    ]
    return array
