"""What vision reports. Every percept belongs to one image and is in base_footprint at its time."""

from dataclasses import dataclass, field
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from nao_soccer.vision.image_geometry import Tilt
from robot_core.types import FloatArray, Point2

Covariance2 = tuple[float, float, float]
"""Variance of x, covariance of x and y, variance of y [m^2]."""


class Kind(StrEnum):
    """Kinds of percepts that are a place on the ground."""

    BALL = "ball"
    CROSSING_L = "crossing_l"
    CROSSING_T = "crossing_t"
    CROSSING_X = "crossing_x"
    CENTRE_CIRCLE = "centre_circle"
    GOAL_POST = "goal_post"
    POLE = "pole"
    ROBOT_RED = "robot_red"
    ROBOT_BLUE = "robot_blue"


CROSSINGS = (Kind.CROSSING_L, Kind.CROSSING_T, Kind.CROSSING_X)
ROBOT_OF = {"red": Kind.ROBOT_RED, "blue": Kind.ROBOT_BLUE}
"""By team."""
ROBOTS = tuple(ROBOT_OF.values())


class Box(NamedTuple):
    """Where an object is in the image, a rectangle [px].

    Attributes:
        left: First column.
        top: First row.
        right: Last column.
        bottom: Last row.
    """

    left: float
    top: float
    right: float
    bottom: float


class Percept(NamedTuple):
    """An object at a place on the ground.

    Attributes:
        kind: What it is.
        position: Place [m] in base_footprint: the foot of a post, the centre of a ball or circle.
        covariance: Covariance of the place [m^2].
        yaw: Orientation [rad] in base_footprint. L: direction of the bisector of its two arms;
            T: direction of the stem; X: direction of one arm; 0 for other kinds.
        box: Where it is in the image; None if it was not seen as one region.
        tilt: What its size says of the tilt of the camera; None if nothing.
        place: Which landmark of its kind on the map it is; None if they look alike.
    """

    kind: Kind
    position: Point2
    covariance: Covariance2
    yaw: float = 0.0
    box: Box | None = None
    tilt: Tilt | None = None
    place: int | None = None


class LineSegment(NamedTuple):
    """A straight piece of a field line.

    Attributes:
        start: One end [m] in base_footprint.
        pixels: (n, 2) columns and rows of its points in the image.
    """

    start: Point2
    end: Point2
    pixels: FloatArray

    @property
    def length(self) -> float:
        """[m]."""
        return float(np.hypot(self.end[0] - self.start[0], self.end[1] - self.start[1]))


@dataclass(frozen=True, slots=True, eq=False)
class Percepts:
    """What one image shows.

    Attributes:
        stamp: Time of the image [ns].
        ball: The ball, or None.
        objects: All other objects.
        line_points: (n, 2) points [m] on the middle of field lines, in base_footprint.
        line_covariances: (n, 3) their covariances [m^2], as in `Covariance2`.
        segments: Straight pieces through these points.
        boundary: (m, 2) columns and rows [px] of the upper edge of the field, from left to right.
        visible: (k, 2) corners [m] of the part of the ground that the image shows, in
            base_footprint; empty if it is not known.
    """

    stamp: int
    ball: Percept | None = None
    objects: tuple[Percept, ...] = ()
    line_points: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))
    line_covariances: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    segments: tuple[LineSegment, ...] = ()
    boundary: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))
    visible: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))

    def of(self, *kinds: Kind) -> tuple[Percept, ...]:
        """The objects of these kinds."""
        return tuple(each for each in self.objects if each.kind in kinds)
