"""Motions from YAML files: the schema of a file, and the motions that are made from it."""

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from robot_core import schema
from robot_core.errors import NaoGaitError
from robot_core.motion.check import check_motion
from robot_core.motion.joints import joint_groups, mirror_law
from robot_core.motion.keyframes import Balance, Interpolation, Keyframe, Kick, Motion, Posture
from robot_core.resources import read_layers
from robot_core.robot import RobotDescription
from robot_core.schema import NAME, Number, Settings, Table, choice, group, number
from robot_core.types import FloatArray

STAND = "stand"
"""The pose of this name is the gait's stand pose, which depends on its parameters."""
LIKE = "like"
"""Key in a pose that names the pose which it changes."""
MOST_KEYFRAMES = 200
LEFT = ("L", "l_", "L_", "left_", "Left_", "ALeft_")
"""What the names of the left joints of robots begin with."""
_SUPPORTS = {"both": 0, "left": 1, "right": -1}
_ANGLE = Number(-math.tau, math.tau, "rad")
_SHARE = Number(0.0, 1.0)
_TIME = Number(0.02, 60.0, "s")
_END_POSTURES = tuple(each.value for each in Posture if each is not Posture.UPRIGHT)


class _PoseKind(schema.Kind):
    """Joint angles by joint, and perhaps another pose that they change."""

    @property
    def allowed(self) -> str:
        """What is allowed, for error messages."""
        return f"a mapping of joints to {_ANGLE.allowed}; {LIKE} names an earlier pose"

    def check(self, where: str, value: Any) -> dict[str, Any]:
        """Return angles [rad] by joint, and the name of the other pose by LIKE."""
        if not isinstance(value, Mapping):
            raise NaoGaitError(where, value, self.allowed)
        return {
            str(key): (NAME if key == LIKE else _ANGLE).check(schema.join(where, str(key)), each)
            for key, each in value.items()
        }


@attrs.frozen
class KeyframeEntry(Settings):
    """A keyframe as the file has it."""

    pose: str = schema.text()
    time: float = number(minimum=0.02, maximum=60.0, unit="s", meaning="Since the last keyframe.")
    interpolation: Interpolation = choice(Interpolation, default=Interpolation.CUBIC)
    stiffness: dict[str, float] = schema.field(
        Table(_SHARE), attrs.Factory(dict), "By joint or group of joints; holds until changed."
    )
    support: str = choice(tuple(_SUPPORTS), "Leg that stands alone.")


@attrs.frozen
class MotionFile(Settings):
    """A motion file; with a `base`, another file in its folder, it holds only what differs."""

    meaning: str = schema.text()
    keyframes: tuple[KeyframeEntry, ...] = schema.field(
        schema.Sequence(schema.Group(KeyframeEntry), minimum=1, maximum=MOST_KEYFRAMES)
    )
    starts: Posture = choice(Posture)
    ends: Posture = schema.field(schema.Choice(_END_POSTURES, Posture), Posture.STANDING)
    mirrored_as: str | None = schema.field(NAME, None, "Name of the mirror image.")
    balance: Balance = group(Balance, Balance())
    kick: Kick | None = group(Kick, None)
    legs_press: bool = schema.switch(
        False, "The legs may be led into each other, as where they press; else that is refused."
    )
    poses: dict[str, dict[str, Any]] = schema.field(
        Table(_PoseKind(), key=NAME), attrs.Factory(dict)
    )
    times: dict[str, float] = schema.field(
        Table(_TIME), attrs.Factory(dict), "By pose, in place of those of the keyframes."
    )


def load_motions(path: Path, robot: RobotDescription) -> tuple[Motion, ...]:
    """Load the motion of a file, which has the file's name, and its mirror image if it has one.

    Raises:
        NaoGaitError: Names the file, the key and its value, or the keyframe and joint that
            `check_motion` refuses.
    """
    where = f"motion file {path}: "
    file = MotionFile.from_mapping(_over_base(path), where)
    motion = Motion(
        name=NAME.check(f"name of motion file {path}", path.stem),
        meaning=file.meaning,
        starts=file.starts,
        ends=file.ends,
        keyframes=_Builder(robot, where).keyframes(file),
        balance=file.balance,
        kick=file.kick,
        legs_press=file.legs_press,
    )
    check_motion(motion, robot)
    if file.mirrored_as is None:
        return (motion,)
    if file.mirrored_as == motion.name:
        raise NaoGaitError(f"{where}mirrored_as", motion.name, "a name other than the motion's")
    mirror = mirrored(motion, file.mirrored_as, robot)
    check_motion(mirror, robot)
    return motion, mirror


