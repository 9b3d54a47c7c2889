"""What `Gait.step` refuses.

The arguments have no types: machine code would refuse others with a TypeError of its own.
"""

import math
from typing import Any

import numpy as np

from robot_core.errors import NaoGaitError
from robot_core.message_checks import read_array
from robot_core.schema import Number, Switch
from robot_core.types import SensorFrame, VelocityCommand

PERIOD = Number(0.002, 0.05, "s")
"""Between two frames."""
STAMP = Number(-(2.0**63), 2.0**63, "ns", whole=True)
LATE = Number(-100, 100, "control periods", whole=True)


def check_inputs(frame: Any, command: Any, joints: int) -> VelocityCommand:
    """Refuse what no tick can work with; one sum finds NaN and infinity in all arrays.

    Returns:
        The command; its numbers are Python's.

    Raises:
        NaoGaitError: Names the field, with its index.
    """
    try:
        position, rate = frame.joint_position, frame.angular_velocity
        force, mean = frame.linear_acceleration, frame.mean_angular_velocity
        x, y, yaw = command
        total = sum(position.tolist()) + sum(rate.tolist()) + sum(force.tolist()) + x + y + yaw
        if mean is not None:
            total += sum(mean.tolist())
        if (
            math.isfinite(total) and len(position) == joints and len(rate) == 3 and len(force) == 3
            and (mean is None or len(mean) == 3) and type(frame.lifted) is bool
            and type(frame.stamp) is int and abs(frame.stamp) < STAMP.maximum
            and type(frame.late) is int and abs(frame.late) <= LATE.maximum
            and isinstance(x, float) and isinstance(y, float) and isinstance(yaw, float)
            and isinstance(frame, SensorFrame) and isinstance(command, VelocityCommand)
        ):  # fmt: skip
            return command
    except (AttributeError, OverflowError, TypeError, ValueError):
        pass
    return _checked(frame, command, joints)


def _checked(frame: object, command: object, joints: int) -> VelocityCommand:
    """Check one field after the other."""
    if not isinstance(frame, SensorFrame):
        allowed = "a SensorFrame; there is none until the first one has passed the sensor delay"
        raise NaoGaitError("frame", frame, allowed)
    if not isinstance(command, VelocityCommand):
        raise NaoGaitError("command", command, "a Velocity(x, y, yaw)")
    named: Any = frame._asdict()
    arrays = {"joint_position": joints, "angular_velocity": 3, "linear_acceleration": 3}
    if named["mean_angular_velocity"] is not None:
        arrays["mean_angular_velocity"] = 3
    for name, count in arrays.items():
        values = read_array(named[name], f"frame.{name}", (count,))
        if not isinstance(named[name], np.ndarray):
            raise NaoGaitError(f"frame.{name}", values.tolist(), "a numpy array")
    for name, whole in (("stamp", STAMP), ("late", LATE)):
        if not isinstance(named[name], int):
            raise NaoGaitError(f"frame.{name}", named[name], f"{whole.allowed}, as int")
        whole.check(f"frame.{name}", named[name])
    Switch().check("frame.lifted", named["lifted"])
    given: Any = command._asdict()
    return VelocityCommand(*(Number().check(f"command.{n}", given[n]) for n in given))
