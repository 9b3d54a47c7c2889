"""Free fall and landing: the referee drops robots, with their joints at zero.

Whoever feels no force for a while and has straight legs has been dropped: in a walk or a fall the
knees are bent, and who lies is pushed for a cycle or two. So has a robot whose legs have turned
faster than any motor: the server straightens them at once, and in the next message they are on
their way back to the walk. The legs then go to a pose that gives way, and the walk begins anew once
the robot has come to rest.
"""

import math

import numpy as np

from rcss_bridge.body import CYCLE
from robot_core.robot import RobotDescription
from robot_core.types import GRAVITY, FloatArray, JointTargets, SensorFrame

FREE = 0.3
"""Share of gravity below which nothing carries the robot."""
FREE_TIME = 0.1
"""[s] of free fall with straight legs that is a drop; the fall takes 0.3 s."""
STRAIGHT = 0.2
"""[rad] up to which the joints of the legs count as at zero."""
JUMP = 1.1
"""Times the no-load speed of the fastest motor of the legs: no joint turns so fast."""
CALM_FORCE, CALM_RATE = 2.0, 0.3
"""Largest difference of the specific force from gravity [m/s^2] and rate [rad/s] of a robot at
rest."""
CALM_TIME = 0.3
"""[s] of rest after which it has landed."""
LANDING_MAX = 2.0
"""[s] after the ground was felt; whoever does not come to rest within it has fallen."""
BEND = 0.26
"""[rad] of the hip and the ankle; the knee bends twice as far."""
STIFFNESS = 0.6
"""Share of the gains with which the legs land."""


class Landing:
    """Watches one robot; `targets` is not None while it falls freely and lands.

    Attributes:
        active: The robot falls or lands.
        count: Number of drops.
    """

    def __init__(self, robot: RobotDescription) -> None:
        pose = np.array(robot.stand_pose)
        for leg in (robot.left_leg, robot.right_leg):
            sign = math.copysign(1.0, pose[robot.index(leg.knee_pitch)])
            pose[[robot.index(name) for name in leg.names]] = 0.0
            pose[robot.index(leg.hip_pitch)] = -sign * BEND
            pose[robot.index(leg.knee_pitch)] = 2.0 * sign * BEND
            pose[robot.index(leg.ankle_pitch)] = -sign * BEND
        self._pose = pose
        self._legs = [robot.index(name) for name in robot.leg_joints]
        self.active = False
        self.count = 0
        self._calm = self._since = 0.0
        self._falls = 0
        speeds = [robot.motors[name].no_load_speed for name in robot.leg_joints]
        self._speed_max = JUMP * max(speeds)
        self._before = np.zeros(len(self._legs))
        self._stamp: int | None = None

    def drop(self) -> None:
        """The robot is going to be dropped."""
        if not self.active:
            self.count += 1
        self.active = True
        self._calm = self._since = 0.0

    def update(self, frame: SensorFrame) -> JointTargets | None:
        """Targets while it falls and lands; None when the walk is in charge."""
        force = float(np.linalg.norm(frame.linear_acceleration))
        rate = float(np.max(np.abs(frame.angular_velocity)))
        free = force < FREE * GRAVITY
        legs = frame.joint_position[self._legs]
        falls = free and float(np.max(np.abs(legs))) < STRAIGHT
        self._falls = self._falls + 1 if falls else 0
        if self._has_jumped(frame.stamp, legs) or self._falls * CYCLE >= FREE_TIME:
            self.drop()
        if not self.active:
            return None
        calm = abs(force - GRAVITY) < CALM_FORCE and rate < CALM_RATE
        self._calm = self._calm + CYCLE if calm else 0.0
        self._since = 0.0 if free else self._since + CYCLE
        if self._calm >= CALM_TIME or self._since >= LANDING_MAX:
            self.active = False
            return None
        return JointTargets(frame.stamp, self._pose, STIFFNESS)

    def _has_jumped(self, stamp: int, legs: FloatArray) -> bool:
        """Whether the joints of the legs have turned faster than any motor."""
        turned = float(np.max(np.abs(legs - self._before)))
        seconds = math.inf if self._stamp is None else 1e-9 * (stamp - self._stamp)
        self._before, self._stamp = legs, stamp
        return turned > self._speed_max * max(seconds, CYCLE)
