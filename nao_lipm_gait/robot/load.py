"""A robot from its URDF and its robot file."""

from collections.abc import Mapping
from pathlib import Path

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.resources import find
from nao_lipm_gait.resources import names as shipped
from nao_lipm_gait.robot.description import (
    JointLimit,
    RobotDescription,
    read_only,
)
from nao_lipm_gait.robot.robot_file import RobotFile
from nao_lipm_gait.robot.sole_outline import check_corners, check_outline
from nao_lipm_gait.robot.text_file import read_text
from nao_lipm_gait.robot.urdf_model import UrdfModel
from nao_lipm_gait.types import FloatArray

HIPS = ("shared_yaw_pitch", "yaw")
_STAND_SLACK = 0.02
"""[rad] by which the stand pose may pass a limit before it is refused instead of cut: the limits of
the published NAO models differ by that much."""
NAO = "nao_h21"
"""The robot file of a URDF whose joints no robot file knows; its error says which are missing."""


def load_robot(
    urdf: str | Path = "nao_h21_v33", robot: str | Path | None = None
) -> RobotDescription:
    """The robot of a URDF (shipped name or path) and a robot file (shipped name or path).

    Without a robot file it is the first shipped one whose joints the URDF has. Joints and links of
    the URDF that the robot file does not name are left alone. Raises NaoGaitError that names the
    file and the joint, link or key that is missing or makes no sense.
    """
    urdf_path = find("urdf", str(urdf))
    text = read_text(urdf_path, "URDF")
    model = UrdfModel.parse(text, urdf_path)
    robot_file = _fitting(model) if robot is None else RobotFile.load(find("robots", str(robot)))

    joint_names = robot_file.joint_names()
    limits = {name: model.limit(name) for name in joint_names}
    legs = robot_file.leg("left_leg", joint_names), robot_file.leg("right_leg", joint_names)
    soles = model.frame(robot_file.frame("left_sole")), model.frame(robot_file.frame("right_sole"))
    torso = model.frame(robot_file.frame("torso"))
    for leg, sole in zip(legs, soles, strict=True):
        model.check_leg(torso, sole, leg)
    outline = robot_file.points("sole_outline")
    corners = robot_file.points("sole_corners")
    check_outline(robot_file.where("sole_outline"), outline)
    check_corners(robot_file.where("sole_corners"), corners, outline)
    left_ankle = robot_file.ankle_rows()
    return RobotDescription(
        name=robot_file.text("name"),
        urdf_path=urdf_path,
        urdf=text,
        joint_names=joint_names,
        left_leg=legs[0],
        right_leg=legs[1],
        hip=robot_file.choice("hip", HIPS),
        coupled_joints=robot_file.coupled(joint_names),
        shoulder_pitch=robot_file.pair("shoulder_pitch", joint_names),
        shoulder_roll=robot_file.optional_pair("shoulder_roll", joint_names),
        waist_pitch=robot_file.optional_joint("waist_pitch", joint_names),
        preset=robot_file.preset(),
        gyro_axes=robot_file.optional_whole("gyro_axes", 2, 3),
        encoder_bits=robot_file.optional_whole("encoder_bits", 1, 24),
        base_frame=model.frame(robot_file.frame("base")),
        torso_frame=torso,
        imu_frame=model.frame(robot_file.frame("imu")),
        sole_frames=soles,
        stand_pose=_inside(robot_file.stand_pose(joint_names), joint_names, limits, urdf_path),
        sole_outline=outline,
        sole_corners=corners,
        ankle_limits={
            "left": left_ankle,
            "right": tuple((pitch, -high, -low) for pitch, low, high in left_ankle),
        },
        motors=robot_file.motors(joint_names),
        limits=limits,
    )


def _fitting(model: UrdfModel) -> RobotFile:
    """The shipped robot file that fits the joints of a URDF."""
    files = {name: RobotFile.load(find("robots", name)) for name in shipped("robots")}
    fitting = [file for file in files.values() if file.has_joints_of(model)]
    return fitting[0] if fitting else files[NAO]


def _inside(
    pose: Mapping[str, float],
    joint_names: tuple[str, ...],
    limits: Mapping[str, JointLimit],
    urdf_path: Path,
) -> FloatArray:
    """The pose as an array, cut at the limits; one that is far outside is refused."""
    values = []
    for name in joint_names:
        angle, limit = pose.get(name, 0.0), limits[name]
        if not limit.lower - _STAND_SLACK <= angle <= limit.upper + _STAND_SLACK:
            raise NaoGaitError(
                f"stand_pose of {name}", angle, f"{limit.lower} to {limit.upper} rad ({urdf_path})"
            )
        values.append(min(max(angle, limit.lower), limit.upper))
    return read_only(values)
