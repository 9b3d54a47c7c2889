"""What a recorded player estimated about its pose and the ball, against the truth of the bag."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gait_lab.analysis.body import BodyTrack
from gait_lab.analysis.recorded_percepts import footprints_at, nearest_rows
from gait_lab.analysis.recorded_walk import RecordedWalk
from robot_core.field import SIDES, TEAMS
from robot_core.geometry import wrapped
from robot_core.types import FloatArray
from sim_bridge.scene import parse_scene
from sim_bridge.trials.trace import IntArray


@dataclass(frozen=True, slots=True)
class RecordedWorld:
    """Errors of a world model over time.

    Attributes:
        stamp: (t,) [ns]
        place_error: (t,) [m]; NaN without truth.
        heading_error: (t,) [rad], not negative.
        place_deviation: (t,) [m] as stated.
        heading_deviation: (t,) [rad] as stated.
        valid: (t,) The pose estimate is valid.
        ball_stamp: (m,) [ns]
        ball_error: (m,) [m] of the ball's place on the field; empty without its truth.
    """

    stamp: IntArray
    place_error: FloatArray
    heading_error: FloatArray
    place_deviation: FloatArray
    heading_deviation: FloatArray
    valid: NDArray[np.bool_]
    ball_stamp: IntArray
    ball_error: FloatArray


def find_world(walk: RecordedWalk, body: BodyTrack | None) -> RecordedWorld | None:
    """The errors; None if no player was recorded, or without the truth."""
    own = walk.own_pose
    truth = footprints_at(body, own.stamp)
    if not len(own) or not np.isfinite(truth).any():
        return None
    side = _side(walk)
    place = side * own.value[:, :2]
    turn = own.value[:, 2] + (0.0 if side > 0.0 else math.pi) - truth[:, 2]
    ball, ball_error = walk.own_ball, np.zeros(0)
    if len(ball) and len(walk.ball):
        true_ball = nearest_rows(walk.ball.stamp, walk.ball.value, ball.stamp)[:, :2]
        ball_error = np.hypot(*(side * ball.value - true_ball).T)
    return RecordedWorld(
        own.stamp,
        np.hypot(*(place - truth[:, :2]).T),
        np.abs(wrapped(turn)),
        own.value[:, 3],
        own.value[:, 4],
        _valid_at(walk),
        ball.stamp if len(ball_error) else ball.stamp[:0],
        ball_error,
    )


def _valid_at(walk: RecordedWalk) -> NDArray[np.bool_]:
    """(t,) the message of validity that came with or last before each pose."""
    if not len(walk.own_valid):
        return np.ones(len(walk.own_pose), dtype=bool)
    # The two are published together; a little later than the other is still the same.
    row = np.searchsorted(walk.own_valid.stamp, walk.own_pose.arrived + 5_000_000, side="right") - 1
    return np.asarray(walk.own_valid.value[np.maximum(row, 0), 0] > 0.5)


def _side(walk: RecordedWalk) -> float:
    """1 if the field of the player is that of the world, -1 if it is turned by half a turn."""
    scene = None if walk.scene is None else parse_scene(walk.scene)
    names = walk.parts.get("own_pose", "").split("/")
    if scene is not None:
        for robot in scene.robots:
            if robot.name in names:
                return -SIDES[TEAMS.index(robot.team)]
    return 1.0
