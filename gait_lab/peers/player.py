"""Plays planned joint trajectories in place of the gait, tick by tick, open loop."""

import math
from dataclasses import dataclass

import numpy as np

from robot_core.geometry import as_point
from robot_core.rate_limiter import eased
from robot_core.robot import RobotDescription
from robot_core.types import (
    FloatArray,
    GaitState,
    GaitStatus,
    JointTargets,
    Point3,
    SensorFrame,
    VelocityCommand,
)

BLEND_TIME = 0.8
"""[s] of blending from the first measured pose into the plan, which still stands then."""
LAG = 0.06
"""[s] from a planned pose to its measurement; the expected CoM is that of so long ago."""
NOWHERE = (0.0, 0.0, 0.0)
NOT_MEASURED: Point3 = (math.nan, math.nan, math.nan)
_SUPPORT = {1: "left", -1: "right", 0: "double"}


@dataclass(frozen=True, slots=True, eq=False)
class JointPlan:
    """A walk, planned for every control period from the start.

    Attributes:
        joints: (n, joints) joint angles [rad].
        support: (n,) support foot: 1 left, -1 right, 0 both.
        com: (n, 3) CoM [m] in the frame of the supporting sole.
    """

    joints: FloatArray
    support: FloatArray
    com: FloatArray


class PeerPlayback:
    """Answers every sensor frame with the pose of the plan at its time.

    Args:
        robot: Its joint limits apply.
        plan: What is played.
        period: Period of the control ticks [s].

    Attributes:
        status: After the last tick.
    """

    def __init__(self, robot: RobotDescription, plan: JointPlan, period: float):
        self._robot = robot
        self._plan = plan
        self._period = period
        self._lag = round(LAG / period)
        self._first: tuple[int, FloatArray] | None = None
        self._steps = 0
        self._last_support = 0
        self.status = peer_status(0, GaitState.STAND, "double", 0)

    def step(self, frame: SensorFrame, command: VelocityCommand) -> JointTargets:
        """The pose for this tick; the command is already part of the plan."""
        if self._first is None:
            self._first = frame.stamp, np.array(frame.joint_position, dtype=float)
        began, start = self._first
        elapsed = (frame.stamp - began) * 1e-9
        tick = min(round(elapsed / self._period), len(self._plan.joints) - 1)
        share = min(1.0, elapsed / BLEND_TIME)
        position = start + eased(share) * (self._plan.joints[tick] - start)
        np.clip(position, self._robot.lower, self._robot.upper, out=position)
        self.status = self._seen(frame.stamp, max(0, tick - self._lag))
        return JointTargets(frame.stamp, position)

    def _seen(self, stamp: int, tick: int) -> GaitStatus:
        """The status at a tick of the plan; the frame Q is the supporting sole."""
        support = int(self._plan.support[tick])
        self._steps += support not in (0, self._last_support)
        self._last_support = support or self._last_support
        state = GaitState.WALK if support else GaitState.STAND
        com = as_point(self._plan.com[tick])
        return peer_status(stamp, state, _SUPPORT[support], self._steps, com)


def peer_status(
    stamp: int, state: GaitState, support: str, step_count: int, com: Point3 = NOT_MEASURED
) -> GaitStatus:
    """The status of a walk that knows no more than these; `com` [m] is the expected one in Q."""
    sole = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    return GaitStatus(
        stamp=stamp,
        state=state,
        support=support,
        com_expected_in_q=com,
        com_measured_in_q=NOT_MEASURED,
        com_estimated_in_q=NOT_MEASURED,
        pendulum_origin_in_q=(math.nan, math.nan),
        step_size=NOWHERE,
        step_count=step_count,
        time_to_support_change=0.0,
        q_in_odom=NOWHERE,
        base_footprint_in_odom=NOT_MEASURED,
        velocity=NOT_MEASURED,
        left_sole_in_odom=sole,
        right_sole_in_odom=sole,
        torso_roll=math.nan,
        torso_pitch=math.nan,
        ik_residual=0.0,
        clipped_joints=0,
    )
