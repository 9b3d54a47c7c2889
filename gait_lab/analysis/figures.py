"""Figures of a recorded walk, written as PNG."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gait_lab.demo.tour import TourPhase
from gait_lab.record.recording import Recording
from nao_lipm_gait.types import FloatArray

BLACK, RED, BLUE, GREY, ORANGE = "#111111", "#d1495b", "#00798c", "#9a9a9a", "#edae49"
"""Distinguishable also without colour vision."""
FRAMES = 12
"""Pictures on the contact sheet."""
SOLE_BACK, SOLE_FRONT, SOLE_HALF_WIDTH = 0.05, 0.10, 0.042
"""[m] outline of a sole around the point under its ankle, for the drawing alone."""


def pyplot() -> Any:
    """Matplotlib's pyplot, without a window and in one style."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    plt.rcParams.update(
        {
            "font.size": 10,
            "axes.spines.top": False,
            "axes.spines.right": False,
            "axes.grid": True,
            "grid.color": "#e4e4e4",
            "axes.axisbelow": True,
            "legend.frameon": False,
            "figure.dpi": 110,
        }
    )
    return plt


_pyplot = pyplot
"""Its former name."""


def draw_demo(
    recording: Recording, tour: Sequence[TourPhase], tour_began: float, out: Path, urdf: str
) -> list[Path]:
    """All figures of a demo; `tour_began` [s] of simulated time, `urdf`: the robot that walked."""
    begins = tour_began + np.cumsum([0.0, *(phase.duration for phase in tour)])
    forward = next((i for i, phase in enumerate(tour) if phase.command.x > 0.0), 0)
    return [
        com_figure(recording, float(begins[forward + 1]) - 3.0, out / "com_y.png"),
        path_figure(recording, tour, begins, out / "path.png"),
        speed_figure(recording, tour, begins, out / "speeds.png"),
        frames_figure(recording, tour, begins, out / "frames.png", urdf),
    ]


def com_figure(recording: Recording, start: float, path: Path) -> Path:
    """The paper's Fig. 6: y of the expected and of the measured CoM, 3 s long."""
    plt = pyplot()
    figure, axes = plt.subplots(figsize=(9, 3.2), layout="constrained")
    expected = recording.expected.between(start, start + 3.0)
    measured = recording.measured.between(start, start + 3.0)
    axes.plot(expected.time - start, 1e3 * expected.value[:, 1], color=BLACK, label="expected")
    axes.plot(measured.time - start, 1e3 * measured.value[:, 1], color=RED, label="measured")
    error = 1e3 * recording.com_error_y(start, start + 3.0)
    constant = 1e3 * float(measured.value[:, 1].mean() - expected.value[:, 1].mean())
    axes.set(
        xlabel="time [s]",
        ylabel="CoM y in Q [mm]",
        title="Centre of mass from side to side, walking forward: mean |expected - measured| "
        f"{error:.1f} mm, constant part {constant:+.1f} mm",
    )
    axes.title.set_fontsize(10)
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return save(figure, path)


def path_figure(
    recording: Recording, tour: Sequence[TourPhase], begins: FloatArray, path: Path
) -> Path:
    """The way from above, in the robot's start frame, with where the feet stood."""
    plt = pyplot()
    figure, axes = plt.subplots(figsize=(8, 6), layout="constrained")
    truth, odometry, soles = recording.truth, recording.odometry, recording.soles
    label: str | None = "footprints by odometry"
    for row in _landed(recording):
        values = soles.value[row]
        for x, y, yaw, _ in (values[:4], values[4:]):
            outline = _sole_outline(x, y, yaw)
            axes.fill(*outline, color=GREY, alpha=0.15, linewidth=0, label=label)
            label = None
    colors = plt.cm.viridis(np.linspace(0.0, 0.92, len(tour)))
    for phase, begin, end, color in zip(tour, begins, begins[1:], colors, strict=False):
        inside = (truth.time >= begin) & (truth.time <= end + 0.02)
        if phase.command.is_zero or not inside.any():
            continue
        axes.plot(
            truth.position[inside, 0], truth.position[inside, 1],
            color=color, linewidth=2.2, label=phase.name,
        )  # fmt: skip
    if len(odometry.time):
        axes.plot(
            odometry.value[:, 0], odometry.value[:, 1],
            color=BLACK, linewidth=0.9, linestyle=":", label="odometry",
        )  # fmt: skip
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(xlabel="x [m]", ylabel="y [m]")
    axes.set_title("The way: ground truth of the torso, and what the feet believe")
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return save(figure, path)


def _landed(recording: Recording) -> list[int]:
    """Rows of `soles` at which both feet stand on the ground just after a support change."""
    soles = recording.soles
    times = [time for time, state in recording.supports if state.startswith("walk")]
    rows = np.searchsorted(soles.time, times) if len(soles.time) else np.empty(0, dtype=int)
    return [int(row) for row in rows if row < len(soles.time)]


