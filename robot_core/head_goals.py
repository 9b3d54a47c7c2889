"""Goals of the head."""

from dataclasses import dataclass, replace
from enum import StrEnum

from robot_core.errors import NaoGaitError
from robot_core.message_checks import read_array
from robot_core.schema import Choice, Number
from robot_core.types import Point3

FARTHEST = 1000.0
"""[m, rad] of a goal; more is a wrong unit."""


class Frame(StrEnum):
    """Frame of a point to look at.

    Attributes:
        TORSO: The torso.
        FOOTPRINT: The ground between the soles; it turns with the heading, not with the torso.
        ODOM: The odometry frame.
    """

    TORSO = "torso"
    FOOTPRINT = "base_footprint"
    ODOM = "odom"


@dataclass(frozen=True, slots=True)
class Angles:
    """Hold two angles.

    Attributes:
        pan: [rad] To the left.
        tilt: [rad] Down.
    """

    pan: float
    tilt: float


@dataclass(frozen=True, slots=True)
class LookAt:
    """Look at a point while the body moves.

    Attributes:
        point: [m]
        frame: Frame of the point.
    """

    point: Point3
    frame: Frame


@dataclass(frozen=True, slots=True)
class Follow:
    """Look at a point that is updated repeatedly; search if the updates stop.

    Attributes:
        point: [m] Last position.
        frame: Frame of the point.
    """

    point: Point3
    frame: Frame


@dataclass(frozen=True, slots=True)
class Search:
    """Sweep the gaze over the ground ahead."""


Goal = Angles | LookAt | Follow | Search


def checked(goal: object) -> Goal | None:
    """The goal, its numbers as Python's; NaoGaitError if it is none, or not finite."""
    if isinstance(goal, Angles):
        angle = Number(-FARTHEST, FARTHEST, "rad")
        return Angles(angle.check("head.pan", goal.pan), angle.check("head.tilt", goal.tilt))
    if isinstance(goal, LookAt | Follow):
        x, y, z = read_array(goal.point, "head.point", (3,), FARTHEST, "m").tolist()
        frame = Choice(tuple(Frame), Frame).check("head.frame", goal.frame)
        return replace(goal, point=(x, y, z), frame=Frame(frame))
    if goal is None or isinstance(goal, Search):
        return goal
    raise NaoGaitError("head", goal, "Angles, LookAt, Follow, Search or None")
