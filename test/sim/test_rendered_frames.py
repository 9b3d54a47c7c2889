"""What a robot of a scene sees, with what it measures and the truth."""

import attrs
import numpy as np
import pytest

from robot_core.errors import NaoGaitError
from robot_core.head_goals import Angles
from robot_core.types import VelocityCommand
from sim_bridge.cameras.camera import CameraSettings
from sim_bridge.scene import load_scene
from sim_bridge.trials.rendered_frames import (
    HeadSweep,
    RenderedFrame,
    RenderSpec,
    rendered_frames,
)

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
    frames = frames_of(
        RenderSpec(
            scene="pitch_small",
            engine=engine,
            robot="red2",
            pose=(-1.5, 0.1, 0.0),
            command=VelocityCommand(0.15),
            head=HeadSweep(0.5, 0.2, 0.15),
            seconds=2.5 if engine == "mujoco" else 1.0,
            cameras=("camera_top",),
            settings=SMALL,
        )
    )
    checked = 0
    for frame in frames:
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
    for pan in (-0.3, 0.0, 0.3):
        spec = RenderSpec(
            scene=alone, engine=engine, head=Angles(pan, 0.1), seconds=0.95, cameras=("camera_top",)
        )
        frame = frames_of(spec)[-1]
        for places, is_line in ((crossings, True), (beside, False)):
            points = np.array([(x, y, 0.0) for x, y in places])
            pixels = frame.truth.view.project(points)
            x, y, _ = frame.truth.footprint
            near = np.hypot(points[:, 0] - x, points[:, 1] - y) < 2.5
            inside = frame.intrinsics.contains(pixels) & near
            for u, v in np.rint(pixels[inside]).astype(int):
                red, lush, _ = frame.image[v, u].astype(float)
                assert (red > 0.7 * lush) == is_line
                white, green = white + is_line, green + (not is_line)
    assert white >= 4
    assert green >= 4


def test_samples_are_what_the_robot_knew_and_reach_over_the_exposure() -> None:
    frames = frames_of(
        RenderSpec(scene="pitch_small", cameras=("camera_bottom",), seconds=0.6, settings=SMALL)
    )
    assert [frame.stamp // 10_000_000 for frame in frames] == [5, 15, 25, 35, 45]
    for frame in frames:
        stamps = [sample.stamp for sample in frame.samples]
        assert stamps == sorted(stamps)
        assert frame.stamp in stamps
        assert stamps[-1] == frame.time - 40_000_000
    for frame in frames[1:]:  # the estimator begins with the noise of one sample
        sample = next(each for each in frame.samples if each.stamp == frame.stamp)
        x, y, _ = frame.truth.footprint
        expected = frame.truth.torso_position - (x, y, 0.0)
        assert sample.torso_in_footprint[:3] == pytest.approx(expected, abs=0.01)


def test_the_head_sweeps_at_its_speed() -> None:
    sweep = HeadSweep(1.0, 0.8, 0.1)
    pans = np.array([sweep.at(0.01 * tick).pan for tick in range(1000)])
    assert pans[0] == pytest.approx(0.0)
    assert np.abs(np.diff(pans)) == pytest.approx(0.01)
    assert (pans.min(), pans.max()) == pytest.approx((-0.8, 0.8))


def test_unknown_names_are_refused() -> None:
    for spec in (RenderSpec(robot="green1"), RenderSpec(cameras=("camera_left",), settings=SMALL)):
        with pytest.raises(NaoGaitError, match=r"green1|camera_left"):
            frames_of(spec)
