"""The moving picture of the demo: a short loop of the walking robot as an animated GIF."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gait_lab.analysis.recorded_walk import RecordedWalk
from gait_lab.analysis.render import TILE_PERIOD, Camera, Renderer
from robot_core.robot import RobotDescription, load_robot
from robot_core.types import FloatArray
from sim_bridge.individual import draw_individual
from sim_bridge.plant import load_plant

LENGTH = 4.0
"""Largest length of the loop [s]; it ends where the pose is most like the first one."""
SHORTEST = 3.0
"""Smallest length of the loop [s]."""
FRAME_PERIOD = 0.08
"""Time between two frames [s]; GIF knows multiples of 10 ms."""
WIDTH, HEIGHT = 360, 320
"""Size of the picture [pixels]."""
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


def write_walk_gif(
    walk: RecordedWalk, urdf: str, start: float, end: float, path: Path
) -> Path | None:
    """Draw a loop of the robot walking straight on.

    Args:
        walk: The recorded tour.
        urdf: Name or file of the robot.
        start: Start of the walk at constant speed [s of simulated time].
        end: End of that walk.
        path: File to write.

    Returns:
        The file, or None if the recording holds too little of the walk for a loop.
    """
    from PIL import Image

    robot = load_robot(urdf)
    motion = motion_between(walk, robot, start, end)
    rows = loop_rows(motion)
    if rows is None:
        return None
    # The camera moves on a straight line at constant speed: the robot sways, the picture does not.
    line = np.polynomial.polynomial.polyfit(motion.time[rows], motion.position[rows, :2], 1)
    individual = draw_individual(load_plant("ideal"), robot, -1)
    pictures = []
    with Renderer(robot, individual) as renderer:
        renderer.lay_floor((0.0, 0.0))
        for row in rows:
            centre = line[0] + line[1] * motion.time[row]
            # Near the origin, where the renderer draws shadows; the pattern of the floor repeats.
            shift = TILE_PERIOD * np.round(centre / TILE_PERIOD)
            position = motion.position[row] - np.array([*shift, 0.0])
            renderer.pose(position, motion.quaternion[row], motion.joints[row])
            image = renderer.photograph(centre - shift, WIDTH, HEIGHT, CAMERA)
            pictures.append(Image.fromarray(image))
    # One palette for all frames, and no dithering, or the floor flickers.
    palette = pictures[0].quantize(COLOURS)
    frames = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    frames[0].save(
        path, save_all=True, append_images=frames[1:], duration=round(1000 * FRAME_PERIOD), loop=0,
        optimize=False,
    )  # fmt: skip
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
