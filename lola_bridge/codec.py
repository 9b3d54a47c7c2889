"""LoLA's two messages as bytes: MessagePack maps with arrays of float32.

The robot sends a map of `SENSOR_BYTES` each 12 ms; the controller answers with a map of at most
`COMMAND_BYTES`. Sizes and orders are those that public controllers of several teams agree on
(docs/robot.md names them). Sensors are strict: every key, every length, every number finite. A
command may leave keys out.
"""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

import msgpack

from robot_core.errors import NaoGaitError

SENSOR_BYTES = 896
"""Size of a sensor message."""
COMMAND_BYTES = 786
"""Size of a command with every key."""
FLOAT32_MAX = 3.4028234663852886e38

JOINTS = (
    "HeadYaw", "HeadPitch",
    "LShoulderPitch", "LShoulderRoll", "LElbowYaw", "LElbowRoll", "LWristYaw",
    "LHipYawPitch", "LHipRoll", "LHipPitch", "LKneePitch", "LAnklePitch", "LAnkleRoll",
    "RHipRoll", "RHipPitch", "RKneePitch", "RAnklePitch", "RAnkleRoll",
    "RShoulderPitch", "RShoulderRoll", "RElbowYaw", "RElbowRoll", "RWristYaw",
    "LHand", "RHand",
)  # fmt: skip
"""Order of every joint array. One motor turns both hips: LHipYawPitch stands for both."""
TOUCH = (
    "chest", "head_front", "head_middle", "head_rear",
    "left_bumper_left", "left_bumper_right",
    "left_hand_back", "left_hand_left", "left_hand_right",
    "right_bumper_left", "right_bumper_right",
    "right_hand_back", "right_hand_left", "right_hand_right",
)  # fmt: skip
"""Order of `Touch`: 1 = pressed."""
_COUNT = len(JOINTS)

_REALS = {
    "Stiffness": _COUNT, "Position": _COUNT, "Temperature": _COUNT, "Battery": 4,
    "Current": _COUNT, "Accelerometer": 3, "Gyroscope": 3, "Angles": 2, "Sonar": 2, "FSR": 8,
    "Touch": len(TOUCH),
}  # fmt: skip
_ACTUATORS = {
    "Position": _COUNT, "Stiffness": _COUNT, "REar": 10, "LEar": 10, "Chest": 3, "LEye": 24,
    "REye": 24, "LFoot": 3, "RFoot": 3, "Skull": 12, "Sonar": 2,
}  # fmt: skip
"""Length of each array of a command; `Sonar` holds booleans, the others float32."""
_SENSOR_KEYS = {*_REALS, "Status", "RobotConfig"}
_UNUSED = frozenset(JOINTS.index(name) for name in ("LWristYaw", "RWristYaw", "LHand", "RHand"))
_MAY_BE_UNKNOWN = {
    "Stiffness": _UNUSED, "Position": _UNUSED, "Temperature": frozenset(range(_COUNT)),
    "Current": frozenset(range(_COUNT)), "Sonar": frozenset(range(2)), "FSR": frozenset(range(8)),
}  # fmt: skip
"""Places of an array that may be no number: no walk depends on them, and a robot whose hand reports
nonsense must not sit down for it."""


class RobotConfig(NamedTuple):
    """Which robot it is.

    Attributes:
        body_id: Serial number of the body, 20 characters.
        body_version: As in `6.0.0`.
        head_id: Serial number of the head, 20 characters.
        head_version: As in `6.0.0`.
    """

    body_id: str
    body_version: str
    head_id: str
    head_version: str


