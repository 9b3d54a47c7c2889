"""LoLA's messages, byte for byte."""

import math
import random
import struct

import msgpack
import pytest

from lola_bridge.codec import (
    COMMAND_BYTES,
    JOINTS,
    SENSOR_BYTES,
    LolaCommand,
    LolaSensors,
    command_stream,
    decode_sensors,
    encode_command,
    encode_sensors,
    read_command,
)
from lola_frames import LIGHTS, sensors
from robot_core.errors import NaoGaitError

SENSOR_LENGTHS = {
    "Stiffness": 25, "Position": 25, "Temperature": 25, "Battery": 4, "Current": 25, "Status": 25,
    "Accelerometer": 3, "Gyroscope": 3, "Angles": 2, "Sonar": 2, "FSR": 8, "Touch": 14,
}  # fmt: skip


def text(value: str) -> bytes:
    return bytes((0xA0 | len(value),)) + value.encode()


def array(count: int) -> bytes:
    return bytes((0x90 | count,)) if count < 16 else struct.pack(">BH", 0xDC, count)


def reals(values: list[float]) -> bytes:
    """Float32 in big-endian order, as the specification of MessagePack has it."""
    return array(len(values)) + b"".join(struct.pack(">Bf", 0xCA, value) for value in values)


def commands_in(stream: bytes) -> list[LolaCommand]:
    """The commands in some bytes, as the robot reads them."""
    parser = command_stream()
    parser.feed(stream)
    return [read_command(each) for each in parser]


def test_a_sensor_message_is_these_896_bytes():
    frame = sensors()
    expected = bytes((0x8D,))
    for key, value in zip(SENSOR_LENGTHS, frame, strict=False):
        assert len(value) == SENSOR_LENGTHS[key]
        body = array(25) + bytes(value) if key == "Status" else reals(list(value))
        expected += text(key) + body
    expected += text("RobotConfig") + array(4) + b"".join(map(text, frame.robot_config))
    assert len(expected) == SENSOR_BYTES == 896
    assert encode_sensors(frame) == expected


def test_sensors_come_back_as_float32():
    frame = sensors(position=[0.1 * index for index in range(25)])
    found = decode_sensors(encode_sensors(frame))
    single = [struct.unpack("f", struct.pack("f", value))[0] for value in frame.position]
    assert list(found.position) == single
    assert found.robot_config == frame.robot_config
    assert encode_sensors(found) == encode_sensors(frame)


def test_a_whole_command_has_786_bytes():
    position = [0.01 * index for index in range(25)]
    command = LolaCommand(position, [1.0] * 25, (0.0, 1.0, 0.0), LIGHTS)
    message = encode_command(command)
    assert len(message) == COMMAND_BYTES == 786
    assert message.startswith(bytes((0x8B,)) + text("Position") + reals(position))
    assert text("Sonar") + bytes((0x92, 0xC3, 0xC2)) in message
    (again,) = commands_in(message)
    assert encode_command(again) == message


def test_a_command_may_leave_keys_out():
    message = encode_command(LolaCommand(None, [0.5] * 25))
    assert message == bytes((0x81,)) + text("Stiffness") + reals([0.5] * 25)
    (again,) = commands_in(message)
    assert again.position is None


def test_there_is_one_motor_for_both_hips():
    assert len(JOINTS) == len(set(JOINTS)) == 25
    assert "LHipYawPitch" in JOINTS
    assert "RHipYawPitch" not in JOINTS


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"position": [math.nan] * 25}, "Position"),
        ({"position": [0.0] * 24}, "Position"),
        ({"gyroscope": [1e39, 0.0, 0.0]}, "Gyroscope"),
        ({"status": [200] * 25}, "Status"),
    ],
)
def test_what_is_not_a_sensor_message_is_not_written(change: dict, field: str):
    with pytest.raises(NaoGaitError, match=f"LoLA {field}"):
        encode_sensors(sensors()._replace(**change))


