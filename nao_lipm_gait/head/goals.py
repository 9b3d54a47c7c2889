"""What a head can be asked for."""

from dataclasses import dataclass
from enum import StrEnum

from nao_lipm_gait.types import Point3


class Frame(StrEnum):
    """What a point to look at is fixed to."""

    TORSO = "torso"
    FOOTPRINT = "base_footprint"
    """The ground between the soles; turns with the heading, not with the torso's sway."""
    ODOM = "odom"
    """The world, as far as odometry knows it."""


@dataclass(frozen=True, slots=True)
class Angles:
    """Hold these angles."""

    pan: float
    """[rad] to the left."""
    tilt: float
    """[rad] down."""


@dataclass(frozen=True, slots=True)
class LookAt:
    """Look at a point, while the body moves."""

    point: Point3
    """[m]"""
    frame: Frame


@dataclass(frozen=True, slots=True)
class Follow:
    """Look at a point that somebody keeps seeing; search when it is seen no more."""

    point: Point3
    """[m] where it was seen last."""
    frame: Frame


@dataclass(frozen=True, slots=True)
class Search:
    """Sweep over the ground ahead."""


Goal = Angles | LookAt | Follow | Search