class LolaSensors(NamedTuple):
    """One sensor message. Joint arrays (25,) are in the order of `JOINTS`.

    Attributes:
        stiffness: Share of the motors' torque that may be used, 0 to 1.
        position: [rad]; hands: 0 closed to 1 open.
        temperature: [deg C] of the motors.
        battery: Charge 0 to 1, status, current [A] (below 0 while it discharges), temperature
            [deg C].
        current: [A] of the motors.
        status: Of the motors: 0 normal, 1 hot, 2 very hot, 3 critically hot.
        accelerometer: x, y, z [m/s^2] along the torso, about (0, 0, -9.8) at rest upright: the
            negative of what REP-145 asks for.
        gyroscope: x, y, z [rad/s].
        angles: Roll and pitch [rad] of the torso, estimated by the robot.
        sonar: Distances [m] on the left and on the right.
        fsr: Loads [kg] of the left sole's front left, front right, rear left and rear right
            sensor, then those of the right sole.
        touch: In the order of `TOUCH`: 1 = pressed.
        robot_config: Which robot it is.
    """

    stiffness: Sequence[float]
    position: Sequence[float]
    temperature: Sequence[float]
    battery: Sequence[float]
    current: Sequence[float]
    status: Sequence[int]
    accelerometer: Sequence[float]
    gyroscope: Sequence[float]
    angles: Sequence[float]
    sonar: Sequence[float]
    fsr: Sequence[float]
    touch: Sequence[float]
    robot_config: RobotConfig


class LolaCommand(NamedTuple):
    """One command. Keys that it leaves out are None.

    Attributes:
        position: (25,) [rad] in the order of `JOINTS`.
        stiffness: (25,) share of the motors' torque, 0 to 1; below 0 = off.
        chest: Red, green, blue of the chest's light, 0 to 1.
        other: The other lights and the sonars by key, as sent.
    """

    position: Sequence[float] | None
    stiffness: Sequence[float] | None
    chest: Sequence[float] | None = None
    other: Mapping[str, Sequence[float] | Sequence[bool]] = MappingProxyType({})


# -- sensors ---------------------------------------------------------------------------------------


def encode_sensors(sensors: LolaSensors) -> bytes:
    """The bytes of a sensor message.

    Raises:
        NaoGaitError: A field is not usable, or the message does not have its size.
    """
    for key, value in zip(_FIELDS, sensors[:-1], strict=True):
        if key == "Status":
            _check_status(value)
        else:
            _check_reals(f"LoLA {key}", value, _REALS[key])
    mapping = {key: list(value) for key, value in zip(_FIELDS, sensors, strict=False)}
    mapping["RobotConfig"] = list(sensors.robot_config)
    message: bytes = msgpack.packb(_as_float(mapping), use_single_float=True)
    if len(message) != SENSOR_BYTES:
        allowed = "ids of 20 characters and versions of 5"
        raise NaoGaitError("LoLA RobotConfig", tuple(sensors.robot_config), allowed)
    return message


def decode_sensors(message: bytes) -> LolaSensors:
    """Read a sensor message.

    Raises:
        NaoGaitError: Another size, another map, or a number that is not finite.
    """
    if len(message) != SENSOR_BYTES:
        raise NaoGaitError("LoLA message", f"{len(message)} bytes", f"{SENSOR_BYTES} bytes")
    found = _unpack(message)
    if found.keys() != _SENSOR_KEYS:
        wrong = sorted(map(str, found.keys() ^ _SENSOR_KEYS))
        allowed = f"the keys {', '.join(sorted(_SENSOR_KEYS))}"
        raise NaoGaitError("LoLA message", f"missing or unknown: {', '.join(wrong)[:120]}", allowed)
    for key, count in _REALS.items():
        _check_reals(f"LoLA {key}", found[key], count, _MAY_BE_UNKNOWN.get(key, frozenset()))
    _check_status(found["Status"])
    config = found["RobotConfig"]
    if len(config) != 4 or not all(isinstance(each, str) for each in config):
        raise NaoGaitError("LoLA RobotConfig", config, "4 texts")
    return LolaSensors._make((*(found[key] for key in _FIELDS), RobotConfig(*config)))


_FIELDS = (
    "Stiffness", "Position", "Temperature", "Battery", "Current", "Status", "Accelerometer",
    "Gyroscope", "Angles", "Sonar", "FSR", "Touch",
)  # fmt: skip
"""The keys in the order of `LolaSensors`, without the last."""


