"""Loads a robot from its URDF and its robot file."""

import io
import os
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from functools import cache
from pathlib import Path

from robot_core.errors import NaoGaitError
from robot_core.resources import find, names
from robot_core.robot.derive import completed, driven_joints, relative_size
from robot_core.robot.description import Camera, JointLimit, RobotDescription, read_only
from robot_core.robot.mjcf import urdf_of_mjcf
from robot_core.robot.robot_file import (
    RobotFile,
    check_given,
    checked_robot_file,
    read_robot_file,
)
from robot_core.robot.urdf_check import check_description, check_names, checked_urdf
from robot_core.robot.urdf_model import LARGEST_URDF, UrdfModel
from robot_core.schema import read_text
from robot_core.types import FloatArray, Point2

_STAND_SLACK = 0.02
"""[rad] The stand pose may exceed a limit by this much and is then clipped, because the limits of
the published NAO models differ."""
NAO = "nao_h21"
ALIKE = 0.8
"""Share of a robot file's joints from which on a URDF without the others is refused by name;
another robot whose joints have common names (LHipRoll) has fewer of them."""


def load_robot(
    urdf: str | Path = "nao_h21_v33", robot: str | Path | None = None
) -> RobotDescription:
    """Load a robot.

    Joints and links of the URDF that the robot file does not name are ignored. A shipped one is
    loaded once in a process, and is the same object from then on.

    Args:
        urdf: Shipped name or path of the URDF or MJCF, or of a robot file (YAML) that names it.
        robot: Shipped name or path of the robot file; None = that beside the URDF with its name
            and `.yaml`, else the shipped one of the name in the URDF's <robot>, else the first
            whose joints the URDF has. A URDF that none fits is taken by itself, see `derive`.

    Returns:
        The robot.

    Raises:
        NaoGaitError: Names the file and the joint, link or key that is missing or not allowed.
    """
    shipped = str(urdf) in names("urdf") and (robot is None or str(robot) in names("robots"))
    return (_shipped if shipped else _loaded)(urdf, robot)


def _loaded(urdf: str | Path, robot: str | Path | None) -> RobotDescription:
    if robot is None and str(urdf).lower().endswith((".yaml", ".yml")):
        robot = find("robots", str(urdf))
        urdf = _urdf_of(robot)
    urdf_path = find("urdf", str(urdf))
    text = read_text(urdf_path, "URDF", LARGEST_URDF)
    if _root_tag(text) == "mujoco":  # a URDF may have one inside
        text = urdf_of_mjcf(urdf_path)
    model = UrdfModel.parse(text, urdf_path)
    file_path = _fitting(model, urdf_path) if robot is None else find("robots", str(robot))
    values = {} if file_path is None else read_robot_file(file_path)
    element = ET.fromstring(text)
    # First what is plainly wrong: what is derived from it, as a stand, would be blamed instead.
    check_names(element, urdf_path)
    if file_path is not None:
        check_given(values, file_path)
    joints = values["joints"] if "joints" in values else driven_joints(element, urdf_path)
    for name in joints if isinstance(joints, list) else ():
        if isinstance(name, str):
            model.limit(name)
    check_description(element, urdf_path)
    given = values
    values = completed(given, element, urdf_path)
    file = checked_robot_file(values, file_path or urdf_path)
    if len(element) != len(ET.fromstring(text)):
        text = ET.tostring(element, encoding="unicode")
        model = UrdfModel.parse(text, urdf_path)

    limits = {name: model.limit(name) for name in file.joints}
    soles = model.frame(file.frames.left_sole), model.frame(file.frames.right_sole)
    torso = model.frame(file.frames.torso)
    for leg, sole in zip((file.left_leg, file.right_leg), soles, strict=True):
        model.check_leg(torso, sole, leg, file.joints)
    text, remarks = checked_urdf(text, urdf_path, file.joints, torso, soles)
    return RobotDescription(
        name=file.name,
        urdf_path=urdf_path,
        urdf=text,
        remarks=remarks,
        from_urdf=tuple(key for key in values if values[key] != given.get(key)),
        robot_file=file_path,
        joint_names=file.joints,
        left_leg=file.left_leg,
        right_leg=file.right_leg,
        coupled_joints=file.coupled_joints,
        head=file.head,
        shoulder_pitch=file.shoulder_pitch,
        shoulder_roll=file.shoulder_roll,
        waist_pitch=file.waist_pitch,
        size=file.size if file.size is not None else relative_size(values, element, urdf_path),
        preset=file.preset and _beside(file_path or urdf_path, file.preset),
        gyro_axes=file.gyro_axes,
        encoder_bits=file.encoder_bits,
        command_lag=file.command_lag,
        base_frame=model.frame(file.frames.base),
        torso_frame=torso,
        upper_body_frame=torso if file.waist_pitch is None else model.child(file.waist_pitch),
        imu_frame=model.frame(file.frames.imu),
        sole_frames=soles,
        stand_pose=_inside(file.stand_pose, file.joints, limits, urdf_path),
        sole_outline=file.sole_outline,
        sole_corners=file.sole_corners,
        ankle_limits={} if file.ankle_limits is None else {
            "left": file.ankle_limits,
            "right": tuple((pitch, -high, -low) for pitch, low, high in file.ankle_limits),
        },
        motors=file.motor_of(),
        motions=file.motions or file.name,
        force_sensors=_both_soles(file.force_sensors),
        battery=file.battery,
        cameras=_cameras(model, file),
        limits=limits,
    )


