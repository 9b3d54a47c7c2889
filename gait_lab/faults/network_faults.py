"""Faults of the way between robot and gait, in both directions."""

from collections.abc import Iterable

import numpy as np

from gait_lab.faults.channel import Command, Message
from gait_lab.faults.fault import Fault, Late, LateCommand, Spell
from gait_lab.faults.harness import Harness


class Loss(Fault):
    """Each message may be lost, whatever it is and wherever it goes."""

    summary = "messages are lost, 1 to 20 % of them, in both directions"
    why = "feedback comes in pieces."
    most = 0.2

    def __init__(self, random: np.random.Generator) -> None:
        super().__init__(random)
        self.share = float(random.uniform(0.01, self.most))

    def _lost(self, stage: Harness) -> bool:
        return self.now(stage) and self.random.uniform() < self.share

    def sensors(self, stage: Harness, message: Message) -> Iterable[Late]:
        if not self._lost(stage):
            yield 0, message

    def drive(self, stage: Harness, message: Message) -> Iterable[Late]:
        if not self._lost(stage):
            yield 0, message

    def commands(self, stage: Harness, command: Command) -> Iterable[LateCommand]:
        if not self._lost(stage):
            yield 0, command


class Bursts(Loss):
    """Nothing gets through for a moment, again and again."""

    summary = "bursts of 20 to 150 ms, 0.3 to 1 s apart, in which nothing gets through"
    why = "feedback comes in pieces."

    def __init__(self, random: np.random.Generator) -> None:
        super().__init__(random)
        self._length = float(random.uniform(0.02, 0.15))
        self._apart = float(random.uniform(0.3, 1.0))

    def _lost(self, stage: Harness) -> bool:
        since = stage.seconds() - self.begin
        return since >= 0.0 and since % self._apart < self._length


class Latency(Fault):
    """Sensors and commands come later than the plant's delay, by a time that changes.

    Messages of one topic do not overtake each other.
    """

    summary = "sensors and commands up to 60 ms later, by a time that wanders"
    why = "up to 120 ms are added to a loop that bridges 60 ms."

    def __init__(self, random: np.random.Generator) -> None:
        super().__init__(random)
        self._most = int(random.integers(1, 7))
        self._jitter = bool(random.integers(2))
        self._arrival = {"": 0}

    def _delay(self, stage: Harness, way: str) -> int:
        if not self.now(stage):
            return 0
        delay = int(self.random.integers(0, self._most + 1)) if self._jitter else self._most
        arrival = max(stage.tick + delay, self._arrival.get(way, 0))
        self._arrival[way] = arrival
        return arrival - stage.tick

    def sensors(self, stage: Harness, message: Message) -> Iterable[Late]:
        yield self._delay(stage, message.topic), message

    def commands(self, stage: Harness, command: Command) -> Iterable[LateCommand]:
        yield self._delay(stage, "commands"), command


class LateController(Fault):
    """The gait's answers come one to five control periods late."""

    summary = "the gait answers 1 to 5 ticks late, now and then or always"
    why = "the loop is up to 50 ms later than the 60 ms that it bridges."

    def __init__(self, random: np.random.Generator) -> None:
        super().__init__(random)
        self._ticks = int(random.integers(1, 6))
        self._share = float(random.choice((0.05, 0.3, 1.0)))
        self._arrival = 0

    def commands(self, stage: Harness, command: Command) -> Iterable[LateCommand]:
        delay = 0
        if self.now(stage) and self.random.uniform() < self._share:
            delay = self._ticks
        self._arrival = max(self._arrival, stage.tick + delay)
        yield self._arrival - stage.tick, command


class StarvedProcessor(Spell):
    """The gait gets no processor for a while, then works off what has come in."""

    summary = "the gait gets no processor for 20 to 300 ms, again and again"
    why = "as silence."
    shortest, longest = 0.02, 0.3

    def __init__(self, random: np.random.Generator) -> None:
        super().__init__(random)
        self._apart = float(random.uniform(0.4, 1.5)) + self.duration

    def sensors(self, stage: Harness, message: Message) -> Iterable[Late]:
        since = stage.seconds() - self.begin
        left = self.duration - since % self._apart
        # Best effort with a queue of five: what is older is thrown away.
        if since < 0.0 or left <= 0.0:
            yield 0, message
        elif left <= 0.05:
            yield round(left * 100.0), message
