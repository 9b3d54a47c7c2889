"""The motions of a robot: the files in config/motions/ROBOT/ and their mirror images."""

import os
from collections.abc import Iterable, Mapping
from functools import lru_cache
from pathlib import Path

from robot_core.errors import NaoGaitError
from robot_core.motion.keyframes import Motion, Posture
from robot_core.motion.motion_file import load_motions
from robot_core.resources import share
from robot_core.robot import RobotDescription


class MotionLibrary:
    """Motions by name."""

    def __init__(self, motions: Iterable[Motion] = ()) -> None:
        self._motions: dict[str, Motion] = {}
        for motion in motions:
            self.add(motion)

    def add(self, motion: Motion) -> None:
        """Add a motion; NaoGaitError if its name is taken, or if it is none."""
        if not isinstance(motion, Motion):
            raise NaoGaitError("motion", motion, "a Motion")
        if motion.name in self._motions:
            raise NaoGaitError("motion", motion.name, "each name once")
        self._motions[motion.name] = motion

    @property
    def motions(self) -> Mapping[str, Motion]:
        """Motions by name."""
        return self._motions

    def find(self, name: str) -> Motion:
        """The motion of a name; NaoGaitError lists the known names."""
        motion = self._motions.get(name) if isinstance(name, str) else None
        if motion is None:
            raise NaoGaitError("motion", name, sorted(self._motions) or "none for this robot")
        return motion

    def between(self, starts: Posture, ends: Posture) -> Motion | None:
        """The shortest motion from one posture to another, or None."""
        found = [
            motion for motion in self._motions.values()
            if motion.begins_from(starts) and motion.ends is ends
        ]  # fmt: skip
        return min(found, key=lambda motion: (motion.time, motion.name), default=None)


def load_library(folder: Path, robot: RobotDescription) -> MotionLibrary:
    """Load every *.yaml of a folder; none, or the first bad file, raises NaoGaitError."""
    paths = sorted(folder.glob("*.yaml")) if os.path.isdir(folder) else []
    if not paths:
        raise NaoGaitError("motions", str(folder), "a folder of motion files, *.yaml")
    return MotionLibrary(motion for path in paths for motion in load_motions(path, robot))


@lru_cache(maxsize=8)
def shipped_library(robot: RobotDescription) -> MotionLibrary:
    """The shipped motions of a robot; an empty library if there are none."""
    folder = share("config") / "motions" / robot.motions
    return load_library(folder, robot) if folder.is_dir() else MotionLibrary()


def library_of(robot: RobotDescription, folder: str = "") -> MotionLibrary:
    """The motions of a folder, or the shipped ones if `folder` is empty."""
    if not folder:
        return shipped_library(robot)
    return load_library(Path(os.path.expanduser(folder)), robot)  # of no such user: as it is
