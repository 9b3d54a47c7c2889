"""Fuzzing of the LoLA messages, both ways: into the bridge and into the robot."""

import random
from dataclasses import dataclass

import numpy as np
from hypothesis import strategies as st

from lola_bridge.codec import (
    COMMAND_BYTES,
    LolaCommand,
    LolaSensors,
    RobotConfig,
    command_stream,
    decode_sensors,
    encode_command,
    encode_sensors,
    read_command,
)
from lola_bridge.joints import JointMap, sitting_pose
from lola_bridge.link import pack_command, unpack_command
from lola_bridge.safety import JointCommand, Safety, SafetySettings
from robot_core.errors import NaoGaitError
from robot_core.robot import load_robot

PERIOD = 0.012
BAD_SHARE = 0.3
"""Share of the messages with changed bytes."""
ROUNDING = 1e-6
"""[rad] of a float32."""
LIMP = 0.06
"""Stiffness up to which a joint may move at any speed."""
ROBOT = load_robot("nao_v6")
JOINTS = JointMap(ROBOT)
LOWER, UPPER, SPEED = map(np.array, JOINTS.limits())
CONFIG = RobotConfig("P0000000S00S00S00000", "6.0.0", "P0000000S00S00S00000", "6.0.0")


@dataclass(frozen=True, slots=True)
class Example:
    """What is sent in a stretch of messages.

    Attributes:
        damage: Changed bytes as (place, byte), the share of a message that is kept, and how many
            bytes are added; each damages many messages.
    """

    seed: int
    numbers: list[float]
    damage: list[tuple[list[tuple[int, int]], float, int]]


EXAMPLES = st.builds(
    Example, st.integers(0, 2**32), st.lists(st.floats(width=32)),
    st.lists(st.tuples(
        st.lists(st.tuples(st.integers(0, 2**16), st.integers(0, 255)), max_size=8),
        st.one_of(st.just(1.0), st.floats(0.0, 1.0)), st.sampled_from((0, 9)),
    )),
)  # fmt: skip


def run(example: Example, frames: int) -> tuple[int, int]:
    """Run an example; the numbers of commands sent and of refusals. Raises AssertionError."""
    rig = Rig(example)
    for _ in range(frames):
        rig.to_bridge()
        rig.to_robot()
    return frames, rig.refused


class Rig:
    """A robot that sends good and damaged frames, and a gait that sends absurd commands."""

    def __init__(self, example: Example) -> None:
        self._example = example
        self._random = random.Random(example.seed)
        lower, upper, speed = JOINTS.limits()
        sit = JOINTS.from_gait(sitting_pose(ROBOT))
        self._safety = Safety(SafetySettings(
            PERIOD, 0.12, 0.06, 0.12, lower, upper, speed, JOINTS.driven, sit
        ))  # fmt: skip
        self._stand = LolaCommand(JOINTS.from_gait(ROBOT.stand_pose), [1.0] * 25, (0.0, 1.0, 0.0))
        self._position, self._stiffness = np.zeros(25), np.zeros(25)
        self.refused = 0

    def to_bridge(self) -> None:
        """A frame and a command, and what the bridge answers to the robot."""
        sensors: LolaSensors | None = None
        command: JointCommand | None = None
        try:
            sensors = decode_sensors(self._damaged(encode_sensors(self._frame())))
        except NaoGaitError:
            self.refused += 1
        if self._random.random() < 0.8:
            position, stiffness = ([self._number(s) for _ in range(25)] for s in (2.0, 1.5))
            try:
                packet = self._damaged(pack_command(0, position, stiffness))
                command = unpack_command(packet)[1]
            except NaoGaitError:
                self.refused += 1
        sent = self._safety.step(sensors, command)
        self._check(encode_command(LolaCommand(sent.position, sent.stiffness, (0.0,) * 3)))

    def to_robot(self) -> None:
        """A command as it comes out of a damaged stream."""
        parser = command_stream()
        try:
            parser.feed(self._damaged(encode_command(self._stand)))
            for found in parser:
                read_command(found)
        except ValueError:  # of MessagePack, or a NaoGaitError
            self.refused += 1

    def _check(self, message: bytes) -> None:
        """The size, the limits of angles and stiffness, and the speed of stiff joints."""
        if len(message) > COMMAND_BYTES:
            raise AssertionError(f"{len(message)} bytes")
        parser = command_stream()
        parser.feed(message)
        (found,) = map(read_command, parser)
        position, stiffness = np.array(found.position), np.array(found.stiffness)
        inside = (position >= LOWER - ROUNDING) & (position <= UPPER + ROUNDING)
        if not inside.all():
            raise AssertionError(f"position {position.tolist()}")
        if not ((stiffness >= 0.0) & (stiffness <= 1.0)).all():
            raise AssertionError(f"stiffness {stiffness.tolist()}")
        held = (stiffness > LIMP) & (self._stiffness > LIMP)
        quick = np.abs(position - self._position) > SPEED * PERIOD + ROUNDING
        if (held & quick).any():
            raise AssertionError(f"from {self._position.tolist()} to {position.tolist()}")
        self._position, self._stiffness = position, stiffness

    def _damaged(self, message: bytes) -> bytes:
        """The message, or some of its bytes changed, cut off or added."""
        if not self._example.damage or self._random.random() > BAD_SHARE:
            return message
        bytes_, share, added = self._random.choice(self._example.damage)
        changed = bytearray(message)
        for place, byte in bytes_:
            changed[place % len(changed)] = byte
        return bytes(changed[: round(share * len(changed))]) + b"\0" * added

    def _number(self, size: float) -> float:
        if self._example.numbers and self._random.random() < 0.2:
            return self._random.choice(self._example.numbers)
        return self._random.uniform(-size, size)

    def _frame(self) -> LolaSensors:
        number = self._number
        return LolaSensors(
            stiffness=[number(1.0)] * 25, position=[number(2.0) for _ in range(25)],
            temperature=[number(60.0)] * 25, battery=[abs(number(1.0)), number(3.0), 0.0, 30.0],
            current=[number(1.0)] * 25, status=[self._random.randrange(4)] * 25,
            accelerometer=[number(10.0)] * 3, gyroscope=[number(2.0)] * 3,
            angles=[number(0.5)] * 2, sonar=[number(2.0)] * 2, fsr=[number(3.0)] * 8,
            touch=[float(self._random.random() < 0.02) for _ in range(14)], robot_config=CONFIG,
        )  # fmt: skip
