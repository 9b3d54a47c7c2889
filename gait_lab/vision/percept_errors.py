"""The measured errors of vision's percepts, for percepts that are made from geometry.

A percept at the distance r and the bearing b from base_footprint has the depression atan(h / r), h
the height of the camera. The errors of the camera's pose are common to all percepts of an image:
they add to each depression (tilt) and bearing (pan), and shift base_footprint. Part of them lasts
as long as the robot, the rest is drawn for each image. Each percept adds errors of its own.
"""

from pathlib import Path

import attrs
import numpy as np

from robot_core import schema
from robot_core.errors import NaoGaitError
from robot_core.resources import find
from robot_core.schema import Number, Sequence, Settings, Table, group, number
from robot_core.types import FloatArray

LINE_POINT = "line_point"
"""A point on the middle of a field line; true ones are 0.1 m apart."""
ROBOT = "robot"
"""Robots of both teams."""


@attrs.frozen
class CommonError(Settings):
    """Standard deviations of an error that all percepts of one image share."""

    robot: float = number(minimum=0.0, maximum=1.0, meaning="Of its mean over a robot's images.")
    image: float = number(minimum=0.0, maximum=1.0, meaning="Of an image, about that mean.")


@attrs.frozen
class KindErrors(Settings):
    """Errors of the percepts of one kind."""

    recall: tuple[float, ...] = schema.field(
        Sequence(Number(0.0, 1.0), 1),
        meaning="Share of what is in the image and not hidden that is found, at each distance.",
    )
    depression: float = number(
        minimum=0.0, maximum=1.0, unit="rad", meaning="Standard deviation of its own."
    )
    bearing: float = number(
        minimum=0.0, maximum=1.0, unit="rad", meaning="Standard deviation of its own."
    )
    false_per_image: float = number(
        minimum=0.0, maximum=100.0, meaning="Mean number of percepts of nothing."
    )
    wrong_kind: float = number(
        0.0, 0.0, 1.0, meaning="Share of those found that have another kind or team."
    )


@attrs.frozen
class PerceptErrors(Settings):
    """Errors of all percepts of a robot."""

    distances: tuple[float, ...] = schema.field(
        Sequence(Number(0.0, 20.0, "m"), 2), meaning="Distances of the recalls; they rise."
    )
    delay: float = number(
        minimum=0.0, maximum=2.0, unit="s", meaning="From exposure to percept."
    )
    camera_height: float = number(
        minimum=0.05, maximum=3.0, unit="m", meaning="Of the camera over the ground."
    )
    tilt: CommonError = group(CommonError, meaning="[rad] Depression.")
    pan: CommonError = group(CommonError, meaning="[rad] Bearing.")
    shift: CommonError = group(CommonError, meaning="[m] base_footprint, in x and in y.")
    kinds: dict[str, KindErrors] = schema.field(
        Table(schema.Group(KindErrors), 1), meaning="By kind."
    )

    def __attrs_post_init__(self) -> None:
        """Check that the lists fit each other."""
        Settings.__attrs_post_init__(self)
        if any(b <= a for a, b in zip(self.distances, self.distances[1:], strict=False)):
            raise NaoGaitError("distances", self.distances, "rising distances")
        for name, kind in self.kinds.items():
            if len(kind.recall) != len(self.distances):
                allowed = f"{len(self.distances)} numbers, one for each of distances"
                raise NaoGaitError(f"kinds.{name}.recall", kind.recall, allowed)

    def recall(self, kind: str, distance: float) -> float:
        """Share that is found of a kind at a distance [m]; 0 beyond the last distance."""
        return float(self.recalls(kind, np.array((distance,)))[0])

    def recalls(self, kind: str, distances: FloatArray) -> FloatArray:
        """Shares (n,) at distances (n,), as `recall`."""
        own = self.kinds[kind].recall
        shares: FloatArray = np.interp(distances, self.distances, own, right=0.0)
        return shares


def load_percept_errors(name_or_path: str | Path = "percept_errors") -> PerceptErrors:
    """Load the errors: a shipped name or the path of a YAML file.

    Raises:
        NaoGaitError: Names the file, the field, its value and what is allowed.
    """
    path = find("vision", name_or_path)
    values = schema.read_yaml(path, "percept errors")
    return PerceptErrors.from_mapping(values, f"percept errors {path}: ")
