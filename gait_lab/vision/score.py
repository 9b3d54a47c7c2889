"""Percepts against the truth: found, missed, false, and how far off."""

import math
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from gait_lab.vision.expected import Expected, View
from nao_lipm_gait.types import FloatArray
from nao_soccer.vision.image_geometry import ImageGeometry
from nao_soccer.vision.percepts import CROSSINGS, ROBOTS, Kind, Percept, Percepts

GATE = (0.2, 0.25)
"""[m] and share of the distance within which a percept is that of an object."""
LINE_GATE = 0.1
"""[m] Off a line beyond which a point on it is false; and 2 px more."""
LINE_FOUND = 12.0
"""[px] A point of a line is found if vision has one so near."""
LINE_FALSE = 5
"""Least number of false points for a false line."""
GROUPS: dict[str, tuple[Kind, ...]] = {
    "ball": (Kind.BALL,),
    "posts": (Kind.GOAL_POST,),
    "robots": ROBOTS,
    "crossings": CROSSINGS,
    "circle": (Kind.CENTRE_CIRCLE,),
}
"""Kinds that are scored together. A crossing counts with its own kind only."""


@dataclass(slots=True)
class Tally:
    """Counts of one group.

    Attributes:
        due: Objects that had to be reported.
        found: Those that were.
        false: Reports of what is not there.
        errors: (distance [m], error along, error across [m], predicted standard deviation [m]) of
            what was found.
    """

    due: int = 0
    found: int = 0
    false: int = 0
    errors: list[tuple[float, float, float, float]] = field(default_factory=list)

    def add(self, other: "Tally") -> None:
        """Add the counts of another run."""
        self.due += other.due
        self.found += other.found
        self.false += other.false
        self.errors += other.errors

    @property
    def recall(self) -> float | None:
        """Share of what was due that was found [%]."""
        return 100.0 * self.found / self.due if self.due else None

    @property
    def error_median(self) -> float | None:
        """Median error [% of the distance]."""
        shares = [math.hypot(along, across) / away for away, along, across, _ in self.errors]
        return 100.0 * float(np.median(shares)) if shares else None


@dataclass(slots=True)
class Score:
    """Counts of some images.

    Attributes:
        frames: Number of images.
        groups: Counts by group.
        lines: Points of lines that were due, found, and images with a false line.
        times: [s] of each image.
    """

    frames: int = 0
    groups: dict[str, Tally] = field(default_factory=lambda: defaultdict(Tally))
    lines: Tally = field(default_factory=Tally)
    times: list[float] = field(default_factory=list)

    def add(self, other: "Score") -> None:
        """Add other images."""
        self.frames += other.frames
        self.times += other.times
        self.lines.add(other.lines)
        for name, tally in other.groups.items():
            self.groups[name].add(tally)

    def per_frames(self, false: int, frames: int) -> float | None:
        """False reports in so many images."""
        return false * frames / self.frames if self.frames else None

    def see(
        self, view: View, percepts: Percepts, geometry: ImageGeometry, seconds: float
    ) -> list[str]:
        """Count one image.

        Args:
            view: The image with its truth.
            percepts: What was seen.
            geometry: Of the image, as vision had it.
            seconds: Time that vision took.

        Returns:
            What is wrong, in words.
        """
        self.frames += 1
        self.times.append(seconds)
        expected = list(view.objects())
        reported = list(percepts.objects)
        if percepts.ball is not None:
            reported.append(percepts.ball)
        wrong: list[str] = []
        for name, kinds in GROUPS.items():
            for kind in kinds:
                wrong += _match(
                    self.groups[name],
                    [each for each in expected if each.kind is kind],
                    [each for each in reported if each.kind is kind],
                )
        wrong += self._see_lines(view, percepts, geometry)
        return wrong

    def _see_lines(self, view: View, percepts: Percepts, geometry: ImageGeometry) -> list[str]:
        due = view.due_line_pixels()
        self.lines.due += len(due)
        if not len(percepts.line_points):
            return []
        pixels = geometry.pixels_of(percepts.line_points)
        if len(due):
            off = due[:, None] - pixels[None]
            near = np.sqrt((off**2).sum(axis=2)).min(axis=1) < LINE_FOUND
            self.lines.found += int(near.sum())
        false = int((view.off_line(pixels) > _line_gate(percepts.line_points, geometry)).sum())
        if false >= LINE_FALSE:
            self.lines.false += 1
            return [f"false line of {false} points"]
        return []


def _line_gate(places: FloatArray, geometry: ImageGeometry) -> FloatArray:
    """[m] Largest distance of each point from a line: 2 px along the line of sight, and more."""
    reach = np.hypot(*(places - geometry.camera[:2]).T)
    drop = float(geometry.camera[2])
    return np.asarray(LINE_GATE + 2.0 * (reach**2 + drop**2) / (drop * geometry.focal))


def _match(tally: Tally, expected: Iterable[Expected], reported: list[Percept]) -> list[str]:
    """Pair objects with percepts, nearest first, and count."""
    expected = list(expected)
    pairs = sorted(
        (math.dist(one.position, other.position), i, j)
        for i, one in enumerate(expected)
        for j, other in enumerate(reported)
        if math.dist(one.position, other.position) < GATE[0] + GATE[1] * one.distance
    )
    taken: dict[int, int] = {}
    used: set[int] = set()
    for _, i, j in pairs:
        if i not in taken and j not in used:
            taken[i] = j
            used.add(j)
            tally.errors.append(_error(expected[i], reported[j]))
    wrong = []
    for i, one in enumerate(expected):
        if one.due:
            tally.due += 1
            tally.found += i in taken
            if i not in taken:
                wrong.append(f"miss {one.kind.value} {one.distance:.2f}")
    for j, other in enumerate(reported):
        if j not in used:
            tally.false += 1
            x, y = other.position
            wrong.append(f"false {other.kind.value} {x:.2f} {y:.2f}")
    return wrong


def _error(truth: Expected, percept: Percept) -> tuple[float, float, float, float]:
    (x, y), (px, py) = truth.position, percept.position
    away = max(truth.distance, 1e-3)
    along = ((px - x) * x + (py - y) * y) / away
    across = ((py - y) * x - (px - x) * y) / away
    xx, _, yy = percept.covariance
    return away, along, across, math.sqrt(max(xx + yy, 0.0))
