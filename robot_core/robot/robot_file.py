"""The parameter file of a robot (config/robots): the facts that its URDF does not hold.

What it leaves out comes from the URDF, see `derive`.
"""

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import attrs

from robot_core import schema
from robot_core.errors import NaoGaitError
from robot_core.resources import read_layers
from robot_core.robot.description import Battery, LegJoints, Motor
from robot_core.schema import Number, Sequence, Settings, Table, Text, group, number, text
from robot_core.types import Point2


def _names(minimum: int, maximum: float = math.inf, default: Any = schema.REQUIRED) -> Any:
    """A list of names, each one once."""
    return schema.field(Sequence(Text(), minimum, maximum, unique=True), default)


def _rows(length: int, minimum: int) -> Any:
    """A list of rows of numbers."""
    return schema.field(Sequence(Sequence(Number(), length, length), minimum))


@attrs.frozen
class Frames(Settings):
    """Links by role; the first name of a role that the URDF has is used."""

    base: tuple[str, ...] = _names(1)
    torso: tuple[str, ...] = _names(1)
    imu: tuple[str, ...] = _names(1)
    left_sole: tuple[str, ...] = _names(1)
    right_sole: tuple[str, ...] = _names(1)


@attrs.frozen(kw_only=True)
class MotorEntry(Motor):
    """A kind of motor and the joints that have it."""

    joints: tuple[str, ...] = _names(1)


@attrs.frozen
class CameraEntry(Settings):
    """A camera: links of its optical frame, as `Frames`, and its horizontal angle of view."""

    frame: tuple[str, ...] = _names(1)
    hfov: float = number(minimum=0.1, maximum=2.8, unit="rad")


@attrs.frozen
class RobotFile(Settings):
    """A robot file. Rows of `ankle_limits` are AnklePitch, lowest and highest AnkleRoll [rad].

    A file may name a `base`: it then holds only the keys that differ from that file.
    """

    name: str = text()
    joints: tuple[str, ...] = _names(1)
    left_leg: LegJoints = group(LegJoints)
    right_leg: LegJoints = group(LegJoints)
    coupled_joints: tuple[tuple[str, str], ...] = schema.field(
        Sequence(Sequence(Text(), 2, 2, unique=True)), meaning="[leader, follower] pairs."
    )
    frames: Frames = group(Frames)
    stand_pose: dict[str, float] = schema.field(Table(Number(unit="rad")))
    sole_outline: tuple[Point2, ...] = _rows(2, 3)
    sole_corners: tuple[Point2, ...] = _rows(2, 4)
    motors: tuple[MotorEntry, ...] = schema.field(Sequence(schema.Group(MotorEntry)))
    ankle_limits: tuple[tuple[float, float, float], ...] | None = schema.field(
        schema.Optional(Sequence(Sequence(Number(), 3, 3), 1)), None
    )
    head: tuple[str, str] | None = _names(2, 2, None)
    shoulder_pitch: tuple[str, str] | None = _names(2, 2, None)
    shoulder_roll: tuple[str, str] | None = _names(2, 2, None)
    waist_pitch: str | None = text(None)
    urdf: str | None = text(None, "The URDF, beside the file, if a robot is named by its file.")
    size: float | None = number(
        None, 0.1, 20.0, "",
        "Size over that for which gait parameters are given; null = by the height of its CoM.",
    )
    preset: str | None = text(None)
    gyro_axes: int | None = number(None, 2, 3, whole=True)
    encoder_bits: int | None = number(None, 1, 24, whole=True)
    command_lag: float = number(0.02, 0.0, 0.2, "s")
    motions: str | None = text(None)
    force_sensors: tuple[Point2, ...] | None = schema.field(
        schema.Optional(Sequence(Sequence(Number(), 2, 2), 4, 4)), None
    )
    battery: Battery | None = schema.field(schema.Optional(schema.Group(Battery)), None)
    cameras: dict[str, CameraEntry] = schema.field(
        Table(schema.Group(CameraEntry), key=schema.NAME), attrs.Factory(dict)
    )

    def motor_of(self) -> Mapping[str, Motor]:
        """The motor of each joint."""
        return {
            joint: Motor(
                entry.stall_torque, entry.no_load_speed, entry.reflected_inertia,
                entry.nominal_torque, entry.stiffness, entry.damping,
            )
            for entry in self.motors
            for joint in entry.joints
        }


