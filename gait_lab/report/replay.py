"""The data of the 3D replay on the page."""

from typing import Any

import numpy as np

from gait_lab.analysis.body import BodyTrack, follow_body, shapes_of, yaw_of_pose
from gait_lab.analysis.recorded_trace import SupportPhase
from gait_lab.report.analysis import Analysis
from gait_lab.report.plot import ArrayStore
from robot_core.geometry import compose
from robot_core.types import FloatArray
from sim_bridge.trials.trace import DOUBLE, LEFT

FRAMES_PER_SECOND = 25.0
MOST_FRAMES = 2500
FOLLOW = 1.0
"""[s] over which the camera's path is smoothed."""


def replay(analysis: Analysis, store: ArrayStore) -> dict[str, Any] | None:
    """Poses and shapes over time; None if the robot is unknown."""
    walk, robot, body = analysis.walk, analysis.robot, analysis.body
    if robot is None or body is None or len(body.stamp) < 2 or not walk.period:
        return None
    shapes = shapes_of(robot.urdf)
    if not shapes.links:
        return None
    wanted = 1e9 / FRAMES_PER_SECOND / walk.period
    every = max(1, round(wanted), -(-len(body.stamp) // MOST_FRAMES))
    track = follow_body(walk, robot, shapes.links, every)
    known = np.isfinite(track.links).all(axis=(1, 2, 3))
    if known.sum() < 2:
        return None
    return {
        "time": store.add(walk.seconds(track.stamp[known])),
        "links": len(shapes.links),
        "poses": store.add(track.links[known][:, :, :3, :].reshape(-1)),
        "vertex": store.add(shapes.vertex.reshape(-1)),
        "link": store.add(shapes.link),
        "triangle": [store.add(shapes.triangle[:, corner]) for corner in range(3)],
        "color": list(shapes.color),
        "com": store.add(track.com[known].reshape(-1)),
        "center": store.add(_center(track)[known].reshape(-1)),
        "prints": _prints(analysis),
        "outline": [[x, y] for x, y in robot.sole_outline],
        "truth": track.from_truth,
        "speeds": _speeds(analysis, store),
    }


def _center(track: BodyTrack) -> FloatArray:
    """(t, 2) [m] point that the camera looks at: the smoothed CoM."""
    step = float(np.median(np.diff(track.stamp))) * 1e-9
    half = max(1, round(0.5 * FOLLOW / step))
    kernel = np.ones(2 * half + 1) / (2 * half + 1)
    columns = []
    for axis in (0, 1):
        values = track.com[:, axis]
        known = np.flatnonzero(np.isfinite(values))
        filled = np.interp(np.arange(len(values)), known, values[known])
        columns.append(np.convolve(np.pad(filled, half, mode="edge"), kernel, mode="valid"))
    return np.column_stack(columns)


def _prints(analysis: Analysis) -> list[dict[str, Any]]:
    """The stance soles with their pendulum origins, in the world."""
    prints = []
    origins = {side: points for side, points in zip((1, 2), analysis.origins, strict=True)}
    for phase in analysis.phases:
        pose = _standing(analysis, phase)
        if pose is None:
            continue
        begin = float(analysis.walk.seconds(phase.stamp))
        end = float(analysis.walk.seconds(phase.end))
        points = origins[phase.support]
        inside = points[(points[:, 0] >= begin) & (points[:, 0] < end)]
        prints.append(
            {
                "t": round(begin, 3),
                "end": round(end, 3),
                "left": phase.support == LEFT,
                "pose": [round(value, 4) for value in pose],
                "origins": [
                    [round(value, 4) for value in (t, *compose(pose, (x, y, 0.0))[:2])]
                    for t, x, y in inside.tolist()
                ],
            }
        )
    return prints


def _standing(analysis: Analysis, phase: SupportPhase) -> tuple[float, float, float] | None:
    """x, y [m], yaw [rad] of the support sole in the middle of its phase."""
    body = analysis.body
    if body is None or phase.support == DOUBLE:
        return None
    middle = (phase.stamp + phase.end) // 2
    row = min(int(np.searchsorted(body.stamp, middle)), len(body.stamp) - 1)
    pose = body.sole[row, phase.support - 1]
    if not np.isfinite(pose).all():
        return None
    return float(pose[0, 3]), float(pose[1, 3]), float(yaw_of_pose(pose))


def _speeds(analysis: Analysis, store: ArrayStore) -> dict[str, Any] | None:
    """The commands over time, shown beside the robot."""
    command = analysis.walk.command
    if not len(command):
        return None
    return {
        "time": store.add(analysis.walk.seconds(command.stamp)),
        "value": store.add(command.value.reshape(-1)),
    }
