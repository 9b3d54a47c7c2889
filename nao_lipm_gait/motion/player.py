"""Plays a motion: joint angles and stiffness for one tick after the other.

Gyro stabilisation of the leg that stands alone: eq. (7) of Friedmann et al. without k_d.

Signs are those of a robot whose joints turn as the NAO's do: a torso that pitches forward is met by
pressing the toes down.
"""

from typing import NamedTuple

import numpy as np

from nao_lipm_gait.motion.check import fastest
from nao_lipm_gait.motion.keyframes import Balance, Interpolation, Motion
from nao_lipm_gait.robot import RobotDescription
from nao_lipm_gait.types import FloatArray, Point3


def balanced(
    position: FloatArray,
    support: int,
    angular_velocity: Point3,
    balance: Balance,
    robot: RobotDescription,
) -> None:
    """Add the corrections to joint targets (n,) [rad] in place.

    support: +1 left, -1 right; angular_velocity [rad/s] of the torso in the torso frame.
    """
    roll_rate, pitch_rate, _ = angular_velocity
    leg = robot.left_leg if support > 0 else robot.right_leg
    pitch, roll = balance.pitch * pitch_rate, balance.roll * roll_rate
    position[robot.index(leg.ankle_pitch)] += pitch
    position[robot.index(leg.ankle_roll)] += roll
    position[robot.index(leg.hip_pitch)] += balance.hip_share * pitch
    position[robot.index(leg.hip_roll)] += balance.hip_share * roll


class MotionTick(NamedTuple):
    """Targets of one control period."""

    position: FloatArray
    """(n,) [rad]; NaN = not the motion's joint."""
    stiffness: FloatArray
    """(n,) 0 to 1."""
    support: int
    """Leg to be stabilised: +1 left, -1 right; 0 none."""


class _Segment(NamedTuple):
    begin: FloatArray
    end: FloatArray
    starts: float
    time: float
    interpolation: Interpolation
    stiffness: FloatArray
    support: int


class MotionPlayer:
    """One run of a motion; deterministic, no clock."""

    def __init__(
        self, motion: Motion, robot: RobotDescription, start: FloatArray, stand: FloatArray
    ) -> None:
        """start: (n,) [rad] where the joints are; stand: (n,) [rad] where the gait wants them.

        Ways whose ends are only known now take longer than the file says, if they have to.
        """
        self.motion = motion
        self._segments: list[_Segment] = []
        before, begin = np.array(start, dtype=float), 0.0
        for keyframe in motion.keyframes:
            wanted = stand if keyframe.position is None else keyframe.position
            after = np.array(wanted, dtype=float)
            needed = fastest(after - before, keyframe.interpolation, robot)
            time = max(keyframe.time, needed)
            # A joint that joins in begins where it is; the motion does not know where that is.
            first = np.where(np.isnan(before), after, before)
            self._segments.append(
                _Segment(
                    first, after, begin, time, keyframe.interpolation,
                    keyframe.stiffness, keyframe.support,
                )
            )  # fmt: skip
            before, begin = after, begin + time
        self.time = begin
        """[s] from start to end."""
        self._now = 0.0
        self._segment = 0

    @property
    def finished(self) -> bool:
        return self._now >= self.time - 1e-9

    def advance(self, dt: float) -> MotionTick:
        """Go on by dt [s]; after the end, its last keyframe."""
        self._now += dt
        segments = self._segments
        while (
            self._segment < len(segments) - 1
            and self._now >= segments[self._segment + 1].starts - 1e-9
        ):
            self._segment += 1
        segment = segments[self._segment]
        share = segment.interpolation.share((self._now - segment.starts) / segment.time)
        position = segment.begin + share * (segment.end - segment.begin)
        return MotionTick(position, segment.stiffness, segment.support)
