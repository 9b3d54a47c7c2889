"""The facts of one robot that everything else works with: its URDF and one parameter file."""

import dataclasses
import math
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from nao_lipm_gait.errors import NaoGaitError, is_number
from nao_lipm_gait.resources import find
from nao_lipm_gait.resources import names as shipped
from nao_lipm_gait.signals import FloatArray

Pose2 = tuple[float, float]
"""A point on the ground plane: x, y [m]."""

HIPS = ("shared_yaw_pitch", "yaw")
_STAND_SLACK = 0.02
"""[rad] by which the stand pose may pass a limit before it is refused instead of cut: the limits of
the published NAO models differ by that much."""


@dataclass(frozen=True, slots=True)
class Motor:
    """A motor behind its gear, as felt at the joint."""

    stall_torque: float
    """[N m], without losses in the gear."""
    no_load_speed: float
    """[rad/s]"""
    reflected_inertia: float
    """[kg m^2]"""


@dataclass(frozen=True, slots=True)
class JointLimit:
    """Limits of a joint from the URDF."""

    lower: float
    """[rad]"""
    upper: float
    """[rad]"""
    velocity: float
    """[rad/s]"""
    effort: float
    """[N m]"""


@dataclass(frozen=True, slots=True)
class LegJoints:
    """Names of the joints of one leg, from the hip down."""

    hip_yaw: str
    hip_roll: str
    hip_pitch: str
    knee_pitch: str
    ankle_pitch: str
    ankle_roll: str

    @property
    def names(self) -> tuple[str, ...]:
        return dataclasses.astuple(self)


