"""What crosses the boundary of the gait: sensors and commands in, joint targets and status out.

Joint arrays (n,) follow `RobotDescription.joint_names`. Stamps are integer nanoseconds.
"""

from enum import StrEnum
from typing import Any, NamedTuple, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

Point2 = tuple[float, float]
"""x, y [m]."""
Point3 = tuple[float, float, float]
"""x, y, z [m], or another vector with its own unit."""
Pose2 = tuple[float, float, float]
"""Planar pose: x, y [m], yaw [rad]."""
Pose6 = tuple[float, float, float, float, float, float]
"""Pose in space: x, y, z [m], roll, pitch, yaw [rad]."""

_T = TypeVar("_T")
Given: TypeAlias = _T | Any
"""What a user gives, before it is checked: machine code lets pass what is of another type."""

GRAVITY = 9.81
"""Gravitational acceleration [m/s^2]."""

LEFT, RIGHT = +1, -1
"""The side of a leg. Arrays and pairs hold the left side first: index 0 left, 1 right."""


class SensorFrame(NamedTuple):
    """All sensors of one sampling instant.

    Attributes:
        stamp: Sampling time [ns].
        joint_position: Joint angles (n,) [rad].
        angular_velocity: Angular velocity (3,) [rad/s] of the torso in the torso frame (REP-145).
        linear_acceleration: Specific force (3,) [m/s^2] in the torso frame; (0, 0, +9.81) at rest
            upright (REP-145).
        late: Control periods by which the frame is older on arrival than the walk is set to; below
            0 fresher.
        lifted: Something else than its soles carries the robot.
        mean_angular_velocity: Mean (3,) [rad/s] since the last frame, in the torso frame, where
            samples were lost; None = `angular_velocity`.
    """

    stamp: int
    joint_position: FloatArray
    angular_velocity: FloatArray
    linear_acceleration: FloatArray
    late: int = 0
    lifted: bool = False
    mean_angular_velocity: FloatArray | None = None


class VelocityCommand(NamedTuple):
    """Commanded velocity of the robot in its own heading frame (REP-103).

    Attributes:
        x: Forward [m/s].
        y: Left [m/s].
        yaw: Counter-clockwise [rad/s].
    """

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0

    @property
    def is_zero(self) -> bool:
        """Whether the robot is to stand."""
        return self.x == 0.0 and self.y == 0.0 and self.yaw == 0.0


STANDSTILL = VelocityCommand()


class JointTargets(NamedTuple):
    """The answer to one sensor frame.

    Attributes:
        stamp: Stamp [ns] of the sensor frame.
        position: Joint angles (n,) [rad], inside the joint limits.
        stiffness: Share of the motors' torque that may be used, 0 (limp) to 1.
        joint_stiffness: The same for each joint (n,) if they differ; `stiffness` is then the
            smallest.
        lead: What of `position` (n,) [rad] is there for motors to exert torque; None = nothing.
    """

    stamp: int
    position: FloatArray
    stiffness: float = 1.0
    joint_stiffness: FloatArray | None = None
    lead: FloatArray | None = None

    @property
    def pose(self) -> FloatArray:
        """Where the joints (n,) [rad] shall be."""
        return self.position if self.lead is None else self.position - self.lead


class GaitState(StrEnum):
    """Mode of the gait; `modes.TRANSITIONS` lists the changes between them.

    Attributes:
        STAND: Stands in the stand pose, or moves into it.
        WALK: Walks.
        STOP: Brings the CoM to rest; both feet stay on the ground.
        LIFTED: Holds the stand pose in the air.
        MOTION: Runs a motion of keyframes, or holds its last pose.
        GETTING_UP: Runs a motion that begins lying.
        FALLEN: Lies or falls; all joints are limp.
        RELAXED: All joints are limp on request.
    """

    STAND = "stand"
    WALK = "walk"
    STOP = "stop"
    LIFTED = "lifted"
    MOTION = "motion"
    GETTING_UP = "getting_up"
    FALLEN = "fallen"
    RELAXED = "relaxed"


