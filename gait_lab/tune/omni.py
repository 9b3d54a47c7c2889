"""Everything at once: four speeds, CoM error and pushes, so that no single criterion is gamed."""

import math
from collections.abc import Mapping

from gait_lab.trials.rollout import rollout
from gait_lab.trials.tasks import SPOT_TURN
from gait_lab.trials.tasks import walk as walk_task
from gait_lab.tune.com_error import LOST, spec_for, upright
from gait_lab.tune.measures import Measures, excess_of
from gait_lab.tune.walker import Push, Setting, walk
from nao_lipm_gait.types import GaitStatus, VelocityCommand

MEASURES = {
    "forward": "m/s",
    "back": "m/s",
    "side": "m/s",
    "turn": "rad/s",
    "reached": "",
    "error_true": "m",
    "upright": "",
    "pushes": "",
}
"""Speeds are in the asked direction; `reached` is 1 where they are what was asked and less the
farther they are from it, above or below, in the mean of the four; `upright` is the share of the
walks without a fall, `pushes` the share of the pushes survived."""
PUSH_DURATION = 0.1
PUSH_FIRST = 3.0
PUSH_EVERY = 2.63
"""[s]; no multiple of a step, so that each push meets another phase."""
DIRECTIONS = ((0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0))
"""x, y in the world; the robot faces along x."""


def run(setting: Setting, options: Mapping[str, float]) -> Measures:
    """Four walks and one series of pushes while stepping on the spot."""
    window = options["window"]
    turn = math.radians(options["turn"])
    tasks = (
        walk_task("forward", x=options["forward"], axis="x", window=window),
        walk_task("back", x=-options["back"], axis="x", window=window),
        walk_task("side", y=options["side"], axis="y", window=window),
        walk_task("turn", yaw=turn, axis="yaw", window=window),
    )
    metrics = [rollout(spec_for(setting, task)).metrics for task in tasks]
    forward, back, side, turning = metrics
    errors = [upright(m, m.com_error_y, LOST) for m in metrics]
    speeds = {
        "forward": upright(forward, forward.speed_x, 0.0),
        "back": upright(back, -back.speed_x, 0.0),
        "side": upright(side, side.speed_y, 0.0),
        "turn": upright(turning, turning.turn_rate, 0.0),
    }
    asked = {**options, "turn": turn}
    off = [abs(speed - asked[name]) / asked[name] for name, speed in speeds.items()]
    values = {
        **speeds,
        "reached": 1.0 - sum(off) / len(off),
        "error_true": sum(errors) / len(errors),
        "upright": 1.0 - sum(m.fell for m in metrics) / len(metrics),
        "pushes": _pushes_survived(setting, options["impulse"]),
    }
    excess = sum(excess_of(m) for m in metrics) / len(metrics)
    return Measures(setting.robot_seed, values, any(m.fell for m in metrics), excess)


def _step_in_place(time: float, status: GaitStatus | None) -> VelocityCommand:
    return VelocityCommand(0.0, 0.0, SPOT_TURN if time > 1.0 else 0.0)


def _pushes_survived(setting: Setting, impulse: float) -> float:
    """Share of the pushes [N s], one per direction, after which the robot still stands."""
    force = impulse / PUSH_DURATION
    pushes = [
        Push(PUSH_FIRST + i * PUSH_EVERY, (force * x, force * y, 0.0), PUSH_DURATION)
        for i, (x, y) in enumerate(DIRECTIONS)
    ]
    end = PUSH_FIRST + len(pushes) * PUSH_EVERY
    trace, fell = walk(setting, _step_in_place, time_limit=end, pushes=pushes)
    if not fell:
        return 1.0
    last = float(trace.time[-1])
    begun = sum(push.time <= last for push in pushes)
    return max(0, begun - 1) / len(pushes)
