"""A walking robot kicks a ball with one foot and walks on: one attempt.

It is led by the truth, so the result shows what the foot does to the ball, not where behaviour
brings the robot.
"""

import math
from dataclasses import dataclass

import numpy as np

from robot_core.geometry import compose, relative
from robot_core.types import Point2, VelocityCommand
from sim_bridge.ball import Ball
from sim_bridge.trials.kick import BallWay
from sim_bridge.trials.trial import CONTROL_PERIOD, Trial, TrialSpec

RUN_UP = (0.3, 0.5)
"""[m] from the robot to the ball at the start; drawn, as the phase of the step at the touch."""
PLACEMENT = 0.01
"""[m] standard deviation of the ball's place beside the robot's line."""
BIAS_WAIT = 1.0
"""[s] of standing at the start."""
MOVED = 0.01
"""[m] A ball that has moved this far was touched."""
STEER = 1.5
"""[1/s] Speed to the side over the ball's distance from its place before the foot."""
SIDE = 0.1
"""[m/s] Greatest speed to the side."""
TURN = 2.0
"""[1/s] Turning speed over the error of the heading."""
LIMIT = 15.0
"""[s] after which a ball that was not touched is not waited for."""
ROLL = 6.0
"""[s] for which the ball may roll."""


@dataclass(frozen=True, slots=True)
class DribbleSpec(TrialSpec):
    """Everything that an attempt depends on.

    Attributes:
        across: y [m] of the ball before the foot, in base_footprint; left is positive.
        direction: [rad] in which the foot shall kick it, counter-clockwise from straight ahead.
        speed: [m/s] commanded forwards.
        lift: Share of their usual height by which the feet are lifted.
    """

    across: float
    speed: float
    direction: float = 0.0
    lift: float = 1.0


@dataclass(frozen=True, slots=True)
class DribbleResult:
    """Result of an attempt.

    Attributes:
        spec: The specification.
        spot: x, y [m] of the ball in base_footprint when it was touched.
        direction: [rad] of its way, counter-clockwise from the robot's heading at the touch.
        distance: [m] from where it lay to where it came to rest.
        speed: [m/s] largest of the ball.
        stood: The robot never fell, and touched the ball.
    """

    spec: DribbleSpec
    spot: Point2
    direction: float
    distance: float
    speed: float
    stood: bool


def dribble(spec: DribbleSpec) -> DribbleResult:
    """Run one attempt."""
    with Trial(spec, ball=Ball(10.0, 0.0)) as trial:
        start = trial.advance(BIAS_WAIT - CONTROL_PERIOD).truth.base_footprint
        random = np.random.default_rng([spec.robot_seed + 1, spec.noise_seed])
        line = compose(start, (0.0, spec.across, 0.0))
        ahead, beside = float(random.uniform(*RUN_UP)), float(random.normal(0.0, PLACEMENT))
        lay = compose(line, (ahead, beside, 0.0))
        ball = BallWay(trial, np.array(lay[:2]))
        place = start
        trial.gait.request_lift(spec.lift)
        for _ in range(round(LIMIT / CONTROL_PERIOD)):
            place = trial.tick.truth.base_footprint
            _, y, yaw = relative(place, start)
            aside = min(max(-STEER * y, -SIDE), SIDE)
            turn = -TURN * math.remainder(yaw, math.tau)
            trial.action = VelocityCommand(spec.speed, aside, turn)
            x, y, turned = relative((*lay[:2], start[2] + spec.direction), place)
            trial.gait.request_kick((x, y), turned)
            trial.step()
            ball.look()
            if ball.distance > MOVED or not trial.stood:
                break
        touched = ball.distance > MOVED
        ball.fastest = 0.0
        trial.action = VelocityCommand()
        for _ in trial.steps(ROLL):
            ball.look()
        x, y, _ = relative(lay, place)
        return DribbleResult(
            spec, (x, y), ball.direction(place[2]), ball.distance, ball.fastest,
            touched and trial.stood,
        )  # fmt: skip
