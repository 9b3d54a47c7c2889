"""Figures 4, 6 and 7 of the first paper, of a walk on a simulated robot."""

import math
from collections.abc import Iterator
from itertools import groupby, islice
from pathlib import Path
from typing import Any

import numpy as np

from gait_lab.analysis.plots import BLACK, BLUE, GREY, RED, pyplot, save
from gait_lab.bench.options import BenchOptions
from nao_lipm_gait.walks.lipm.parameters import LipmParameters
from nao_lipm_gait.walks.steps import home_sole
from robot_core.errors import NaoGaitError
from robot_core.geometry import compose
from robot_core.types import LEFT, RIGHT, GaitStatus, Pose2
from sim_bridge.trials.metrics import measure
from sim_bridge.trials.rollout import RolloutSpec, make_pair, rollout, task_ticks
from sim_bridge.trials.tasks import find_task
from sim_bridge.trials.trace import Trace
from sim_bridge.trials.trial import Push, TimedCommands, loaded_robot, run

SHOWN = 4.0
"""[s] of the CoM that figures 6 and 7 show."""
BEFORE_PUSH = 1.5
"""[s] of these before the push of figure 7."""
IMPULSE = 1.0
"""[N s] of this push, to the left."""
SIDES = {"left": LEFT, "right": RIGHT}


def paper_figures(options: BenchOptions, folder: Path) -> list[Path]:
    """Write `paper_figure_4.png`, `_6` and `_7`.

    Args:
        options: The gait, and the robots, of which the first one walks.
        folder: Where to write; it is made.

    Returns:
        The files.
    """
    folder.mkdir(parents=True, exist_ok=True)
    files = []
    for number, (draw, width, height) in FIGURES.items():
        figure, panel = pyplot().subplots(figsize=(width, height), layout="constrained")
        draw(panel, options)
        files.append(save(figure, folder / f"paper_figure_{number}.png"))
    return files


def draw_origins(panel: Any, options: BenchOptions) -> None:
    """Figure 4: soles, pendulum origins and step sizes of successive steps, seen from above."""
    p = options.parameters
    if not isinstance(p, LipmParameters):
        raise NaoGaitError("walk", p.walk, "lipm")
    outline = np.array(loaded_robot(options.urdf).sole_outline)
    steps = [list(step) for _, step in groupby(_walk_forward(options), lambda s: s.step_count)]
    q: Pose2 = (0.0, 0.0, 0.0)
    for step in steps[-4:-1]:
        side = SIDES[step[0].support]
        sole = _placed(outline * (1.0, side), compose(q, home_sole(side, p)))
        panel.fill(*sole.T, facecolor="none", edgecolor=GREY)
        best = side * p.pendulum_offset_y
        allowed = ((-p.pendulum_shift_back_max, best), (p.pendulum_shift_max, best))
        panel.plot(*_placed(allowed, q).T, ":", color=BLACK, linewidth=1.0)
        panel.plot(*_placed([(0.0, best)], q).T, "o", color=GREY, fillstyle="none")
        # The plan is ahead of the measurement by the delay; at last it is of the next step.
        planned = [status for status in step if side * status.pendulum_origin_in_q[1] > 0.0]
        origins = _placed([status.pendulum_origin_in_q for status in planned], q)
        panel.plot(*origins.T, ".", color=RED, markersize=3)
        ahead = compose(q, planned[-1].step_size)
        panel.annotate("", ahead[:2], q[:2], arrowprops={"arrowstyle": "->", "color": BLUE})
        q = ahead
    panel.set(xlabel="x [m]", ylabel="y [m]", aspect="equal")
    panel.set_title(
        "Pendulum origins: planned (red), optimal (o), allowed (dotted)\nand step sizes (arrows)",
        fontsize=9,
    )


def _walk_forward(options: BenchOptions) -> Iterator[GaitStatus]:
    """The status of each tick of single support at 20 cm/s."""
    task = find_task("forward=20").lasting(2.0)
    spec = RolloutSpec(
        task, robot_seed=options.seed, calibrated=options.calibrated, **options.trial
    )
    world, gait = make_pair(spec)
    with world:
        ticks = islice(run(world, gait, TimedCommands(task.command_at)), task_ticks(task))
        for tick in ticks:
            if tick.status is not None and tick.status.support in SIDES:
                yield tick.status


def _placed(points: Any, pose: Pose2) -> Any:
    """(n, 2) points of a frame with this pose."""
    x, y, yaw = pose
    c, s = math.cos(yaw), math.sin(yaw)
    return np.asarray(points) @ np.array(((c, s), (-s, c))) + (x, y)


def draw_spot(panel: Any, options: BenchOptions) -> None:
    """Figure 6: measured and expected CoM while stepping on the spot."""
    trace = _on_the_spot(options)
    end = float(trace.time[-1])
    _draw_com_y(panel, trace, end - SHOWN, end)
    error = 1000.0 * measure(trace, end - SHOWN, end).com_error_y_measured
    panel.set_title(f"CoM y on the spot: mean |expected - measured| {error:.2f} mm")


def draw_push(panel: Any, options: BenchOptions) -> None:
    """Figure 7: the same while the robot is pushed from the right."""
    task = find_task("spot")
    push = Push(task.start + BEFORE_PUSH, IMPULSE, math.radians(90.0))
    trace = _on_the_spot(options, push)
    _draw_com_y(panel, trace, task.start, task.start + SHOWN)
    panel.axvline(BEFORE_PUSH, color=GREY, linestyle=":")
    panel.set_title(f"CoM y, pushed to the left with {IMPULSE:g} N s at {BEFORE_PUSH:g} s")


def _on_the_spot(options: BenchOptions, push: Push | None = None) -> Trace:
    task = find_task("spot").lasting(SHOWN)
    spec = RolloutSpec(
        task, robot_seed=options.seed, keep_trace=True, push=push, calibrated=options.calibrated,
        **options.trial,
    )  # fmt: skip
    trace = rollout(spec).trace
    assert trace is not None  # keep_trace
    return trace


def _draw_com_y(panel: Any, trace: Trace, start: float, end: float) -> None:
    shown = trace.between(start, end)
    time = (shown.status_stamp - trace.stamp[0]) * 1e-9 - start
    for values, name, color in (
        (shown.com_measured_in_q, "measured", RED), (shown.com_expected_in_q, "expected", BLACK),
    ):  # fmt: skip
        panel.plot(time, 1000.0 * values[:, 1], color=color, linewidth=1.2, label=name)
    panel.set(xlabel="time [s]", ylabel="y in Q [mm]")
    panel.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize=8)


FIGURES = {4: (draw_origins, 6.0, 4.0), 6: (draw_spot, 7.0, 3.0), 7: (draw_push, 7.0, 3.0)}
"""Number in the paper -> what draws it, width and height [in]."""