@dataclass(frozen=True, slots=True, eq=False)
class RobotDescription:
    """One robot. Joint arrays are (n,) in the order of `joint_names`; the arrays are read-only."""

    name: str
    urdf_path: Path
    urdf: str
    """The text of the URDF."""
    joint_names: tuple[str, ...]
    left_leg: LegJoints
    right_leg: LegJoints
    hip: str
    """`shared_yaw_pitch` (one motor, tilted axes) or `yaw` (a vertical axis each)."""
    coupled_joints: tuple[tuple[str, str], ...]
    """(leader, follower) pairs that one motor turns to the same angle."""
    shoulder_pitch: tuple[str, str]
    """Left, right: the joints that swing the arms; positive swings an arm back."""
    shoulder_roll: tuple[str, str] | None
    """Left, right: the joints that spread the arms, about x; None without them."""
    waist_pitch: str | None
    """The joint that leans the upper body over the hips; None without it."""
    preset: str
    """The gait preset that was made for this robot."""
    gyro_axes: int | None
    """3 where the robot has a yaw gyro; None = as in the plant."""
    encoder_bits: int | None
    """Counts of an encoder per turn = 2^bits; None = as in the plant."""
    base_frame: str
    torso_frame: str
    imu_frame: str
    sole_frames: tuple[str, str]
    """Left, right: below the ankle axes, on the ground plane of a flat foot."""
    stand_pose: FloatArray
    """(n,) [rad], inside the limits."""
    sole_outline: tuple[Pose2, ...]
    """Convex hull of the left sole in its sole frame, counter-clockwise [m]; right: y mirrored."""
    sole_corners: tuple[Pose2, ...]
    """Four points of the left outline: front inner, front outer, rear outer, rear inner."""
    ankle_limits: Mapping[str, tuple[tuple[float, float, float], ...]]
    """`left`, `right` -> rows (AnklePitch, lowest AnkleRoll, highest AnkleRoll), pitch rising."""
    motors: Mapping[str, Motor]
    limits: Mapping[str, JointLimit]
    lower: FloatArray = field(init=False)
    """(n,) [rad]"""
    upper: FloatArray = field(init=False)
    """(n,) [rad]"""
    velocity_limit: FloatArray = field(init=False)
    """(n,) [rad/s]"""

    def __post_init__(self) -> None:
        limits = [self.limits[name] for name in self.joint_names]
        for name, values in (
            ("lower", [limit.lower for limit in limits]),
            ("upper", [limit.upper for limit in limits]),
            ("velocity_limit", [limit.velocity for limit in limits]),
        ):
            object.__setattr__(self, name, _read_only(values))

    def index(self, joint: str) -> int:
        """Where `joint` stands in a joint array."""
        try:
            return self.joint_names.index(joint)
        except ValueError:
            raise NaoGaitError("joint", joint, f"one of {', '.join(self.joint_names)}") from None


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
    text = _read(urdf_path, "URDF")
    model = _UrdfModel.parse(text, urdf_path)
    settings = _settings_of(model) if robot is None else _Settings.load(find("robots", str(robot)))

    joint_names = settings.joint_names()
    limits = {name: model.limit(name) for name in joint_names}
    legs = settings.leg("left_leg", joint_names), settings.leg("right_leg", joint_names)
    soles = model.frame(settings.frame("left_sole")), model.frame(settings.frame("right_sole"))
    torso = model.frame(settings.frame("torso"))
    for leg, sole in zip(legs, soles, strict=True):
        model.check_leg(torso, sole, leg)
    outline = settings.points("sole_outline")
    corners = settings.points("sole_corners")
    _check_outline(settings.where("sole_outline"), outline)
    _check_corners(settings.where("sole_corners"), corners, outline)
    left_ankle = settings.ankle_rows()
    return RobotDescription(
        name=settings.text("name"),
        urdf_path=urdf_path,
        urdf=text,
        joint_names=joint_names,
        left_leg=legs[0],
        right_leg=legs[1],
        hip=settings.choice("hip", HIPS),
        coupled_joints=settings.coupled(joint_names),
        shoulder_pitch=settings.pair("shoulder_pitch", joint_names),
        shoulder_roll=settings.optional_pair("shoulder_roll", joint_names),
        waist_pitch=settings.optional_joint("waist_pitch", joint_names),
        preset=settings.preset(),
        gyro_axes=settings.optional_whole("gyro_axes", 2, 3),
        encoder_bits=settings.optional_whole("encoder_bits", 1, 24),
        base_frame=model.frame(settings.frame("base")),
        torso_frame=torso,
        imu_frame=model.frame(settings.frame("imu")),
        sole_frames=soles,
        stand_pose=_inside(settings.stand_pose(joint_names), joint_names, limits, urdf_path),
        sole_outline=outline,
        sole_corners=corners,
        ankle_limits={
            "left": left_ankle,
            "right": tuple((pitch, -high, -low) for pitch, low, high in left_ankle),
        },
        motors=settings.motors(joint_names),
        limits=limits,
    )


def _read_only(values: Iterable[float]) -> FloatArray:
    array = np.array(tuple(values), dtype=np.float64)
    array.setflags(write=False)
    return array


def _read(path: Path, what: str) -> str:
    try:
        return path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise NaoGaitError(f"{what} {path}", str(error), "a readable UTF-8 file") from error


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
    return _read_only(values)


def _check_outline(where: str, outline: tuple[Pose2, ...]) -> None:
    if len(outline) < 3:
        raise NaoGaitError(where, f"{len(outline)} points", "at least 3 points")
    for index, (x1, y1) in enumerate(outline):
        x0, y0 = outline[index - 1]
        x2, y2 = outline[(index + 1) % len(outline)]
        if (x1 - x0) * (y2 - y1) - (y1 - y0) * (x2 - x1) <= 0.0:
            raise NaoGaitError(where, (x1, y1), "points of a convex outline, counter-clockwise")


def _check_corners(where: str, corners: tuple[Pose2, ...], outline: tuple[Pose2, ...]) -> None:
    if len(corners) != 4 or not set(corners) <= set(outline):
        raise NaoGaitError(where, corners, "four points of sole_outline")


