"""Percepts without images: from geometry, with the errors that were measured on rendered images.

`gait_lab.vision.percept_errors` says what is drawn and what the numbers mean.
"""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gait_lab.vision.percept_errors import LINE_POINT, ROBOT, PerceptErrors
from nao_soccer.vision.image_geometry import ImageGeometry
from nao_soccer.vision.near_robots import (
    FEET_MIN,
    LYING_HEIGHT,
    LYING_RANGE,
    LYING_SPREAD,
    too_near,
)
from nao_soccer.vision.percepts import CROSSINGS, ROBOTS, Box, Kind, Percept, Percepts
from nao_soccer.vision.visible_ground import visible_ground
from nao_soccer.world.field_map import FieldMap
from robot_core.field import Field, Goals, seen_from
from robot_core.geometry import wrapped
from robot_core.robot.camera import CameraView
from robot_core.types import FloatArray, Point2, Pose2

SPACING = 0.1
"""[m] Between two points of a line."""
EDGE = 5.0
"""[px] What is nearer to the edge of the image is not found."""
HIDES = 0.12
"""[m] Half of the width of a robot that hides what is behind it."""
YAW_ERROR = 0.05
"""[rad] Standard deviation of the orientation of a crossing."""
DEPRESSION_MIN = 0.02
"""[rad] Percepts that seem to be further away are dropped."""
CLUMP = 10
"""Number of false line points that come together."""
WAIST, SHOULDERS = 0.25, 0.42
"""[m] of a robot's torso. It is found by its feet and the lower edge of that, or, if its feet are
below the image, by the torso alone."""
SHOULDER_WIDTH = 0.15
"""[m]"""
LYING_RECALL, LYING_ERROR = 0.7, 0.05
"""Share of the lying robots in the image that is found; [m] standard deviation of their place."""
TORSO_BEARING = 0.04
"""[rad] Standard deviation of the bearing of a robot that is found by its torso alone."""
WANDER = 5.0
"""[s] Time constant by which the tilt of a robot wanders, as vision goes on learning it."""


_NOTHING: FloatArray = np.zeros((0, 3))


class OtherRobot(NamedTuple):
    """Another robot, where it truly is.

    Attributes:
        place: x, y [m] in the field: between its feet, or its torso if it lies.
    """

    kind: Kind
    place: Point2
    lies: bool = False


class ErrorModel:
    """The errors and misses of one robot's vision; `scale` is a factor of all errors of places."""

    def __init__(self, errors: PerceptErrors, seed: int, scale: float = 1.0) -> None:
        self._errors = errors
        self._scale = scale
        self._random = random = np.random.default_rng(seed)
        self._tilt = scale * errors.tilt.robot * random.standard_normal()
        self._pan = scale * errors.pan.robot * random.standard_normal()
        self._shift = scale * errors.shift.robot * random.standard_normal(2)
        self._stamp: int | None = None

    def image(self, stamp: int) -> FloatArray:
        """Begin an image at a stamp [ns]; its errors (4,): tilt, pan, shift in x and y."""
        self._wander(stamp)
        errors, random, scale = self._errors, self._random, self._scale
        tilt = self._tilt + scale * errors.tilt.image * random.standard_normal()
        pan = self._pan + scale * errors.pan.image * random.standard_normal()
        shift = self._shift + scale * errors.shift.image * random.standard_normal(2)
        return np.array((tilt, pan, *shift))

    def found(
        self, kind: str, near: FloatArray, seen: NDArray[np.bool_], common: FloatArray
    ) -> FloatArray:
        """What is found of places (n, 2) of a kind in base_footprint, of those to be seen (n,).

        (m, 3) measured x, y [m] and the index of the place; `common` are the image's errors.
        """
        chosen = self._chosen(kind, near, seen)
        return self._measured(kind, near, chosen, common) if len(chosen) else _NOTHING

    def _wander(self, stamp: int) -> None:
        """Move the tilt of the robot by one step of a first-order Gauss-Markov process."""
        if self._stamp is not None:
            keep = math.exp(-max(0.0, (stamp - self._stamp) * 1e-9) / WANDER)
            spread = self._scale * self._errors.tilt.robot * math.sqrt(1.0 - keep * keep)
            self._tilt = keep * self._tilt + spread * self._random.standard_normal()
        self._stamp = stamp

    def _chosen(
        self, kind: str, near: FloatArray, seen: NDArray[np.bool_]
    ) -> NDArray[np.intp]:
        """Indices of the places (n, 2) in base_footprint, of those to be seen, that are found."""
        chosen = np.flatnonzero(seen)
        if not len(chosen):  # as of most landmarks in most images
            return chosen
        share = self._errors.recalls(kind, np.hypot(*near[chosen].T))
        return chosen[self._random.random(len(share)) < share]

    def _measured(
        self, kind: str, near: FloatArray, chosen: NDArray[np.intp], common: FloatArray
    ) -> FloatArray:
        """(m, 3) x, y [m] with errors, and the index of the place that was chosen."""
        own, random, scale = self._errors.kinds[kind], self._random, self._scale
        height = self._errors.camera_height
        x, y = near[chosen].T
        count = len(chosen)
        depression = np.arctan2(height, np.hypot(x, y)) + common[0]
        depression += scale * own.depression * random.standard_normal(count)
        bearing = np.arctan2(y, x) + common[1]
        bearing += scale * own.bearing * random.standard_normal(count)
        kept = depression > DEPRESSION_MIN
        reach = height / np.tan(np.maximum(depression, DEPRESSION_MIN))
        rows = np.array(
            (reach * np.cos(bearing) + common[2], reach * np.sin(bearing) + common[3], chosen)
        ).T
        result: FloatArray = rows[kept]
        return result


