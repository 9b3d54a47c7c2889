"""Random valid and invalid LoLA messages, both ways: into the bridge and into the robot."""

import random
from dataclasses import dataclass

import numpy as np

from gait_lab.faults.fuzz_messages import LOLA, FuzzRun
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
"""Share of the frames and commands with changed bytes."""
ROUNDING = 1e-6
"""[rad] of a float32."""
_EVIDENCE = 20
_CONFIG = RobotConfig("P0000000S00S00S00000", "6.0.0", "P0000000S00S00S00000", "6.0.0")


@dataclass(frozen=True, slots=True)
class LolaFuzzResult:
    """Result of a run.

    Attributes:
        run: The run; each tick has a message each way.
        refused: Messages that were refused.
        violations: Commands beyond a limit or the size, and exceptions; the first 20.
    """

    run: FuzzRun
    refused: int
    violations: tuple[str, ...]


class LolaFuzzer:
    """A robot that sends good and broken frames, and a gait that sends good and absurd commands.

    Args:
        seed: Seed of all random choices.
    """

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self.random = random.Random(seed)
        robot = load_robot("nao_v6")
        joints = JointMap(robot)
        lower, upper, speed = joints.limits()
        self._lower, self._upper = np.array(lower), np.array(upper)
        self._step = np.array(speed) * PERIOD
        self._stand = joints.from_gait(robot.stand_pose)
        self._safety = Safety(SafetySettings(
            PERIOD, 0.12, 0.06, 0.12, lower, upper, speed, joints.driven,
            joints.from_gait(sitting_pose(robot)),
        ))  # fmt: skip
        self._refused = 0
        self._violations: list[str] = []
        self._before: LolaCommand | None = None

    def run(self, frames: int) -> LolaFuzzResult:
        """Send so many messages each way."""
        for index in range(frames):
            try:
                self._to_bridge()
                self._to_robot()
            except Exception as error:
                self._violation(f"message {index}: {type(error).__name__}: {error}")
        run = FuzzRun(LOLA, self._seed, frames)
        return LolaFuzzResult(run, self._refused, tuple(self._violations))

    def _violation(self, text: str) -> None:
        if len(self._violations) < _EVIDENCE:
            self._violations.append(text)

    def _broken(self, message: bytes) -> bytes:
        """The message, or some of its bytes changed, cut off or added."""
        if self.random.random() > BAD_SHARE:
            return message
        changed = bytearray(message)
        for _ in range(self.random.randint(1, 8)):
            changed[self.random.randrange(len(changed))] = self.random.randrange(256)
        kind = self.random.random()
        if kind < 0.1:
            return bytes(changed[: self.random.randrange(len(changed))])
        return bytes(changed + b"\0" * 9) if kind < 0.2 else bytes(changed)

    def _number(self, size: float) -> float:
        choice = self.random.random()
        if choice < 0.8:
            return self.random.uniform(-size, size)
        return self.random.choice((0.0, 1e30, -1e30, 1e-40, 3.4e38))

    def _frame(self) -> LolaSensors:
        number = self._number
        return LolaSensors(
            stiffness=[number(1.0)] * 25, position=[number(2.0) for _ in range(25)],
            temperature=[number(60.0)] * 25, battery=[abs(number(1.0)), number(3.0), 0.0, 30.0],
            current=[number(1.0)] * 25, status=[self.random.randrange(4)] * 25,
            accelerometer=[number(10.0)] * 3, gyroscope=[number(2.0)] * 3,
            angles=[number(0.5)] * 2, sonar=[number(2.0)] * 2, fsr=[number(3.0)] * 8,
            touch=[float(self.random.random() < 0.02) for _ in range(14)], robot_config=_CONFIG,
        )  # fmt: skip

    def _to_bridge(self) -> None:
        """A frame, and what the bridge answers to it."""
        sensors: LolaSensors | None = None
        try:
            sensors = decode_sensors(self._broken(encode_sensors(self._frame())))
        except NaoGaitError:
            self._refused += 1
        command = self._command() if self.random.random() < 0.8 else None
        sent = self._safety.step(sensors, command)
        message = encode_command(LolaCommand(sent.position, sent.stiffness, (0.0, 0.0, 0.0)))
        self._check(message)

    def _command(self) -> JointCommand | None:
        """A command as it comes from the node."""
        position, stiffness = ([self._number(size) for _ in range(25)] for size in (2.0, 1.5))
        try:
            return unpack_command(self._broken(pack_command(0, position, stiffness)))[1]
        except NaoGaitError:
            self._refused += 1
            return None

    def _check(self, message: bytes) -> None:
        if len(message) > COMMAND_BYTES:
            self._violation(f"{len(message)} bytes")
        parser = command_stream()
        parser.feed(message)
        (found,) = map(read_command, parser)
        position, stiffness = np.array(found.position), np.array(found.stiffness)
        if (position < self._lower - ROUNDING).any() or (position > self._upper + ROUNDING).any():
            self._violation(f"position {position.tolist()}")
        if (stiffness < 0.0).any() or (stiffness > 1.0).any():
            self._violation(f"stiffness {stiffness.tolist()}")
        if self._before is not None:
            held = (stiffness > 0.06) & (np.array(self._before.stiffness) > 0.06)
            step = np.abs(position - np.array(self._before.position))
            if (step[held] > self._step[held] + ROUNDING).any():
                self._violation(f"step {step.tolist()}")
        self._before = found

    def _to_robot(self) -> None:
        """A command as it comes out of a broken stream."""
        command = LolaCommand(self._stand, [1.0] * 25, (0.0, 1.0, 0.0))
        parser = command_stream()
        try:
            parser.feed(self._broken(encode_command(command)))
            for found in parser:
                read_command(found)
        except ValueError:  # of MessagePack, or a NaoGaitError
            self._refused += 1