class _UrdfModel:
    """The part of a URDF that matters here: which links and joints there are, and the limits."""

    def __init__(self, path: Path, links: set[str], joints: dict[str, ET.Element]) -> None:
        self._path = path
        self._links = links
        self._joints = joints

    @classmethod
    def parse(cls, text: str, path: Path) -> "_UrdfModel":
        where = f"URDF {path}"
        if "<!DOCTYPE" in text or "<!ENTITY" in text:  # entities can be made to fill the memory
            raise NaoGaitError(where, "a document type declaration", "plain XML without one")
        try:
            root = ET.fromstring(text)
        except (ET.ParseError, ValueError) as error:
            raise NaoGaitError(where, str(error), "well-formed XML") from error
        if root.tag != "robot":
            raise NaoGaitError(where, f"<{root.tag}>", "a <robot> element")
        links = {link.get("name", "") for link in root.findall("link")}
        joints: dict[str, ET.Element] = {}
        for joint in root.findall("joint"):
            name = joint.get("name", "")
            if name in joints:
                raise NaoGaitError(f"joint {name} in {path}", "listed twice", "one joint per name")
            joints[name] = joint
        return cls(path, links, joints)

    def frame(self, names: tuple[str, ...]) -> str:
        """The first of these links that there is."""
        for name in names:
            if name in self._links:
                return name
        raise NaoGaitError(f"link {' or '.join(names)} in {self._path}", "missing", "a link")

    def has_joint(self, name: str) -> bool:
        return name in self._joints

    def limit(self, name: str) -> JointLimit:
        where = f"joint {name} in {self._path}"
        allowed = "a revolute joint with finite limits, lower < upper, velocity and effort over 0"
        joint = self._joints.get(name)
        if joint is None:
            raise NaoGaitError(where, "missing", allowed)
        if joint.get("type") != "revolute":
            raise NaoGaitError(where, f"type {joint.get('type')}", allowed)
        element = joint.find("limit")
        if element is None:
            raise NaoGaitError(where, "no <limit>", allowed)
        try:
            limit = JointLimit(
                # The URDF standard lets a missing bound be 0, and demands the other two.
                lower=float(element.get("lower", "0")),
                upper=float(element.get("upper", "0")),
                velocity=float(element.get("velocity", "")),
                effort=float(element.get("effort", "")),
            )
        except ValueError as error:
            raise NaoGaitError(where, dict(element.attrib), allowed) from error
        finite = all(math.isfinite(value) for value in dataclasses.astuple(limit))
        if not (finite and limit.lower < limit.upper and limit.velocity > 0.0 < limit.effort):
            raise NaoGaitError(where, dict(element.attrib), allowed)
        return limit

    def check_leg(self, torso: str, sole: str, leg: LegJoints) -> None:
        """Refuses a leg whose joints do not lead from the torso to the sole in this order."""
        above: dict[str, tuple[str, str]] = {}
        for name, joint in self._joints.items():
            parent, child = joint.find("parent"), joint.find("child")
            if parent is not None and child is not None:
                above[child.get("link", "")] = (name, parent.get("link", ""))
        chain: list[str] = []
        link = sole
        while link in above and link != torso and len(chain) <= len(self._joints):
            name, link = above[link]
            if self._joints[name].get("type") != "fixed":
                chain.insert(0, name)
        if link != torso or tuple(chain) != leg.names:
            raise NaoGaitError(
                f"joints from {torso} to {sole} in {self._path}",
                ", ".join(chain) or "none",
                ", ".join(leg.names),
            )


_KEYS = tuple(
    "name joints hip left_leg right_leg coupled_joints shoulder_pitch frames stand_pose "
    "sole_outline sole_corners ankle_limits motors".split()
)
_OPTIONAL_KEYS = ("shoulder_roll", "waist_pitch", "preset", "gyro_axes", "encoder_bits")
_FRAMES = ("base", "torso", "imu", "left_sole", "right_sole")


