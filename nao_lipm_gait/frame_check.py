"""What `Gait.step` refuses."""

import math

import numpy as np

from robot_core.errors import NaoGaitError
from robot_core.types import SensorFrame, VelocityCommand


def check_inputs(frame: SensorFrame, command: VelocityCommand, joints: int) -> None:
    """Refuse what no tick can work with; one sum finds NaN and infinity in all three arrays.

    Raises:
        NaoGaitError: Names the field, with its index.
    """
    try:
        position, rate = frame.joint_position, frame.angular_velocity
        force = frame.linear_acceleration
        total = sum(position.tolist()) + sum(rate.tolist()) + sum(force.tolist())
        total += command.x + command.y + command.yaw
        if len(position) == joints and len(rate) == 3 and len(force) == 3 and math.isfinite(total):
            return
    except (AttributeError, TypeError, ValueError):
        pass
    _explain(frame, command, joints)


def _explain(frame: object, command: object, joints: int) -> None:
    if not isinstance(frame, SensorFrame):
        allowed = "a SensorFrame; there is none until the first one has passed the sensor delay"
        raise NaoGaitError("frame", frame, allowed)
    if not isinstance(command, VelocityCommand):
        raise NaoGaitError("command", command, "a Velocity(x, y, yaw)")
    for name, value in zip(command._fields, command, strict=True):
        _check(f"command.{name}", value, ())
    _check("frame.joint_position", frame.joint_position, (joints,))
    _check("frame.angular_velocity", frame.angular_velocity, (3,))
    _check("frame.linear_acceleration", frame.linear_acceleration, (3,))


def _check(field: str, value: object, shape: tuple[int, ...]) -> None:
    allowed = f"an array of shape {shape} of finite numbers" if shape else "a finite number"
    if shape and not isinstance(value, np.ndarray):
        raise NaoGaitError(field, value, allowed)
    try:
        found = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise NaoGaitError(field, value, allowed) from None
    if found.shape != shape:
        raise NaoGaitError(field, f"shape {found.shape}" if shape else value, allowed)
    for index, number in np.ndenumerate(found):
        if not math.isfinite(number):
            place = "".join(f"[{each}]" for each in index)
            raise NaoGaitError(f"{field}{place}", float(number), "a finite number")
