"""Torques that compliant motors need beside their targets, as a lead of the targets.

A servo of stiffness k and damping d gives the torque k (target - angle) - d speed. To give a torque
without an error of the angle, its target leads by that torque over k, which any position interface
can send. The torques carry the robot on its soles: at rest on both, in a step on the support sole,
with the force of the pendulum. They also accelerate the links as the targets move.

A robot that leans loads its ankles by more, which then give way and let it lean further. The
torques are therefore those of the robot as it leans on average.
"""

import numpy as np

from nao_lipm_gait.walks.base import BodyTargets, SoleTarget
from nao_lipm_gait.whole_body.support_torque import Load, SupportTorque
from robot_core.geometry import rotate_planar
from robot_core.robot import RobotDescription
from robot_core.types import FloatArray, Point2

SMOOTHING_TIME = 0.005
"""[s] Of the velocity of the targets. It delays the torques that accelerate the legs: with 20 ms a
foot of a T1 overshoots by 30 mm."""
LARGEST = 100.0
"""[rad/s^2] A faster change is a step of the plan, not a movement."""
SHIFT_TIME = 0.06
"""[s] in which the weight goes from one sole to the other."""
RISE_TIME = 0.3
"""[s] in which the torques follow the lean, and rise after a motion, which has none: all at once
they kick a robot."""


class FeedForward:
    """The lead of the targets of one robot."""

    def __init__(self, robot: RobotDescription) -> None:
        stiffness = [robot.motors[name].stiffness for name in robot.joint_names]
        self._yield = np.array([0.0 if each is None else 1.0 / each for each in stiffness])
        self.needed = bool(robot.soft_joint)
        self._torque = SupportTorque(robot) if self.needed else None
        self._length = robot.size
        self._left = 0.5
        dampings = [robot.motors[name].damping or 0.0 for name in robot.joint_names]
        self._damping = np.array(dampings)
        self._velocity = np.zeros(len(stiffness))
        self._last: FloatArray | None = None
        self._rise = 1.0
        self._lean = 0.0

    def begin(self) -> None:
        """A stand begins in another pose than the last one, without these torques."""
        self._last, self._velocity[:], self._rise, self._lean = None, 0.0, 0.0, 0.0

    def lead(
        self, position: FloatArray, targets: BodyTargets, support: int, origin: Point2, dt: float,
        com_ahead: float = 0.0,
    ) -> FloatArray:
        """What to add to joint targets (n,) [rad].

        Args:
            position: Joint targets (n,) [rad].
            targets: The body targets behind them, of the robot's image.
            support: Supporting leg, LEFT or RIGHT; 0 = both.
            origin: Origin of the pendulum in Q [m], of the image.
            dt: Time since the last tick [s].
            com_ahead: By how much the CoM is ahead of its target on average [m], as far as there
                shall be torque for it; of the image.
        """
        if self._torque is None:
            return np.zeros(len(position))
        x, y, height = targets.com_in_q
        left, right = targets.left_sole, targets.right_sole
        yaw = 0.5 * (left.yaw + right.yaw)
        share = 0.5 * (1.0 + support)
        if support == 0:
            origin = (x, y)
            apart = rotate_planar(left.x - right.x, left.y - right.y, -yaw)[1]
            off = rotate_planar(x - right.x, y - right.y, -yaw)[1]
            share = min(max(off / max(apart, 1e-6), 0.0), 1.0)
        stride = dt / SHIFT_TIME
        self._left += min(max(share - self._left, -stride), stride)
        ahead, aside = rotate_planar(
            (x - origin[0]) / height, (y - origin[1]) / height, -yaw
        )

        def load(part: float, sole: SoleTarget, side: int) -> Load:
            px, py = rotate_planar(origin[0] - sole.x, origin[1] - sole.y, -yaw)
            py = py if side == support else 0.0
            return Load(part, self._length * px, self._length * py, ahead, aside)

        self._lean += min(1.0, dt / RISE_TIME) * (com_ahead / height - self._lean)
        velocity, acceleration = self._moves(position, dt)
        torque = self._torque.at(
            position, targets.torso_pitch + self._lean,
            (load(self._left, left, 1), load(1.0 - self._left, right, -1)), acceleration,
        )  # fmt: skip
        lead = self._yield * (torque + self._damping * velocity)
        if self._rise < 1.0:
            self._rise = min(1.0, self._rise + dt / RISE_TIME)
            lead *= self._rise
        return np.asarray(lead)

    def _moves(self, position: FloatArray, dt: float) -> tuple[FloatArray, FloatArray]:
        """Velocity (n,) [rad/s] and acceleration (n,) [rad/s^2] of the targets."""
        last = position if self._last is None else self._last
        self._last = position.copy()
        before, share = self._velocity, dt / (dt + SMOOTHING_TIME)
        self._velocity = before + share * ((position - last) / dt - before)
        change = (self._velocity - before) / dt
        return self._velocity, np.clip(change, -LARGEST, LARGEST)
