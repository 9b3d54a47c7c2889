"""The first paper's criterion: how far the CoM is from where the model expects it.

Measured against the robot's own sensors (what the paper had) and against the truth. On its own the
first one is gamed: an observer that believes its sensors makes it small and the walk slow, or even
backward. So the speed is measured in the same walk, and how far it is from the asked one.
"""

import math
from collections.abc import Mapping

from gait_lab.analysis.metrics import Metrics
from gait_lab.trials.rollout import RolloutSpec, rollout
from gait_lab.trials.tasks import Task
from gait_lab.trials.tasks import walk as walk_task
from gait_lab.tune.measures import Measures, excess_of
from gait_lab.tune.walker import Setting

MEASURES = {"error_measured": "m", "error_true": "m", "speed": "m/s", "speed_error": "m/s"}
LOST = 0.05
"""Error [m] of a robot that fell."""


def run(setting: Setting, options: Mapping[str, float]) -> Measures:
    """Mean |error| along y of a straight walk at `speed`."""
    asked = options["speed"]
    task = walk_task("forward", x=asked, axis="x", window=options["window"])
    metrics = rollout(spec_for(setting, task)).metrics
    values = {
        "error_measured": upright(metrics, metrics.com_error_y_measured, LOST),
        "error_true": upright(metrics, metrics.com_error_y, LOST),
        "speed": upright(metrics, metrics.speed_x, 0.0),
        "speed_error": upright(metrics, abs(metrics.speed_x - asked), abs(asked)),
    }
    return Measures(setting.robot_seed, values, metrics.fell, excess_of(metrics))


def spec_for(setting: Setting, task: Task) -> RolloutSpec:
    return RolloutSpec(
        task,
        robot_seed=setting.robot_seed,
        parameters=setting.parameters,
        plant=setting.plant,
        urdf=setting.urdf,
        engine=setting.engine,
    )


def upright(metrics: Metrics, value: float, otherwise: float) -> float:
    """The value of a walk without a fall."""
    return value if math.isfinite(value) and not metrics.fell else otherwise
