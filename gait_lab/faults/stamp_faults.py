"""Faults of the stamps of sensor messages."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from gait_lab.faults.channel import Message
from gait_lab.faults.fault import Fault, Late, Spell
from gait_lab.faults.harness import Harness
from nao_lipm_gait.runtime.inputs import ImuInput, JointInput, TwistInput

_SECOND = 1_000_000_000


def shifted(message: Message, nanoseconds: int) -> Message:
    """The same message with another stamp, not before 0."""
    content = message.content
    if isinstance(content, TwistInput):
        return message
    stamp = content.sec * _SECOND + content.nanosec + nanoseconds
    sec, nanosec = divmod(max(0, stamp), _SECOND)
    return replace(message, content=replace(content, sec=sec, nanosec=nanosec))


class Repeated(Fault):
    """Messages come twice or more often."""

    summary = "sensor messages come twice or three times, 5 to 50 % of them"

    def __init__(self, random: np.random.Generator) -> None:
        super().__init__(random)
        self._share = float(random.uniform(0.05, 0.5))

    def sensors(self, stage: Harness, message: Message) -> Iterable[Late]:
        yield 0, message
        if self.now(stage) and self.random.uniform() < self._share:
            for _ in range(int(self.random.integers(1, 3))):
                yield int(self.random.integers(0, 4)), message


class Reordered(Fault):
    """Some messages are overtaken by later ones."""

    summary = "sensor messages are overtaken by one to five later ones, 2 to 20 % of them"

    def __init__(self, random: np.random.Generator) -> None:
        super().__init__(random)
        self._share = float(random.uniform(0.02, 0.2))

    def sensors(self, stage: Harness, message: Message) -> Iterable[Late]:
        late = self.now(stage) and self.random.uniform() < self._share
        yield int(self.random.integers(1, 6)) if late else 0, message


class Outliers(Spell):
    """Single messages with a stamp from another time."""

    summary = "stamps that are off by 0.1 to 1000 s, in 5 to 30 % of the sensor messages"

    def __init__(self, random: np.random.Generator) -> None:
        super().__init__(random)
        self._share = float(random.uniform(0.05, 0.3))

    def sensors(self, stage: Harness, message: Message) -> Iterable[Late]:
        if self.now(stage) and self.random.uniform() < self._share:
            size = 10.0 ** float(self.random.uniform(-1.0, 3.0))
            sign = int(self.random.choice((-1, 1)))
            message = shifted(message, sign * round(size * 1e9))
        yield 0, message


class Jitter(Fault):
    """Stamps that are not those of the measurement."""

    summary = "stamps are off by up to 1 to 4.5 ms, to and fro, those of one instant alike"

    def __init__(self, random: np.random.Generator) -> None:
        super().__init__(random)
        self._size = float(random.uniform(1e6, 4.5e6))
        self._instant, self._shift = -1, 0

    def sensors(self, stage: Harness, message: Message) -> Iterable[Late]:
        if self.now(stage):
            if stage.tick != self._instant:
                self._instant = stage.tick
                self._shift = round(self.random.uniform(-self._size, self._size))
            message = shifted(message, self._shift)
        yield 0, message


class Jump(Fault):
    """The clock of the sensors jumps and goes on from there."""

    summary = "the clock of the sensors jumps by 0.02 to 100 s, ahead or back, and goes on"
    why = "up to 0.2 s ahead look like lost messages, and the walk goes on with what was not lost."

    def __init__(self, random: np.random.Generator) -> None:
        super().__init__(random)
        size = 10.0 ** float(random.uniform(-1.7, 2.0))
        self._shift = int(random.choice((-1, 1))) * round(size * 100.0) * 10_000_000

    def sensors(self, stage: Harness, message: Message) -> Iterable[Late]:
        if self.now(stage) and isinstance(message.content, JointInput | ImuInput):
            # Clocks begin anew, they do not go below zero.
            message = shifted(message, max(self._shift, -round(self.begin * 0.9e9)))
        yield 0, message
