"""Motions in a trial: requested while the robot walks, watched, with a ball for each kick."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from nao_lipm_gait.gait import Gait
from robot_core.errors import NaoGaitError
from robot_core.geometry import rotate_planar
from robot_core.motion.library import shipped_library
from robot_core.types import FloatArray, GaitState
from sim_bridge.ball import Ball
from sim_bridge.robot import GroundTruth
from sim_bridge.trials.metrics import yaw_of
from sim_bridge.trials.tasks import AskedMotion
from sim_bridge.world import World

FAR_AWAY = (-50.0, 50.0)
"""[m] where the ball lies while no kick runs."""


def spot_in_world(truth: GroundTruth, x: float, y: float) -> FloatArray:
    """(2,) [m] in the world: x ahead, y left [m] of the middle between the soles of a robot."""
    heading = float(yaw_of(truth.torso_quaternion))
    middle = 0.5 * (truth.soles[0].position + truth.soles[1].position)[:2]
    return np.asarray(middle + rotate_planar(x, y, heading))


@dataclass(frozen=True, slots=True)
class MotionOutcome:
    """What became of a requested motion; times in s since the start, None for what never came.

    Attributes:
        ball: [m] from a kick's spot to the ball at the end of the kick.
    """

    asked: AskedMotion
    began: float | None = None
    ended: float | None = None
    walked: float | None = None
    ball: float | None = None


def ball_for(asked: Sequence[AskedMotion]) -> Ball | None:
    """The ball that a world needs for these motions; None without motions."""
    return Ball(*FAR_AWAY) if asked else None


class MotionWatch:
    """Requests motions at their times and records what becomes of them.

    A kick gets a ball, which is put on its spot the moment the kick begins and taken away when it
    ends. Call `tick` once after every control period.

    Args:
        world: The robot; times count from now.
        gait: Its gait.
        asked: The motions, at increasing times.

    Raises:
        NaoGaitError: The robot does not have one of the motions.
    """

    def __init__(self, world: World, gait: Gait, asked: Sequence[AskedMotion]) -> None:
        self._world, self._gait = world, gait
        robot = world.robot.description
        # The library is read only if there are motions: it takes longer than a second of walking.
        self._motions = {each.name: shipped_library(robot).find(each.name) for each in asked}
        self._due = list(asked)
        self._start = world.time
        self._spot: FloatArray | None = None
        self._outcomes: list[MotionOutcome] = []

    @property
    def outcomes(self) -> tuple[MotionOutcome, ...]:
        """Of all motions that were due so far, in their order."""
        return tuple(self._outcomes)

    def tick(self) -> None:
        """Update the outcome of the last motion, and request the one that is due."""
        time = (self._world.time - self._start) * 1e-9
        if self._outcomes:
            self._outcomes[-1] = self._updated(self._outcomes[-1], time)
        if self._due and time >= self._due[0].time - 1e-6:
            asked = self._due.pop(0)
            self._outcomes.append(MotionOutcome(asked))
            try:
                self._gait.request_motion(asked.name)
            except NaoGaitError:
                return  # it falls or lies: the outcome stays empty

    def _updated(self, last: MotionOutcome, time: float) -> MotionOutcome:
        running = self._gait.status.motion == last.asked.name
        if last.began is None:
            if not running:
                return last
            self._put_ball(last.asked.name)
            return replace(last, began=time)
        if last.ended is None and self._gait.state is GaitState.STAND:
            return replace(last, ended=time, ball=self._take_ball())
        if last.ended is not None and last.walked is None and self._gait.state is GaitState.WALK:
            return replace(last, walked=time)
        return last

    def _put_ball(self, name: str) -> None:
        kick = self._motions[name].kick
        if kick is not None:
            self._spot = spot_in_world(self._world.robot.truth(), kick.x, kick.y)
            self._world.put_ball(float(self._spot[0]), float(self._spot[1]))

    def _take_ball(self) -> float | None:
        ball, spot = self._world.ball, self._spot
        if ball is None or spot is None:
            return None
        self._world.put_ball(*FAR_AWAY)
        self._spot = None
        return float(np.hypot(*(ball.position[:2] - spot)))
