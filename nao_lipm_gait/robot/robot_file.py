"""The parameter file of a robot (config/robots): what its URDF cannot say."""

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from nao_lipm_gait.errors import NaoGaitError, is_number
from nao_lipm_gait.robot.description import LegJoints, Motor
from nao_lipm_gait.robot.text_file import read_text
from nao_lipm_gait.robot.urdf_model import UrdfModel
from nao_lipm_gait.types import Point2

_KEYS = tuple(
    ["name", "joints", "hip", "left_leg", "right_leg", "coupled_joints", "shoulder_pitch", "frames", "stand_pose", "sole_outline", "sole_corners", "ankle_limits", "motors"]
)
_OPTIONAL_KEYS = ("shoulder_roll", "waist_pitch", "preset", "gyro_axes", "encoder_bits")
_FRAMES = ("base", "torso", "imu", "left_sole", "right_sole")


class RobotFile:
    """A robot file, read with every value checked."""

    def __init__(self, path: Path, values: Mapping[str, Any]) -> None:
        self._path = path
        self._values = values

    @classmethod
    def load(cls, path: Path) -> "RobotFile":
        try:
            values = yaml.safe_load(read_text(path, "robot file"))
        except yaml.YAMLError as error:
            reason = " ".join(str(error).split())
            raise NaoGaitError(f"robot file {path}", reason, "a readable YAML file") from error
        robot_file = cls(path, {})
        robot_file._values = robot_file._mapping("robot file", values, _KEYS, _OPTIONAL_KEYS)
        return robot_file

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

    def has_joints_of(self, model: UrdfModel) -> bool:
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

    def points(self, key: str) -> tuple[Point2, ...]:
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