class PerceptModel(ErrorModel):
    """The vision of one robot; `scale` is a factor of all errors of places, 0 = exact percepts."""

    def __init__(
        self,
        errors: PerceptErrors,
        field: Field,
        goals: Goals | None,
        seed: int,
        scale: float = 1.0,
    ) -> None:
        super().__init__(errors, seed, scale)
        field_map = FieldMap(field, goals)
        self._objects = [
            (kind, rows) for kind, rows in field_map.landmarks.items() if kind in errors.kinds
        ]
        line = field.points_on_lines(SPACING)
        parts = [*(rows[:, :2] for _, rows in self._objects), line]
        ends = np.cumsum([len(each) for each in parts])
        self._fixed = np.concatenate(parts)
        self._parts = [slice(end - len(each), end) for end, each in zip(ends, parts, strict=True)]

    def see(
        self,
        stamp: int,
        view: CameraView,
        footprint: Pose2,
        ball: Point2 | None = None,
        robots: Sequence[OtherRobot] = (),
    ) -> Percepts:
        """The percepts of one image at a stamp [ns].

        The camera is in base_footprint, all others are true places on the field [m].
        """
        common = self.image(stamp)
        geometry = ImageGeometry(view)
        standing = np.array([not each.lies for each in robots], dtype=bool)
        others = seen_from(footprint, np.array([each.place for each in robots]).reshape(-1, 2))
        hiding = others[standing]
        places = self._fixed if ball is None else np.concatenate((self._fixed, [ball]))
        fixed = seen_from(footprint, places)  # and the ball, last
        in_sight = _in_image(_pixels(fixed, (0.0,), view), view)[:, 0]
        in_sight[in_sight] = ~_hidden(fixed[in_sight], hiding)

        *parts, line = self._parts
        objects: list[Percept] = []
        for (kind, rows), part in zip(self._objects, parts, strict=True):
            for x, y, index in self.found(
                kind.value, fixed[part], in_sight[part], common
            ).tolist():
                yaw = rows[int(index), 2] - footprint[2] if kind in CROSSINGS else 0.0
                objects.append(self._percept(geometry, kind, (x, y), yaw))
        hidden = _hidden(others, hiding)  # nobody hides himself
        pixels = _pixels(others, (0.0, WAIST, SHOULDERS), view)
        whole = _in_image(pixels[:, :2], view).all(axis=1) & ~hidden
        for index, (kind, _, lies) in enumerate(robots):
            near = others[index : index + 1]
            if lies:
                objects += self._lying(geometry, kind, near)
                continue
            for x, y, _ in self.found(ROBOT, near, whole[index : index + 1], common).tolist():
                objects.append(self._percept(geometry, kind, (x, y)))
            if not hidden[index]:
                objects += self._too_near(geometry, kind, pixels[index])
        seen = None
        if ball is not None:
            for x, y, _ in self.found(
                Kind.BALL.value, fixed[-1:], in_sight[-1:], common
            ).tolist():
                seen = self._percept(geometry, Kind.BALL, (x, y))
        points = self.found(LINE_POINT, fixed[line], in_sight[line], common)[:, :2]
        visible = visible_ground(view)
        false = self._false_percepts(geometry, visible)
        if seen is None:
            seen = next((each for each in false if each.kind is Kind.BALL), None)
        objects += [each for each in false if each.kind is not Kind.BALL]
        points = np.concatenate((points, self._false_points(visible)))
        return Percepts(
            stamp, seen, tuple(objects), points, geometry.covariance(points), visible=visible
        )

    def _lying(self, geometry: ImageGeometry, kind: Kind, near: FloatArray) -> list[Percept]:
        """The robot that lies at a place (1, 2) in base_footprint, if it is found."""
        seen = _in_image(_pixels(near, (LYING_HEIGHT,), geometry.view), geometry.view)[0, 0]
        reach = float(np.hypot(*(near[0] - geometry.camera[:2])))
        near_enough = LYING_RANGE[0] < reach < LYING_RANGE[1]
        if not (seen and near_enough) or self._random.random() >= LYING_RECALL:
            return []
        x, y = (near[0] + self._scale * LYING_ERROR * self._random.standard_normal(2)).tolist()
        a, b, c = geometry.covariance(near, LYING_HEIGHT)[0].tolist()
        variance = LYING_SPREAD**2
        return [Percept(kind, (x, y), (a + variance, b, c + variance))]

    def _too_near(self, geometry: ImageGeometry, kind: Kind, pixels: FloatArray) -> list[Percept]:
        """The robot with feet, waist and shoulders at pixels (3, 2), if only its torso is seen."""
        feet, waist, shoulders = pixels.tolist()
        columns, rows = geometry.width, geometry.height
        tall = waist[1] - shoulders[1]
        middle = waist[0] + geometry.focal * self._scale * TORSO_BEARING * self._random.normal()
        # Behind the camera there are no pixels, which makes all comparisons false.
        if not (
            EDGE < waist[0] < columns - EDGE
            and tall > EDGE
            and shoulders[1] < rows - EDGE
            and waist[1] > EDGE
            and not feet[1] < rows - EDGE
            and rows - shoulders[1] < FEET_MIN * tall
        ):
            return []
        half = 0.5 * SHOULDER_WIDTH / (SHOULDERS - WAIST) * tall
        top, bottom = max(0.0, shoulders[1]), min(float(rows), waist[1])
        torso = Box(middle - half, top, middle + half, bottom)
        found = too_near(geometry, torso, kind, rows)
        return [] if found is None else [found]

    def _percept(
        self, geometry: ImageGeometry, kind: Kind, place: Point2, yaw: float = 0.0
    ) -> Percept:
        a, b, c = geometry.covariance(np.array([place]))[0].tolist()
        if kind in CROSSINGS:
            yaw += self._pan + self._scale * YAW_ERROR * self._random.standard_normal()
            if self._random.random() < self._errors.kinds[kind.value].wrong_kind:
                kind = CROSSINGS[(CROSSINGS.index(kind) + 1) % len(CROSSINGS)]
        elif kind in ROBOTS and self._random.random() < self._errors.kinds[ROBOT].wrong_kind:
            kind = ROBOTS[1 - ROBOTS.index(kind)]
        return Percept(kind, place, (a, b, c), math.remainder(yaw, math.tau))

    def _false_percepts(self, geometry: ImageGeometry, visible: FloatArray) -> list[Percept]:
        if len(visible) < 3:
            return []
        found = []
        kinds: Mapping[str, tuple[Kind, ...]] = {ROBOT: ROBOTS}
        for name, each in self._errors.kinds.items():
            if name == LINE_POINT:
                continue
            for _ in range(self._random.poisson(each.false_per_image)):
                kind = kinds.get(name, (Kind(name),) if name != ROBOT else ROBOTS)
                chosen = kind[int(self._random.integers(len(kind)))]
                yaw = self._random.uniform(-math.pi, math.pi)
                found.append(self._percept(geometry, chosen, self._anywhere(visible), yaw))
        return found

    def _false_points(self, visible: FloatArray) -> FloatArray:
        """(n, 2) A clump of points, in few images."""
        share = self._errors.kinds[LINE_POINT].false_per_image / CLUMP
        if len(visible) < 3 or self._random.random() >= share:
            return np.zeros((0, 2))
        clump: FloatArray = self._anywhere(visible) + 0.15 * self._random.standard_normal(
            (CLUMP, 2)
        )
        return clump

    def _anywhere(self, visible: FloatArray) -> Point2:
        """A place in the visible part, uniform in the image and not on the ground."""
        u, v = self._random.random(2)
        low, high = (visible[0] * (1 - u) + visible[3] * u, visible[1] * (1 - u) + visible[2] * u)
        near, far = np.hypot(*low), np.hypot(*high)
        share = 1.0 / ((1 - v) + v * near / max(far, 1e-9)) * v * near / max(far, 1e-9)
        x, y = (low + share * (high - low)).tolist()
        return x, y


