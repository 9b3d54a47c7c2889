"""Faults of the transport between robot and gait: loss, latency, late processing."""

from collections.abc import Iterable

import numpy as np

from gait_lab.faults.harness import Fault, Harness, TemporaryFault, Timed
from gait_lab.faults.messages import Command, Delivery, Message


class Loss(Fault):
    """Messages are lost, 1 to 20 % of them, in both directions."""

    why = "the feedback has gaps."
    most = 0.2

    def _draw(self, random: np.random.Generator) -> None:
        self.share = float(random.uniform(0.01, self.most))

    def _lost(self, harness: Harness) -> bool:
        return self.active(harness) and self.random.uniform() < self.share

    def on_sensor(self, harness: Harness, message: Message) -> Iterable[Delivery[Message]]:
        """Drop some sensor messages."""
        if not self._lost(harness):
            yield Delivery(0, message)

    def on_velocity(self, harness: Harness, message: Message) -> Iterable[Delivery[Message]]:
        """Drop some velocity commands."""
        if not self._lost(harness):
            yield Delivery(0, message)

    def on_command(self, harness: Harness, command: Command) -> Iterable[Delivery[Command]]:
        """Drop some joint commands."""
        if not self._lost(harness):
            yield Delivery(0, command)


class Bursts(Loss):
    """All messages are lost for 20 to 150 ms, every 0.3 to 1 s."""

    why = "the feedback has gaps."

    def _draw(self, random: np.random.Generator) -> None:
        super()._draw(random)
        self._length = float(random.uniform(0.02, 0.15))
        self._apart = float(random.uniform(0.3, 1.0))

    def _lost(self, harness: Harness) -> bool:
        since = harness.seconds() - self.begin
        return since >= 0.0 and since % self._apart < self._length


class Latency(Fault):
    """Sensor messages and commands arrive up to 60 ms late, constant or random.

    Messages of one topic keep their order.
    """

    why = (
        "up to 60 ms are added on each way; the gait measures and bridges the age of its sensors, "
        "not the delay of its commands."
    )

    def _draw(self, random: np.random.Generator) -> None:
        self._most = int(random.integers(1, 7))
        self._jitter = bool(random.integers(2))
        self._arrival = {"": 0}

    def _delay(self, harness: Harness, topic: str) -> int:
        if not self.active(harness):
            return 0
        delay = int(self.random.integers(0, self._most + 1)) if self._jitter else self._most
        arrival = max(harness.tick + delay, self._arrival.get(topic, 0))
        self._arrival[topic] = arrival
        return arrival - harness.tick

    def on_sensor(self, harness: Harness, message: Message) -> Iterable[Delivery[Message]]:
        """Delay the message."""
        yield Delivery(self._delay(harness, message.topic), message)

    def on_command(self, harness: Harness, command: Command) -> Iterable[Delivery[Command]]:
        """Delay the joint command."""
        yield Delivery(self._delay(harness, "commands"), command)


class WanderingAge(Fault):
    """The age of the sensor messages wanders by up to 60 ms.

    Messages keep their order: while the age grows none arrives, while it shrinks two at a time.
    It is at most `most` control periods more than the plant's.
    """

    why = "while the age grows the robot holds its last targets."
    STEPS = 0.3
    """Probability of a step of the random walk in each control period."""

    def _draw(self, random: np.random.Generator) -> None:
        self.most = 6
        self._late = int(random.integers(self.most + 1))
        self._stepped_at = self._arrival = 0

    def on_sensor(self, harness: Harness, message: Message) -> Iterable[Delivery[Message]]:
        """Delay the message; all messages of one control period equally."""
        if not self.active(harness):
            yield Delivery(0, message)
            return
        if harness.tick != self._stepped_at:
            self._stepped_at = harness.tick
            if self.random.uniform() < self.STEPS:
                step = int(self.random.choice((-1, 1)))
                self._late = min(max(self._late + step, 0), self.most)
            self._arrival = max(harness.tick + self._late, self._arrival)
        yield Delivery(self._arrival - harness.tick, message)


class LateController(Fault):
    """5, 30 or 100 % of the gait's commands are 1 to 5 ticks late."""

    why = "up to 50 ms are added to a loop that predicts over 60 ms."

    def _draw(self, random: np.random.Generator) -> None:
        self._ticks = int(random.integers(1, 6))
        self._share = float(random.choice((0.05, 0.3, 1.0)))
        self._arrival = 0

    def on_command(self, harness: Harness, command: Command) -> Iterable[Delivery[Command]]:
        """Delay some joint commands, in order."""
        delay = 0
        if self.active(harness) and self.random.uniform() < self._share:
            delay = self._ticks
        self._arrival = max(self._arrival, harness.tick + delay)
        yield Delivery(self._arrival - harness.tick, command)


class StarvedProcessor(TemporaryFault):
    """The gait repeatedly gets no processor time for 20 to 300 ms."""

    why = "as for silence."
    span = (0.02, 0.3)

    def _draw(self, random: np.random.Generator) -> None:
        self._apart = float(random.uniform(0.4, 1.5)) + self.duration

    def _left(self, harness: Timed) -> float:
        """Time [s] until the gait runs again; 0 or less while it runs."""
        since = harness.seconds() - self.begin
        return self.duration - since % self._apart if since >= 0.0 else 0.0

    def coasts(self, harness: Timed) -> bool:
        """A starved gait cannot coast."""
        return self._left(harness) <= 0.0

    def on_sensor(self, harness: Harness, message: Message) -> Iterable[Delivery[Message]]:
        """Drop or delay what arrives while the gait does not run."""
        left = self._left(harness)
        # A best-effort queue of depth 5 drops what is older than 50 ms.
        if left <= 0.0:
            yield Delivery(0, message)
        elif left <= 0.05:
            yield Delivery(round(left * 100.0), message)
