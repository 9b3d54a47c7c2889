"""Motions from YAML files; every key and value is checked."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import yaml

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.motion.check import check_motion
from nao_lipm_gait.motion.groups import joint_groups
from nao_lipm_gait.motion.keyframes import (
    Balance,
    Interpolation,
    Keyframe,
    Kick,
    Motion,
    Posture,
)
from nao_lipm_gait.motion.mirror import LEFT, mirror_law
from nao_lipm_gait.robot import RobotDescription
from nao_lipm_gait.types import FloatArray

STAND = "stand"
"""The pose of this name is the gait's own, whatever its parameters make of it."""
SUPPORTS = {"left": 1, "right": -1, "both": 0}
_KEYS = ("meaning", "starts", "ends", "mirrored_as", "balance", "kick", "poses", "keyframes")
_KEYFRAME_KEYS = ("pose", "time", "interpolation", "stiffness", "support")
_KICK_KEYS = ("x", "y", "direction")
_BALANCE_KEYS = ("pitch", "roll", "hip_share")
LIKE = "like"
"""In a pose: another pose that it only changes."""
TIMES = (0.02, 60.0)
"""[s] shortest and longest way between two keyframes."""
GAIN_MAX = 0.5
_NAME = "a name of small letters, digits and _"

Choice = TypeVar("Choice", bound=StrEnum)


def load_motions(path: Path, robot: RobotDescription) -> tuple[Motion, ...]:
    """The motion of a file, named after the file, and its mirror image if it has one.

    Raises NaoGaitError that names file, key and value, or (see `check_motion`) keyframe and joint.
    """
    return _File(path, robot).motions()