def read_robot_file(path: Path) -> dict[str, Any]:
    """The keys of a robot file over those of its base; NaoGaitError names the file."""
    layers = read_layers(path, "robot file", "robots")
    found = {key: value for _, values in layers for key, value in values.items()}
    if not found:
        raise NaoGaitError(f"robot file {path}", "nothing", "a mapping of keys")
    return found


def check_given(values: dict[str, Any], path: Path) -> None:
    """Check the keys that a robot file has, before others are derived from them; NaoGaitError."""
    where = f"robot file {path}: "
    # Of the frames a file may name some.
    frames = values.get("frames", {})
    Frames.checked(frames, f"{where}frames", partial=True)
    RobotFile.checked(
        {key: value for key, value in values.items() if key != "frames"}, where, partial=True
    )


def checked_robot_file(values: dict[str, Any], path: Path) -> RobotFile:
    """A whole robot file; NaoGaitError names the file, the key, its value and what is allowed."""
    where = f"robot file {path}: "
    file = RobotFile.from_mapping(values, where)
    for key, joint in _joint_references(file):
        if joint not in file.joints:
            allowed = f"one of joints: {', '.join(file.joints)}"
            raise NaoGaitError(f"{where}{key}", joint, allowed, file.joints)
    used = [joint for entry in file.motors for joint in entry.joints]
    for joint in used:
        if used.count(joint) > 1:
            raise NaoGaitError(f"{where}motors", joint, "each joint once")
    missing = [joint for joint in file.joints if joint not in used]
    if missing:
        raise NaoGaitError(f"{where}motors", f"none for {', '.join(missing)}", "all joints")
    _check_sole(where, file.sole_outline, file.sole_corners)
    last = -math.inf
    for pitch, low, high in file.ankle_limits or ():
        if low > high or pitch <= last:
            allowed = "rows of increasing pitch, lowest roll <= highest roll"
            raise NaoGaitError(f"{where}ankle_limits", [pitch, low, high], allowed)
        last = pitch
    return file


def _joint_references(file: RobotFile) -> Iterator[tuple[str, str]]:
    """Every key that names joints, with each joint."""
    for key in ("left_leg", "right_leg"):
        for role, joint in getattr(file, key).as_dict().items():
            yield f"{key}.{role}", joint
    for pair in file.coupled_joints:
        yield from (("coupled_joints", joint) for joint in pair)
    for key in ("head", "shoulder_pitch", "shoulder_roll"):
        yield from ((key, joint) for joint in getattr(file, key) or ())
    if file.waist_pitch is not None:
        yield "waist_pitch", file.waist_pitch
    yield from (("stand_pose", joint) for joint in file.stand_pose)
    for number_, entry in enumerate(file.motors, start=1):
        yield from ((f"motors[{number_}].joints", joint) for joint in entry.joints)


def _check_sole(where: str, outline: tuple[Point2, ...], corners: tuple[Point2, ...]) -> None:
    """The outline is convex and counter-clockwise, the corners are four of its points."""
    for index, (x1, y1) in enumerate(outline):
        x0, y0 = outline[index - 1]
        x2, y2 = outline[(index + 1) % len(outline)]
        if (x1 - x0) * (y2 - y1) - (y1 - y0) * (x2 - x1) <= 0.0:
            allowed = "points of a convex outline, counter-clockwise"
            raise NaoGaitError(f"{where}sole_outline", (x1, y1), allowed)
    if len(corners) != 4 or not set(corners) <= set(outline):
        raise NaoGaitError(f"{where}sole_corners", corners, "four points of sole_outline")