class _Settings:
    """A robot file, read with every value checked."""

    def __init__(self, path: Path, values: Mapping[str, Any]) -> None:
        self._path = path
        self._values = values

    @classmethod
    def load(cls, path: Path) -> "_Settings":
        try:
            values = yaml.safe_load(_read(path, "robot file"))
        except yaml.YAMLError as error:
            reason = " ".join(str(error).split())
            raise NaoGaitError(f"robot file {path}", reason, "a readable YAML file") from error
        settings = cls(path, {})
        settings._values = settings._mapping("robot file", values, _KEYS, _OPTIONAL_KEYS)
        return settings

    def pair(self, key: str, joint_names: tuple[str, ...]) -> tuple[str, str]:
        """Two joints: left, right."""
        value = self._values[key]
        if (
            not isinstance(value, list)
            or len(value) != 2
            or any(name not in joint_names for name in value)
        ):
            raise NaoGaitError(self.where(key), value, "two names of `joints`: left, right")
        return value[0], value[1]

    def where(self, key: str) -> str:
        return f"{key} in {self._path}"

    def optional_pair(self, key: str, joint_names: tuple[str, ...]) -> tuple[str, str] | None:
        return None if self._values.get(key) is None else self.pair(key, joint_names)

    def optional_joint(self, key: str, joint_names: tuple[str, ...]) -> str | None:
        value = self._values.get(key)
        return None if value is None else self._joint(key, value, joint_names)

    def optional_whole(self, key: str, low: int, high: int) -> int | None:
        value = self._values.get(key)
        if value is None:
            return None
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            raise NaoGaitError(self.where(key), value, f"a whole number from {low} to {high}")
        return value

    def preset(self) -> str:
        return self.text("preset") if "preset" in self._values else "default"

    def has_joints_of(self, model: _UrdfModel) -> bool:
        """Whether the URDF knows every joint of this file."""
        return all(model.has_joint(name) for name in self.joint_names())

    def _mapping(
        self, key: str, value: object, keys: tuple[str, ...], optional: tuple[str, ...] = ()
    ) -> Mapping[str, Any]:
        """A mapping with exactly these keys, and perhaps some of the optional ones."""
        allowed = f"a mapping of {', '.join(keys)}"
        if not isinstance(value, dict):
            raise NaoGaitError(self.where(key), type(value).__name__, allowed)
        for name in value:
            if name not in keys and name not in optional:
                raise NaoGaitError(self.where(key), f"unknown key {name}", allowed)
        for name in keys:
            if name not in value:
                raise NaoGaitError(self.where(key), f"no {name}", allowed)
        return value

    def _numbers(self, key: str, value: object, count: int) -> tuple[float, ...]:
        if (
            not isinstance(value, list)
            or len(value) != count
            or not all(is_number(item) for item in value)
        ):
            raise NaoGaitError(self.where(key), value, f"{count} numbers")
        return tuple(float(item) for item in value)

    def _list(self, key: str) -> list[Any]:
        value = self._values[key]
        if not isinstance(value, list):
            raise NaoGaitError(self.where(key), value, "a list")
        return value

    def _joint(self, key: str, value: object, joint_names: tuple[str, ...]) -> str:
        if not isinstance(value, str) or value not in joint_names:
            raise NaoGaitError(self.where(key), value, f"one of joints: {', '.join(joint_names)}")
        return value

    def text(self, key: str) -> str:
        value = self._values[key]
        if not isinstance(value, str) or not value:
            raise NaoGaitError(self.where(key), value, "a text")
        return value

    def choice(self, key: str, choices: tuple[str, ...]) -> str:
        value = self._values[key]
        if value not in choices:
            raise NaoGaitError(self.where(key), value, f"one of {', '.join(choices)}")
        return str(value)

    def joint_names(self) -> tuple[str, ...]:
        names = self._list("joints")
        if not names or not all(isinstance(name, str) and name for name in names):
            raise NaoGaitError(self.where("joints"), names, "a list of joint names")
        if len(set(names)) != len(names):
            raise NaoGaitError(self.where("joints"), names, "each joint once")
        return tuple(names)

    def leg(self, key: str, joint_names: tuple[str, ...]) -> LegJoints:
        roles = tuple(role.name for role in dataclasses.fields(LegJoints))
        row = self._mapping(key, self._values[key], roles)
        return LegJoints(
            **{role: self._joint(f"{key}: {role}", row[role], joint_names) for role in roles}
        )

    def coupled(self, joint_names: tuple[str, ...]) -> tuple[tuple[str, str], ...]:
        pairs = []
        for pair in self._list("coupled_joints"):
            if not isinstance(pair, list) or len(pair) != 2 or pair[0] == pair[1]:
                raise NaoGaitError(self.where("coupled_joints"), pair, "[leader, follower]")
            leader, follower = (self._joint("coupled_joints", name, joint_names) for name in pair)
            pairs.append((leader, follower))
        return tuple(pairs)

    def frame(self, role: str) -> tuple[str, ...]:
        names = self._mapping("frames", self._values["frames"], _FRAMES)[role]
        if (
            not isinstance(names, list)
            or not names
            or not all(isinstance(name, str) for name in names)
        ):
            raise NaoGaitError(self.where(f"frames: {role}"), names, "a list of link names")
        return tuple(names)

    def stand_pose(self, joint_names: tuple[str, ...]) -> Mapping[str, float]:
        pose = self._values["stand_pose"]
        if not isinstance(pose, dict):
            raise NaoGaitError(self.where("stand_pose"), pose, "a mapping of joints to angles")
        for name, angle in pose.items():
            self._joint("stand_pose", name, joint_names)
            if not is_number(angle):
                raise NaoGaitError(self.where(f"stand_pose: {name}"), angle, "an angle in rad")
        return {name: float(angle) for name, angle in pose.items()}

    def points(self, key: str) -> tuple[Pose2, ...]:
        points = []
        for point in self._list(key):
            x, y = self._numbers(key, point, 2)
            points.append((x, y))
        return tuple(points)

    def ankle_rows(self) -> tuple[tuple[float, float, float], ...]:
        rows: list[tuple[float, float, float]] = []
        for row in self._list("ankle_limits"):
            pitch, low, high = self._numbers("ankle_limits", row, 3)
            if low > high or (rows and pitch <= rows[-1][0]):
                raise NaoGaitError(
                    self.where("ankle_limits"), row, "rows of rising pitch, lowest roll <= highest"
                )
            rows.append((pitch, low, high))
        if not rows:
            raise NaoGaitError(self.where("ankle_limits"), rows, "at least one row")
        return tuple(rows)

    def motors(self, joint_names: tuple[str, ...]) -> Mapping[str, Motor]:
        numbers = tuple(number.name for number in dataclasses.fields(Motor))
        motors: dict[str, Motor] = {}
        for entry in self._list("motors"):
            row = self._mapping("motors", entry, ("joints", *numbers))
            for number in numbers:
                if not is_number(row[number]) or row[number] <= 0.0:
                    where = self.where(f"motors: {number}")
                    raise NaoGaitError(where, row[number], "a number over 0")
            if not isinstance(row["joints"], list):
                raise NaoGaitError(self.where("motors: joints"), row["joints"], "a list of joints")
            for value in row["joints"]:
                joint = self._joint("motors: joints", value, joint_names)
                if joint in motors:
                    raise NaoGaitError(self.where("motors"), joint, "each joint once")
                motors[joint] = Motor(**{number: float(row[number]) for number in numbers})
        missing = [name for name in joint_names if name not in motors]
        if missing:
            raise NaoGaitError(self.where("motors"), f"none for {', '.join(missing)}", "all joints")
        return motors


def _settings_of(model: _UrdfModel) -> _Settings:
    """The shipped robot file that fits the joints of a URDF."""
    files = {name: _Settings.load(find("robots", name)) for name in shipped("robots")}
    fitting = [settings for settings in files.values() if settings.has_joints_of(model)]
    return fitting[0] if fitting else files[NAO]
