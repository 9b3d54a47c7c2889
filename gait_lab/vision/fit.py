"""Fits the errors of percepts to scored images."""

import math
from collections.abc import Mapping, Sequence

import numpy as np
import yaml

from gait_lab.vision.percept_errors import (
    LINE_POINT,
    ROBOT,
    CommonError,
    KindErrors,
    PerceptErrors,
)
from gait_lab.vision.score import Score, Sighting, merged
from nao_soccer.vision.percepts import CROSSINGS, ROBOTS, Kind
from robot_core.types import FloatArray

DISTANCES = (0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0)
"""[m] At which the recalls are stated; each object counts for the nearest one."""
SAMPLES_MIN = 8
"""Least number of objects at a distance; with fewer its recall is interpolated, or 0 beyond."""
QUANTILES = (0.1587, 0.8413)
"""Of a normal distribution, one standard deviation to either side."""
KINDS: Mapping[str, tuple[Kind, ...]] = {
    "ball": (Kind.BALL,),
    **{kind.value: (kind,) for kind in CROSSINGS},
    "centre_circle": (Kind.CENTRE_CIRCLE,),
    "goal_post": (Kind.GOAL_POST,),
    ROBOT: ROBOTS,
}


def fit(scores: Sequence[Score], delay: float) -> PerceptErrors:
    """Errors of the percepts, of a score for each robot and way of walking; `delay` [s]."""
    every = merged(scores)
    poses = [np.array(score.poses) for score in scores if score.poses]
    kinds = {name: _kind(every, group) for name, group in KINDS.items()}
    kinds[LINE_POINT] = _line_points(every)
    return PerceptErrors(
        distances=DISTANCES,
        delay=delay,
        camera_height=_rounded(float(np.median(np.concatenate(poses)[:, 4]))),
        tilt=_common([each[:, :1] for each in poses]),
        pan=_common([each[:, 1:2] for each in poses]),
        shift=_common([each[:, 2:4] for each in poses]),
        kinds=kinds,
    )


def as_yaml(errors: PerceptErrors, comment: str) -> str:
    """The text of a file of errors; each line of the comment begins with `#`."""
    head = "".join(f"# {line}\n" for line in comment.splitlines())
    body: str = yaml.safe_dump(
        errors.plain(), sort_keys=False, default_flow_style=None, width=100
    )
    return head + body


def _common(by_run: Sequence[FloatArray]) -> CommonError:
    """Deviations of the means of runs, and of images about them; (n, k) for each run."""
    means = np.array([np.median(each, axis=0) for each in by_run])
    rest = np.concatenate([each - mean for each, mean in zip(by_run, means, strict=True)])
    return CommonError(_rounded(float(np.sqrt((means**2).mean()))), _rounded(_spread(rest)))


def _kind(score: Score, kinds: Sequence[Kind]) -> KindErrors:
    sightings = [each for each in score.sightings if each.kind in kinds]
    inside = np.array(
        [(each.distance, each.seen_as is not None) for each in sightings if each.in_image]
    ).reshape(-1, 2)
    found = [each for each in sightings if each.seen_as is not None]
    own = np.array([_own_error(each) for each in found]).reshape(-1, 2)
    false = sum(kind in kinds for kind, _ in score.false)
    wrong = sum(each.seen_as is not each.kind for each in found)
    return KindErrors(
        recall=_recall(inside),
        depression=_rounded(_spread(own[:, 0])),
        bearing=_rounded(_spread(own[:, 1])),
        false_per_image=_rounded(false / max(score.images, 1)),
        wrong_kind=_rounded(wrong / max(len(found), 1)),
    )


def _line_points(score: Score) -> KindErrors:
    parts = score.line_points
    depression, bearing = (
        np.concatenate([getattr(part, name) for part in parts]) if parts else np.empty(0)
        for name in ("depression", "bearing")
    )
    due = np.concatenate(score.line_due) if score.line_due else np.empty((0, 2))
    return KindErrors(
        recall=_recall(due),
        depression=_rounded(_spread(depression[np.isfinite(depression)])),
        bearing=_rounded(_spread(bearing[np.isfinite(bearing)])),
        false_per_image=_rounded(score.false_line_points / max(score.images, 1)),
    )


def _own_error(sighting: Sighting) -> tuple[float, float]:
    """Error of depression and bearing [rad] without those of the camera's pose."""
    pose = sighting.pose
    (x, y), (px, py) = sighting.position, sighting.percept
    px, py = px - pose.x, py - pose.y
    seen, true = (math.atan2(pose.height, math.hypot(*each)) for each in ((px, py), (x, y)))
    bearing = math.remainder(math.atan2(py, px) - math.atan2(y, x) - pose.pan, math.tau)
    return seen - true - pose.tilt, bearing


def _recall(found: FloatArray) -> tuple[float, ...]:
    """Shares that were found of (n, 2) distance [m] and 0 or 1, at each of `DISTANCES`."""
    nearest = np.abs(found[:, :1] - np.array(DISTANCES)).argmin(axis=1)
    known: list[float] = []
    shares: list[float] = []
    for index, distance in enumerate(DISTANCES):
        here = found[nearest == index, 1]
        if len(here) >= SAMPLES_MIN:
            known.append(distance)
            shares.append(float(here.mean()))
    if not known:
        return (0.0,) * len(DISTANCES)
    return tuple(_rounded(float(each)) for each in np.interp(DISTANCES, known, shares, right=0.0))


def _spread(values: FloatArray) -> float:
    """Standard deviation without the tails: half the width of the middle 68 %."""
    if not values.size:
        return 0.0
    low, high = np.quantile(values, QUANTILES)
    return 0.5 * float(high - low)


def _rounded(value: float) -> float:
    return float(f"{value:.3g}")
