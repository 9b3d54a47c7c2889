"""Which motion runs, which comes next, and what it asks of the joints; the gait's side of motions.

Pure: no clock, no I/O but the reading of the motion files when a motion is first asked for.
"""

from typing import NamedTuple

import numpy as np

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.motion.groups import HEAD, joint_groups
from nao_lipm_gait.motion.keyframes import LYING, Motion, Posture
from nao_lipm_gait.motion.library import MotionLibrary, shipped_library
from nao_lipm_gait.motion.player import MotionPlayer, balanced
from nao_lipm_gait.robot import RobotDescription
from nao_lipm_gait.types import FloatArray, Point3

GET_UP = "get_up"
"""Stands for the motion that gets up from the side on which the robot lies."""
ATTEMPTS = 5
"""Get-ups on its own after one fall; then the robot stays down until it is asked again."""


class MotionTargets(NamedTuple):
    """What a motion asks for in one tick."""

    position: FloatArray
    """(n,) [rad], not yet cut at the joint limits."""
    stiffness: FloatArray
    """(n,) 0 to 1."""


class MotionScheduler:
    """Runs one motion after the other."""

    def __init__(self, robot: RobotDescription, library: MotionLibrary | None = None) -> None:
        """library: None = the shipped motions of this robot, read when first needed."""
        self._robot = robot
        self._library = library
        self._head = joint_groups(robot)[HEAD]
        self._player: MotionPlayer | None = None
        self._hold = np.array(robot.stand_pose, dtype=float)
        self.waiting: Motion | None = None
        """Was asked for and runs as soon as it can."""
        self.get_up_wanted = False
        """A get-up was asked for and runs once it is known on which side the robot lies."""
        self.attempts = 0
        """Get-ups since the last stand."""

    @property
    def library(self) -> MotionLibrary:
        if self._library is None:
            self._library = shipped_library(self._robot)
        return self._library

    @property
    def running(self) -> Motion | None:
        return None if self._player is None else self._player.motion

    @property
    def turns_head(self) -> bool:
        """The running motion has poses of the head; one that has none leaves the head alone."""
        running = self.running
        return running is not None and any(
            keyframe.position is not None and not np.isnan(keyframe.position[self._head]).all()
            for keyframe in running.keyframes
        )

    @property
    def finished(self) -> bool:
        """The motion has come to its last keyframe, and holds it."""
        return self._player is None or self._player.finished

    def request(self, asked: str | Motion, posture: Posture | None) -> None:
        """Ask for a motion, or one by its name, for a robot that is, or after the running motion
        will be, in this posture; None = not known, as while it falls.

        NaoGaitError for an unknown motion and for one that does not begin there.
        """
        lies = posture is None or posture in LYING
        name = asked.name if isinstance(asked, Motion) else asked
        if asked == GET_UP:
            if not lies:
                raise NaoGaitError("motion", name, f"get-ups from lying; the robot is {posture}")
            self.get_up_wanted = True
            self.attempts = 0
            return
        motion = asked if isinstance(asked, Motion) else self.library.find(asked)
        if posture is not None and not motion.begins_from(posture):
            possible = sorted(
                each.name for each in self.library.motions.values() if each.begins_from(posture)
            )
            raise NaoGaitError(
                "motion", f"{name}, which starts {motion.starts}",
                f"while {posture}: {', '.join(possible) or 'none'}",
            )  # fmt: skip
        if posture is None and motion.starts not in LYING:
            raise NaoGaitError("motion", f"{name}, which starts {motion.starts}", "get_up")
        self.waiting = motion

    def get_up_from(self, posture: Posture) -> Motion | None:
        """The motion that leads from there to the feet, or nearer to them; None if there is none"""
        to_feet = self.library.between(posture, Posture.STANDING)
        if to_feet is not None:
            return to_feet
        for way in (Posture.LYING_BACK, Posture.LYING_FRONT):
            roll = self.library.between(posture, way)
            if roll is not None:
                return roll
        return None

    def begin(self, motion: Motion, start: FloatArray, stand: FloatArray) -> None:
        """start: (n,) [rad] where the joints are; stand: (n,) [rad] the gait's stand."""
        self._player = MotionPlayer(motion, self._robot, start, stand)
        self._hold = np.array(start, dtype=float)
        self.waiting = None

    def advance(self, time: float, angular_velocity: Point3) -> MotionTargets:
        """Go on by time [s]; angular_velocity [rad/s] of the torso in the torso frame."""
        player = self._player
        if player is None:
            return MotionTargets(self._hold.copy(), np.ones(len(self._hold)))
        tick = player.advance(time)
        position = np.where(np.isnan(tick.position), self._hold, tick.position)
        if tick.support:
            balanced(position, tick.support, angular_velocity, player.motion.balance, self._robot)
        return MotionTargets(position, tick.stiffness)

    def end(self) -> None:
        """Forget the running motion, and keep what is to follow."""
        self._player = None

    def stop(self) -> None:
        """Forget the running motion and what was to follow."""
        self._player = None
        self.waiting = None
        self.get_up_wanted = False

    def forget_if_upright(self) -> None:
        """The robot falls: what needs feet is off."""
        self._player = None
        if self.waiting is not None and self.waiting.starts not in LYING:
            self.waiting = None