@pytest.mark.parametrize(
    ("message", "reason"),
    [
        (b"", "0 bytes"),
        (encode_sensors(sensors())[:-1], "895 bytes"),
        (b"\xc1" * 896, "MessagePack"),
        (b"\x01" * 896, "MessagePack"),
        (encode_sensors(sensors()).replace(b"Gyroscope", b"Gyroscopy"), "Gyroscopy"),
        (encode_sensors(sensors()).replace(struct.pack(">f", -9.81), b"\x7f\xc0\x00\x00"),
         "Accelerometer"),
    ],
)  # fmt: skip
def test_another_map_is_refused_with_a_reason(message: bytes, reason: str):
    with pytest.raises(NaoGaitError, match=reason):
        decode_sensors(message)


def changed(good: bytes, rng: random.Random) -> bytes:
    """A message with random bytes at random places."""
    message = bytearray(good)
    for _ in range(rng.randint(1, 6)):
        message[rng.randrange(len(message))] = rng.randrange(256)
    return bytes(message)


def test_broken_sensors_are_refused_and_never_worse():
    """Bytes of good sensors, changed at random places: refused, or good sensors again."""
    rng, good = random.Random(0), encode_sensors(sensors())
    refused = 0
    for _ in range(1500):
        try:
            found = decode_sensors(changed(good, rng))
        except NaoGaitError:
            refused += 1
            continue
        again = encode_sensors(known(found))
        assert encode_sensors(decode_sensors(again)) == again
    assert 150 < refused < 1495


def known(found: LolaSensors) -> LolaSensors:
    """Sensors with 0 for what may be no number."""
    return found._replace(
        **{
            name: [each if math.isfinite(each) else 0.0 for each in getattr(found, name)]
            for name in ("stiffness", "position", "temperature", "current", "sonar", "fsr")
        }
    )


@pytest.mark.parametrize(
    ("key", "place", "taken"),
    [("Current", 24, True), ("Temperature", 3, True), ("FSR", 0, True), ("Position", 24, True),
     ("Position", 10, False), ("Gyroscope", 0, False), ("Touch", 0, False), ("Battery", 0, False)],
)  # fmt: skip
def test_what_no_walk_depends_on_may_be_no_number(key: str, place: int, taken: bool):
    content = msgpack.unpackb(encode_sensors(sensors()))
    content[key][place] = math.nan
    frame = msgpack.packb(content, use_single_float=True)
    if taken:
        decode_sensors(frame)
    else:
        with pytest.raises(NaoGaitError, match=f"LoLA {key}"):
            decode_sensors(frame)


def test_broken_commands_are_refused_and_never_worse():
    """Bytes of a good command, changed at random places: refused, or good commands again."""
    rng = random.Random(0)
    good = encode_command(LolaCommand([0.0] * 25, [1.0] * 25, (0.0, 1.0, 0.0), LIGHTS))
    refused = 0
    for _ in range(1500):
        try:
            found = commands_in(changed(good, rng))
        except (NaoGaitError, ValueError):
            refused += 1
            continue
        for each in found:
            again = encode_command(each)
            assert list(map(encode_command, commands_in(again))) == [again]
    assert 150 < refused < 1495


def test_a_stream_gives_commands_in_any_pieces():
    rng = random.Random(1)
    commands = [LolaCommand([0.01 * index] * 25, [1.0] * 25) for index in range(20)]
    stream, parser = b"".join(map(encode_command, commands)), command_stream()
    found = []
    while stream:
        size = rng.randint(1, 400)
        parser.feed(stream[:size])
        stream = stream[size:]
        found += [read_command(each) for each in parser]
    assert [round(each.position[0], 4) for each in found] == [
        round(each.position[0], 4) for each in commands
    ]


@pytest.mark.parametrize(
    "found", [3, [1, 2], {"Position": 1}, {"Tail": (0.0,)}, {"Sonar": (1.0, 0.0)}, {1: (0.0,)}]
)
def test_what_is_not_a_command_is_refused(found: object):
    with pytest.raises(NaoGaitError, match="LoLA"):
        read_command(found)
