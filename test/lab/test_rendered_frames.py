"""What a robot of a scene sees, with what it measures and the truth."""

import math

import attrs
import numpy as np
import pytest

from gait_lab.vision.rendered_frames import (
    HeadSweep,
    RenderedFrame,
    RenderSpec,
    rendered_frames,
)
from robot_core.errors import NaoGaitError
from robot_core.types import VelocityCommand
from sim_bridge.cameras.camera import CameraSettings
from sim_bridge.scene import load_scene

SMALL = CameraSettings(width=160, height=120)


def frames_of(spec: RenderSpec) -> list[RenderedFrame]:
    pytest.importorskip(spec.engine)
    try:
        return list(rendered_frames(spec))
    except NaoGaitError as error:
        if error.field == "cameras":
            pytest.skip(f"no images here: {error.allowed}")
        raise


@pytest.mark.parametrize("engine", ["mujoco", "pybullet"])
def test_the_orange_ball_is_where_the_truth_says(engine: str) -> None:
    """While it walks with its head turning, the pixels of the ball are around its projection."""
    pitch = load_scene("pitch_small")
    red1, red2, *others = pitch.robots
    moved = attrs.evolve(red2, pose=(-1.5, 0.1, 0.0))
    frames = frames_of(
        RenderSpec(
            scene=attrs.evolve(pitch, robots=(red1, moved, *others)),
            engine=engine,
            robot=1,
            command=VelocityCommand(0.15),
            head=HeadSweep(0.5, 0.2, 0.15),
            seconds=2.5 if engine == "mujoco" else 1.0,
            settings=SMALL,
        )
    )
    checked = 0
    for frame in frames:
        if frame.camera != "camera_top":
            continue
        assert frame.truth.ball is not None
        assert frame.time - frame.stamp == 100_000_000
        expected = frame.truth.view.project(frame.truth.ball)
        if not (10 < expected[0] < 149 and 10 < expected[1] < 109):
            continue
        red, green, blue = np.moveaxis(frame.image.astype(int), -1, 0)
        rows, columns = np.nonzero((red > 1.5 * green) & (green > 1.2 * blue) & (red > 90))
        near = np.hypot(columns - expected[0], rows - expected[1]) < 12
        assert near.sum() > 15
        assert columns[near].mean() == pytest.approx(expected[0], abs=1.5)
        assert rows[near].mean() == pytest.approx(expected[1], abs=1.5)
        checked += 1
    assert checked >= 6


@pytest.mark.parametrize("engine", ["mujoco", "pybullet"])
def test_lines_cross_where_the_field_says(engine: str) -> None:
    """The pixels of crossings are white, those of points beside the lines are green."""
    pitch = load_scene("pitch_small")
    assert pitch.field is not None
    alone = attrs.evolve(pitch, ball=None, robots=pitch.robots[:1])
    crossings = [(each.x, each.y) for each in pitch.field.crossings()]
    beside = [(-1.2, 0.3), (-0.2, 0.15), (0.2, -0.2), (0.6, 0.3)]
    white = green = 0
    spec = RenderSpec(scene=alone, engine=engine, head=HeadSweep(0.3, 0.3, 0.1), seconds=3.5)
    for frame in [each for each in frames_of(spec) if each.camera == "camera_top"][9::5]:
        for places, is_line in ((crossings, True), (beside, False)):
            points = np.array([(x, y, 0.0) for x, y in places])
            pixels = frame.truth.view.project(points)
            x, y, _ = frame.truth.footprint
            near = np.hypot(points[:, 0] - x, points[:, 1] - y) < 2.5
            inside = frame.view.intrinsics.contains(pixels) & near
            for u, v in np.rint(pixels[inside]).astype(int):
                red, lush, _ = frame.image[v, u].astype(float)
                assert (red > 0.7 * lush) == is_line
                white, green = white + is_line, green + (not is_line)
    assert white >= 4
    assert green >= 4


def test_the_camera_is_where_the_robot_measured_it_at_the_exposure() -> None:
    """The pose at the exposure is nearer to the truth than the newest one, while the head turns."""
    pitch = load_scene("pitch_small")
    nominal = attrs.evolve(pitch, robots=(attrs.evolve(pitch.robots[0], seed=-1),))
    sweep = HeadSweep(1.0, 0.8, 0.1)
    spec = RenderSpec(scene=nominal, head=sweep, seconds=0.9, settings=SMALL)
    frames = [frame for frame in frames_of(spec) if frame.camera == "camera_bottom"]
    assert [frame.stamp // 10_000_000 for frame in frames] == [5, 15, 25, 35, 45, 55, 65, 75]
    off, late_off = [], []
    for frame in frames:
        _, _, yaw = frame.truth.footprint
        true = frame.truth.view.pose.rotation[:, 2]
        ahead = np.array((math.cos(yaw), math.sin(yaw)))
        for view, found in ((frame.view, off), (frame.late_view, late_off)):
            line = view.pose.rotation[:, 2]
            angle = math.atan2(line[1], line[0]) + math.atan2(ahead[1], ahead[0])
            found.append(abs(math.remainder(angle - math.atan2(true[1], true[0]), math.tau)))
    assert max(off[1:]) < 0.03
    assert min(late_off[3:]) > 0.04


def test_the_head_sweeps_at_its_speed() -> None:
    sweep = HeadSweep(1.0, 0.8, 0.1)
    pans = np.array([sweep.at(0.01 * tick).pan for tick in range(1000)])
    assert pans[0] == pytest.approx(0.0)
    assert np.abs(np.diff(pans)) == pytest.approx(0.01)
    assert (pans.min(), pans.max()) == pytest.approx((-0.8, 0.8))
