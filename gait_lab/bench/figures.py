"""Figures of the benchmarks, written as small PNG: from their rows, or of one crossing."""

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from gait_lab.analysis.plots import BLACK, BLUE, GREY, ORANGE, RED, pyplot, save
from gait_lab.bench.published import NAO_SPEED, PAPER_SPEED, PLACO_PUSH, PLACO_SPEED
from gait_lab.bench.pushes import DIRECTIONS
from sim_bridge.individual import draw_individual
from sim_bridge.terrain import prisms
from sim_bridge.trials.crossing import CrossingResult, CrossingSpec, cross, plant_of
from sim_bridge.trials.trial import Tick, loaded_robot

Values = Mapping[str, float | None]
"""Metric -> value of one suite."""
_TRIED = re.compile(r"push_(?P<task>.+)_tried")
_DELAYED = re.compile(r"delay_(?P<delay>\d+)_ms(?P<ignored>_ignored)?_(?P<what>.+)_error_median")
_DELAYED_UNITS = {"pose": "cm", "heading": "deg", "position": "cm", "velocity": "cm/s"}
SPEEDS = ("forward", "back", "side", "turn")


def speed_figure(values: Values, path: Path) -> Path | None:
    """Worst to median of closed and open loop beside published speeds; None without rows."""
    shown = [task for task in SPEEDS if f"{task}_worst" in values]
    if not shown:
        return None
    plt = pyplot()
    figure, panels = plt.subplots(
        1, len(shown), figsize=(2.1 * len(shown) + 1.8, 3.2), layout="constrained", squeeze=False
    )
    for panel, task in zip(panels[0], shown, strict=True):
        _loop_bar(panel, 0, values, task, BLUE, "closed loop")
        _loop_bar(panel, 1, values, f"{task}_open_loop", GREY, "open loop")
        panel.axhline(PAPER_SPEED[task], color=RED, linewidth=1.5, label="paper")
        low, high = PLACO_SPEED[task]
        panel.axhspan(low, high, color=ORANGE, alpha=0.35, linewidth=0, label="placo, open loop")
        if task in NAO_SPEED:
            panel.axhline(NAO_SPEED[task], color=BLACK, linewidth=1.0, linestyle=":",
                          label="fastest real NAO")  # fmt: skip
        panel.set(title=task, xticks=[], xlim=(-0.6, 1.6),
                  ylabel="deg/s" if task == "turn" else "cm/s")  # fmt: skip
        panel.set_ylim(bottom=0.0)
    handles, labels = panels[0][0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside right center", fontsize=8)
    return save(figure, path)


def _loop_bar(panel: Any, x: int, values: Values, name: str, color: str, label: str) -> None:
    worst, median = values.get(f"{name}_worst"), values.get(f"{name}_median")
    panel.bar(x, median or 0.0, width=0.7, color=color, label=label)
    if worst is None or median is None:
        if f"{name}_counts" in values:
            panel.text(x, 0.0, "does not\ncount", ha="center", va="bottom", fontsize=7)
        return
    # The line goes from the median down to the worst robot.
    panel.plot((x, x), (worst, median), color=BLACK, linewidth=1.2, marker="_", markersize=9)


def delay_figure(values: Values, path: Path) -> Path | None:
    """Median errors by the delay of the images; None without the rows of the ablation."""
    metrics = [(name, match) for name in values if (match := _DELAYED.fullmatch(name))]
    shown = list(dict.fromkeys(match["what"] for _, match in metrics))
    if not shown:
        return None
    plt = pyplot()
    figure, panels = plt.subplots(
        1, len(shown), figsize=(2.6 * len(shown) + 0.6, 2.8), layout="constrained", squeeze=False
    )
    for panel, what in zip(panels[0], shown, strict=True):
        for name, match in metrics:
            if match["what"] == what:
                label = match["delay"] + (" ms,\nignored" if match["ignored"] else " ms")
                color = GREY if match["ignored"] else BLUE
                panel.bar(label, values[name] or 0.0, color=color)
        panel.set(title=what, ylabel=_DELAYED_UNITS[what])
        panel.tick_params(axis="x", labelsize=8)
    return save(figure, path)


def push_figure(values: Values, path: Path) -> Path | None:
    """The largest survived impulse around the robot, per task; None without a search's rows."""
    tasks = _searched(values)
    if not tasks:
        return None
    plt = pyplot()
    figure, panels = plt.subplots(
        1, len(tasks), figsize=(3.1 * len(tasks) + 1.4, 3.6), layout="constrained",
        squeeze=False, subplot_kw={"projection": "polar"},
    )  # fmt: skip
    for panel, task in zip(panels[0], tasks, strict=True):
        for name, color, label in (
            (task, BLUE, "closed loop"), (f"{task}_open_loop", GREY, "open loop"),
        ):  # fmt: skip
            _outline(panel, values, name, color, label)
        if task == "spot":
            angles = [math.radians(DIRECTIONS[direction]) for direction in PLACO_PUSH]
            panel.plot(angles, list(PLACO_PUSH.values()), "D", color=ORANGE, markersize=5,
                       label="placo, one robot")  # fmt: skip
        panel.set_theta_zero_location("N")
        panel.set_ylim(bottom=0.0)
        panel.set_xticks([math.radians(angle) for angle in DIRECTIONS.values()])
        panel.set_xticklabels([name.replace("_", "\n") for name in DIRECTIONS], fontsize=7)
        panel.tick_params(axis="y", labelsize=7)
        panel.set_title(f"{task.replace('_', ' ')} [N s]", fontsize=9)
    handles, labels = panels[0][0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, fontsize=8)
    return save(figure, path)


def _searched(values: Values) -> list[str]:
    """Tasks with pushes of more than one impulse; on the spot first."""
    tasks = [
        match["task"] for metric, tried in values.items()
        if (match := _TRIED.fullmatch(metric)) and tried is not None and tried > 1
    ]  # fmt: skip
    names = {task.removesuffix("_open_loop") for task in tasks}
    return sorted(names, key=lambda task: (task != "spot", task))


def _outline(panel: Any, values: Values, name: str, color: str, label: str) -> None:
    known = [way for way in DIRECTIONS if f"push_{name}_{way}_max" in values]
    if not known:
        return
    # A direction in which not even the smallest impulse is survived lies in the middle.
    sizes = [values[f"push_{name}_{way}_max"] or 0.0 for way in known]
    angles = [math.radians(DIRECTIONS[way]) for way in known]
    closed: Sequence[int] = (*range(len(known)), 0) if len(known) > 2 else range(len(known))
    panel.plot([angles[i] for i in closed], [sizes[i] for i in closed], color=color, marker="o",
               markersize=3.5, linewidth=1.8, label=label)  # fmt: skip


def crossing_figure(spec: CrossingSpec, path: Path, frames: int = 4) -> CrossingResult:
    """Let a robot cross a field and write pictures of it at even times, side by side.

    Args:
        spec: The crossing.
        path: Path of the PNG.
        frames: Number of pictures.

    Returns:
        The result of the crossing.
    """
    from gait_lab.analysis.render import Camera, Renderer

    camera = Camera(distance=1.25, yaw=35.0, pitch=-28.0, height=0.16)
    ticks: list[Tick] = []
    result = cross(spec, ticks.append)
    robot, plant = loaded_robot(spec.robot.urdf), plant_of(spec)
    figure, panels = pyplot().subplots(
        1, frames, figsize=(3.3 * frames, 3.7), layout="constrained", squeeze=False
    )
    with Renderer(robot, draw_individual(plant, robot, spec.robot_seed)) as stage:
        stage.lay_floor((plant.terrain.start + plant.terrain.length / 2.0, 0.0))
        stage.lay_terrain(prisms(plant.terrain, spec.robot_seed))
        for number, panel in enumerate(panels.flat):
            truth = ticks[(len(ticks) - 1) * (number + 1) // frames].truth
            stage.pose(truth.torso_position, truth.torso_quaternion, truth.joint_position)
            panel.imshow(stage.photograph(truth.torso_position.tolist(), 420, 420, camera))
            panel.set_title(f"{1e-9 * truth.stamp:.1f} s", fontsize=9)
            panel.axis("off")
    save(figure, path)
    return result
