"""The interface of leg kinematics, and the geometry that it is made from.

The geometry of a robot's legs decides which kinematics it has, see `legs`. All of them work on a
pair of legs, because the two hips of a NAO share one motor.
"""

from math import sqrt
from typing import NamedTuple, Protocol, final

import pinocchio as pin

from nao_lipm_gait.whole_body.body_model import SolePose
from robot_core.motion.joints import joint_signs
from robot_core.robot import LegJoints, RobotDescription
from robot_core.types import Point3

OFFSET_MAX = 1e-6
"""Largest sum of leg offsets that counts as none [m]."""
ALIGNED = 1.0 - 1e-9
"""Smallest cosine of the angle between a joint's axis and that of the closed form."""
SQRT_HALF = sqrt(0.5)


@final
class LegAngles:
    """Joint angles of one leg [rad].

    Attributes:
        hip_yaw: Hip yaw, or the yaw-pitch that both legs share.
        hip_roll: Hip roll.
        hip_pitch: Hip pitch.
        knee_pitch: Knee.
        ankle_pitch: Ankle pitch.
        ankle_roll: Ankle roll.
    """

    __slots__ = ("ankle_pitch", "ankle_roll", "hip_pitch", "hip_roll", "hip_yaw", "knee_pitch")

    def __init__(
        self,
        hip_yaw: float,
        hip_roll: float,
        hip_pitch: float,
        knee_pitch: float,
        ankle_pitch: float,
        ankle_roll: float,
    ):
        self.hip_yaw = hip_yaw
        self.hip_roll = hip_roll
        self.hip_pitch = hip_pitch
        self.knee_pitch = knee_pitch
        self.ankle_pitch = ankle_pitch
        self.ankle_roll = ankle_roll


@final
class LegSolution:
    """Joint angles for two soles, and how far they miss them.

    Attributes:
        left: Angles of the left leg.
        right: Angles of the right leg.
        left_yaw_error: Wanted minus reached rotation of the left sole about its normal [rad].
        right_yaw_error: The same for the right sole [rad].
        reach_error: Distance by which the farther sole is beyond its leg's reach [m]; 0 in reach.
    """

    __slots__ = ("left", "left_yaw_error", "reach_error", "right", "right_yaw_error")

    def __init__(
        self,
        left: LegAngles,
        right: LegAngles,
        left_yaw_error: float,
        right_yaw_error: float,
        reach_error: float,
    ):
        self.left = left
        self.right = right
        self.left_yaw_error = left_yaw_error
        self.right_yaw_error = right_yaw_error
        self.reach_error = reach_error


class LegKinematics(Protocol):
    """Inverse kinematics of both legs; exact in position and sole normal within reach."""

    def solve(self, left: SolePose, right: SolePose, *, again: bool = False) -> LegSolution:
        """Joint angles for two soles.

        Args:
            left: Left sole in the torso frame.
            right: Right sole in the torso frame.
            again: Whether this is a further call of the same tick, close to the last one.

        Returns:
            The solution.
        """


class LegColumns:
    """Where the joints of one leg are in joint arrays, and how they turn.

    Args:
        robot: The robot; its `joint_names` give the order of joint arrays.
        leg: The leg.

    Attributes:
        hip_yaw: Index of the hip yaw.
        hip_roll: Index of the hip roll.
        hip_pitch: Index of the hip pitch.
        knee_pitch: Index of the knee.
        ankle_pitch: Index of the ankle pitch.
        ankle_roll: Index of the ankle roll.
        ankle_pitch_sign: +1 for an ankle pitch about +y, -1 about -y.
        ankle_roll_sign: The same for the ankle roll and x.
    """

    def __init__(self, robot: RobotDescription, leg: LegJoints):
        signs = joint_signs(robot)
        self.hip_yaw = robot.index(leg.hip_yaw)
        self.hip_roll = robot.index(leg.hip_roll)
        self.hip_pitch = robot.index(leg.hip_pitch)
        self.knee_pitch = robot.index(leg.knee_pitch)
        self.ankle_pitch = robot.index(leg.ankle_pitch)
        self.ankle_roll = robot.index(leg.ankle_roll)
        self.ankle_pitch_sign = signs[self.ankle_pitch]
        self.ankle_roll_sign = signs[self.ankle_roll]

    def write(self, angles: LegAngles, joints: "memoryview[float]") -> None:
        """Write the angles of the leg into a joint array (n,) [rad]."""
        joints[self.hip_yaw] = angles.hip_yaw
        joints[self.hip_roll] = angles.hip_roll
        joints[self.hip_pitch] = angles.hip_pitch
        joints[self.knee_pitch] = angles.knee_pitch
        joints[self.ankle_pitch] = angles.ankle_pitch
        joints[self.ankle_roll] = angles.ankle_roll


