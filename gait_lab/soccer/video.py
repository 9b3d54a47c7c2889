"""A match as a video file: MuJoCo's pictures of the recorded poses, as a television shows them.

The waiting between the end of play and the next kick-off is left out.
"""

import math
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from gait_lab.soccer.match import MatchResult, match_scene
from gait_lab.soccer.motion_track import PERIOD, POSE, MotionTrack
from gait_lab.soccer.snapshots import Snapshot
from gait_lab.soccer.story import Event, Story
from nao_soccer.game_state import Phase
from robot_core.field import Field
from robot_core.robot.camera import CameraView, Intrinsics, RgbImage, looking
from robot_core.types import FloatArray
from sim_bridge.state import StartState
from sim_bridge.trials.progress import Progress
from sim_bridge.trials.trial import make_scene_world

SIZE = 640, 360
"""[px]"""
FINE = 2
"""Pixels of a rendered picture for each one of the video, along both axes: smooth edges."""
VIEW = 1.0
"""[rad] horizontal angle of view."""
AROUND = 1.0
"""[s] before and after a moment over which the camera's way is smoothed."""
CAPTION = 4.0
"""[s] for which an event is written below the picture."""
BEFORE, AFTER = 1.0, 2.5
"""[s] shown before a kick-off and after the end of play."""


def write_video(path: Path, result: MatchResult) -> None:
    """Write an MP4 file (H.264) of a match, in real time.

    Raises:
        NaoGaitError: There is no OpenGL without a window here.
        ModuleNotFoundError: imageio-ffmpeg is not installed.
    """
    from imageio_ffmpeg import write_frames

    path.parent.mkdir(parents=True, exist_ok=True)
    video = write_frames(
        str(path), SIZE, fps=round(1.0 / PERIOD), codec="libx264", quality=6, macro_block_size=8
    )
    video.send(None)
    assert result.motion is not None
    total = int(shown(result.motion.time, result.frames).sum())
    with Progress(pictures(result), total=total, unit="picture", desc="video") as progress:
        for picture in progress:
            video.send(np.ascontiguousarray(picture))
    video.close()


def pictures(result: MatchResult) -> Iterator[RgbImage]:
    """Each moment that is shown, with score, time and what has just happened."""
    scene, motion, story = match_scene(result.spec), result.motion, Story(result)
    assert motion is not None
    assert scene.field is not None
    bodies = [motion.body(index) for index in range(len(scene.robots))]
    ball, target = motion.ball, smoothed(motion)
    fonts = ImageFont.load_default(17), ImageFont.load_default(14)
    with make_scene_world(scene, plant=result.spec.plant, visual=True) as world:
        for row in np.flatnonzero(shown(motion.time, result.frames)).tolist():
            time = float(motion.time[row])
            world.pose([_state(body[row]) for body in bodies], ball[row])
            view = television(scene.field, target[row])
            picture = Image.fromarray(world.render(view)).reduce(FINE)
            _write(picture, story, time, fonts)
            yield np.asarray(picture)


def shown(time: FloatArray, frames: Sequence[Snapshot]) -> NDArray[np.bool_]:
    """(t,) whether the ball is in play around a time [s]."""
    plays = np.array([frame.time for frame in frames if frame.phase == Phase.PLAYING])
    after = np.searchsorted(plays, time - AFTER)
    before = np.searchsorted(plays, time + BEFORE, "right")
    result: NDArray[np.bool_] = before > after
    return result


def television(field: Field, target: FloatArray) -> CameraView:
    """Beside the touch line, looking at a point x, y [m] on the field."""
    x, y = target.tolist()
    place = np.array((0.7 * x, -0.5 * field.width - field.border - 1.2, 2.0))
    intrinsics = Intrinsics.from_fov(FINE * SIZE[0], FINE * SIZE[1], VIEW)
    return CameraView(intrinsics, looking(place, np.array((0.85 * x, 0.5 * y, 0.05))))


def smoothed(motion: MotionTrack) -> FloatArray:
    """(t, 2) [m] way of the ball without its haste."""
    reach = round(AROUND / PERIOD)
    kernel = np.full(2 * reach + 1, 1.0 / (2 * reach + 1))
    ball = motion.ball[:, :2]
    padded = np.pad(ball, ((reach, reach), (0, 0)), mode="edge")
    return np.column_stack([np.convolve(padded[:, axis], kernel, "valid") for axis in (0, 1)])


def _state(body: FloatArray) -> StartState:
    quaternion = body[3:POSE] / np.linalg.norm(body[3:POSE])
    return StartState(body[:3], quaternion, body[POSE:])


def _write(picture: Image.Image, story: Story, time: float, fonts: tuple[object, object]) -> None:
    """Score and phase above, the newest event below."""
    frame, draw = story.frame_at(time), ImageDraw.Draw(picture, "RGBA")
    large, small = fonts
    red, blue = frame.score
    board = f"red {red} : {blue} blue   {math.floor(time / 60)}:{time % 60:04.1f}   {frame.phase}"
    _text(draw, board, (12, 10), large)
    newest: Event | None = None
    for event in story.events:
        if event.time <= time:
            newest = event
    if newest is not None and time - newest.time < CAPTION:
        _text(draw, newest.text, (12, SIZE[1] - 32), small)


def _text(draw: ImageDraw.ImageDraw, text: str, place: tuple[int, int], font: object) -> None:
    left, top, right, bottom = draw.textbbox(place, text, font=font)  # type: ignore[arg-type]
    draw.rectangle((left - 6, top - 4, right + 6, bottom + 4), fill=(16, 22, 28, 200))
    draw.text(place, text, font=font, fill=(255, 255, 255, 255))  # type: ignore[arg-type]