def _check_status(value: Any) -> None:
    if len(value) != _COUNT or not all(type(each) is int and 0 <= each <= 127 for each in value):
        raise NaoGaitError("LoLA Status", value, f"{_COUNT} whole numbers from 0 to 127")


# -- commands --------------------------------------------------------------------------------------


def encode_command(command: LolaCommand) -> bytes:
    """The bytes of a command.

    Raises:
        NaoGaitError: A field is not usable.
    """
    mapping: dict[str, Any] = {}
    for key, value in (
        ("Position", command.position), ("Stiffness", command.stiffness), ("Chest", command.chest),
        *command.other.items(),
    ):  # fmt: skip
        if value is not None:
            mapping[key] = list(value)
    for key, value in mapping.items():
        _check_actuator(key, value)
    message: bytes = msgpack.packb(_as_float(mapping), use_single_float=True)
    return message


def read_command(found: Any) -> LolaCommand:
    """Check a map that was unpacked from a stream of commands.

    Raises:
        NaoGaitError: Another map, or a number that is not finite.
    """
    if not isinstance(found, dict):
        raise NaoGaitError("LoLA command", type(found).__name__, "a map")
    for key, value in found.items():
        _check_actuator(key, value)
    rest = {
        key: value
        for key, value in found.items()
        if key not in ("Position", "Stiffness", "Chest")
    }
    return LolaCommand(
        found.get("Position"), found.get("Stiffness"), found.get("Chest"), rest
    )


def command_stream() -> msgpack.Unpacker:
    """A parser of commands that arrive in pieces; `feed` it, then iterate over the maps.

    It raises ValueError (or a subclass) for bytes that are no MessagePack.
    """
    return msgpack.Unpacker(
        use_list=False, strict_map_key=True, max_buffer_size=16 * COMMAND_BYTES,
        max_array_len=32, max_map_len=16, max_str_len=32, max_bin_len=0, max_ext_len=0,
    )  # fmt: skip


def _check_actuator(key: Any, value: Any) -> None:
    count = _ACTUATORS.get(key) if isinstance(key, str) else None
    if count is None:
        raise NaoGaitError("LoLA command key", str(key)[:40], _ACTUATORS)
    if key != "Sonar":
        _check_reals(f"LoLA {key}", value, count)
    elif not (
        isinstance(value, list | tuple)
        and len(value) == count
        and all(type(each) is bool for each in value)
    ):
        raise NaoGaitError("LoLA Sonar", str(value)[:40], f"{count} booleans")


# -- both ------------------------------------------------------------------------------------------


def _check_reals(
    field: str, value: Any, count: int, unknown: frozenset[int] = frozenset()
) -> None:
    """Refuse anything but `count` numbers that a float32 can hold; `unknown` places may be NaN."""
    if isinstance(value, list | tuple) and len(value) == count:
        for place, each in enumerate(value):
            kind = type(each)
            if kind is not float and kind is not int:
                break
            if not -FLOAT32_MAX <= each <= FLOAT32_MAX and place not in unknown:
                break
        else:
            return
    raise NaoGaitError(field, value, f"{count} finite numbers")


def _as_float(mapping: dict[str, Any]) -> dict[str, Any]:
    """Whole numbers in arrays of float32 become floats, because MessagePack tells them apart."""
    return {
        key: [float(each) for each in value]
        if (key in _REALS or key in _ACTUATORS) and (not value or type(value[0]) is not bool)
        else value
        for key, value in mapping.items()
    }


def _unpack(message: bytes) -> dict[Any, Any]:
    field = "LoLA message"
    try:
        found = msgpack.unpackb(message, use_list=False, strict_map_key=True)
    except (ValueError, TypeError, msgpack.UnpackException, RecursionError) as error:
        text = f"{type(error).__name__}: {error}"[:80]
        raise NaoGaitError(field, text, "a MessagePack map") from error
    if not isinstance(found, dict):
        raise NaoGaitError(field, type(found).__name__, "a map")
    if not all(isinstance(value, tuple) for value in found.values()):
        raise NaoGaitError(field, "a value that is no array", "a map of arrays")
    return found
