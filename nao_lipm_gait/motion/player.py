"""Plays a motion: joint angles and stiffness of each tick.

The support leg of a keyframe is stabilised with the gyro, eq (7) of Friedmann et al. without k_d.
Positive joint angles are those of the NAO: a torso that pitches forward presses the toes down.
"""

from typing import NamedTuple

import numpy as np

from robot_core.motion.check import fastest
from robot_core.motion.joints import joint_signs
from robot_core.motion.keyframes import Balance, Interpolation, Motion
from robot_core.robot import RobotDescription
from robot_core.types import FloatArray, Point3


def balanced(
    position: FloatArray,
    support: int,
    angular_velocity: Point3,
    balance: Balance,
    robot: RobotDescription,
) -> None:
    """Add the gyro corrections of the support leg to joint targets in place.

    Args:
        position: (n,) [rad] Joint targets.
        support: +1 left, -1 right.
        angular_velocity: [rad/s] Of the torso, in the torso frame.
        balance: Gains.
        robot: The robot.
    """
    roll_rate, pitch_rate, _ = angular_velocity
    leg = robot.left_leg if support > 0 else robot.right_leg
    pitch, roll = balance.pitch * pitch_rate, balance.roll * roll_rate
    signs = joint_signs(robot)
    for name, change in (
        (leg.ankle_pitch, pitch), (leg.ankle_roll, roll),
        (leg.hip_pitch, balance.hip_share * pitch), (leg.hip_roll, balance.hip_share * roll),
    ):  # fmt: skip
        joint = robot.index(name)
        position[joint] += signs[joint] * change


class MotionTick(NamedTuple):
    """Targets of one control period.

    Attributes:
        position: (n,) [rad]; NaN for joints that the motion does not move.
        stiffness: (n,) 0 to 1.
        support: Leg to be stabilised: +1 left, -1 right, 0 none.
    """

    position: FloatArray
    stiffness: FloatArray
    support: int


class _Segment(NamedTuple):
    begin: FloatArray
    end: FloatArray
    starts: float
    time: float
    interpolation: Interpolation
    stiffness: FloatArray
    support: int


class MotionPlayer:
    """One run of a motion.

    Movements whose start or end is only known now take longer than in the file if necessary.

    Args:
        motion: The motion.
        robot: The robot.
        start: (n,) [rad] Current joint angles.
        stand: (n,) [rad] The gait's stand pose.

    Attributes:
        time: [s] From start to end.
    """

    def __init__(
        self, motion: Motion, robot: RobotDescription, start: FloatArray, stand: FloatArray
    ) -> None:
        self.motion = motion
        self._segments: list[_Segment] = []
        before, begin = np.array(start, dtype=float), 0.0
        for keyframe in motion.keyframes:
            wanted = stand if keyframe.position is None else keyframe.position
            after = np.array(wanted, dtype=float)
            needed = fastest(after - before, keyframe.interpolation, robot)
            time = max(keyframe.time, needed)
            self._segments.append(
                _Segment(
                    before, after, begin, time, keyframe.interpolation,
                    keyframe.stiffness, keyframe.support,
                )
            )  # fmt: skip
            # Joints that this keyframe does not move stay where they are.
            before, begin = np.where(np.isnan(after), before, after), begin + time
        self.time = begin
        self._now = 0.0
        self._segment = 0

    @property
    def finished(self) -> bool:
        """True after the last keyframe."""
        return self._now >= self.time - 1e-9

    def advance(self, dt: float) -> MotionTick:
        """Advance by dt [s]; after the end the last keyframe is held."""
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