def state_of(support: str) -> GaitState | None:
    """The state in a text of the topic `gait/support`, e.g. `walk left`; None if there is none."""
    words = support.split()
    return GaitState(words[0]) if words and words[0] in set(GaitState) else None


# The tick uses these names: a global is looked up faster than a member of an enumeration.
STAND, WALK, STOP = GaitState.STAND, GaitState.WALK, GaitState.STOP
LIFTED = GaitState.LIFTED
MOTION, GETTING_UP = GaitState.MOTION, GaitState.GETTING_UP
FALLEN, RELAXED = GaitState.FALLEN, GaitState.RELAXED

DOWN = (FALLEN, RELAXED)
"""All joints are limp."""
ON_THE_WAY = (WALK, STOP)
"""The walk moves the robot."""
UPRIGHT = (STAND, *ON_THE_WAY, LIFTED)
"""The targets come from the walk engine."""
IN_MOTION = (MOTION, GETTING_UP)
"""A motion moves or holds the robot."""
BUSY = (*ON_THE_WAY, *IN_MOTION)
"""The walk or a motion moves or holds the robot."""


class PoseCovariance(NamedTuple):
    """Covariance of x, y [m] and yaw [rad] of base_footprint in odom."""

    xx: float = 0.0
    xy: float = 0.0
    yy: float = 0.0
    x_yaw: float = 0.0
    y_yaw: float = 0.0
    yaw: float = 0.0

    @property
    def matrix(self) -> FloatArray:
        """The covariance as a symmetric array (3, 3)."""
        xx, xy, yy, x_yaw, y_yaw, yaw = self
        return np.array(((xx, xy, x_yaw), (xy, yy, y_yaw), (x_yaw, y_yaw, yaw)))


class GaitStatus(NamedTuple):
    """The state of the gait after a tick, for topics, bags and figures.

    Q is the paper's coordinate system of the current single support phase, on the ground plane. The
    CoM positions are those at the time of the sensor frame.

    Attributes:
        stamp: Stamp [ns] of the sensor frame.
        state: Mode of the gait.
        support: Support leg: `left`, `right` or `double`.
        com_expected_in_q: CoM [m] that the walk expected to be measured; z is `com_height`.
        com_measured_in_q: Measured CoM [m].
        com_estimated_in_q: CoM [m] after the correction by the measurement; z is `com_height`.
        pendulum_origin_in_q: Origin of the pendulum, or ZMP [m].
        step_size: Pose of the next Q in Q.
        step_count: Number of support changes since the walk began.
        time_to_support_change: Time [s] until the support changes; 0 while standing.
        q_in_odom: Pose of Q.
        base_footprint_in_odom: Pose of base_footprint by odometry.
        velocity: Velocity of base_footprint in its own frame [m/s, m/s, rad/s].
        left_sole_in_odom: Target of the left sole.
        right_sole_in_odom: Target of the right sole.
        torso_roll: Roll [rad] of the torso.
        torso_pitch: Pitch [rad] of the torso.
        ik_residual: Largest distance [m] of a sole from its target; 0 when in reach.
        clipped_joints: Number of targets that were clipped at a joint limit.
        motion: Name of the running motion, or empty.
        pose_covariance: Covariance of `base_footprint_in_odom`.
        yaw_rate_variance: Variance [rad^2/s^2] of the yaw rate in `velocity`.
        blocked: The robot walks against something.
    """

    stamp: int
    state: GaitState
    support: str
    com_expected_in_q: Point3
    com_measured_in_q: Point3
    com_estimated_in_q: Point3
    pendulum_origin_in_q: Point2
    step_size: Pose2
    step_count: int
    time_to_support_change: float
    q_in_odom: Pose2
    base_footprint_in_odom: Pose2
    velocity: Pose2
    left_sole_in_odom: Pose6
    right_sole_in_odom: Pose6
    torso_roll: float
    torso_pitch: float
    ik_residual: float
    clipped_joints: int
    motion: str = ""
    pose_covariance: PoseCovariance = PoseCovariance()
    yaw_rate_variance: float = 0.0
    blocked: bool = False
