"""The pinhole model, and where the cameras of the robots look."""

import math
from pathlib import Path

import numpy as np
import pytest

from robot_core.errors import NaoGaitError
from robot_core.robot import load_robot
from robot_core.robot.camera import CameraModel, CameraPose, CameraView, Intrinsics
from robot_core.types import FloatArray

PINHOLE = Intrinsics.from_fov(320, 240, math.radians(60.0))
FORWARD = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""Optical frame of a camera that looks along x, upright, to the frame in which it stands."""


def test_the_angle_of_view_is_that_between_the_edges_of_the_image() -> None:
    middle = PINHOLE.cy
    left, right = PINHOLE.rays(np.array([[-0.5, middle], [319.5, middle]]))
    cosine = left @ right / (np.linalg.norm(left) * np.linalg.norm(right))
    assert math.degrees(math.acos(cosine)) == pytest.approx(60.0)
    assert left == pytest.approx(right * [-1.0, 1.0, 1.0])


def test_rays_lead_back_to_their_pixels() -> None:
    rng = np.random.default_rng(1)
    pixels = rng.uniform((-0.5, -0.5), (319.5, 239.5), (4, 25, 2))
    depth = rng.uniform(0.1, 9.0, (4, 25, 1))
    assert PINHOLE.project(depth * PINHOLE.rays(pixels)) == pytest.approx(pixels)


def test_points_behind_the_camera_are_not_in_the_image() -> None:
    points = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [0.1, 0.0, 0.0], [1.0, 0.0, 1.0]])
    pixels = PINHOLE.project(points)
    assert np.isnan(pixels[1:3]).all()
    assert PINHOLE.contains(pixels).tolist() == [True, False, False, False]


def test_pixels_meet_the_ground_where_the_points_lie() -> None:
    tilt = math.radians(25.0)
    down = np.array(
        [[math.cos(tilt), 0.0, math.sin(tilt)], [0, 1, 0], [-math.sin(tilt), 0.0, math.cos(tilt)]]
    )
    view = CameraView(PINHOLE, CameraPose(np.array([0.2, -0.1, 0.45]), down @ FORWARD))
    points = np.array([[0.9, 0.1, 0.0], [1.5, -0.4, 0.0], [3.0, 0.5, 0.0]])
    pixels = view.project(points)
    assert PINHOLE.contains(pixels).all()
    assert view.on_plane(pixels) == pytest.approx(points)
    assert view.on_plane(view.project(points + [0, 0, 0.05]), 0.05)[:, 2] == pytest.approx(0.05)
    assert np.diff(pixels[:, 1]).max() < 0.0, "what is farther away is higher in the image"
    assert pixels[0, 0] < pixels[1, 0], "what is to the left is to the left"


def test_no_ground_above_the_horizon() -> None:
    view = CameraView(PINHOLE, CameraPose(np.array([0.0, 0.0, 0.45]), FORWARD))
    below, above = view.on_plane(np.array([[160.0, 200.0], [160.0, 40.0]]))
    assert below[2] == pytest.approx(0.0)
    assert np.isnan(above).all()


@pytest.mark.parametrize(
    ("urdf", "cameras"),
    [
        ("nao_h21_v33", {"camera_top": (47.8, 0.0), "camera_bottom": (47.8, 40.0)}),
        ("nao_h21_v40", {"camera_top": (47.8, 1.2), "camera_bottom": (47.8, 39.7)}),
        ("bruno", {"camera_head": (45.0, 0.0), "camera_chest": (95.0, 0.0)}),
    ],
)
def test_cameras_of_the_robots(urdf: str, cameras: dict[str, tuple[float, float]]) -> None:
    """Angle of view and pitch [deg] with the head straight; upright and in the middle."""
    robot = load_robot(urdf)
    assert set(robot.cameras) == set(cameras)
    for name, (hfov, pitch) in cameras.items():
        assert math.degrees(robot.cameras[name].hfov) == pytest.approx(hfov, abs=0.01)
        assert robot.cameras[name].frame == f"{name}_optical_frame"
        position, axes = CameraModel(robot, name, PINHOLE).in_torso(np.zeros(len(robot.lower)))
        right, down, forward = axes.T
        assert right == pytest.approx([0.0, -1.0, 0.0])
        assert down[2] < -0.7
        assert math.degrees(-math.asin(forward[2])) == pytest.approx(pitch, abs=0.01)
        assert position[0] > 0.03
        assert position[1] == pytest.approx(0.0)
        assert position[2] > 0.1


def test_the_head_turns_its_cameras() -> None:
    robot = load_robot()
    model = CameraModel(robot, "camera_top", PINHOLE)
    joints = np.zeros(len(robot.joint_names))
    straight = model.in_torso(joints)
    pan, tilt = 0.6, 0.3
    joints[robot.index("HeadYaw")], joints[robot.index("HeadPitch")] = pan, tilt
    turned = model.in_torso(joints)
    expected = (
        math.cos(tilt) * math.cos(pan),
        math.cos(tilt) * math.sin(pan),
        -math.sin(tilt),
    )
    assert turned.rotation[:, 2] == pytest.approx(expected)
    neck = np.array([0.0, 0.0, 0.1265])
    size: FloatArray = np.linalg.norm([turned.position - neck, straight.position - neck], axis=1)
    assert size[0] == pytest.approx(size[1])


def test_a_waist_moves_the_chest_camera_in_the_torso_frame() -> None:
    """Bruno's gait calls the hip frame torso; the chest is above the waist joint."""
    robot = load_robot("bruno")
    model = CameraModel(robot, "camera_chest", PINHOLE)
    joints = np.zeros(len(robot.joint_names))
    joints[robot.index("WaistPitch")] = 0.2
    assert math.asin(-model.in_torso(joints).rotation[2, 2]) == pytest.approx(0.2)


def test_the_view_follows_the_torso() -> None:
    robot = load_robot()
    model = CameraModel(robot, "camera_bottom", PINHOLE)
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    torso = np.array([2.0, 1.0, 0.33])
    in_torso = model.in_torso(robot.stand_pose)
    position, rotation = model.view(robot.stand_pose, torso, quarter).pose
    x, y, z = in_torso.position
    assert position == pytest.approx(torso + [-y, x, z])
    assert rotation.T @ quarter @ in_torso.rotation == pytest.approx(np.eye(3))


def test_a_model_without_a_frame_lacks_that_camera(tmp_path: Path) -> None:
    text = load_robot().urdf.replace("camera_top_optical_frame", "CameraTop_optical_frame")
    path = tmp_path / "other.urdf"
    path.write_text(text.replace("camera_bottom_optical_frame", "below"), encoding="utf-8")
    cameras = load_robot(path).cameras
    assert {name: camera.frame for name, camera in cameras.items()} == {
        "camera_top": "CameraTop_optical_frame"
    }


def test_an_unknown_camera_is_refused() -> None:
    with pytest.raises(NaoGaitError, match=r"camera: got 'camera_chest'; .*camera_top"):
        CameraModel(load_robot(), "camera_chest", PINHOLE)
