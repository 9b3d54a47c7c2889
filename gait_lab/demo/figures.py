"""Figures of a recorded tour, written as PNG."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from gait_lab.analysis.plots import BLACK, BLUE, GREY, ORANGE, RED, pyplot, save
from gait_lab.analysis.recorded_walk import RecordedWalk
from gait_lab.demo.tour import TourPhase
from robot_core.types import FloatArray
from sim_bridge.trials.metrics import velocity_in_heading, yaw_of

COM_WINDOW = 3.0
"""[s] shown of the CoM."""
FRAMES = 12
"""Pictures on the contact sheet."""
SOLE_BACK, SOLE_FRONT, SOLE_HALF_WIDTH = 0.05, 0.10, 0.042
"""[m] outline of a sole around the point under its ankle, for the drawing alone."""


def draw_demo(
    walk: RecordedWalk, tour: Sequence[TourPhase], tour_began: float, out: Path, urdf: str
) -> list[Path]:
    """Draw all figures of a demo.

    Args:
        walk: The recorded tour.
        tour: Its phases.
        tour_began: [s] of simulated time.
        out: Folder of the figures.
        urdf: Name or file of the robot.

    Returns:
        The files.
    """
    begins = tour_began + np.cumsum([0.0, *(phase.duration for phase in tour)])
    # The paper's Fig. 6 shows stepping on the spot: that phase if there is one.
    spot = [i for i, phase in enumerate(tour) if on_the_spot(phase)]
    forward = [i for i, phase in enumerate(tour) if phase.command.x > 0.0]
    shown = next(iter((*spot, *forward)), 0)
    start = float(begins[shown + 1]) - COM_WINDOW
    return [
        com_figure(walk, start, tour[shown].name, out / "com_y.png"),
        path_figure(walk, tour, begins, out / "path.png"),
        speed_figure(walk, tour, begins, out / "speeds.png"),
        frames_figure(walk, tour, begins, out / "frames.png", urdf),
    ]


def on_the_spot(phase: TourPhase) -> bool:
    """Whether the robot steps without a visible motion in this phase."""
    command = phase.command
    slow = math.hypot(command.x, command.y) < 0.005 and abs(command.yaw) < 0.02
    return slow and not command.is_zero


def com_figure(walk: RecordedWalk, start: float, phase: str, path: Path) -> Path:
    """Expected and measured y of the CoM, as the paper's Fig. 6 shows it for steps on the spot.

    Args:
        walk: The recording.
        start: Start of the window of `COM_WINDOW` [s of simulated time].
        phase: What the robot does, for the title.
        path: Path of the PNG.

    Returns:
        The file.
    """
    plt = pyplot()
    figure, axes = plt.subplots(figsize=(9, 3.2), layout="constrained")
    stamp = walk.expected.stamp
    stamp = stamp[(stamp >= 1e9 * start) & (stamp <= 1e9 * (start + COM_WINDOW))]
    time = 1e-9 * stamp - start
    expected, measured = (1e3 * table.at(stamp)[:, 1] for table in (walk.expected, walk.measured))
    axes.plot(time, expected, color=BLACK, label="expected")
    axes.plot(time, measured, color=RED, label="measured")
    error = float(np.nanmean(np.abs(measured - expected))) if len(stamp) else math.nan
    constant = float(np.nanmean(measured - expected)) if len(stamp) else math.nan
    axes.set(
        xlabel="time [s]",
        ylabel="CoM y in Q [mm]",
        title=f"CoM from side to side, {phase}: mean |expected - measured| "
        f"{error:.1f} mm, constant part {constant:+.1f} mm",
    )
    axes.title.set_fontsize(10)
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return save(figure, path)


def path_figure(
    walk: RecordedWalk, tour: Sequence[TourPhase], begins: FloatArray, path: Path
) -> Path:
    """The path from above, with the footprints.

    Args:
        walk: The recorded tour.
        tour: Its phases.
        begins: [s of simulated time] of the phases, and the end of the last one.
        path: Path of the PNG.

    Returns:
        The file.
    """
    plt = pyplot()
    figure, axes = plt.subplots(figsize=(8, 6), layout="constrained")
    label: str | None = "footprints by odometry"
    for row in _landed(walk):
        for sole in (walk.footsteps.left_sole, walk.footsteps.right_sole):
            outline = _sole_outline(*sole[row].tolist())
            axes.fill(*outline, color=GREY, alpha=0.15, linewidth=0, label=label)
            label = None
    colors = plt.cm.viridis(np.linspace(0.0, 0.92, len(tour)))
    time, position = 1e-9 * walk.truth.stamp, walk.truth.value[:, :2]
    for phase, begin, end, color in zip(tour, begins, begins[1:], colors, strict=False):
        inside = (time >= begin) & (time <= end + 0.02)
        if phase.command.is_zero or not inside.any():
            continue
        axes.plot(*position[inside].T, color=color, linewidth=2.2, label=phase.name)
    if len(walk.odometry):
        axes.plot(
            *walk.odometry.value[:, :2].T,
            color=BLACK, linewidth=0.9, linestyle=":", label="odometry",
        )  # fmt: skip
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(xlabel="x [m]", ylabel="y [m]")
    axes.set_title("Path of the torso (ground truth), and footprints by odometry")
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return save(figure, path)


def _landed(walk: RecordedWalk) -> list[int]:
    """Rows of the footsteps just after each support change, when both feet are on the ground."""
    stamps = walk.footsteps.stamp
    changes = [stamp for stamp, state in walk.support if state.startswith("walk")]
    rows = np.searchsorted(stamps, changes) if len(stamps) else np.empty(0, dtype=int)
    return [int(row) for row in rows if row < len(stamps)]


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
    walk: RecordedWalk, tour: Sequence[TourPhase], begins: FloatArray, path: Path
) -> Path:
    """Commanded and achieved velocity over the tour.

    Args:
        walk: The recorded tour.
        tour: Its phases.
        begins: [s of simulated time] of the phases, and the end of the last one.
        path: Path of the PNG.

    Returns:
        The file.
    """
    plt = pyplot()
    figure, panels = plt.subplots(3, 1, figsize=(10, 6.5), sharex=True, layout="constrained")
    zero = begins[0]
    quaternion = walk.truth.value[:, 3:7]
    time, commanded = 1e-9 * walk.truth.stamp, 1e-9 * walk.command.stamp
    velocity = velocity_in_heading(quaternion, walk.truth.value[:, 7:10])
    turn = np.gradient(np.unwrap(yaw_of(quaternion)), time)
    tracks = (
        ("forward [cm/s]", 100.0, velocity[:, 0]),
        ("left [cm/s]", 100.0, velocity[:, 1]),
        ("turn [deg/s]", math.degrees(1.0), turn),
    )
    for column, (panel, (label, factor, achieved)) in enumerate(zip(panels, tracks, strict=True)):
        panel.plot(time - zero, factor * achieved, color=GREY, linewidth=0.5, alpha=0.8)
        panel.plot(
            time - zero, factor * _smoothed(achieved, 50),
            color=BLUE, linewidth=1.8, label="achieved (mean over 0.5 s)",
        )  # fmt: skip
        panel.step(
            commanded - zero, factor * walk.command.value[:, column],
            where="post", color=BLACK, linewidth=1.2, linestyle="--", label="commanded",
        )  # fmt: skip
        panel.set_ylabel(label)
        reach = max(1.0, 1.8 * factor * np.abs(walk.command.value[:, column]).max(initial=0.0))
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
    walk: RecordedWalk, tour: Sequence[TourPhase], begins: FloatArray, path: Path, urdf: str
) -> Path:
    """A contact sheet of the robot, drawn from the recorded poses.

    Args:
        walk: The recorded tour.
        tour: Its phases.
        begins: [s of simulated time] of the phases, and the end of the last one.
        path: Path of the PNG.
        urdf: Name or file of the robot.

    Returns:
        The file.
    """
    from gait_lab.analysis.render import Renderer
    from robot_core.robot import load_robot
    from sim_bridge.individual import draw_individual
    from sim_bridge.plant import load_plant

    plt = pyplot()
    robot = load_robot(urdf)
    columns = [walk.joint_names.index(name) for name in robot.joint_names]
    stamps, angles = walk.truth.stamp, walk.position.at(walk.truth.stamp)[:, columns]
    figure, panels = plt.subplots(2, FRAMES // 2, figsize=(13, 5.2), layout="constrained")
    with Renderer(robot, draw_individual(load_plant("ideal"), robot, -1)) as renderer:
        times = np.linspace(begins[1] + 1.0, begins[-1] - 0.5, FRAMES)
        for panel, time in zip(panels.flat, times, strict=True):
            panel.axis("off")
            row = int(np.searchsorted(stamps, 1e9 * time))
            if row >= len(stamps) or not np.isfinite(angles[row]).all():
                continue
            position, quaternion = walk.truth.value[row, :3], walk.truth.value[row, 3:7]
            renderer.lay_floor(position.tolist())
            renderer.pose(position, quaternion, angles[row])
            panel.imshow(renderer.photograph(position.tolist()))
            index = int(np.searchsorted(begins, time, side="right")) - 1
            panel.set_title(f"{time - begins[0]:.0f} s, {tour[index].name}", fontsize=9)
    return save(figure, path)
