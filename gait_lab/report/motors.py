"""Joints: targets against measured, and how near torque and speed came to their limits."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gait_lab.report.walk import IntArray, Walk
from nao_lipm_gait.robot import RobotDescription
from nao_lipm_gait.types import FloatArray
from sim_bridge.individual import draw_individual
from sim_bridge.motors import TorqueLimits
from sim_bridge.plant import load_plant
from sim_bridge.robot import SATURATED

LONGEST_LAG = 0.2
"""[s] that a joint may follow its target late."""

STILL = 0.01
"""[rad] standard deviation of a target below which a joint's lag cannot be seen."""


@dataclass(frozen=True, slots=True)
class JointUse:
    """One joint over the whole bag."""

    name: str
    tracking: float
    """RMS of target minus angle, the lag taken out [rad]; NaN without targets."""
    lag: float
    """[s] from target sent to the angle that fits it best; NaN without motion."""
    torque_share: float
    """Largest share of the torque that the motor has at that speed; NaN without efforts."""
    torque_saturated: float
    """Share of the ticks at the torque limit."""
    speed_share: float
    """Largest share of the joint's speed limit."""
    speed_saturated: float
    """Share of the ticks in which the target asks for more than the joint's speed."""


@dataclass(frozen=True, slots=True)
class MotorUse:
    """All joints of the robot."""

    joints: tuple[JointUse, ...]
    stamp: IntArray
    torque: FloatArray
    """(t, n) share of the torque limit."""
    saturated: FloatArray
    """(t,) number of motors at their torque limit."""

    @property
    def saturated_share(self) -> float:
        """Share of the ticks with any motor at its torque limit; NaN without efforts."""
        known = np.isfinite(self.torque).any(axis=1)
        return float((self.saturated[known] > 0).mean()) if known.any() else float("nan")


def motor_use(walk: Walk, robot: RobotDescription) -> MotorUse:
    """Limits are those of a nominal motor of the reference plant: a bag names no individual."""
    columns = [walk.joint_names.index(name) for name in robot.joint_names]
    velocity, effort = walk.velocity.value[:, columns], walk.effort.value[:, columns]
    plant = load_plant("reference")
    limits = TorqueLimits(robot, plant, draw_individual(plant, robot, -1))
    torque = np.full(effort.shape, np.nan)
    leaders = dict((follower, leader) for leader, follower in robot.coupled_joints)
    for row in range(len(effort)):
        lowest, highest = limits.span(np.nan_to_num(velocity[row]))
        limit = np.where(effort[row] < 0.0, -lowest, highest)
        torque[row] = np.abs(effort[row]) / np.where(limit > 0.0, limit, np.nan)
    period = max(1, walk.period) * 1e-9
    joints = []
    for index, name in enumerate(robot.joint_names):
        if name in leaders:
            continue
        tracking, lag, fast = _tracking(walk, name, robot.velocity_limit[index], period)
        joints.append(
            JointUse(
                name,
                tracking,
                lag,
                _largest(torque[:, index]),
                _share(torque[:, index] >= SATURATED, torque[:, index]),
                _largest(np.abs(velocity[:, index]) / robot.velocity_limit[index]),
                fast,
            )
        )
    return MotorUse(
        tuple(joints), walk.effort.stamp, torque, (torque >= SATURATED).sum(axis=1).astype(float)
    )


def _tracking(walk: Walk, name: str, limit: float, period: float) -> tuple[float, float, float]:
    """RMS error [rad], lag [s], share of ticks with a target beyond the joint's speed."""
    if name not in walk.target_names or len(walk.targets) < 10:
        return float("nan"), float("nan"), float("nan")
    target = walk.targets.value[:, walk.target_names.index(name)]
    measured = walk.position.value[:, walk.joint_names.index(name)]
    # A target takes effect when it arrives: its own stamp is that of the older sensors.
    sent = (walk.targets.stamp + walk.age - walk.origin) * 1e-9
    time = (walk.position.stamp - walk.origin) * 1e-9
    if float(np.nanstd(target)) < STILL:
        error = measured - np.interp(time, sent, target)
        return float(np.sqrt(np.nanmean(error**2))), float("nan"), 0.0
    best = (np.inf, 0.0)
    for lag in np.arange(0.0, LONGEST_LAG, period):
        inside = (time >= sent[0] + lag) & (time <= sent[-1] + lag)
        if inside.sum() < 10:
            break
        error = measured[inside] - np.interp(time[inside] - lag, sent, target)
        best = min(best, (float(np.sqrt(np.nanmean(error**2))), float(lag)))
    fast = np.abs(np.diff(target)) > limit * np.maximum(np.diff(walk.targets.stamp) * 1e-9, period)
    return best[0], best[1], float(fast.mean())


def _largest(values: FloatArray) -> float:
    return float(np.nanmax(values)) if np.isfinite(values).any() else float("nan")


def _share(hits: NDArray[np.bool_], values: FloatArray) -> float:
    known = np.isfinite(values)
    return float(hits[known].mean()) if known.any() else float("nan")