_shipped = cache(_loaded)


def _root_tag(text: str) -> str:
    """Name of the root element of an XML text; empty if there is none."""
    try:
        _, element = next(iter(ET.iterparse(io.StringIO(text), ("start",))))
    except ET.ParseError:
        return ""  # refused where the text is read as a whole
    return str(element.tag)


def _urdf_of(file: Path) -> str:
    """The URDF that a robot file names: beside it, or a shipped one."""
    name = read_robot_file(file).get("urdf")
    if not isinstance(name, str):
        allowed = "the name of a URDF beside the file, or a shipped one"
        raise NaoGaitError(f"robot file {file}: urdf", name, allowed)
    return _beside(file, name)


def _beside(file: Path, name: str) -> str:
    """The path of a file that a robot file names, if it is beside it; else the name."""
    beside = file.parent / name
    return str(beside) if os.path.isfile(beside) else name  # false for a name too long for a file


def _fitting(model: UrdfModel, path: Path) -> Path | None:
    """The robot file of a URDF; None if none fits."""
    beside = path.with_suffix(".yaml")
    if beside.is_file():
        return beside
    if model.name in names("robots"):
        return find("robots", model.name)
    files = {name: read_robot_file(find("robots", name)) for name in names("robots")}
    shares = {
        name: sum(map(model.has_joint, file["joints"])) / len(file["joints"])
        for name, file in files.items()
        if any(model.first_of(tuple(links)) for links in file["frames"].values())
    }
    best = max(shares, key=lambda name: (shares[name], name == NAO), default=None)
    return find("robots", best) if best is not None and shares[best] > ALIKE else None


def _cameras(model: UrdfModel, file: RobotFile) -> dict[str, Camera]:
    """The cameras whose optical frame the URDF has: other models of a robot may lack one."""
    return {
        name: Camera(frame, entry.hfov)
        for name, entry in file.cameras.items()
        if (frame := model.first_of(entry.frame)) is not None
    }


def _both_soles(
    left: tuple[Point2, ...] | None,
) -> tuple[tuple[Point2, ...], tuple[Point2, ...]] | None:
    """The force sensors of the left sole, and those of its mirror image in the same order."""
    if left is None:
        return None
    front_left, front_right, rear_left, rear_right = ((x, -y) for x, y in left)
    return left, (front_right, front_left, rear_right, rear_left)


def _inside(
    pose: Mapping[str, float],
    joint_names: tuple[str, ...],
    limits: Mapping[str, JointLimit],
    urdf_path: Path,
) -> FloatArray:
    """Clip a pose at the joint limits; refuse one that is further outside.

    Args:
        pose: [rad] By joint; 0 for joints that are not named.
        joint_names: The order of the result.
        limits: Limits by joint.
        urdf_path: Path of the URDF, for the error message.

    Returns:
        (n,) [rad]; read-only.

    Raises:
        NaoGaitError: An angle is outside its limits.
    """
    values = []
    for name in joint_names:
        angle, limit = pose.get(name, 0.0), limits[name]
        if not limit.lower - _STAND_SLACK <= angle <= limit.upper + _STAND_SLACK:
            raise NaoGaitError(
                f"stand_pose of {name}", angle, f"{limit.lower} to {limit.upper} rad ({urdf_path})"
            )
        values.append(min(max(angle, limit.lower), limit.upper))
    return read_only(values)
