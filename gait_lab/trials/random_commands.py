"""Random, smooth, omnidirectional velocity commands."""

from collections.abc import Sequence

import numpy as np

from gait_lab.trials.tasks import STAND_TIME, TASKS
from nao_lipm_gait.types import STANDSTILL, VelocityCommand

HOLD_TIME = (1.0, 4.0)
"""A command is held for a time between these [s]."""
CHANGE_TIME = 1.0
"""From one command to the next [s]."""
STOP_SHARE = 0.1
"""Of the commands, these are to stop."""


class RandomCommands:
    """A smooth random command over time: held, changed, held again."""

    def __init__(self, seed: Sequence[int]) -> None:
        self._random = np.random.default_rng(list(seed))
        self._before = self._after = STANDSTILL
        self._change, self._end = 0.0, STAND_TIME

    def at(self, time: float) -> VelocityCommand:
        """The command at rising times [s]."""
        while time >= self._end:
            self._before, self._after = self._after, self._draw()
            self._change = self._end
            self._end += CHANGE_TIME + float(self._random.uniform(*HOLD_TIME))
        share = min(1.0, (time - self._change) / CHANGE_TIME)
        share *= share * (3.0 - 2.0 * share)
        a, b = self._before, self._after
        return VelocityCommand(
            a.x + share * (b.x - a.x), a.y + share * (b.y - a.y), a.yaw + share * (b.yaw - a.yaw)
        )

    def _draw(self) -> VelocityCommand:
        """Any direction up to full speed: uniform in the ball whose axes are the full speeds."""
        direction = self._random.normal(size=3)
        radius = self._random.uniform() ** (1.0 / 3.0)
        if self._random.uniform() < STOP_SHARE:
            return STANDSTILL
        x, y, yaw = (radius / np.linalg.norm(direction) * direction).tolist()
        ahead = TASKS["forward"].asked if x > 0.0 else -TASKS["back"].asked
        return VelocityCommand(ahead * x, TASKS["side"].asked * y, TASKS["turn"].asked * yaw)
