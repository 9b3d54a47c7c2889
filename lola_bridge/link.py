"""What the driver process and the node say to each other, one packet each.

The driver listens at a name in Linux's abstract socket namespace that belongs to LoLA's socket.
"""

import hashlib
import math
import os
import struct
from collections.abc import Sequence
from typing import NamedTuple

from lola_bridge.codec import JOINTS, SENSOR_BYTES
from lola_bridge.safety import JointCommand, Mode
from robot_core.errors import NaoGaitError
from robot_core.log import Level, LogLine

_MODES = tuple(Mode)
_FRAME = struct.Struct("<cqBIIIff")
_COMMAND = struct.Struct(f"<cq{len(JOINTS)}f{len(JOINTS)}f")
PACKET_BYTES = _FRAME.size + SENSOR_BYTES
"""Size of the largest packet."""


FRAME, LOG = b"F", b"L"
"""First byte of a packet of the driver: a frame of LoLA, a line for the log."""
SETTINGS, COMMAND, END = b"S", b"C", b"E"
"""First byte of a packet of the node: its settings as JSON, a command, its end."""


def address(lola: str) -> str:
    """Where the driver of LoLA's socket at a path listens."""
    digest = hashlib.sha256(os.path.abspath(lola).encode()).hexdigest()  # names are short there
    return f"\0lola_bridge_{digest[:32]}"


class DriverStatus(NamedTuple):
    """How the driver is doing.

    Attributes:
        mode: What it does with the robot.
        frames: Frames since the start.
        repeated: Frames that were answered with the last command again.
        late: Frames that were answered more than a period after they arrived.
        answer_median: [s] from the arrival of a frame to its answer, over the last second.
        answer_worst: [s] the same, the largest.
    """

    mode: Mode
    frames: int
    repeated: int
    late: int
    answer_median: float
    answer_worst: float


class SensorPacket(NamedTuple):
    """A sensor message.

    Attributes:
        stamp: [ns]
        status: State of the driver.
        sensors: Bytes of the message.
    """

    stamp: int
    status: DriverStatus
    sensors: bytes


def pack_frame(frame: SensorPacket) -> bytes:
    """Driver to node: a frame."""
    mode, *rest = frame.status
    return _FRAME.pack(FRAME, frame.stamp, _MODES.index(mode), *rest) + frame.sensors


def pack_log(line: LogLine) -> bytes:
    """Driver to node: a line for the log."""
    return LOG + bytes((line.level,)) + line.text.encode()[: PACKET_BYTES - 2]


def unpack_from_driver(packet: bytes) -> SensorPacket | LogLine:
    """Read a packet of the driver.

    Raises:
        NaoGaitError: It is none, as those of a driver of another version.
    """
    try:
        return _unpacked(packet)
    except (struct.error, ValueError, IndexError) as error:
        text = f"{len(packet)} bytes that begin with {packet[:1]!r}"
        allowed = f"a packet of this version ({error})"
        raise NaoGaitError("driver", text, allowed) from error


def _unpacked(packet: bytes) -> SensorPacket | LogLine:
    if packet[:1] == LOG:
        return LogLine(Level(packet[1]), packet[2:].decode(errors="replace"))
    kind, stamp, mode, *rest = _FRAME.unpack_from(packet)
    if kind != FRAME:
        raise ValueError("its kind is unknown")
    return SensorPacket(stamp, DriverStatus(_MODES[mode], *rest), packet[_FRAME.size :])


def pack_command(stamp: int, position: Sequence[float], stiffness: Sequence[float]) -> bytes:
    """Node to driver: a command that answers the frame of `stamp` [ns]."""
    return _COMMAND.pack(COMMAND, stamp, *position, *stiffness)


def unpack_command(packet: bytes) -> tuple[int, JointCommand]:
    """Stamp [ns] and command of a packet of the node.

    Raises:
        NaoGaitError: A number is not finite, or the packet is none.
    """
    if len(packet) != _COMMAND.size:
        raise NaoGaitError("command", f"{len(packet)} bytes", f"{_COMMAND.size} bytes")
    _, stamp, *values = _COMMAND.unpack(packet)
    count = len(JOINTS)
    for index, value in enumerate(values):
        if not math.isfinite(value):
            what = "position" if index < count else "stiffness"
            raise NaoGaitError(f"command {what}[{JOINTS[index % count]}]", value, "a finite number")
    return stamp, JointCommand(values[:count], values[count:])