def _over_base(path: Path) -> dict[str, Any]:
    """The content of a file over that of its base."""
    content: dict[str, Any] = {}
    for _, values in read_layers(path, "motion file"):
        for key in ("poses", "times"):
            if isinstance(values.get(key), dict) and isinstance(content.get(key), dict):
                values[key] = {**content[key], **values[key]}
        content.update(values)
    return content


class _Builder:
    """Turns names of joints and poses into arrays."""

    def __init__(self, robot: RobotDescription, where: str) -> None:
        self._robot = robot
        self._where = where

    def keyframes(self, file: MotionFile) -> tuple[Keyframe, ...]:
        poses = self._poses(file.poses)
        used = [entry.pose for entry in file.keyframes]
        for name in file.times:
            if name not in used:
                raise NaoGaitError(f"{self._where}times.{name}", name, "a pose of a keyframe")
        count = len(self._robot.joint_names)
        position, stiffness = np.full(count, np.nan), np.ones(count)
        keyframes = []
        for number_, entry in enumerate(file.keyframes, start=1):
            where = f"{self._where}keyframes[{number_}]"
            if entry.pose not in poses:
                raise NaoGaitError(f"{where}.pose", entry.pose, poses)
            named = poses[entry.pose]
            if named is None:
                position = np.full(count, np.nan)
            else:
                position = np.where(np.isnan(named), position, named)
            stiffness = self._stiffness(f"{where}.stiffness", entry.stiffness, stiffness)
            keyframes.append(
                Keyframe(
                    pose=entry.pose,
                    position=None if named is None else position,
                    time=file.times.get(entry.pose, entry.time),
                    interpolation=entry.interpolation,
                    stiffness=stiffness,
                    support=_SUPPORTS[entry.support],
                )
            )
        return tuple(keyframes)

    def _poses(self, entries: Mapping[str, Mapping[str, Any]]) -> dict[str, FloatArray | None]:
        """Positions (n,) [rad] by pose; NaN for joints that a pose does not name."""
        poses: dict[str, FloatArray | None] = {STAND: None}
        for name, joints in entries.items():
            where = f"{self._where}poses.{name}"
            if name == STAND:
                raise NaoGaitError(where, name, f"a name other than {STAND}")
            position = np.full(len(self._robot.joint_names), np.nan)
            if LIKE in joints:
                base = poses.get(joints[LIKE])
                if base is None:
                    earlier = ", ".join(each for each in poses if each != STAND) or "none"
                    allowed = f"an earlier pose of the file ({earlier})"
                    raise NaoGaitError(f"{where}.{LIKE}", joints[LIKE], allowed)
                position = base.copy()
            for joint, angle in joints.items():
                if joint != LIKE:
                    for index, sign in self._joints(f"{where}.{joint}", joint):
                        position[index] = sign * angle
            poses[name] = position
        return poses

    def _joints(self, where: str, name: str) -> list[tuple[int, float]]:
        """Index and sign of a joint, or of a mirrored pair whose name lacks its side."""
        names = self._robot.joint_names
        if name in names:
            return [(names.index(name), 1.0)]
        left = next((each for prefix in LEFT if (each := f"{prefix}{name}") in names), None)
        if left is not None:
            law = mirror_law(self._robot)
            index = names.index(left)
            twin = int(law.partner[index])
            if twin != index:
                return [(index, 1.0), (twin, float(law.sign[twin]))]
        allowed = f"a joint ({', '.join(names)}), or one without {', '.join(LEFT)} for both sides"
        raise NaoGaitError(where, name, allowed)

    def _stiffness(
        self, where: str, shares: Mapping[str, float], before: FloatArray
    ) -> FloatArray:
        """The stiffness (n,) after some joints or groups of joints have changed."""
        stiffness = before.copy()
        groups = joint_groups(self._robot)
        changes = []
        for name, share in shares.items():
            if name not in groups and name not in self._robot.joint_names:
                allowed = f"a joint or one of {', '.join(groups)}"
                raise NaoGaitError(where, name, allowed, (*groups, *self._robot.joint_names))
            changes.append((groups.get(name) or [self._robot.index(name)], share))
        # Large groups first, so that a joint or a smaller group overrides them.
        for joints, share in sorted(changes, key=lambda each: -len(each[0])):
            stiffness[joints] = share
        return stiffness


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
