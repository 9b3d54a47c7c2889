"""Figures as PNG: 4, 6 and 7 of the first paper, of a simulated robot; and the push polar."""

import math
from collections.abc import Callable, Mapping
from functools import partial
from itertools import groupby, islice
from pathlib import Path
from typing import Any

import numpy as np

from gait_lab.analysis.plots import BLUE, GOLD, GREY, RED
from gait_lab.bench.options import Options
from gait_lab.bench.published import PLACO_PUSH
from gait_lab.bench.pushes import DIRECTIONS
from nao_lipm_gait.walks.lipm.parameters import LipmParameters
from nao_lipm_gait.walks.steps import home_sole
from robot_core.errors import NaoGaitError
from robot_core.geometry import compose, planar_rotation
from robot_core.types import LEFT, RIGHT, Pose2
from sim_bridge.trials.metrics import measure
from sim_bridge.trials.rollout import RolloutSpec, make_pair, rollout, task_ticks
from sim_bridge.trials.tasks import find_task
from sim_bridge.trials.trial import Push, TimedCommands, loaded_robot, run

SHOWN = 4.0
"""[s] of the CoM that figures 6 and 7 show."""
BEFORE_PUSH, IMPULSE = 1.5, 1.0
"""[s] of these before the push of figure 7, to the left; [N s]."""
SIDES = {"left": LEFT, "right": RIGHT}


def draw(path: Path, size: tuple[float, float], content: Callable[[Any], object],
         **axes: Any) -> Path:  # fmt: skip
    """A figure of one panel; `size` in inches; the path of the PNG."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    content(figure.add_subplot(**axes))
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110, metadata={"Software": None})
    return path


def paper_figures(options: Options, folder: Path) -> list[Path]:
    """Write `paper_figure_4.png`, `_6` and `_7` of the first robot of the options."""
    push = Push(find_task("spot").start + BEFORE_PUSH, IMPULSE, math.radians(90.0))
    figures: dict[int, tuple[float, Callable[[Any], None]]] = {
        4: (4.0, partial(_draw_origins, options)),
        6: (3.0, partial(_draw_com_y, options, None)),
        7: (3.0, partial(_draw_com_y, options, push)),
    }
    return [
        draw(folder / f"paper_figure_{number}.png", (7.0, height), content)
        for number, (height, content) in figures.items()
    ]


def _draw_origins(options: Options, panel: Any) -> None:
    """Figure 4: soles, pendulum origins and step sizes of successive steps, seen from above."""
    p = options.parameters
    if not isinstance(p, LipmParameters):
        raise NaoGaitError("walk", p.walk, "lipm")
    outline = np.array(loaded_robot(options.urdf).sole_outline)
    task = find_task("forward=20").lasting(2.0)
    world, gait = make_pair(_spec(options, "forward=20", 2.0))
    with world:
        ticks = islice(run(world, gait, TimedCommands(task.command_at)), task_ticks(task))
        walked = [tick.status for tick in ticks
                  if tick.status is not None and tick.status.support in SIDES]  # fmt: skip
    steps = [list(step) for _, step in groupby(walked, lambda status: status.step_count)]
    q: Pose2 = (0.0, 0.0, 0.0)
    for step in steps[-4:-1]:
        side = SIDES[step[0].support]
        sole = _placed(outline * (1.0, side), compose(q, home_sole(side, p)))
        panel.fill(*sole.T, facecolor="none", edgecolor=GREY)
        best = side * p.pendulum_offset_y
        allowed = ((-p.pendulum_shift_back_max, best), (p.pendulum_shift_max, best))
        panel.plot(*_placed(allowed, q).T, ":k", linewidth=1.0)
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


def _placed(points: Any, pose: Pose2) -> Any:
    """(n, 2) points of a frame with this pose."""
    return np.asarray(points) @ planar_rotation(pose[2]).T + pose[:2]


def _draw_com_y(options: Options, push: Push | None, panel: Any) -> None:
    """Measured and expected CoM: figure 6 on the spot, figure 7 pushed from the right."""
    spec = _spec(options, "spot", SHOWN, keep_trace=True, push=push)
    trace = rollout(spec).trace
    assert trace is not None  # keep_trace
    start = float(trace.time[-1]) - SHOWN if push is None else spec.task.start
    shown = trace.between(start, start + SHOWN)
    time = (shown.status_stamp - trace.stamp[0]) * 1e-9 - start
    for values, name, color in (
        (shown.com_measured_in_q, "measured", RED), (shown.com_expected_in_q, "expected", "black"),
    ):  # fmt: skip
        panel.plot(time, 1000.0 * values[:, 1], color=color, linewidth=1.2, label=name)
    panel.set(xlabel="time [s]", ylabel="y in Q [mm]")
    panel.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize=8)
    error = 1000.0 * measure(trace, start, start + SHOWN).com_error_y_measured
    title = f"CoM y on the spot: mean |expected - measured| {error:.2f} mm"
    if push is not None:
        panel.axvline(BEFORE_PUSH, color=GREY, linestyle=":")
        title = f"CoM y, pushed to the left with {IMPULSE:g} N s at {BEFORE_PUSH:g} s"
    panel.set_title(title)


def _spec(options: Options, task: str, seconds: float, **more: Any) -> RolloutSpec:
    return RolloutSpec(
        find_task(task).lasting(seconds), robot_seed=options.seed, calibrated=options.calibrated,
        **options.trial, **more,
    )  # fmt: skip


def push_figure(values: Mapping[str, float | None], path: Path) -> Path | None:
    """The largest survived impulse around a robot that steps on the spot, as PNG.

    None without the rows of a search among the values of the suite `push`.
    """
    angles = {name: math.radians(degrees) for name, degrees in DIRECTIONS.items()}

    def outline(panel: Any) -> None:
        for name, color, label in (("spot", BLUE, "closed"), ("spot_open_loop", GREY, "open")):
            known = [way for way in DIRECTIONS if f"push_{name}_{way}_max" in values]
            # A direction in which not even the smallest impulse is survived lies in the middle.
            sizes = [values[f"push_{name}_{way}_max"] or 0.0 for way in known]
            panel.plot([angles[way] for way in [*known, *known[:1]]], [*sizes, *sizes[:1]],
                       "o-", color=color, markersize=3.5, label=f"{label} loop")  # fmt: skip
        panel.plot([angles[way] for way in PLACO_PUSH], list(PLACO_PUSH.values()), "D",
                   color=GOLD, markersize=5, label="placo, one robot")  # fmt: skip
        panel.set_theta_zero_location("N")
        panel.set_xticks(list(angles.values()), [name.replace("_", "\n") for name in angles])
        panel.tick_params(labelsize=7)
        panel.set_title("spot [N s]", fontsize=9)
        panel.legend(loc="upper left", bbox_to_anchor=(1.1, 1.0), fontsize=8)

    if "push_spot_left_max" not in values:
        return None
    return draw(path, (5.6, 3.6), outline, projection="polar")
