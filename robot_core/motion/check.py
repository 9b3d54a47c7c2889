"""Checks joint limits and joint speeds of a motion before it runs."""

import numpy as np

from robot_core.errors import NaoGaitError
from robot_core.joint_limits import JointLimits
from robot_core.motion.keyframes import Interpolation, Motion
from robot_core.robot import RobotDescription
from robot_core.types import FloatArray

SPEED_SHARE = 0.95
"""Share of a joint's speed limit that a motion may use; the rest is left for gyro stabilisation."""
_ROUNDING = 1e-6


def check_motion(motion: Motion, robot: RobotDescription) -> None:
    """Raise NaoGaitError with motion, keyframe, joint, value and limit.

    The movement into the first keyframe starts at an unknown pose; the player extends its time if
    necessary. The same holds for movements from and to the gait's stand pose.
    """
    limits = JointLimits(robot)
    before: FloatArray | None = None
    for number, keyframe in enumerate(motion.keyframes, start=1):
        position = keyframe.position
        if position is None:
            before = None
            continue
        where = f"motion {motion.name}, keyframe {number} ({keyframe.pose})"
        _check_limits(where, position, robot, limits)
        if before is not None:
            _check_speed(where, position - before, keyframe.time, keyframe.interpolation, robot)
        before = position


def fastest(change: FloatArray, interpolation: Interpolation, robot: RobotDescription) -> float:
    """[s] The shortest time for a change of the joints (n,) [rad] within their speed limits."""
    speed = SPEED_SHARE * robot.velocity_limit
    times = interpolation.peak * np.abs(np.nan_to_num(change)) / speed
    return float(np.max(times))


def _check_limits(
    where: str, position: FloatArray, robot: RobotDescription, limits: JointLimits
) -> None:
    wanted = np.where(np.isnan(position), robot.stand_pose, position)
    possible = wanted.copy()
    limits.cut(possible)
    beyond = np.abs(wanted - possible)
    worst = int(np.argmax(beyond))
    if beyond[worst] > _ROUNDING:
        side = "at least" if possible[worst] > wanted[worst] else "at most"
        raise NaoGaitError(
            f"{where}, {robot.joint_names[worst]}", f"{wanted[worst]:.6g} rad",
            f"{side} {possible[worst]:.6g} rad (of {robot.lower[worst]:.6g} to "
            f"{robot.upper[worst]:.6g}; an ankle's roll also depends on its pitch)",
        )  # fmt: skip
    for leader, follower in robot.coupled_joints:
        first, second = (float(wanted[robot.index(name)]) for name in (leader, follower))
        if abs(first - second) > _ROUNDING:
            raise NaoGaitError(
                f"{where}, {follower}", f"{second:.6g} rad",
                f"{first:.6g} rad, as {leader}: one motor turns both",
            )  # fmt: skip


def _check_speed(
    where: str,
    change: FloatArray,
    time: float,
    interpolation: Interpolation,
    robot: RobotDescription,
) -> None:
    speed = interpolation.peak * np.abs(np.nan_to_num(change)) / time
    limit = SPEED_SHARE * robot.velocity_limit
    worst = int(np.argmax(speed / limit))
    if speed[worst] > limit[worst] * (1.0 + _ROUNDING):
        needed = time * float(speed[worst] / limit[worst])
        raise NaoGaitError(
            f"{where}, {robot.joint_names[worst]}", f"{speed[worst]:.4g} rad/s in {time:g} s",
            f"at most {limit[worst]:.4g} rad/s ({SPEED_SHARE:g} of the joint's), so {needed:.3f} s "
            "or more",
        )  # fmt: skip
