"""The figures of docs/tune.md: one parameter varied at a time, `nao_gait write guide`."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gait_lab.analysis.plots import BLUE, GOLD, GREY, INK, RED, pyplot, save
from nao_lipm_gait.parameters import BY_NAME, GaitParameters
from robot_core.errors import NaoGaitError
from sim_bridge.trials.metrics import Metrics
from sim_bridge.trials.parallel import parallel_map
from sim_bridge.trials.rollout import RolloutSpec, rollout
from sim_bridge.trials.tasks import walk as walk_task
from sim_bridge.trials.trace import LEFT, RIGHT, Trace

SWEEPS = {
    "pendulum_width": (0.020, 0.026, 0.032, 0.038, 0.044),
    "pendulum_offset_y": (0.040, 0.045, 0.050, 0.055, 0.060),
    "pendulum_height": (0.20, 0.22, 0.24, 0.26, 0.28),
    "com_height": (0.22, 0.23, 0.24, 0.25, 0.26),
    "foot_reference_x": (-0.01, 0.005, 0.02, 0.035, 0.05),
    "torso_pitch": (-0.10, -0.04, 0.02, 0.08, 0.14),
    "swing_lift": (0.006, 0.012, 0.02, 0.03, 0.04),
    "swing_travel_end": (0.5, 0.65, 0.8, 0.9, 1.0),
    "step_forward_max": (0.03, 0.05, 0.07, 0.09, 0.11),
    "feedback_delay": (0.0, 0.03, 0.06, 0.09, 0.12),
    "velocity_sigma": (0.0005, 0.002, 0.004, 0.01, 0.03),
    "gyro_pitch_gain": (-0.03, 0.0, 0.03, 0.06, 0.1),
}
"""Values of each parameter, SI units."""
ROBOTS, COLOURS = (0, 2), (BLUE, INK)
SPEED, WINDOW = 0.30, 6.0
"""Commanded speed forward [m/s]; duration of the measurement [s]."""


@dataclass(frozen=True, slots=True)
class Sample:
    """One robot at one value of a parameter; `step_duration` [s] is NaN after a fall."""

    value: float
    robot: int
    metrics: Metrics
    step_duration: float


PANELS: dict[str, Callable[[Sample], float]] = {
    "speed [cm/s]": lambda s: 100.0 * s.metrics.speed_x,
    "CoM error along y [mm]": lambda s: 1000.0 * s.metrics.com_error_y,
    "step duration [s]": lambda s: s.step_duration,
}


def sample(call: tuple[str, float, int, float]) -> Sample:
    """Walk forward; the call is parameter, value, robot and commanded speed [m/s]."""
    name, value, robot, speed = call
    task = walk_task("forward", x=speed, axis="x", window=WINDOW)
    parameters = GaitParameters().replace(**{name: value})
    result = rollout(
        RolloutSpec(task, robot_seed=robot, parameters=parameters, engine="mujoco", keep_trace=True)
    )
    if result.trace is None or result.metrics.fell:
        return Sample(value, robot, result.metrics, float("nan"))
    duration = step_duration(result.trace.between(task.start, task.end))
    return Sample(value, robot, result.metrics, duration)


def step_duration(trace: Trace) -> float:
    """Return the mean time [s] between support changes; NaN with fewer than two changes."""
    single = np.isin(trace.support, (LEFT, RIGHT))
    support, time = trace.support[single], trace.time[single]
    changes = time[1:][np.diff(support) != 0]
    return float(np.diff(changes).mean()) if len(changes) > 1 else float("nan")


def draw(name: str, samples: Sequence[Sample], path: Path) -> None:
    """Draw speed, CoM error and step duration over the values, one line per robot."""
    figure, panels = pyplot().subplots(1, 3, figsize=(10, 2.7), layout="constrained")
    unit = BY_NAME[name].unit
    for axes, (label, value) in zip(panels, PANELS.items(), strict=True):
        for robot, colour in zip(ROBOTS, COLOURS, strict=True):
            kept = [s for s in samples if s.robot == robot and not s.metrics.fell]
            axes.plot([s.value for s in kept], [value(s) for s in kept], "o-", ms=4, color=colour,
                      label=f"robot {robot}")  # fmt: skip
        preset = getattr(GaitParameters(), name)
        axes.axvline(preset, color=GREY, lw=1, ls=":", label="preset")
        _mark(axes, [s.value for s in samples if s.metrics.fell], "x", RED, 0.05)
        improper = [s.value for s in samples if not s.metrics.fell and not s.metrics.walks]
        _mark(axes, improper, "^", GOLD, 0.12)
        axes.set_title(label, loc="left", fontsize=10)
        axes.set_xlabel(f"{name} [{unit}]" if unit else name)
        axes.set_ylim(0.0, 1.12 * axes.get_ylim()[1])
    panels[0].axhline(100.0 * SPEED, color=GREY, lw=1, ls="--")
    panels[2].legend(fontsize=7, loc="lower right")
    save(figure, path)


def _mark(axes: Any, x: list[float], symbol: str, colour: str, height: float) -> None:
    """Mark values at a height, as a share of the panel."""
    transform = axes.get_xaxis_transform()
    axes.plot(x, [height] * len(x), symbol, color=colour, transform=transform)


def write(parameters: Sequence[str], out: Path, say: Callable[[str], None]) -> None:
    """Run the sweeps of parameters, or all of them, and draw their figures."""
    for name in parameters:
        if name not in SWEEPS:
            raise NaoGaitError("parameter", name, ", ".join(SWEEPS))
    for name in parameters or SWEEPS:
        calls = [(name, value, robot, SPEED) for value in SWEEPS[name] for robot in ROBOTS]
        path = out / f"tune_{name}.png"
        draw(name, parallel_map(sample, calls, label=name), path)
        say(f"written: {path}")
