"""Pictures of the robot in a recorded tour: a sheet of the whole tour, and a loop of its walk."""

from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gait_lab.analysis.recorded_walk import RecordedWalk
from gait_lab.analysis.render import TILE_PERIOD, Camera, Renderer, write_gif
from gait_lab.demo.tour import SETTLE, TourPhase
from robot_core.robot import RobotDescription, load_robot
from robot_core.types import FloatArray
from sim_bridge.individual import NOMINAL, draw_individual
from sim_bridge.plant import load_plant

FRAMES, COLUMNS = 12, 6
"""Pictures on the sheet, and in a row of it."""
LENGTH = 4.0
"""Largest length of the loop [s]; it ends where the pose is most like the first one."""
SHORTEST = 3.0
"""Smallest length of the loop [s]."""
FRAME_PERIOD = 0.08
"""Time between two frames [s]."""
WIDTH, HEIGHT = 360, 320
"""Size of the loop [pixels]."""
COLOURS = 64
CAMERA = Camera(distance=0.85, yaw=38.0, pitch=-12.0, height=0.24)


@dataclass(frozen=True, slots=True)
class PoseTrace:
    """Poses of the robot, t rows.

    Attributes:
        time: Simulated time (t,) [s].
        position: Torso position (t, 3) in the world [m].
        quaternion: Torso orientation (t, 4), xyzw.
        joints: Joint angles (t, n) [rad].
    """

    time: FloatArray
    position: FloatArray
    quaternion: FloatArray
    joints: FloatArray


def write_pictures(
    walk: RecordedWalk, tour: Sequence[TourPhase], began: float, out: Path, urdf: str
) -> list[Path]:
    """Write `frames.png` and `walk.gif`, as far as the tour was walked; the files.

    Args:
        walk: The recorded tour.
        tour: Its phases.
        began: When it began [s of simulated time].
        out: Folder of the files.
        urdf: Name or file of the robot.
    """
    robot = load_robot(urdf)
    begins = (began + np.cumsum([0.0, *(phase.duration for phase in tour)])).tolist()
    fastest = max(range(len(tour)), key=lambda index: tour[index].command.x)
    steady = motion_between(walk, robot, begins[fastest] + SETTLE, begins[fastest + 1])
    rows = loop_rows(steady)
    individual = draw_individual(load_plant("ideal"), robot, NOMINAL)
    with closing(Renderer(robot, individual)) as renderer:
        files = []
        whole = motion_between(walk, robot, begins[1], begins[-1])
        if len(whole.time):
            files.append(_write_sheet(renderer, whole, tour, begins, out / "frames.png"))
        if rows is not None:
            files.append(_write_loop(renderer, steady, rows, out / "walk.gif"))
    return files


def _write_sheet(
    renderer: Renderer,
    motion: PoseTrace,
    tour: Sequence[TourPhase],
    begins: Sequence[float],
    path: Path,
) -> Path:
    """The robot at even times of the tour, with the name of the phase."""
    from PIL import Image, ImageDraw

    pictures = []
    for time in np.linspace(begins[1] + 1.0, begins[-1] - 0.5, FRAMES):
        row = min(int(np.searchsorted(motion.time, time)), len(motion.time) - 1)
        pose = motion.position[row], motion.quaternion[row], motion.joints[row]
        picture = Image.fromarray(renderer.photograph(*pose, motion.position[row, :2]))
        phase = tour[int(np.searchsorted(begins, motion.time[row], side="right")) - 1]
        words = f"{motion.time[row] - begins[0]:.0f} s, {phase.name}"
        ImageDraw.Draw(picture).text((8, 6), words, fill="black")
        pictures.append(np.asarray(picture))
    lines = [np.hstack(pictures[first : first + COLUMNS]) for first in range(0, FRAMES, COLUMNS)]
    Image.fromarray(np.vstack(lines)).save(path)
    return path


def _write_loop(renderer: Renderer, motion: PoseTrace, rows: list[int], path: Path) -> Path:
    # The camera moves on a straight line at constant speed: the robot sways, the picture does not.
    line = np.polynomial.polynomial.polyfit(motion.time[rows], motion.position[rows, :2], 1)
    pictures = []
    for row in rows:
        pose = motion.position[row], motion.quaternion[row], motion.joints[row]
        centre = line[0] + line[1] * motion.time[row]
        pictures.append(renderer.photograph(*pose, centre, WIDTH, HEIGHT, CAMERA))
    write_gif(path, pictures, FRAME_PERIOD, COLOURS)
    return path


def motion_between(
    walk: RecordedWalk, robot: RobotDescription, start: float, end: float
) -> PoseTrace:
    """Return the poses between two times at which torso and joints have the same stamp."""
    stamp = walk.truth.stamp
    stamp = stamp[(stamp >= 1e9 * start) & (stamp <= 1e9 * end)]
    angles = walk.position.at(stamp)[:, [walk.joint_names.index(j) for j in robot.joint_names]]
    known = np.isfinite(angles).all(axis=1)
    torso = walk.truth.at(stamp)[known]
    time = np.asarray(1e-9 * stamp[known], dtype=float)
    return PoseTrace(time, torso[:, :3], torso[:, 3:7], angles[known])


def loop_rows(motion: PoseTrace) -> list[int] | None:
    """Return the rows of the frames of a loop without a visible jump at its end.

    At the end of the loop, the joints are where they were at its start, and the robot has walked
    over a whole number of periods of the floor's pattern. None if the motion is too short.
    """
    step = round(FRAME_PERIOD / 0.01)
    best: tuple[float, list[int]] | None = None
    for first in range(0, len(motion.time) - round(SHORTEST / 0.01), 2):
        for frames in range(round(SHORTEST / FRAME_PERIOD), round(LENGTH / FRAME_PERIOD) + 1):
            last = first + frames * step
            if last >= len(motion.time):
                break
            moved = (motion.position[last, :2] - motion.position[first, :2]) / TILE_PERIOD
            jump = TILE_PERIOD * float(np.abs(moved - np.round(moved)).max())
            error = float(np.abs(motion.joints[last] - motion.joints[first]).max()) + 2.0 * jump
            if best is None or error < best[0]:
                best = error, list(range(first, last, step))
    return best[1] if best is not None else None