def _sole_outline(x: float, y: float, yaw: float) -> tuple[FloatArray, FloatArray]:
    corners = np.array(
        [
            (-SOLE_BACK, -SOLE_HALF_WIDTH),
            (SOLE_FRONT, -SOLE_HALF_WIDTH),
            (SOLE_FRONT, SOLE_HALF_WIDTH),
            (-SOLE_BACK, SOLE_HALF_WIDTH),
        ]
    )
    c, s = math.cos(yaw), math.sin(yaw)
    return x + c * corners[:, 0] - s * corners[:, 1], y + s * corners[:, 0] + c * corners[:, 1]


def speed_figure(
    recording: Recording, tour: Sequence[TourPhase], begins: FloatArray, path: Path
) -> Path:
    """Commanded and achieved velocity over the tour."""
    plt = pyplot()
    figure, panels = plt.subplots(3, 1, figsize=(10, 6.5), sharex=True, layout="constrained")
    truth, commands = recording.truth, recording.commands
    zero = begins[0]
    velocity = truth.velocity_in_heading
    turn = np.gradient(np.unwrap(truth.yaw), truth.time)
    tracks = (
        ("forward [cm/s]", 100.0, velocity[:, 0]),
        ("left [cm/s]", 100.0, velocity[:, 1]),
        ("turn [deg/s]", math.degrees(1.0), turn),
    )
    for column, (panel, (label, factor, achieved)) in enumerate(zip(panels, tracks, strict=True)):
        panel.plot(truth.time - zero, factor * achieved, color=GREY, linewidth=0.5, alpha=0.8)
        panel.plot(
            truth.time - zero, factor * _smoothed(achieved, 50),
            color=BLUE, linewidth=1.8, label="achieved (mean over 0.5 s)",
        )  # fmt: skip
        panel.step(
            commands.time - zero, factor * commands.value[:, column],
            where="post", color=BLACK, linewidth=1.2, linestyle="--", label="commanded",
        )  # fmt: skip
        panel.set_ylabel(label)
        reach = max(1.0, 1.8 * factor * np.abs(commands.value[:, column]).max(initial=0.0))
        panel.set_ylim(-max(reach, 20.0), max(reach, 20.0))
        for begin in begins[1:-1]:
            panel.axvline(begin - zero, color=ORANGE, linewidth=0.8)
    for phase, begin, end in zip(tour, begins, begins[1:], strict=False):
        panels[0].text(
            0.5 * (begin + end) - zero, 1.02, phase.name, ha="center", fontsize=8,
            transform=panels[0].get_xaxis_transform(),
        )  # fmt: skip
    panels[0].legend(loc="lower left", ncols=2, fontsize=8)
    panels[-1].set_xlabel("time in the tour [s]")
    panels[-1].set_xlim(0.0, begins[-1] - zero)
    return save(figure, path)


def _smoothed(values: FloatArray, window: int) -> FloatArray:
    if len(values) < window:
        return values
    return np.convolve(values, np.ones(window) / window, mode="same")


def frames_figure(
    recording: Recording, tour: Sequence[TourPhase], begins: FloatArray, path: Path, urdf: str
) -> Path:
    """A contact sheet: the robot as it was, drawn from the recorded poses."""
    from gait_lab.analysis.render import Renderer
    from nao_lipm_gait.robot import load_robot
    from sim_bridge.individual import draw_individual
    from sim_bridge.plant import load_plant

    plt = pyplot()
    robot = load_robot(urdf)
    columns = [recording.joint_names.index(name) for name in robot.joint_names]
    truth, joints = recording.truth, recording.joints
    row_of = {round(1e3 * time): row for row, time in enumerate(joints.time.tolist())}
    figure, panels = plt.subplots(2, FRAMES // 2, figsize=(13, 5.2), layout="constrained")
    with Renderer(robot, draw_individual(load_plant("ideal"), robot, -1)) as stage:
        times = np.linspace(begins[1] + 1.0, begins[-1] - 0.5, FRAMES)
        for panel, time in zip(panels.flat, times, strict=True):
            panel.axis("off")
            row = int(np.searchsorted(truth.time, time))
            if row >= len(truth.time) or round(1e3 * truth.time[row]) not in row_of:
                continue
            angles = joints.value[row_of[round(1e3 * truth.time[row])]][columns]
            position = truth.position[row]
            stage.lay_floor(position)
            stage.pose(position, truth.quaternion[row], angles)
            panel.imshow(stage.photograph(position))
            index = int(np.searchsorted(begins, time, side="right")) - 1
            panel.set_title(f"{time - begins[0]:.0f} s, {tour[index].name}", fontsize=9)
    return save(figure, path)


def save(figure: Any, path: Path) -> Path:
    """Write a figure and let go of it."""
    figure.savefig(path)
    pyplot().close(figure)
    return path
