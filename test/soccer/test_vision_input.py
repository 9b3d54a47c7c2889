"""What vision refuses, in one line each, and that it works afterwards."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from nao_soccer.vision.colors import BALL, FIELD, WHITE, ColorClassifier, load_color_table
from nao_soccer.vision.controller import ImageInput, VisionController
from nao_soccer.vision.pose_history import PoseHistory
from nao_soccer.vision.settings import VisionSettings, settings_of_scene
from pitch_image import camera, picture
from robot_core.errors import NaoGaitError
from robot_core.resources import find
from robot_core.robot import load_robot
from robot_core.robot.camera import Intrinsics

ROBOT = load_robot("nao_h21_v33")
TABLE = load_color_table("pitch")
PINHOLE = Intrinsics.from_fov(320, 240, 0.8342)
SECOND = 1_000_000_000


def image(stamp: int = SECOND) -> ImageInput:
    """An image of the pitch."""
    pixels = picture(camera(0.0, 0.0, 0.5))
    return ImageInput(stamp, 320, 240, "rgb8", 960, pixels.tobytes())


@pytest.fixture
def controller() -> VisionController:
    """Vision that knows its camera and the body from 0.9 to 1.1 s."""
    vision = VisionController(ROBOT, TABLE, VisionSettings())
    vision.set_camera("camera_top", PINHOLE)
    for tick in range(21):
        stamp = 900_000_000 + tick * 10_000_000
        vision.add_joints(stamp, list(ROBOT.joint_names), ROBOT.stand_pose)
        vision.add_torso(stamp, np.array((0.0, 0.0, 0.33)), np.eye(3))
    return vision


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"width": 160, "step": 480, "data": bytes(480 * 240)}, "size"),
        ({"encoding": "mono8"}, "encoding"),
        ({"data": b"123"}, "data"),
        ({"step": 3}, "step"),
    ],
)
def test_bad_image_is_refused_and_the_next_one_is_seen(
    controller: VisionController, change: dict, field: str
):
    with pytest.raises(NaoGaitError, match=f"camera_top/image_raw {field}") as refusal:
        controller.add_image("camera_top", replace(image(), **change))
    assert "\n" not in str(refusal.value)
    controller.add_image("camera_top", image())
    assert controller.see("camera_top") is not None


def test_a_black_image_is_refused(controller: VisionController):
    noise = np.random.default_rng(0).integers(0, 6, (240, 320, 3)).astype(np.uint8)
    controller.add_image("camera_top", replace(image(), data=noise.tobytes()))
    with pytest.raises(NaoGaitError, match="camera_top/image_raw brightness"):
        controller.see("camera_top")


def test_an_image_that_stays_the_same_is_refused_once_the_camera_has_moved(
    controller: VisionController,
):
    turned = ROBOT.stand_pose.copy()
    turned[list(ROBOT.joint_names).index("HeadYaw")] += 0.1
    controller.add_image("camera_top", image())
    assert controller.see("camera_top") is not None
    controller.add_image("camera_top", image(SECOND + 50_000_000))
    assert controller.see("camera_top") is not None, "nothing moved"
    for tick in range(11, 21):
        stamp = SECOND + tick * 10_000_000
        controller.add_joints(stamp, list(ROBOT.joint_names), turned)
        controller.add_torso(stamp, np.array((0.0, 0.0, 0.33)), np.eye(3))
    controller.add_image("camera_top", image(SECOND + 150_000_000))
    with pytest.raises(NaoGaitError, match="the same image again"):
        controller.see("camera_top")


def test_image_without_camera_info_is_refused(controller: VisionController):
    with pytest.raises(NaoGaitError, match="camera_info"):
        controller.add_image("camera_bottom", image())


@pytest.mark.parametrize("field", ["fx", "fy", "cx", "cy"])
@pytest.mark.parametrize("value", [float("nan"), float("inf"), -1.0, 1e5])
def test_a_pinhole_that_is_none_is_refused_and_the_old_one_kept(
    controller: VisionController, field: str, value: float
):
    with pytest.raises(NaoGaitError, match=f"camera_top/camera_info {field}"):
        controller.set_camera("camera_top", replace(PINHOLE, **{field: value}))
    controller.add_image("camera_top", image())
    assert controller.see("camera_top") is not None


def test_an_image_of_another_size_does_not_wait(controller: VisionController):
    controller.add_image("camera_top", image(1_105_000_000))
    controller.set_camera("camera_top", Intrinsics.from_fov(160, 120, 0.8342))
    controller.add_joints(1_110_000_000, list(ROBOT.joint_names), ROBOT.stand_pose)
    controller.add_torso(1_110_000_000, np.array((0.0, 0.0, 0.33)), np.eye(3))
    assert controller.see("camera_top") is None


def test_image_waits_for_the_joints_of_its_time(controller: VisionController):
    controller.add_image("camera_top", image(1_115_000_000))
    assert controller.see("camera_top") is None
    controller.add_joints(1_120_000_000, list(ROBOT.joint_names), ROBOT.stand_pose)
    controller.add_torso(1_120_000_000, np.array((0.0, 0.0, 0.33)), np.eye(3))
    percepts = controller.see("camera_top")
    assert percepts is not None
    assert percepts.stamp == 1_115_000_000


def test_image_from_before_the_history_is_refused(controller: VisionController):
    controller.add_image("camera_top", image(SECOND // 2))
    with pytest.raises(NaoGaitError, match="at the time of the image"):
        controller.see("camera_top")
    assert controller.see("camera_top") is None


def test_history_interpolates_and_knows_its_gaps():
    history = PoseHistory("joints")
    history.add(0, np.zeros(2))
    history.add(10_000_000, np.array((1.0, -2.0)))
    assert history.at(2_500_000) == pytest.approx((0.25, -0.5))
    history.add(SECOND, np.ones(2))
    with pytest.raises(NaoGaitError):
        history.at(SECOND // 2)


def test_joint_that_is_missing_is_named(controller: VisionController):
    with pytest.raises(NaoGaitError, match="HeadYaw"):
        controller.add_joints(SECOND, list(ROBOT.joint_names[1:]), ROBOT.stand_pose[1:])


def test_unknown_camera_is_refused():
    with pytest.raises(NaoGaitError, match="camera_top"):
        VisionController(ROBOT, TABLE, VisionSettings(), ("camera_left",))


def test_table_that_misses_a_class_is_refused(tmp_path: Path):
    table = yaml.safe_load(find("vision", "pitch").read_text(encoding="utf-8"))
    del table["ball"]
    file = tmp_path / "table.yaml"
    file.write_text(yaml.safe_dump(table), encoding="utf-8")
    with pytest.raises(NaoGaitError, match=r"table\.yaml: ball"):
        load_color_table(file)


def test_scene_without_a_field_is_refused(tmp_path: Path):
    file = tmp_path / "empty.yaml"
    file.write_text("robots: []\n", encoding="utf-8")
    with pytest.raises(NaoGaitError, match="field"):
        settings_of_scene(file)


@pytest.mark.parametrize("tint", [(1.0, 1.0, 1.0), (1.12, 1.0, 0.9), (0.9, 1.0, 1.12)])
@pytest.mark.parametrize("brightness", [0.6, 1.0, 1.4])
def test_classes_do_not_depend_on_exposure_and_white_balance(tint: tuple, brightness: float):
    view = camera(-3.0, 0.3, 0.2)
    pixels = picture(view, (-1.8, 0.4), noise=0.0) * np.array(tint) * brightness
    colors = ColorClassifier(TABLE)
    bright = np.clip(pixels, 0, 255).astype(np.uint8)
    colors.adapt(bright, 100)
    classes = colors.classify(colors.balance(bright))
    centre = np.rint(view.project(np.array((-1.8, 0.4, 0.05)))).astype(int)
    assert classes[centre[1], centre[0]] == BALL
    line = np.rint(view.project(np.array((0.0, 0.5, 0.0)))).astype(int)
    assert classes[line[1], line[0]] in (WHITE, FIELD)
    assert (classes[150:] == FIELD).mean() > 0.85
