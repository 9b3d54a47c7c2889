"""Lengths of a pair of legs whose axes meet in points, read from the URDF.

Where the joints of one leg stand in a joint array.

What the gait asks of a pair of legs, whatever their hips look like.
"""

from typing import NamedTuple, Protocol

import pinocchio as pin

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.robot import LegJoints, RobotDescription
from nao_lipm_gait.types import Point3
from nao_lipm_gait.whole_body.body_model import SolePose


class LegAngles(NamedTuple):
    """One leg from the hip down [rad]."""

    hip_yaw: float
    hip_roll: float
    hip_pitch: float
    knee_pitch: float
    ankle_pitch: float
    ankle_roll: float


class LegSolution(NamedTuple):
    """Joint angles for two wanted soles, and how far they miss."""

    left: LegAngles
    right: LegAngles
    left_yaw_error: float
    right_yaw_error: float
    """[rad] wanted minus reached turn of each sole about its own normal."""
    reach_error: float
    """[m] by which the farther sole lies beyond the reach of its leg; 0 when in reach."""


class LegKinematics(Protocol):
    """Position and sole normal are met exactly wherever they are in reach."""

    def solve(self, left: SolePose, right: SolePose, *, again: bool = False) -> LegSolution:
        """Joint angles for two soles given in the torso frame.

        again: for the same tick as the last call; may be used for a good first guess.
        """


class LegColumns(NamedTuple):
    """Indices into `RobotDescription.joint_names`, from the hip down."""

    hip_yaw: int
    hip_roll: int
    hip_pitch: int
    knee_pitch: int
    ankle_pitch: int
    ankle_roll: int


def leg_columns(robot: RobotDescription, leg: LegJoints) -> LegColumns:
    """Those of one leg of this robot."""
    return LegColumns(
        robot.index(leg.hip_yaw),
        robot.index(leg.hip_roll),
        robot.index(leg.hip_pitch),
        robot.index(leg.knee_pitch),
        robot.index(leg.ankle_pitch),
        robot.index(leg.ankle_roll),
    )


OFFSET_MAX = 1e-6
"""[m]"""


class LegGeometry(NamedTuple):
    """Both legs: straight down from the hips in the zero pose, without offsets."""

    thigh: float
    """[m] hip axes to knee."""
    tibia: float
    """[m] knee to ankle axes."""
    foot_height: float
    """[m] ankle axes to sole."""
    left_hip: Point3
    """[m] where the hip axes meet, in the torso frame."""
    right_hip: Point3


def read_leg_geometry(robot: RobotDescription) -> LegGeometry:
    """The geometry of the legs; NaoGaitError where closed forms do not hold."""
    model = pin.buildModelFromXML(robot.urdf)
    data = model.createData()
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    torso = data.oMf[model.getFrameId(robot.torso_frame, pin.FrameType.BODY)]

    def in_torso(joint: str) -> Point3:
        x, y, z = torso.actInv(data.oMi[model.getJointId(joint)]).translation.tolist()
        return x, y, z

    left = robot.left_leg
    sole_frame = model.getFrameId(robot.sole_frames[0], pin.FrameType.BODY)
    sole = torso.actInv(data.oMf[sole_frame]).translation.tolist()
    hip, knee, ankle = map(in_torso, (left.hip_pitch, left.knee_pitch, left.ankle_pitch))
    aside = sum(abs(point[i] - hip[i]) for point in (knee, ankle, sole) for i in (0, 1))
    apart = max(map(abs, _minus(in_torso(left.hip_roll), hip)))
    apart = max(apart, *map(abs, _minus(in_torso(left.ankle_roll), ankle)))
    if aside + apart > OFFSET_MAX:
        raise NaoGaitError(
            f"URDF {robot.urdf_path}",
            f"leg offsets of {aside + apart:.6f} m",
            "hip axes that meet in one point, above knee, ankle and sole in the zero pose",
        )
    return LegGeometry(
        thigh=hip[2] - knee[2],
        tibia=knee[2] - ankle[2],
        foot_height=ankle[2] - sole[2],
        left_hip=hip,
        right_hip=in_torso(robot.right_leg.hip_pitch),
    )


def _minus(a: Point3, b: Point3) -> Point3:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]
