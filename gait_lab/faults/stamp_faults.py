"""Faults of the order and the time stamps of sensor messages."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from gait_lab.faults.harness import Fault, Harness, TemporaryFault
from gait_lab.faults.messages import Delivery, Message
from nao_lipm_gait.runtime.inputs import ImuInput, JointInput, TwistInput

_SECOND = 1_000_000_000


def shifted(message: Message, nanoseconds: int) -> Message:
    """Return a sensor message with its stamp shifted, not below 0; other messages unchanged."""
    content = message.content
    if isinstance(content, TwistInput):
        return message
    stamp = content.sec * _SECOND + content.nanosec + nanoseconds
    sec, nanosec = divmod(max(0, stamp), _SECOND)
    return replace(message, content=replace(content, sec=sec, nanosec=nanosec))


class Repeated(Fault):
    """5 to 50 % of the sensor messages arrive twice or three times."""

    def _draw(self, random: np.random.Generator) -> None:
        self._share = float(random.uniform(0.05, 0.5))

    def on_sensor(self, harness: Harness, message: Message) -> Iterable[Delivery[Message]]:
        """Repeat some messages."""
        yield Delivery(0, message)
        if self.active(harness) and self.random.uniform() < self._share:
            for _ in range(int(self.random.integers(1, 3))):
                yield Delivery(int(self.random.integers(0, 4)), message)


class Reordered(Fault):
    """2 to 20 % of the sensor messages arrive 1 to 5 ticks late, out of order."""

    def _draw(self, random: np.random.Generator) -> None:
        self._share = float(random.uniform(0.02, 0.2))

    def on_sensor(self, harness: Harness, message: Message) -> Iterable[Delivery[Message]]:
        """Delay some messages past later ones."""
        late = self.active(harness) and self.random.uniform() < self._share
        yield Delivery(int(self.random.integers(1, 6)) if late else 0, message)


class Outliers(TemporaryFault):
    """The stamps of 5 to 30 % of the sensor messages are wrong by 0.1 to 1000 s."""

    def _draw(self, random: np.random.Generator) -> None:
        self._share = float(random.uniform(0.05, 0.3))

    def on_sensor(self, harness: Harness, message: Message) -> Iterable[Delivery[Message]]:
        """Shift the stamps of some messages."""
        if self.active(harness) and self.random.uniform() < self._share:
            size = 10.0 ** float(self.random.uniform(-1.0, 3.0))
            sign = int(self.random.choice((-1, 1)))
            message = shifted(message, sign * round(size * 1e9))
        yield Delivery(0, message)


class Jitter(Fault):
    """Random stamp errors, at most 1 to 4.5 ms, equal within one tick."""

    def _draw(self, random: np.random.Generator) -> None:
        self._size = float(random.uniform(1e6, 4.5e6))
        self._shifted_tick, self._shift = -1, 0

    def on_sensor(self, harness: Harness, message: Message) -> Iterable[Delivery[Message]]:
        """Shift the stamp by the error of this tick."""
        if self.active(harness):
            if harness.tick != self._shifted_tick:
                self._shifted_tick = harness.tick
                self._shift = round(self.random.uniform(-self._size, self._size))
            message = shifted(message, self._shift)
        yield Delivery(0, message)


class Jump(Fault):
    """The sensor clock jumps once by 0.02 to 100 s, forward or back."""

    why = "a jump of up to 0.2 s forward looks like lost messages, and the walk continues."

    def _draw(self, random: np.random.Generator) -> None:
        size = 10.0 ** float(random.uniform(-1.7, 2.0))
        self._shift = int(random.choice((-1, 1))) * round(size * 100.0) * 10_000_000

    def on_sensor(self, harness: Harness, message: Message) -> Iterable[Delivery[Message]]:
        """Shift every stamp by the jump."""
        if self.active(harness) and isinstance(message.content, JointInput | ImuInput):
            # A clock that restarts does not become negative.
            message = shifted(message, max(self._shift, -round(self.begin * 0.9e9)))
        yield Delivery(0, message)
