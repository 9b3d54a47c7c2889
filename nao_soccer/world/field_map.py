"""The field as self-localisation uses it: distances to the lines, and landmarks by kind.

The frame is `field`: x towards the opponents' goal. A field looks the same after half a turn, so
one map serves both teams.
"""

import math
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nao_soccer.vision.percepts import Kind
from robot_core.field import Field, Goals, Pole
from robot_core.types import FloatArray

CELL = 0.02
"""[m] Size of the cells of the distance map."""
AROUND = 0.5
"""[m] Width of the distance map beyond the border."""
PERIODS = {
    Kind.CROSSING_L: math.tau,
    Kind.CROSSING_T: math.tau,
    Kind.CROSSING_X: math.pi / 2.0,
}
"""[rad] Period of the orientation of a landmark; other kinds have none."""


class Nearest(NamedTuple):
    """The nearest place on a line, for each of some points.

    Attributes:
        distance: [m] to it.
        x: x of the unit vector from the line.
        y: y of it.
    """

    distance: FloatArray
    x: FloatArray
    y: FloatArray


class FieldMap:
    """Lines and landmarks of a field.

    Attributes:
        half: Half length and half width [m] of the carpet.
        landmarks: By kind, (n, 3) x, y [m] and orientation [rad] as in `Percept.yaw`.
        goal_width: [m] between the middles of two posts; 0 without goals.
    """

    def __init__(self, field: Field, goals: Goals | None, poles: tuple[Pole, ...] = ()) -> None:
        self.half = field.length / 2.0 + field.border, field.width / 2.0 + field.border
        self._corner = tuple(-(each + AROUND) for each in self.half)
        shape = tuple(math.ceil(-2.0 * each / CELL) + 1 for each in self._corner)
        self._columns = shape[1]
        self._limits = shape[0] - 1, shape[1] - 1
        self._of = field
        self.landmarks: dict[Kind, FloatArray] = {}
        for kind in PERIODS:
            letter = kind.value[-1].upper()
            self._add(
                kind,
                [(c.x, c.y, c.heading) for c in field.crossings() if c.kind.value == letter],
            )
        if field.circle_diameter:
            self._add(Kind.CENTRE_CIRCLE, [(0.0, 0.0, 0.0)])
        posts = () if goals is None else field.posts(goals)
        self._add(Kind.GOAL_POST, [(x, y, 0.0) for x, y in posts])
        self._add(Kind.POLE, [(pole.x, pole.y, 0.0) for pole in poles])
        self.goal_width = 0.0 if goals is None else goals.width + goals.post_diameter

    def _add(self, kind: Kind, rows: list[tuple[float, float, float]]) -> None:
        if rows:
            self.landmarks[kind] = np.array(rows)

    @cached_property
    def _cells(self) -> Nearest:
        """The nearest line of every cell; who sees no lines does without."""
        x: FloatArray = self._corner[0] + CELL * np.arange(self._limits[0] + 1.0)[:, None]
        y: FloatArray = self._corner[1] + CELL * np.arange(self._limits[1] + 1.0)[None, :]
        return Nearest(*(each.ravel() for each in _nearest_line(self._of, x, y)))

    def nearest(self, x: FloatArray, y: FloatArray) -> Nearest:
        """The nearest line of places x and y [m] of any shape; outside the map, of its edge."""
        if not x.size:
            return Nearest(x, x, x)
        row = ((x - self._corner[0]) * (1.0 / CELL) + 0.5).astype(np.intp)
        column = ((y - self._corner[1]) * (1.0 / CELL) + 0.5).astype(np.intp)
        np.clip(row, 0, self._limits[0], out=row)
        np.clip(column, 0, self._limits[1], out=column)
        index = row * self._columns + column
        return Nearest(*(each[index] for each in self._cells))

    def contains(self, poses: FloatArray) -> NDArray[np.bool_]:
        """Whether places (n, 2 or more) are on the carpet: (n,)."""
        return np.asarray(
            (np.abs(poses[:, 0]) <= self.half[0]) & (np.abs(poses[:, 1]) <= self.half[1])
        )


def _nearest_line(field: Field, x: FloatArray, y: FloatArray) -> Nearest:
    """Nearest line of every cell, for x (n, 1) and y (1, m)."""
    shape = np.broadcast_shapes(x.shape, y.shape)
    best = Nearest(np.full(shape, np.inf), np.zeros(shape), np.zeros(shape))
    for line in field.lines():
        (x0, y0), (x1, y1) = line.start, line.end
        along = ((x - x0) * (x1 - x0) + (y - y0) * (y1 - y0)) / math.hypot(x1 - x0, y1 - y0) ** 2
        along = np.clip(along, 0.0, 1.0)
        _keep(best, x - x0 - along * (x1 - x0), y - y0 - along * (y1 - y0))
    if field.circle_diameter:
        radius = np.maximum(np.hypot(x, y), 1e-9)
        ahead = 1.0 - field.circle_diameter / 2.0 / radius
        _keep(best, x * ahead, y * ahead)
    return best


def _keep(best: Nearest, dx: FloatArray, dy: FloatArray) -> None:
    """Take over where the offset from another line is shorter."""
    distance = np.hypot(dx, dy)
    nearer = distance < best.distance
    scale = 1.0 / np.maximum(distance, 1e-9)
    best.distance[nearer] = distance[nearer]
    best.x[nearer] = (dx * scale)[nearer]
    best.y[nearer] = (dy * scale)[nearer]
