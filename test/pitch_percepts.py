"""Percepts of a robot on a field, made from geometry, for tests of the world model."""

import math

import numpy as np

from nao_soccer.vision.percepts import CROSSINGS, Kind, Percept, Percepts
from nao_soccer.world.field_map import FieldMap
from robot_core.field import Field, Goals
from robot_core.types import Point2, Pose2

SMALL = Field(
    length=4.5, width=3.0, border=0.5, goal_area_length=0.3, goal_area_width=1.6,
    penalty_area_length=0.85, penalty_area_width=2.2, penalty_mark=0.65, circle_diameter=0.75,
)  # fmt: skip
GOALS = Goals(width=1.0, height=0.7, depth=0.4)
REACH, HALF_VIEW = 3.0, 0.6
"""[m, rad] What is nearer and less aside is seen."""
VARIANCE = 0.03**2
"""[m^2] Stated by all percepts."""


class Eyes:
    """Sees everything in front of the robot.

    Args:
        seed: Of the errors of places.
        deviation: [m] of these.
        field: The lines.
    """

    def __init__(self, seed: int = 0, deviation: float = 0.02, field: Field = SMALL) -> None:
        self._random = np.random.default_rng(seed)
        self._deviation = deviation
        self._landmarks = FieldMap(field, GOALS).landmarks
        lines = [np.linspace(line.start, line.end, 30) for line in field.lines()]
        self._points = np.concatenate(lines)

    def see(self, stamp: int, pose: Pose2, ball: Point2 | None = None) -> Percepts:
        """The percepts at a time [ns] from a pose on the field."""
        objects = []
        for kind, rows in self._landmarks.items():
            for (x, y), row in zip(self._near(rows[:, :2], pose), rows, strict=True):
                if self._sees(x, y):
                    yaw = row[2] - pose[2] if kind in CROSSINGS else 0.0
                    objects.append(percept(kind, self._measured(x, y), yaw))
        places = [(x, y) for x, y in self._near(self._points, pose) if self._sees(x, y)]
        points = [self._measured(x, y) for x, y in places]
        seen = None
        if ball is not None:
            x, y = self._near(np.array([ball]), pose)[0]
            seen = percept(Kind.BALL, self._measured(x, y)) if self._sees(x, y) else None
        return Percepts(
            stamp, seen, tuple(objects), np.array(points).reshape(-1, 2),
            np.tile((VARIANCE, 0.0, VARIANCE), (len(points), 1)), visible=VIEW,
        )  # fmt: skip

    def _near(self, places: np.ndarray, pose: Pose2) -> np.ndarray:
        c, s = math.cos(pose[2]), math.sin(pose[2])
        return (places - pose[:2]) @ np.array(((c, -s), (s, c)))

    def _sees(self, x: float, y: float) -> bool:
        return math.hypot(x, y) < REACH and abs(math.atan2(y, x)) < HALF_VIEW

    def _measured(self, x: float, y: float) -> Point2:
        dx, dy = self._deviation * self._random.standard_normal(2)
        return x + dx, y + dy


_SIDE = REACH * math.cos(HALF_VIEW), REACH * math.sin(HALF_VIEW)
VIEW = np.array(((0.0, 0.0), (_SIDE[0], _SIDE[1]), (_SIDE[0], -_SIDE[1])))
"""Part of the ground that is seen [m]."""


def percept(kind: Kind, place: Point2, yaw: float = 0.0, variance: float = VARIANCE) -> Percept:
    """A percept with the same variance [m^2] along both axes."""
    return Percept(kind, place, (variance, 0.0, variance), math.remainder(yaw, math.tau))


def nothing(stamp: int) -> Percepts:
    """The percepts of an image that shows nothing of use."""
    return Percepts(stamp)
