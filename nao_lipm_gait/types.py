"""What crosses the boundary of the gait: one frame of sensors in, joint targets and a status out.

Joint arrays follow `RobotDescription.joint_names`. Stamps are integer nanoseconds.
"""

from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

GRAVITY = 9.81
"""[m/s^2]"""


@dataclass(frozen=True, slots=True)
class SensorFrame:
    """All sensors of one sampling instant."""

    stamp: int
    """Sampling time [ns]."""
    joint_position: FloatArray
    """(n,) [rad]."""
    joint_velocity: FloatArray
    """(n,) [rad/s]."""
    angular_velocity: FloatArray
    """(3,) [rad/s] of the torso, in the torso frame (REP-145)."""
    linear_acceleration: FloatArray
    """(3,) specific force [m/s^2] in the torso frame; (0, 0, +9.81) at rest upright (REP-145)."""
    sole_load: tuple[float, float] | None = None
    """Normal force on the left and right sole [N]; None where the robot cannot measure it."""


class VelocityCommand(NamedTuple):
    """The asked velocity of the robot in its own heading frame (REP-103)."""

    x: float = 0.0
    """Forward [m/s]."""
    y: float = 0.0
    """Left [m/s]."""
    yaw: float = 0.0
    """Counter-clockwise [rad/s]."""

    @property
    def is_zero(self) -> bool:
        return self.x == 0.0 and self.y == 0.0 and self.yaw == 0.0


STANDSTILL = VelocityCommand()


class JointTargets(NamedTuple):
    """The answer to one sensor frame."""

    stamp: int
    """Stamp of the sensor frame that is answered [ns]."""
    position: FloatArray
    """(n,) [rad], inside the joint limits."""
    stiffness: float = 1.0
    """Share of the motors' torque that may be used, 0 (relaxed) to 1."""
    joint_stiffness: FloatArray | None = None
    """(n,) the same for each joint, where they differ; `stiffness` is then the smallest."""


class GaitState(StrEnum):
    """What the gait is doing."""

    STAND = "stand"
    WALK = "walk"
    STOP = "stop"
    MOTION = "motion"
    """A motion of keyframes runs, or its last pose is held."""
    GETTING_UP = "getting_up"
    FALLEN = "fallen"
    RELAXED = "relaxed"


# By these names the tick asks for them: Python looks a member of an enumeration up by a function.
STAND, WALK, STOP = GaitState.STAND, GaitState.WALK, GaitState.STOP
MOTION, GETTING_UP = GaitState.MOTION, GaitState.GETTING_UP
FALLEN, RELAXED = GaitState.FALLEN, GaitState.RELAXED

DOWN = (FALLEN, RELAXED)
ON_THE_WAY = (WALK, STOP)
IN_MOTION = (MOTION, GETTING_UP)
BUSY = (*ON_THE_WAY, *IN_MOTION)
"""It walks, or a motion moves or holds it."""

LEFT, RIGHT = +1, -1
"""The side of a leg. Arrays and pairs hold the left side first: index 0 left, 1 right."""

Point2 = tuple[float, float]
"""x, y [m]."""
Point3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
"""x, y, z, w, of unit length."""
Pose2 = tuple[float, float, float]
"""x [m], y [m], yaw [rad]."""
Pose6 = tuple[float, float, float, float, float, float]
"""x, y, z [m], roll, pitch, yaw [rad]."""


class GaitStatus(NamedTuple):
    """A snapshot of the gait after a tick, for topics, bags and figures.

    The three CoM positions belong to the stamp of the frame that was answered and are relative to
    Q, the paper's coordinate system of the current single support phase, on the ground plane.
    """

    stamp: int
    state: GaitState
    support: str
    """`left`, `right` or `double`."""
    com_expected_in_q: Point3
    com_measured_in_q: Point3
    com_estimated_in_q: Point3
    pendulum_origin_in_q: tuple[float, float]
    step_size: Pose2
    """Offset from Q to the next Q of the running step."""
    step_count: int
    """Number of support changes since the walk began."""
    time_to_support_change: float
    """[s]; 0 while standing."""
    q_in_odom: Pose2
    base_footprint_in_odom: Pose2
    velocity: Pose2
    """Odometry velocity of base_footprint in its own frame [m/s, m/s, rad/s]."""
    left_sole_in_odom: Pose6
    """Commanded sole pose."""
    right_sole_in_odom: Pose6
    torso_roll: float
    torso_pitch: float
    ik_residual: float
    """Largest distance of a sole from its target [m]; 0 when in reach."""
    clipped_joints: int
    """Targets that were cut at a joint limit this tick."""
    motion: str = ""
    """The motion that runs; empty when none does."""
