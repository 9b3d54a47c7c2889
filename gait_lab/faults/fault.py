"""What a fault is: something that stands between the robot, its gait and the operator."""

from collections.abc import Iterable

import numpy as np

from gait_lab.faults.channel import Command, Message
from gait_lab.faults.harness import Harness
from nao_lipm_gait.runtime.controller import Settings

Late = tuple[int, Message]
"""Ticks until it arrives, and what arrives."""
LateCommand = tuple[int, Command]


class Fault:
    """Nothing is wrong. A fault overrides what it disturbs; everything random is drawn at birth."""

    summary = "nothing"
    end = 6.0
    """[s] A run lasts so long."""
    settings = Settings()
    """Of the gait; a fault that is there for comparison has others."""
    why = ""
    """Why robots fall, where they do."""

    def __init__(self, random: np.random.Generator) -> None:
        self.random = random
        self.begin = float(random.uniform(2.0, 3.0))
        """[s] The fault begins then, in the middle of the walk."""

    def now(self, stage: Harness) -> bool:
        """The fault is there; the usual fault stays."""
        return stage.seconds() >= self.begin

    def act(self, stage: Harness) -> None:
        """Before the physics of a tick."""

    def sensors(self, stage: Harness, message: Message) -> Iterable[Late]:
        """One sensor message of the robot; what arrives of it."""
        yield 0, message

    def drive(self, stage: Harness, message: Message) -> Iterable[Late]:
        """One velocity command of the operator; what arrives of it."""
        yield 0, message

    def commands(self, stage: Harness, command: Command) -> Iterable[LateCommand]:
        """One joint command of a gait; what arrives of it."""
        yield 0, command


class Spell(Fault):
    """A fault that ends by itself."""

    shortest, longest = 0.05, 2.0
    """[s]"""

    def __init__(self, random: np.random.Generator) -> None:
        super().__init__(random)
        # Short ones are as frequent as long ones.
        low, high = np.log((self.shortest, self.longest))
        self.duration = float(np.exp(random.uniform(low, high)))

    def now(self, stage: Harness) -> bool:
        return self.begin <= stage.seconds() < self.begin + self.duration
