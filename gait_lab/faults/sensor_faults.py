"""Faults of the robot's sensors."""

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from gait_lab.faults.channel import Message
from gait_lab.faults.fault import Fault, Late, Spell
from gait_lab.faults.harness import Harness
from nao_lipm_gait.runtime.controller import Settings
from nao_lipm_gait.runtime.inputs import ImuInput, JointInput

JOINTS = 1000
"""More than a robot has: a joint is drawn before its robot is known."""


class Silence(Spell):
    summary = "no sensor message at all for 0.05 to 2 s"
    why = (
        "the robot stands on one leg with its last targets for longer than a step, "
        "and nobody computes."
    )

    def sensors(self, stage: Harness, message: Message) -> Iterable[Late]:
        if not self.now(stage):
            yield 0, message


class Frozen(Spell):
    """All numbers stay as they are, or those of the joints, or those of the IMU."""

    summary = "numbers of joints, IMU or both stand still for 0.05 to 2 s, stamps go on"
    why = (
        "an IMU that is stuck while the robot turns is believed until joints have "
        "moved by 0.02 rad and it has said the same ten times."
    )

    def __init__(self, random: np.random.Generator) -> None:
        super().__init__(random)
        self._kinds = ((JointInput,), (ImuInput,), (JointInput, ImuInput))[random.integers(3)]
        self._kept: dict[type, JointInput | ImuInput] = {}

    def sensors(self, stage: Harness, message: Message) -> Iterable[Late]:
        content = message.content
        if not isinstance(content, self._kinds) or not self.now(stage):
            self._kept.pop(type(content), None)
            yield 0, message
            return
        kept = self._kept.setdefault(type(content), content)
        yield 0, replace(message, content=replace(kept, sec=content.sec, nanosec=content.nanosec))


class JointDropout(Spell):
    """One joint is missing, or reads zero, or stays where it was."""

    summary = "one joint is left out, reads 0 or stands still for 0.05 to 2 s"
    why = "a single leg joint that is stuck is believed."

    def __init__(self, random: np.random.Generator) -> None:
        super().__init__(random)
        self._joint = int(random.integers(JOINTS))
        self._kind = ("missing", "zero", "stuck")[random.integers(3)]
        self._value: float | None = None

    def sensors(self, stage: Harness, message: Message) -> Iterable[Late]:
        content = message.content
        if not isinstance(content, JointInput) or not self.now(stage):
            yield 0, message
            return
        names, position, velocity = (
            list(content.names), list(content.position), list(content.velocity)
        )  # fmt: skip
        place = self._joint % len(names)
        if self._kind == "missing":
            for column in (names, position, velocity):
                del column[place]
        else:
            if self._value is None:
                self._value = 0.0 if self._kind == "zero" else position[place]
            position[place], velocity[place] = self._value, 0.0
        yield 0, replace(message, content=replace(
            content, names=names, position=position, velocity=velocity))  # fmt: skip


class NotANumber(Spell):
    """NaN or infinity in one field, in some messages."""

    summary = "NaN or infinity in joints or IMU, in 5 to 100 % of the messages for 0.05 to 2 s"
    why = "without a gyro for most of a second, while the walk comes to its end."

    def __init__(self, random: np.random.Generator) -> None:
        super().__init__(random)
        self._share = float(random.uniform(0.05, 1.0))
        self._joints = bool(random.integers(2))

    def sensors(self, stage: Harness, message: Message) -> Iterable[Late]:
        content = message.content
        hit = self.now(stage) and self.random.uniform() < self._share
        bad = (math.nan, math.inf, -math.inf)[self.random.integers(3)]
        if hit and isinstance(content, JointInput) and self._joints:
            position = list(content.position)
            position[self.random.integers(len(position))] = bad
            message = replace(message, content=replace(content, position=position))
        elif hit and isinstance(content, ImuInput) and not self._joints:
            x, y, _ = content.angular_velocity
            message = replace(message, content=replace(content, angular_velocity=(x, y, bad)))
        yield 0, message


class Spikes(Fault):
    """Single wrong numbers, large and small ones, that are no NaN."""

    summary = "joints wrong by 0.1 to 2 rad, gyro and acceleration too, in 1 to 10 % of messages"
    why = "wrong numbers below the limits of belief reach the ankles by the gyro's feedback."

    def __init__(self, random: np.random.Generator) -> None:
        super().__init__(random)
        self._share = float(random.uniform(0.01, 0.1))

    def sensors(self, stage: Harness, message: Message) -> Iterable[Late]:
        content = message.content
        if self.now(stage) and self.random.uniform() < self._share:
            size = float(self.random.choice((-1.0, 1.0)) * self.random.uniform(0.1, 2.0))
            if isinstance(content, JointInput):
                position = list(content.position)
                position[self.random.integers(len(position))] += size
                message = replace(message, content=replace(content, position=position))
            elif isinstance(content, ImuInput):
                x, y, z = content.angular_velocity
                a, b, c = content.linear_acceleration
                turned = (x + 10.0 * size, y - 10.0 * size, z)
                forced = (a + 40.0 * size, b, c + 40.0 * size)
                message = replace(message, content=replace(
                    content, angular_velocity=turned, linear_acceleration=forced))  # fmt: skip
        yield 0, message


class BiasJump(Fault):
    """An encoder slips, or the gyro gets another offset, and stays so."""

    summary = "from now on one leg joint is off by up to 3 deg, or the gyro by up to 0.1 rad/s"
    why = "degrees at a hip or an ankle, or of the gyro, tilt the robot faster than is learned."

    def __init__(self, random: np.random.Generator) -> None:
        super().__init__(random)
        self._joint = int(random.integers(JOINTS))
        self._angle = float(random.uniform(-0.052, 0.052))
        self._rate = random.uniform(-0.1, 0.1, 2).tolist()
        self._gyro = bool(random.integers(2))

    def sensors(self, stage: Harness, message: Message) -> Iterable[Late]:
        content = message.content
        if self.now(stage):
            if isinstance(content, JointInput) and not self._gyro:
                position = list(content.position)
                position[self._joint % len(position)] += self._angle
                message = replace(message, content=replace(content, position=position))
            elif isinstance(content, ImuInput) and self._gyro:
                x, y, z = content.angular_velocity
                rate = (x + self._rate[0], y + self._rate[1], z)
                message = replace(message, content=replace(content, angular_velocity=rate))
        yield 0, message


class ImuOutage(Spell):
    """Shorter and longer ones, and half of them without end."""

    summary = "no IMU message for 0.05 s to the end"
    longest = 20.0

    def sensors(self, stage: Harness, message: Message) -> Iterable[Late]:
        if not (isinstance(message.content, ImuInput) and self.now(stage)):
            yield 0, message


class ImuGone(ImuOutage):
    summary = "no IMU from now on; 9 s"
    end = 12.0

    def now(self, stage: Harness) -> bool:
        return stage.seconds() >= self.begin


class ImuIgnored(ImuGone):
    """Not the gait as it is: what it would be to walk on."""

    summary = "the same, and the gait is told to walk on"
    settings = Settings(imu_patience=1e6)
