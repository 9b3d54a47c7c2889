"""The video of a match."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mujoco")
pytest.importorskip("PIL")

from gait_lab.soccer.match import MatchResult, MatchSpec, match_scene
from gait_lab.soccer.motion_track import PERIOD, BodyState, MotionTrack
from gait_lab.soccer.snapshots import RobotSnapshot, Snapshot
from gait_lab.soccer.video import (
    AFTER,
    BEFORE,
    FINE,
    pictures,
    shown,
    smoothed,
    television,
    write_video,
)
from robot_core.robot import load_robot
from robot_core.robot.camera import looking


def test_the_picture_looks_at_its_point_upright() -> None:
    place, at = np.array((1.0, -3.0, 2.0)), np.array((0.5, 0.2, 0.1))
    position, rotation = looking(place, at)
    assert np.allclose(rotation.T @ rotation, np.eye(3))
    assert np.linalg.det(rotation) == pytest.approx(1.0)
    assert np.allclose((at - position) @ rotation, (0.0, 0.0, np.linalg.norm(at - place)))
    assert rotation[2, 0] == pytest.approx(0.0)
    assert rotation[2, 1] < 0.0  # y of an optical frame points down


def test_waiting_is_left_out() -> None:
    frames = [
        Snapshot(0.2 * n, (0.0, 0.0), {}, "playing" if 50 <= n <= 75 else "ready", (0, 0))
        for n in range(200)
    ]
    time = np.arange(0.0, 40.0, PERIOD)
    seen = time[shown(time, frames)]
    assert seen[0] == pytest.approx(10.0 - BEFORE, abs=PERIOD)
    assert seen[-1] == pytest.approx(15.0 + AFTER, abs=PERIOD)
    assert len(seen) == pytest.approx((seen[-1] - seen[0]) / PERIOD + 1)


def short_match() -> MatchResult:
    """Five moments in which the ball moves by half a metre."""
    spec = MatchSpec()
    scene = match_scene(spec)
    joints = np.zeros(len(load_robot(scene.robots[0].urdf).joint_names))
    motion, frames = MotionTrack(), []
    for row in range(5):
        bodies = [
            BodyState(np.array((*robot.pose[:2], 0.33)), np.array((0.0, 0.0, 0.0, 1.0)), joints)
            for robot in scene.robots
        ]
        motion.add(row * PERIOD, (0.12 * row, 0.0, 0.05), bodies)
        robots = {r.name: RobotSnapshot(*r.pose, "stand", "striker", "") for r in scene.robots}
        frames.append(Snapshot(row * PERIOD, (0.12 * row, 0.0), robots, "playing", (0, 0)))
    return MatchResult(
        spec, {"red": 0, "blue": 0}, [], 1.0, falls={}, kicks=0, strokes=0, wrong_half=0,
        frames=frames, motion=motion,
    )  # fmt: skip


def test_the_ball_moves_in_the_pictures(tmp_path: Path) -> None:
    result = short_match()
    seen = list(pictures(result))
    assert len(seen) == 5
    scene, motion = match_scene(result.spec), result.motion
    assert scene.field is not None
    assert motion is not None
    for picture, target, ball in zip(seen, smoothed(motion), motion.ball, strict=True):
        column, row = television(scene.field, target).project(ball) / FINE
        red, green, blue = picture[round(row), round(column)].tolist()
        assert red - green > 50
        assert green - blue > 50
    pytest.importorskip("imageio_ffmpeg")
    from imageio_ffmpeg import count_frames_and_secs

    path = tmp_path / "match.mp4"
    write_video(path, result)
    frames, seconds = count_frames_and_secs(str(path))
    assert frames == 5
    assert seconds == pytest.approx(5 * PERIOD, abs=PERIOD)
