"""A robot without a fault: what is said of its sensors is a false alarm."""

import numpy as np

from gait_lab.faults.harness import PERIOD, Fault, Harness
from robot_core.types import STANDSTILL, VelocityCommand
from sim_bridge.trials.tasks import RandomCommands

TURNS, STANDS = 0.2, 0.1
"""Shares of the stretches in which the robot turns on the spot, and stands."""
STRETCH = 5.0
"""[s] Random commands of one kind; a push in each of them."""
PUSH = 0.1
"""[N s] Largest impulse of a push for each kg of the robot."""
DOWN_TICKS = 100
"""Ticks after a fall until the robot is reset."""


class Healthy(Fault):
    """Nothing is wrong for a minute of walks, turns, stands, stops and pushes."""

    end = 60.0

    def _draw(self, random: np.random.Generator) -> None:
        self._commands = RandomCommands(random.integers(2**31, size=2).tolist())
        self._kind, self._push_at, self._down = 1.0, 0.0, 0

    def individual(self, seed: int) -> int:
        """Each run has another robot."""
        return seed

    def before_physics(self, harness: Harness) -> None:
        """Command, push, set up a robot that fell; every alarm is a violation."""
        since = harness.seconds() % STRETCH
        if since < PERIOD:
            self._kind = float(self.random.uniform())
            self._push_at = float(self.random.uniform(0.0, STRETCH - PERIOD))
        asked = self._commands.at(harness.seconds())
        if self._kind < STANDS:
            asked = STANDSTILL
        elif self._kind < STANDS + TURNS:
            asked = VelocityCommand(0.0, 0.0, asked.yaw)
        harness.command = asked
        if self._push_at <= since < self._push_at + PERIOD and harness.seconds() > self.begin:
            self._push(harness)
        self._down = self._down + 1 if harness.fallen else 0
        if self._down == DOWN_TICKS:
            harness.reset_robot()
        for report in harness.invariants.explained:
            if report.startswith("sensors: "):
                harness.invariants.violate("false alarm", report)

    def _push(self, harness: Harness) -> None:
        mass = sum(link.mass for link in harness.world.robot.body.links)
        angle, size = self.random.uniform(0.0, 2.0 * np.pi), self.random.uniform(0.0, PUSH)
        force = size * mass / PERIOD * np.array((np.cos(angle), np.sin(angle), 0.0))
        harness.push_robot(force)
