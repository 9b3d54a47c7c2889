"""A NAO and a Bruno in one scene: what each sees of ball and other robot, against the truth."""

import math

import pytest

pytest.importorskip("cv2")

from gait_lab.vision.rendered_frames import HeadSweep, RenderSpec, rendered_frames
from nao_soccer.vision.colors import load_color_table
from nao_soccer.vision.detector import Vision
from nao_soccer.vision.percepts import ROBOTS, Kind
from nao_soccer.vision.settings import VisionSettings
from robot_core.errors import NaoGaitError
from robot_core.field import Field, Goals
from sim_bridge.scene import Scene, SceneBall, SceneRobot

SEES = {
    "nao": ("camera_top", Kind.ROBOT_BLUE),
    "bruno": ("camera_chest", Kind.ROBOT_RED),
}
"""Camera that sees both things, and the kind of the other robot."""
DUEL = Scene(
    name="duel",
    field=Field(),
    goals=Goals(),
    ball=SceneBall(x=-0.4, y=0.35),
    robots=(
        SceneRobot(name="nao", team="red", number=1, urdf="nao_h21_v33", pose=(-2.0, 0.0, 0.0)),
        SceneRobot(name="bruno", team="blue", number=1, urdf="bruno", pose=(0.1, -0.2, 3.1)),
    ),
)


@pytest.mark.parametrize("engine", ["mujoco", "pybullet"])
@pytest.mark.parametrize("name", SEES)
def test_each_sees_the_ball_and_the_other(engine: str, name: str) -> None:
    """With the true camera poses, in the frame of the field."""
    pytest.importorskip(engine)
    camera, kind = SEES[name]
    vision = Vision(load_color_table("pitch"), VisionSettings(goals=Goals()))
    index = [robot.name for robot in DUEL.robots].index(name)
    head = HeadSweep(speed=0.0, width=1.0, tilt=0.0)
    spec = RenderSpec(scene=DUEL, engine=engine, robot=index, head=head, seconds=0.41)
    try:
        frames = [frame for frame in rendered_frames(spec) if frame.camera == camera]
    except NaoGaitError as error:
        if error.field == "cameras":
            pytest.skip(f"no images here: {error.allowed}")
        raise
    assert len(frames) >= 2
    for frame in frames:
        percepts = vision.see(frame.stamp, frame.image, frame.truth.view)
        assert percepts.ball is not None
        assert frame.truth.ball is not None
        away = math.dist(frame.truth.ball[:2], frame.truth.footprint[:2])
        assert math.dist(percepts.ball.position, frame.truth.ball[:2]) < 0.02 * away + 0.01
        (other,) = percepts.of(*ROBOTS)
        assert other.kind is kind
        (place,) = frame.truth.others.values()
        assert math.dist(other.position, place[:2]) < 0.12
        assert len(percepts.line_points) > 10
