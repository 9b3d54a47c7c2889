"""What the vision of a recorded robot has seen, and how far that is from the truth of the bag."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from gait_lab.analysis.body import BodyTrack, footprint_of
from gait_lab.analysis.recorded_walk import RecordedWalk
from nao_soccer.vision.percepts import CROSSINGS, ROBOTS, Kind
from robot_core.geometry import rotate_each
from robot_core.types import FloatArray
from sim_bridge.scene import parse_scene
from sim_bridge.trials.trace import IntArray

KINDS = tuple(Kind)
"""The field `kind` of `vision/percepts` is an index of this."""
FIELDS = ("x", "y", "kind")
GROUPS: tuple[tuple[str, tuple[Kind, ...]], ...] = (
    ("ball", (Kind.BALL,)),
    ("crossings", CROSSINGS),
    ("centre circle", (Kind.CENTRE_CIRCLE,)),
    ("goal posts", (Kind.GOAL_POST,)),
    ("poles", (Kind.POLE,)),
    ("robots", ROBOTS),
)
"""Percepts that are counted together, by their name."""
_LATE = 20_000_000
"""[ns] A truth that is further from the image's time is not compared."""


@dataclass(frozen=True, slots=True)
class Seen:
    """Percepts of one group: m of them in t images.

    Attributes:
        name: Of the group.
        count: (t,) percepts of each image.
        stamp: (m,) [ns] of their images.
        position: (m, 2) [m] in base_footprint.
        error: (m,) [m] from the nearest such thing of the bag's truth; NaN where that is unknown.
    """

    name: str
    count: IntArray
    stamp: IntArray
    position: FloatArray
    error: FloatArray


@dataclass(frozen=True, slots=True)
class RecordedPercepts:
    """What a robot has seen.

    Attributes:
        stamp: (t,) [ns] of the images, increasing.
        groups: By `GROUPS`, without those of which there is nothing in the bag.
    """

    stamp: IntArray
    groups: tuple[Seen, ...]

    def group(self, name: str) -> Seen | None:
        """A group; None if nothing of it was seen."""
        return next((each for each in self.groups if each.name == name), None)


def find_percepts(walk: RecordedWalk, body: BodyTrack | None) -> RecordedPercepts | None:
    """The percepts of a bag; None without any image that was seen.

    Args:
        walk: The recording.
        body: Poses of the robot; None = errors are unknown.
    """
    if not walk.seen:
        return None
    stamps = np.array([stamp for stamp, _ in walk.seen], dtype=np.int64)
    rows = np.concatenate([percepts_of(message) for _, message in walk.seen])
    image = np.repeat(
        np.arange(len(stamps)), [int(message.width) for _, message in walk.seen]
    )
    known = np.isfinite(rows).all(axis=1)
    rows, image = rows[known], image[known]
    kinds = np.clip(rows[:, 2].astype(int), 0, len(KINDS) - 1)
    footprint = footprints_at(body, stamps)
    groups = []
    for name, members in GROUPS:
        mine = np.isin(kinds, [KINDS.index(kind) for kind in members])
        if not mine.any():
            continue
        index, position = image[mine], rows[mine, :2]
        error = _errors(_in_world(position, footprint[index]), _truths(walk, name, stamps[index]))
        count = np.bincount(index, minlength=len(stamps))
        groups.append(Seen(name, count, stamps[index], position, error))
    return RecordedPercepts(stamps, tuple(groups))


def percepts_of(message: Any) -> FloatArray:
    """(m, 3) x, y [m] and kind of a `vision/percepts` (PointCloud2 of float32)."""
    offsets = {field.name: field.offset for field in message.fields}
    if not all(name in offsets for name in FIELDS):
        return np.full((int(message.width), len(FIELDS)), np.nan)
    data = np.frombuffer(bytes(message.data), np.uint8)
    data = data.reshape(int(message.width), int(message.point_step))
    columns = [
        np.ascontiguousarray(data[:, offsets[name] : offsets[name] + 4]).view("<f4")[:, 0]
        for name in FIELDS
    ]
    return np.stack(columns, axis=1).astype(float)


def footprints_at(body: BodyTrack | None, stamps: IntArray) -> FloatArray:
    """(t, 3) true x, y [m], yaw [rad] of base_footprint in world; NaN where unknown."""
    if body is None or not body.from_truth or not len(body.stamp):
        return np.full((len(stamps), 3), np.nan)
    return nearest_rows(body.stamp, footprint_of(body.sole), stamps)


def nearest_rows(known: IntArray, values: FloatArray, stamps: IntArray) -> FloatArray:
    """Rows of values (k, n) at the nearest of the known stamps; NaN beyond `_LATE`."""
    if not len(known):
        return np.full((len(stamps), values.shape[1]), np.nan)
    after = np.clip(np.searchsorted(known, stamps), 1, max(len(known) - 1, 1))
    after = np.minimum(after, len(known) - 1)
    before = np.maximum(after - 1, 0)
    row = np.where(stamps - known[before] <= known[after] - stamps, before, after)
    late = np.abs(known[row] - stamps) > _LATE
    return np.where(late[:, None], np.nan, values[row])


def _in_world(position: FloatArray, footprint: FloatArray) -> FloatArray:
    """(m, 2) places in base_footprint (m, 2) as places in world."""
    turned = rotate_each(position[:, 0], position[:, 1], footprint[:, 2])
    return footprint[:, :2] + np.column_stack(turned)


def _truths(walk: RecordedWalk, name: str, stamps: IntArray) -> FloatArray:
    """(m, k, 2) [m] in world: where the things of a group were at the time of each percept."""
    if name == "ball":
        return nearest_rows(walk.ball.stamp, walk.ball.value, stamps)[:, None, :2]
    if name == "robots":
        places = [
            nearest_rows(each.stamp, each.value, stamps)[:, :2] for each in walk.others.values()
        ]
        return np.stack(places, axis=1) if places else np.empty((len(stamps), 0, 2))
    return np.broadcast_to(_fixed(walk, name), (len(stamps), *_fixed(walk, name).shape))


def _fixed(walk: RecordedWalk, name: str) -> FloatArray:
    """(k, 2) [m] Where the things of a group stand, by the scene of the bag."""
    places: list[tuple[float, float]] = []
    scene = None if walk.scene is None else parse_scene(walk.scene)
    if scene is not None and scene.field is not None:
        if name == "crossings":
            places = [(each.x, each.y) for each in scene.field.crossings()]
        elif name == "centre circle":
            places = [(0.0, 0.0)]
        elif name == "goal posts" and scene.goals is not None:
            places = [(x, y) for x, y in scene.field.posts(scene.goals)]
        elif name == "poles":
            places = [(pole.x, pole.y) for pole in scene.poles]
    return np.array(places, dtype=float).reshape(-1, 2)


def _errors(places: FloatArray, truths: FloatArray) -> FloatArray:
    """(m,) [m] from places (m, 2) to the nearest of their truths (m, k, 2)."""
    if not truths.shape[1]:
        return np.full(len(places), np.nan)
    apart = np.linalg.norm(truths - places[:, None], axis=2)
    nearest: FloatArray = np.where(np.isnan(apart), np.inf, apart).min(axis=1)
    return np.where(np.isfinite(nearest), nearest, np.nan)
