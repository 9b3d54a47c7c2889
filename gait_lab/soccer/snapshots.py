"""The moments of a match that a replay shows."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

from nao_soccer.behavior.option_tree import Activation
from nao_soccer.referee.rules import Goal
from robot_core.types import DOWN, GETTING_UP, Point2, Pose2

STROKE_SPEED = 0.3
"""[m/s] by which the ball is faster after a stroke of a dribbling robot."""
STROKE_REACH = 0.3
"""[m] from the middle of a robot to a ball that its foot hits."""
STROKE_TIME = 0.5
"""[s] in which a robot hits the ball once: the time of a step."""
DRIBBLES = ": dribble", ": push"
"""Ends of what a dribbling robot does."""
PLAYS = "play the ball: "
"""Beginning of what a robot does that plays the ball."""
TOUCHED_WITHIN = 0.5
"""[m] from the middle of a robot to a ball that it has touched since the last frame."""
LYING = {state.value for state in (*DOWN, GETTING_UP)}


class PlanSnapshot(NamedTuple):
    """What a robot means to do with the ball.

    Attributes:
        direction: Where the ball has to go [rad] in the world.
        seconds: Expected time [s] until the ball is in the goal.
    """

    name: str
    direction: float
    seconds: float


class RobotSnapshot(NamedTuple):
    """One robot in a moment of the replay.

    Attributes:
        x: [m] in the world.
        y: [m].
        heading: [rad].
        doing: The last option of its activation path, and the state of that.
        turned: It takes one half of the field for the other.
        change: The newest transition on that path: option, state before and after, and why.
        believed: Where it takes itself to be, in the world.
        ball: Where it takes the ball to be [m], in the world.
        others: Where it takes other robots to be [m], in the world.
        penalty: Why it may not play; empty if it may.
    """

    x: float
    y: float
    heading: float
    state: str
    role: str
    doing: str
    turned: bool = False
    path: tuple[str, ...] = ()
    change: str = ""
    plan: PlanSnapshot | None = None
    runner_up: PlanSnapshot | None = None
    believed: Pose2 | None = None
    ball: Point2 | None = None
    others: tuple[Point2, ...] = ()
    penalty: str = ""
    kicks: int = 0

    @property
    def down(self) -> bool:
        """It lies or gets up."""
        return self.state in LYING


@dataclass(frozen=True, slots=True)
class Snapshot:
    """One moment of the replay.

    Attributes:
        time: [s].
        ball: x, y [m] in the world.
        set_play: The set play that is not over; empty if none is.
        kicking: The team that has the kick-off or the set play.
    """

    time: float
    ball: Point2
    robots: dict[str, RobotSnapshot]
    phase: str
    score: tuple[int, int]
    set_play: str = ""
    kicking: str = ""


def path_of(path: Sequence[Activation]) -> dict[str, Any]:
    """The fields of a `RobotSnapshot` that an activation path gives."""
    if not path:
        return {}
    newest = min((each for each in path if each.left), key=lambda each: each.seconds, default=None)
    change = "" if newest is None else (
        f"{newest.option}: {newest.left} \u2192 {newest.state}: {newest.why}"
    )
    texts = tuple(f"{each.option}: {each.state}" for each in path)
    return {"doing": texts[-1], "path": texts, "change": change}


def is_turned(heading: float, estimated: float) -> bool:
    """Whether an estimated heading [rad] is nearer to the opposite of the true one."""
    return math.cos(estimated - heading) < 0.0


def wrong_half(goals: Sequence[Goal], frames: Sequence[Snapshot]) -> int:
    """Number of goals into the own goal by robots that took it for the opponents'.

    What counts is what the robot believed and did when it was at the ball last. A ball that only
    bounces off a defender is an own goal too, but none of these: one that does not play the ball,
    because it gets up or looks for its place, takes no goal for another one.
    """
    count = 0
    for goal in goals:
        moments = (
            (each.robots[goal.player], each.ball)
            for each in reversed(frames)
            if goal.own and each.time <= goal.time and goal.player in each.robots
        )
        at_ball = (
            robot for robot, ball in moments if math.dist((robot.x, robot.y), ball) < TOUCHED_WITHIN
        )
        robot = next(at_ball, None)
        if robot is not None and robot.turned:
            count += any(each.startswith(PLAYS) for each in robot.path)
    return count


def dribble_strokes(frames: Sequence[Snapshot]) -> int:
    """Number of times that the foot of a dribbling robot makes the ball faster.

    Frames must be so dense that a foot hits the ball once between two of them.
    """
    count, speed, last = 0, 0.0, -math.inf
    for before, now in pairwise(frames):
        dt = now.time - before.time
        slower, speed = speed, math.dist(now.ball, before.ball) / dt if dt > 0.0 else speed
        if speed - slower < STROKE_SPEED or now.time - last < STROKE_TIME:
            continue
        gap, doing = min(
            (math.dist(before.ball, (robot.x, robot.y)), robot.doing)
            for robot in before.robots.values()
        )
        if gap < STROKE_REACH and doing.endswith(DRIBBLES):
            count, last = count + 1, now.time
    return count