class _File:
    def __init__(self, path: Path, robot: RobotDescription) -> None:
        self._path = path
        self._robot = robot
        self._law = mirror_law(robot)
        self._groups = joint_groups(robot)
        self._values = self._mapping("file", self._read(), _KEYS, needed=("meaning", "keyframes"))

    def motions(self) -> tuple[Motion, ...]:
        name = self._path.stem
        if not is_name(name):
            raise NaoGaitError(f"motion file {self._path}", name, _NAME)
        motion = Motion(
            name=name,
            meaning=self._text("meaning", self._values["meaning"]),
            starts=self._posture("starts"),
            ends=self._posture("ends"),
            keyframes=self._keyframes(),
            balance=self._balance(),
            kick=self._kick(),
        )
        if motion.ends is Posture.UPRIGHT:
            raise NaoGaitError(self._where("ends"), motion.ends.value, "one posture")
        check_motion(motion, self._robot)
        if "mirrored_as" not in self._values:
            return (motion,)
        twin = self._text("mirrored_as", self._values["mirrored_as"])
        if not is_name(twin) or twin == name:
            raise NaoGaitError(self._where("mirrored_as"), twin, f"{_NAME}, not {name}")
        mirror = mirrored(motion, twin, self._robot)
        check_motion(mirror, self._robot)
        return motion, mirror

    # -- parts -------------------------------------------------------------------------------------

    def _keyframes(self) -> tuple[Keyframe, ...]:
        poses = self._poses()
        rows = self._values["keyframes"]
        if not isinstance(rows, list) or not rows:
            raise NaoGaitError(self._where("keyframes"), rows, "a list of keyframes")
        count = len(self._robot.joint_names)
        position = np.full(count, np.nan)
        stiffness = np.ones(count)
        keyframes = []
        for number, row in enumerate(rows, start=1):
            key = f"keyframes[{number}]"
            values = self._mapping(key, row, _KEYFRAME_KEYS, needed=("pose", "time"))
            pose = values["pose"]
            if pose not in poses:
                raise NaoGaitError(self._where(f"{key}.pose"), pose, f"one of {', '.join(poses)}")
            named = poses[pose]
            if named is None:
                position = np.full(count, np.nan)
            else:
                position = np.where(np.isnan(named), position, named)
            stiffness = self._stiffness(f"{key}.stiffness", values.get("stiffness", {}), stiffness)
            support = values.get("support", "both")
            if support not in SUPPORTS:
                raise NaoGaitError(
                    self._where(f"{key}.support"), support, f"one of {', '.join(SUPPORTS)}"
                )
            interpolation = values.get("interpolation", Interpolation.CUBIC.value)
            keyframes.append(
                Keyframe(
                    pose=pose,
                    position=None if named is None else position,
                    time=self._number(f"{key}.time", values["time"], *TIMES, "s"),
                    interpolation=self._choice(
                        f"{key}.interpolation", interpolation, Interpolation
                    ),
                    stiffness=stiffness,
                    support=SUPPORTS[support],
                )
            )
        return tuple(keyframes)

    def _poses(self) -> Mapping[str, FloatArray | None]:
        rows = self._mapping("poses", self._values.get("poses", {}), None)
        poses: dict[str, FloatArray | None] = {STAND: None}
        for name, joints in rows.items():
            where = f"poses.{name}"
            if not isinstance(name, str) or not is_name(name) or name == STAND:
                raise NaoGaitError(self._where(where), name, f"{_NAME}, not {STAND}")
            poses[name] = self._pose(where, self._mapping(where, joints, None), poses)
        return poses

    def _pose(
        self, where: str, joints: Mapping[Any, Any], poses: Mapping[str, FloatArray | None]
    ) -> FloatArray:
        position = np.full(len(self._robot.joint_names), np.nan)
        if LIKE in joints:
            base = poses.get(joints[LIKE])
            if base is None:
                earlier = [name for name, pose in poses.items() if pose is not None]
                raise NaoGaitError(
                    self._where(f"{where}.{LIKE}"), joints[LIKE],
                    f"an earlier pose of the file ({', '.join(earlier) or 'none'})",
                )  # fmt: skip
            position = base.copy()
        for joint, value in joints.items():
            if joint == LIKE:
                continue
            angle = self._number(f"{where}.{joint}", value, -math.tau, math.tau, "rad")
            for index, sign in self._joints(f"{where}.{joint}", joint):
                position[index] = sign * angle
        return position

    def _joints(self, where: str, name: object) -> list[tuple[int, float]]:
        """A joint, or a pair of them by the name without its side: both as mirror images."""
        names = self._robot.joint_names
        if name in names:
            return [(names.index(str(name)), 1.0)]
        left = f"{LEFT}{name}"
        if left in names:
            index = names.index(left)
            twin = int(self._law.partner[index])
            if twin != index:
                return [(index, 1.0), (twin, float(self._law.sign[twin]))]
        raise NaoGaitError(
            self._where(where), name,
            f"a joint ({', '.join(names)}), or one without its L or R for both sides",
        )  # fmt: skip

    def _stiffness(self, key: str, value: object, before: FloatArray) -> FloatArray:
        stiffness = before.copy()
        shares = []
        for name, share in self._mapping(key, value, None).items():
            if name in self._groups:
                joints = self._groups[name]
            elif name in self._robot.joint_names:
                joints = [self._robot.index(name)]
            else:
                raise NaoGaitError(
                    self._where(key), name, f"a joint or one of {', '.join(self._groups)}"
                )
            shares.append((joints, self._number(f"{key}.{name}", share, 0.0, 1.0, "")))
        # A part goes before the whole, in whatever order they are written.
        for joints, amount in sorted(shares, key=lambda each: -len(each[0])):
            stiffness[joints] = amount
        return stiffness

    def _balance(self) -> Balance:
        values = self._mapping("balance", self._values.get("balance", {}), _BALANCE_KEYS)
        numbers = {
            name: self._number(f"balance.{name}", value, -GAIN_MAX, GAIN_MAX, "")
            for name, value in values.items()
        }
        return Balance(**numbers)

    def _kick(self) -> Kick | None:
        if "kick" not in self._values:
            return None
        values = self._mapping("kick", self._values["kick"], _KICK_KEYS, needed=_KICK_KEYS)
        x, y = (self._number(f"kick.{axis}", values[axis], -1.0, 1.0, "m") for axis in "xy")
        turn = self._number("kick.direction", values["direction"], -math.pi, math.pi, "rad")
        return Kick(x, y, turn)

    def _posture(self, key: str) -> Posture:
        return self._choice(key, self._values.get(key, Posture.STANDING.value), Posture)

    # -- values ------------------------------------------------------------------------------------

    def _read(self) -> object:
        try:
            return yaml.safe_load(self._path.read_text(encoding="utf-8"))
        except (OSError, UnicodeDecodeError, yaml.YAMLError, RecursionError) as error:
            reason = " ".join(str(error).split())
            raise NaoGaitError(
                f"motion file {self._path}", reason, "a readable YAML file"
            ) from error

    def _where(self, key: str) -> str:
        return f"{key} in {self._path}"

    def _mapping(
        self,
        key: str,
        value: object,
        keys: Sequence[str] | None,
        needed: Sequence[str] = (),
    ) -> Mapping[Any, Any]:
        allowed = "a mapping" if keys is None else f"a mapping of {', '.join(keys)}"
        if not isinstance(value, dict):
            raise NaoGaitError(self._where(key), value, allowed)
        for name in value:
            if keys is not None and name not in keys:
                raise NaoGaitError(self._where(key), f"unknown key {name}", allowed)
        for name in needed:
            if name not in value:
                raise NaoGaitError(self._where(key), f"no {name}", allowed)
        return value

    def _number(self, key: str, value: object, lowest: float, highest: float, unit: str) -> float:
        good = isinstance(value, int | float) and not isinstance(value, bool)
        if not good or not lowest <= float(value) <= highest:  # type: ignore[arg-type]
            allowed = f"a number from {lowest:g} to {highest:g} {unit}".rstrip()
            raise NaoGaitError(self._where(key), value, allowed)
        return float(value)  # type: ignore[arg-type]

    def _text(self, key: str, value: object) -> str:
        if not isinstance(value, str) or not value.strip():
            raise NaoGaitError(self._where(key), value, "a text")
        return value.strip()

    def _choice(self, key: str, value: object, kind: type[Choice]) -> Choice:
        try:
            return kind(str(value))
        except ValueError:
            allowed = f"one of {', '.join(each.value for each in kind)}"
            raise NaoGaitError(self._where(key), value, allowed) from None


def is_name(text: str) -> bool:
    return text.isascii() and text.isidentifier() and text == text.lower()


_MIRROR_POSTURE = {
    Posture.LYING_LEFT: Posture.LYING_RIGHT,
    Posture.LYING_RIGHT: Posture.LYING_LEFT,
}


def mirrored(motion: Motion, name: str, robot: RobotDescription) -> Motion:
    """The mirror image of a motion, under another name."""
    law, kick = mirror_law(robot), motion.kick
    keyframes = tuple(
        replace(
            keyframe,
            position=None if keyframe.position is None else law.mirrored(keyframe.position),
            stiffness=law.swapped(keyframe.stiffness),
            support=-keyframe.support,
        )
        for keyframe in motion.keyframes
    )
    return replace(
        motion,
        name=name,
        meaning=f"{motion.meaning} (mirror image of {motion.name})",
        starts=_MIRROR_POSTURE.get(motion.starts, motion.starts),
        ends=_MIRROR_POSTURE.get(motion.ends, motion.ends),
        keyframes=keyframes,
        kick=None if kick is None else Kick(kick.x, -kick.y, -kick.direction),
    )
