"""Faults of the joint encoders and of the IMU."""

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from gait_lab.faults.harness import Fault, Harness, TemporaryFault, Timed
from gait_lab.faults.messages import Delivery, Message
from nao_lipm_gait.runtime.controller import ControllerSettings
from nao_lipm_gait.runtime.inputs import ImuInput, JointInput

JOINTS = 1000
"""Range of drawn joint numbers; taken modulo the number of joints, unknown when drawn."""


class Silence(TemporaryFault):
    """No sensor message at all for 0.05 to 2 s."""

    why = (
        "the robot holds its last targets, on one leg, for longer than a step, and the gait "
        "does not tick."
    )

    def on_sensor(self, harness: Harness, message: Message) -> Iterable[Delivery[Message]]:
        """Drop every sensor message."""
        if not self.active(harness):
            yield Delivery(0, message)


class Frozen(TemporaryFault):
    """Values of joints, IMU or both freeze for 0.05 to 2 s, stamps continue."""

    why = (
        "a frozen IMU is detected only after ten equal values during which the joints "
        "moved by 0.02 rad."
    )

    def _draw(self, random: np.random.Generator) -> None:
        self._frozen = ((JointInput,), (ImuInput,), (JointInput, ImuInput))[random.integers(3)]
        self._values: dict[type, JointInput | ImuInput] = {}

    def on_sensor(self, harness: Harness, message: Message) -> Iterable[Delivery[Message]]:
        """Replace the values by the first ones of the fault."""
        content = message.content
        if not isinstance(content, self._frozen) or not self.active(harness):
            self._values.pop(type(content), None)
            yield Delivery(0, message)
            return
        frozen = self._values.setdefault(type(content), content)
        frozen = replace(frozen, sec=content.sec, nanosec=content.nanosec)
        yield Delivery(0, replace(message, content=frozen))


class JointDropout(TemporaryFault):
    """One joint is missing, reads 0 or freezes for 0.05 to 2 s."""

    why = "a single frozen leg joint is not detected."

    def _draw(self, random: np.random.Generator) -> None:
        self._joint = int(random.integers(JOINTS))
        self._kind = ("missing", "zero", "stuck")[random.integers(3)]
        self._value: float | None = None

    def on_sensor(self, harness: Harness, message: Message) -> Iterable[Delivery[Message]]:
        """Remove or replace the values of the joint."""
        content = message.content
        if not isinstance(content, JointInput) or not self.active(harness):
            yield Delivery(0, message)
            return
        names, position = list(content.names), list(content.position)
        place = self._joint % len(names)
        if self._kind == "missing":
            del names[place], position[place]
        else:
            if self._value is None:
                self._value = 0.0 if self._kind == "zero" else position[place]
            position[place] = self._value
        content = replace(content, names=names, position=position)
        yield Delivery(0, replace(message, content=content))


class NotANumber(TemporaryFault):
    """NaN or infinity in 5 to 100 % of the joint or IMU messages for 0.05 to 2 s."""

    why = "no gyro for most of a second, while the robot stops."

    def _draw(self, random: np.random.Generator) -> None:
        self._share = float(random.uniform(0.05, 1.0))
        self._joints = bool(random.integers(2))

    def on_sensor(self, harness: Harness, message: Message) -> Iterable[Delivery[Message]]:
        """Replace one value in some messages."""
        content = message.content
        hit = self.active(harness) and self.random.uniform() < self._share
        bad = (math.nan, math.inf, -math.inf)[self.random.integers(3)]
        if hit and isinstance(content, JointInput) and self._joints:
            position = list(content.position)
            position[self.random.integers(len(position))] = bad
            message = replace(message, content=replace(content, position=position))
        elif hit and isinstance(content, ImuInput) and not self._joints:
            x, y, _ = content.angular_velocity
            message = replace(message, content=replace(content, angular_velocity=(x, y, bad)))
        yield Delivery(0, message)


class Spikes(Fault):
    """1 to 10 % of the messages with a joint, gyro and acceleration error (0.1 to 2 rad)."""

    why = "errors below the validation limits reach the ankles through the gyro feedback."

    def _draw(self, random: np.random.Generator) -> None:
        self._share = float(random.uniform(0.01, 0.1))

    def on_sensor(self, harness: Harness, message: Message) -> Iterable[Delivery[Message]]:
        """Add an error to some messages."""
        content = message.content
        if self.active(harness) and self.random.uniform() < self._share:
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
        yield Delivery(0, message)


class BiasJump(Fault):
    """A permanent error of one joint (up to 3 deg) or of the gyro (up to 0.1 rad/s)."""

    why = "the error tilts the robot faster than the estimators adapt."

    def _draw(self, random: np.random.Generator) -> None:
        self._joint = int(random.integers(JOINTS))
        self._angle = float(random.uniform(-0.052, 0.052))
        self._rate = random.uniform(-0.1, 0.1, 2).tolist()
        self._gyro = bool(random.integers(2))

    def on_sensor(self, harness: Harness, message: Message) -> Iterable[Delivery[Message]]:
        """Add the constant error."""
        content = message.content
        if self.active(harness):
            if isinstance(content, JointInput) and not self._gyro:
                position = list(content.position)
                position[self._joint % len(position)] += self._angle
                message = replace(message, content=replace(content, position=position))
            elif isinstance(content, ImuInput) and self._gyro:
                x, y, z = content.angular_velocity
                rate = (x + self._rate[0], y + self._rate[1], z)
                message = replace(message, content=replace(content, angular_velocity=rate))
        yield Delivery(0, message)


class ImuOutage(TemporaryFault):
    """No IMU message for 0.05 s or longer, up to the end."""

    span = (0.05, 20.0)

    def on_sensor(self, harness: Harness, message: Message) -> Iterable[Delivery[Message]]:
        """Drop every IMU message."""
        if not (isinstance(message.content, ImuInput) and self.active(harness)):
            yield Delivery(0, message)


class ImuGone(ImuOutage):
    """No IMU message for the last 9 s."""

    end = 12.0

    def active(self, harness: Timed) -> bool:
        """Whether the fault acts: from `begin` on."""
        return harness.seconds() >= self.begin


class ImuIgnored(ImuGone):
    """The same, with a gait that does not stop without an IMU."""

    settings = ControllerSettings(imu_patience=1e6)
