"""Goals of the head."""

from dataclasses import dataclass
from enum import StrEnum

from robot_core.types import Point3


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
