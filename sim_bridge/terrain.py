"""Uneven ground: hexagonal plates of different height, a ramp, steps.

Pure geometry, the same in every engine. The field begins at x = `start` in front of the robot and
is symmetric in y. It consists of convex upright prisms with a flat top.
"""

import math
from dataclasses import dataclass
from zlib import crc32

import numpy as np

from robot_core.types import FloatArray
from sim_bridge.plant import Terrain

LEVELS = 4
"""Number of different heights of the hexagons, evenly spaced from the floor up; chosen, because the
paper does not give them."""
FOUNDATION = 0.05
"""[m] by which a prism reaches below the floor, so that no contact pushes downwards."""

_SEAM = 1e-12
"""[m^2] rounding tolerance: a point on an edge belongs to both prisms."""

_LIGHTEST = 0.02
"""[m] height from which on a prism has its lightest colour."""
_LOW, _HIGH = (0.25, 0.32, 0.42), (1.0, 0.72, 0.25)
"""Colours of the lowest and the highest prisms: red, green, blue."""


@dataclass(frozen=True, slots=True)
class Prism:
    """An upright prism with a convex outline and a flat top.

    Attributes:
        outline: (k, 2) [m] in the world, counter-clockwise.
        top: (k,) [m] height at each corner; all in one plane.
    """

    outline: FloatArray
    top: FloatArray

    @property
    def vertices(self) -> FloatArray:
        """(2 k, 3) [m] in the world: first the bottom, then the top."""
        count = len(self.outline)
        bottom = np.column_stack((self.outline, np.full(count, -FOUNDATION)))
        return np.vstack((bottom, np.column_stack((self.outline, self.top))))

    @property
    def triangles(self) -> tuple[tuple[int, int, int], ...]:
        """Vertices of each triangle of the surface, counter-clockwise from outside."""
        k = len(self.outline)
        fan = [(0, i, i + 1) for i in range(1, k - 1)]
        top = [(a + k, b + k, c + k) for a, b, c in fan]
        bottom = [(a, c, b) for a, b, c in fan]
        edges = [(i, (i + 1) % k) for i in range(k)]
        sides = [(i, j, j + k) for i, j in edges] + [(i, j + k, i + k) for i, j in edges]
        return (*top, *bottom, *sides)

    def height_at(self, x: float, y: float) -> float | None:
        """[m] height of its top at a point; None outside of its outline."""
        ahead = np.roll(self.outline, -1, axis=0) - self.outline
        to = np.array((x, y)) - self.outline
        if (ahead[:, 0] * to[:, 1] - ahead[:, 1] * to[:, 0] < -_SEAM).any():
            return None
        plane = np.column_stack((self.outline, np.ones(len(self.outline))))
        slope_x, slope_y, level = np.linalg.lstsq(plane, self.top, rcond=None)[0]
        return float(slope_x * x + slope_y * y + level)

    @property
    def color(self) -> tuple[float, float, float, float]:
        """Red, green, blue, alpha: the lighter, the higher."""
        share = min(1.0, float(np.max(self.top)) / _LIGHTEST)
        red, green, blue = ((1.0 - share) * a + share * b for a, b in zip(_LOW, _HIGH, strict=True))
        return red, green, blue, 1.0


def is_uneven(terrain: Terrain) -> bool:
    """Whether prisms rise above the floor."""
    return terrain.kind in ("hexagons", "ramp", "steps")


def prisms(terrain: Terrain, seed: int) -> tuple[Prism, ...]:
    """All prisms that rise above the floor; `seed` (from -1) draws their heights."""
    if terrain.kind == "hexagons":
        return tuple(prism for prism in hexagons(terrain, seed) if prism.top[0] > 0.0)
    third, h = terrain.length / 3.0, terrain.height
    tops = {
        "ramp": ((0.0, h), (h, h), (h, 0.0)),
        "steps": ((h, h), (2.0 * h, 2.0 * h), (h, h)),
    }.get(terrain.kind, ())
    return tuple(
        _slab(terrain.start + i * third, third, terrain.width, near, far)
        for i, (near, far) in enumerate(tops)
        if max(near, far) > 0.0
    )


def hexagons(terrain: Terrain, seed: int) -> tuple[Prism, ...]:
    """All plates that overlap the field, including those of height 0.

    Rows of hexagons along x whose flats touch; each height is one of `LEVELS`, equally likely.
    Plates at the rim are whole, so they extend beyond the field by up to their radius.
    """
    rng = np.random.default_rng([seed + 1, crc32(b"terrain")])
    radius = terrain.plate / math.sqrt(3.0)
    corners = radius * np.array(
        [(math.cos(a), math.sin(a)) for a in math.radians(30.0) + math.tau / 6.0 * np.arange(6)]
    )
    last_row = math.ceil((terrain.width / 2.0 + radius) / (1.5 * radius))
    columns = math.ceil(terrain.length / terrain.plate) + 1
    plates = []
    for row in range(-last_row, last_row + 1):
        y = 1.5 * radius * row
        if abs(y) - radius >= terrain.width / 2.0:
            continue
        for column in range(columns + 1):
            x = (column - 0.5 * (row % 2)) * terrain.plate
            if x - terrain.plate / 2.0 >= terrain.length or x + terrain.plate / 2.0 <= 0.0:
                continue
            level = int(rng.integers(LEVELS))
            height = terrain.height * level / (LEVELS - 1)
            outline = corners + (terrain.start + x, y)
            plates.append(Prism(outline, np.full(6, height)))
    return tuple(plates)


def ground_height(ground: tuple[Prism, ...], x: float, y: float) -> float:
    """[m] of the ground at a point in the world."""
    return max((h for prism in ground if (h := prism.height_at(x, y)) is not None), default=0.0)


def _slab(x: float, length: float, width: float, near: float, far: float) -> Prism:
    half = width / 2.0
    outline = np.array([(x, -half), (x + length, -half), (x + length, half), (x, half)])
    return Prism(outline, np.array((near, far, far, near)))