class LegGeometry(NamedTuple):
    """Lengths of both legs, which hang straight down from the hips in the zero pose.

    Attributes:
        thigh: Hip axes to knee [m].
        tibia: Knee to ankle axes [m].
        foot_height: Ankle axes to sole [m].
        left_hip: Intersection of the left hip axes in the torso frame [m].
        right_hip: The same of the right hip [m].
    """

    thigh: float
    tibia: float
    foot_height: float
    left_hip: Point3
    right_hip: Point3


def read_leg_geometry(robot: RobotDescription) -> LegGeometry | None:
    """The geometry of legs for which closed forms hold, from the URDF.

    Args:
        robot: The robot.

    Returns:
        The geometry; None for legs whose joints follow in another order than yaw, roll, pitch,
        knee, ankle pitch and roll, turn about other axes, or have offsets.
    """
    model = pin.buildModelFromXML(robot.urdf)
    data = model.createData()
    pin.computeJointJacobians(model, data, pin.neutral(model))
    pin.updateFramePlacements(model, data)
    torso = data.oMf[model.getFrameId(robot.torso_frame, pin.FrameType.BODY)]
    if any(robot.stand_pose[i] != 0.0 for i in _held(robot, model)):
        return None

    def in_torso(joint: str) -> Point3:
        x, y, z = torso.actInv(data.oMi[model.getJointId(joint)]).translation.tolist()
        return x, y, z

    for leg, side in ((robot.left_leg, 1.0), (robot.right_leg, -1.0)):
        indices = [model.getJointId(name) for name in leg.as_dict().values()]
        if indices != sorted(indices):
            return None
        tilted = (0.0, SQRT_HALF, -side * SQRT_HALF)
        hip = tilted if robot.coupled_joints else (0.0, 0.0, 1.0)
        x, y = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
        for index, axis in zip(indices, (hip, x, y, y, y, x), strict=True):
            jacobian = pin.getJointJacobian(model, data, index, pin.ReferenceFrame.WORLD)
            turned = torso.rotation.T @ jacobian[3:, model.joints[index].idx_v]
            if turned @ axis < ALIGNED:
                return None
    left = robot.left_leg
    sole_frame = model.getFrameId(robot.sole_frames[0], pin.FrameType.BODY)
    sole = torso.actInv(data.oMf[sole_frame]).translation.tolist()
    hip, knee, ankle = map(in_torso, (left.hip_pitch, left.knee_pitch, left.ankle_pitch))
    aside = sum(abs(point[i] - hip[i]) for point in (knee, ankle, sole) for i in (0, 1))
    apart = max(map(abs, _minus(in_torso(left.hip_roll), hip)))
    apart = max(apart, *map(abs, _minus(in_torso(left.ankle_roll), ankle)))
    if aside + apart > OFFSET_MAX:
        return None
    return LegGeometry(
        thigh=hip[2] - knee[2],
        tibia=knee[2] - ankle[2],
        foot_height=ankle[2] - sole[2],
        left_hip=hip,
        right_hip=in_torso(robot.right_leg.hip_pitch),
    )


def _held(robot: RobotDescription, model: pin.Model) -> list[int]:
    """Indices of the driven joints between torso and legs."""
    above: set[str] = set()
    for leg in (robot.left_leg, robot.right_leg):
        supports = model.supports[model.getJointId(leg.hip_pitch)].tolist()
        above |= {model.names[index] for index in supports} - set(leg.names)
    return [robot.index(name) for name in robot.joint_names if name in above]


def _minus(a: Point3, b: Point3) -> Point3:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]
