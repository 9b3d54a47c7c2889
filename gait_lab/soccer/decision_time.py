"""How long a decision takes: updates of the behaviour in drawn situations with other robots.

python -m gait_lab.soccer.decision_time
"""

import math
import statistics
import sys
import time

import numpy as np

from gait_lab.soccer.pitch import parts_of
from nao_soccer.behavior.kicks import load_kicks
from nao_soccer.behavior.mind import Mind
from nao_soccer.behavior.situation import Body
from nao_soccer.world.state import BallEstimate, Obstacle, PoseEstimate, WorldState
from robot_core.geometry import relative
from robot_core.types import GaitState, Point2, Pose2, PoseCovariance
from sim_bridge.scene import load_scene

SITUATIONS, UPDATES = 50, 40
"""Number of drawn situations, and of updates in each."""
ROBOTS = 3
"""Other robots, near the ball."""
PERIOD = 50_000_000
"""[ns] between two updates."""
EXACT = (1e-4, 0.0, 1e-4)
"""Covariance [m^2] of what is seen."""


def measured(seed: int) -> list[float]:
    """CPU times [s] of all updates, in rising order."""
    random = np.random.default_rng(seed)
    field, goals, _ = parts_of(load_scene("pitch_small"))
    half = np.array((field.length, field.width)) / 2.0
    times = []
    for _ in range(SITUATIONS):
        mind = Mind(load_kicks("nao_h21"), field, goals)
        x, y = random.uniform(-half, half).tolist()
        own = x, y, float(random.uniform(-math.pi, math.pi))
        ball = np.clip(random.normal((x, y), 0.6), -half, half)
        robots = random.normal(ball, 0.5, (ROBOTS, 2)).tolist()
        for step in range(UPDATES):
            world = _world(step * PERIOD, own, (float(ball[0]), float(ball[1])), robots)
            began = time.process_time()
            mind.update(world, Body(GaitState.WALK))
            times.append(time.process_time() - began)
    return sorted(times)


def _world(stamp: int, own: Pose2, ball: Point2, robots: list[Point2]) -> WorldState:
    def seen(place: Point2) -> Point2:
        x, y, _ = relative((place[0], place[1], 0.0), own)
        return x, y

    still = 0.0, 0.0
    return WorldState(
        stamp,
        PoseEstimate(own, PoseCovariance(), True),
        BallEstimate(seen(ball), still, EXACT, ball, still, EXACT, EXACT, 0.1, True),
        tuple(
            Obstacle(seen(place), (place[0], place[1]), EXACT, still, "blue", False, 0.1)
            for place in robots
        ),
    )


def main() -> int:
    """Print the times; the exit status."""
    times = [1e3 * each for each in measured(0)]
    sys.stdout.write(
        f"decision: {statistics.median(times):.2f} ms p50, "
        f"{times[int(0.95 * len(times))]:.2f} ms p95, {times[-1]:.2f} ms at most; "
        f"{len(times)} updates with {ROBOTS} other robots\n"
    )
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
