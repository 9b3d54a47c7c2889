"""Motions in the middle of a walk: asked for at their times, and what became of them.

A kick gets a ball, which is laid on its spot the moment the kick begins and is gone once it ends.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gait_lab.trials.ball_spot import spot_in_world
from gait_lab.trials.tasks import AskedMotion
from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.gait import Gait
from nao_lipm_gait.motion.library import shipped_library
from nao_lipm_gait.types import FloatArray, GaitState
from sim_bridge.ball import Ball
from sim_bridge.simulation import Simulation

OUT_OF_THE_WAY = (-50.0, 50.0)
"""[m] where a ball lies that nobody kicks."""


@dataclass(frozen=True, slots=True)
class MotionOutcome:
    """What became of an asked motion; times [s] since the start, None for what never came."""

    asked: AskedMotion
    began: float | None = None
    ended: float | None = None
    walked: float | None = None
    """The robot walked again."""
    ball: float | None = None
    """[m] from a kick's spot to the ball at the end of the kick."""


def ball_for(asked: Sequence[AskedMotion]) -> Ball | None:
    """The ball that a simulation needs for these motions; None without motions."""
    return Ball(*OUT_OF_THE_WAY) if asked else None


class MotionWatch:
    """Asks for the motions while a robot walks; `tick` once after every control period."""

    def __init__(self, simulation: Simulation, gait: Gait, asked: Sequence[AskedMotion]) -> None:
        """NaoGaitError for a motion that the robot does not have."""
        self._simulation, self._gait = simulation, gait
        self._motions = {
            each.name: shipped_library(simulation.robot).find(each.name) for each in asked
        }
        self._due = list(asked)
        self._start = simulation.time
        self._lay: FloatArray | None = None
        self._outcomes: list[MotionOutcome] = []

    @property
    def outcomes(self) -> tuple[MotionOutcome, ...]:
        """Of all motions that were due so far, in their order."""
        return tuple(self._outcomes)

    def tick(self) -> None:
        """Look what the gait does, and ask for what is due."""
        time = (self._simulation.time - self._start) * 1e-9
        if self._outcomes:
            self._outcomes[-1] = self._seen(self._outcomes[-1], time)
        if self._due and time >= self._due[0].time - 1e-6:
            asked = self._due.pop(0)
            self._outcomes.append(MotionOutcome(asked))
            try:
                self._gait.request_motion(asked.name)
            except NaoGaitError:
                return  # it falls or lies: the outcome stays empty

    def _seen(self, last: MotionOutcome, time: float) -> MotionOutcome:
        running = self._gait.status.motion == last.asked.name
        if last.began is None:
            if not running:
                return last
            self._lay_ball(last.asked.name)
            return replace(last, began=time)
        if last.ended is None and self._gait.state is GaitState.STAND:
            return replace(last, ended=time, ball=self._take_ball())
        if last.ended is not None and last.walked is None and self._gait.state is GaitState.WALK:
            return replace(last, walked=time)
        return last

    def _lay_ball(self, name: str) -> None:
        kick = self._motions[name].kick
        if kick is not None:
            self._lay = spot_in_world(self._simulation.truth(), kick.x, kick.y)
            self._simulation.put_ball(float(self._lay[0]), float(self._lay[1]))

    def _take_ball(self) -> float | None:
        ball, lay = self._simulation.ball, self._lay
        if ball is None or lay is None:
            return None
        self._simulation.put_ball(*OUT_OF_THE_WAY)
        self._lay = None
        return float(np.hypot(*(ball.position[:2] - lay)))
