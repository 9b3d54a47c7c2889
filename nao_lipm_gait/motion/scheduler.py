"""Schedules motions: which one runs, which one comes next, and the joint targets of the tick.

There is no clock and no I/O, except that the motion files are read when a motion is first needed.
"""

from typing import NamedTuple

import numpy as np

from nao_lipm_gait.motion.player import MotionPlayer, balanced
from robot_core.errors import NaoGaitError
from robot_core.motion.joints import HEAD, joint_groups
from robot_core.motion.keyframes import LYING, Motion, Posture
from robot_core.motion.library import MotionLibrary, shipped_library
from robot_core.robot import RobotDescription
from robot_core.types import FloatArray, Point3

GET_UP = "get_up"
"""Request for the motion that gets up from the side on which the robot lies."""
ATTEMPTS = 5
"""Automatic get-ups after one fall; then the robot stays down until the next request."""


class MotionTargets(NamedTuple):
    """Joint targets of one tick.

    Attributes:
        position: (n,) [rad]; not yet clipped at the joint limits.
        stiffness: (n,) 0 to 1.
    """

    position: FloatArray
    stiffness: FloatArray


class MotionScheduler:
    """Runs one motion after the other.

    Args:
        robot: The robot.
        library: Its motions; None = the shipped ones, read when first needed.

    Attributes:
        get_up_wanted: A get-up was requested; it starts once the lying side is known.
        attempts: Get-ups since the last stand.
    """

    def __init__(self, robot: RobotDescription, library: MotionLibrary | None = None) -> None:
        self._robot = robot
        self._library = library
        self._head = joint_groups(robot)[HEAD]
        self._player: MotionPlayer | None = None
        self._hold = np.array(robot.stand_pose, dtype=float)
        self.waiting: Motion | None = None
        self.get_up_wanted = False
        self.attempts = 0

    @property
    def library(self) -> MotionLibrary:
        """The motions that can be requested."""
        if self._library is None:
            self._library = shipped_library(self._robot)
        return self._library

    @property
    def running(self) -> Motion | None:
        """The motion that runs now."""
        return None if self._player is None else self._player.motion

    @property
    def turns_head(self) -> bool:
        """True if the running motion moves the head."""
        running = self.running
        return running is not None and any(
            keyframe.position is not None and not np.isnan(keyframe.position[self._head]).all()
            for keyframe in running.keyframes
        )

    @property
    def finished(self) -> bool:
        """True if no motion runs or the last keyframe is held."""
        return self._player is None or self._player.finished

    def request(self, asked: str | Motion, posture: Posture | None) -> None:
        """Request a motion.

        Args:
            asked: The motion or its name; GET_UP for the get-up of the lying side.
            posture: Posture now, or after the running motion; None = unknown, as during a fall.

        Raises:
            NaoGaitError: The motion is unknown or cannot start in this posture.
        """
        lies = posture is None or posture in LYING
        name = asked.name if isinstance(asked, Motion) else asked
        if isinstance(asked, str) and asked == GET_UP:
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
        """The motion that gets up from a lying side, or rolls to one from which a motion does."""
        to_feet = self.library.between(posture, Posture.STANDING)
        if to_feet is not None:
            return to_feet
        for side in (Posture.LYING_BACK, Posture.LYING_FRONT):
            roll = self.library.between(posture, side)
            if roll is not None:
                return roll
        return None

    def begin(self, motion: Motion, start: FloatArray, stand: FloatArray) -> None:
        """Start a motion; start: (n,) [rad] current joints, stand: (n,) [rad] the gait's stand."""
        self._player = MotionPlayer(motion, self._robot, start, stand)
        self._hold = np.array(start, dtype=float)
        self.waiting = None

    def advance(self, time: float, angular_velocity: Point3) -> MotionTargets:
        """Advance by time [s]; angular_velocity [rad/s] of the torso in the torso frame."""
        player = self._player
        if player is None:
            return MotionTargets(self._hold.copy(), np.ones(len(self._hold)))
        tick = player.advance(time)
        position = np.where(np.isnan(tick.position), self._hold, tick.position)
        if tick.support:
            balanced(position, tick.support, angular_velocity, player.motion.balance, self._robot)
        return MotionTargets(position, tick.stiffness)

    def stop(self) -> None:
        """Drop the running motion and all requests."""
        self._player = None
        self.waiting = None
        self.get_up_wanted = False

    def drop_upright(self) -> None:
        """Drop the motions that need a robot on its feet; called when it falls."""
        self._player = None
        if self.waiting is not None and self.waiting.starts not in LYING:
            self.waiting = None