def _hidden(near: FloatArray, hiding: FloatArray) -> NDArray[np.bool_]:
    """(n,) Whether one of some robots (m, 2) hides places (n, 2), all in base_footprint."""
    hidden = np.zeros(len(near), dtype=bool)
    distance, bearings = np.hypot(*near.T), np.arctan2(near[:, 1], near[:, 0])
    for x, y in hiding.tolist():
        away = math.hypot(x, y)
        bearing = bearings - math.atan2(y, x)
        beside = np.abs(wrapped(bearing))
        hidden |= (distance > away + HIDES) & (beside < math.atan2(HIDES, away))
    return hidden


def _pixels(near: FloatArray, heights: tuple[float, ...], view: CameraView) -> FloatArray:
    """(n, m, 2) Pixels of points at m heights [m] over places (n, 2) in base_footprint."""
    points = np.empty((len(near), len(heights), 3))
    points[..., :2] = near[:, None]
    points[..., 2] = heights
    return view.project(points.reshape(-1, 3)).reshape(*points.shape[:2], 2)


def _in_image(pixels: FloatArray, view: CameraView) -> NDArray[np.bool_]:
    """(...) Whether pixels (..., 2) are well inside the image; false behind the camera."""
    u, v = pixels[..., 0], pixels[..., 1]
    width, height = view.intrinsics.width, view.intrinsics.height
    inside: NDArray[np.bool_] = (u > EDGE) & (u < width - EDGE) & (v > EDGE) & (v < height - EDGE)
    return inside
