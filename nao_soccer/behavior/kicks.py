"""The kicks of a robot: where the ball has to lie and where it goes, as measured.

One file per kind of robot in `config/kicks/`, written by `nao_gait write kicks`.
"""

import math
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import attrs

from robot_core import schema
from robot_core.errors import NaoGaitError
from robot_core.geometry import rotate_planar
from robot_core.resources import find, names
from robot_core.schema import NAME, Group, Sequence, Settings, number
from robot_core.types import Point2, Pose2


@attrs.frozen
class Kick(Settings):
    """One kick, on the average over several robots. Positions are in base_footprint."""

    motion: str = schema.field(NAME, meaning="Motion that kicks.")
    x: float = number(minimum=-0.5, maximum=0.5, unit="m", meaning="Ball before the kick.")
    y: float = number(minimum=-0.5, maximum=0.5, unit="m", meaning="Ball before the kick.")
    direction: float = number(
        minimum=-math.pi, maximum=math.pi, unit="rad", meaning="Where the ball goes."
    )
    direction_spread: float = number(
        minimum=0.0, maximum=2.0, unit="rad", meaning="Standard deviation of the direction."
    )
    distance: float = number(minimum=0.0, maximum=20.0, unit="m", meaning="How far it rolls.")
    distance_spread: float = number(
        minimum=0.0, maximum=10.0, unit="m", meaning="Standard deviation of the distance."
    )
    speed: float = number(minimum=0.0, maximum=20.0, unit="m/s", meaning="Largest speed.")
    seconds: float = number(minimum=0.1, maximum=20.0, unit="s", meaning="Time until it stands.")

    @property
    def spot(self) -> Point2:
        """Where the ball has to lie, x and y [m] in base_footprint."""
        return self.x, self.y

    def robot_pose(self, ball: Point2, direction: float) -> Pose2:
        """Pose of base_footprint to kick a ball at x, y [m] in a direction [rad].

        All are in one frame.
        """
        heading = math.remainder(direction - self.direction, math.tau)
        dx, dy = rotate_planar(self.x, self.y, heading)
        return ball[0] - dx, ball[1] - dy, heading


@attrs.frozen
class _KickFile(Settings):
    """A file of `config/kicks/`."""

    dribbles: tuple[Kick, ...] = schema.field(Sequence(Group(Kick), 1, 10))
    kicks: tuple[Kick, ...] = schema.field(Sequence(Group(Kick), 1, 50))


@dataclass(frozen=True, slots=True)
class KickTable:
    """All kicks of a robot.

    Attributes:
        kicks: Motions of a standing robot, in the order of the file.
        dribbles: What a walking robot does to a ball in front of one foot; `motion` is a name only.
    """

    kicks: tuple[Kick, ...]
    dribbles: tuple[Kick, ...]


def kicks_of(robot: str) -> KickTable:
    """The shipped table of a kind of robot; without one it only dribbles, as a NAO does."""
    if robot in names("kicks"):
        return load_kicks(robot)
    return KickTable((), load_kicks("nao_h21").dribbles)


@cache
def load_kicks(name_or_path: str | Path) -> KickTable:
    """Read a table of kicks.

    Raises:
        NaoGaitError: The file cannot be read, a field is missing or not allowed, or a kick is
            there twice.
    """
    path = find("kicks", name_or_path)
    where = f"kick table {path}: "
    table = _KickFile.from_mapping(schema.read_yaml(path, "kick table"), where)
    motions = [kick.motion for kick in (*table.dribbles, *table.kicks)]
    for motion in motions:
        if motions.count(motion) > 1:
            raise NaoGaitError(f"{where}motion", f"{motion} twice", "each motion once")
    return KickTable(table.kicks, table.dribbles)
