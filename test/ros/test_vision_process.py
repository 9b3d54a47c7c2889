"""`vision` as a process: percepts of rendered images, and what it does with unusable messages."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

pytest.importorskip("cv2")

from geometry_msgs.msg import PoseArray, PoseStamped, PoseWithCovarianceStamped
from sensor_msgs.msg import CameraInfo, Image, JointState

from pitch_image import picture
from robot_core.resources import find
from robot_core.robot import load_robot
from robot_core.robot.camera import CameraModel, Intrinsics
from ros_probe import Probe, set_stamp, stamp

ROBOT = load_robot()
TORSO = np.array((0.0, 0.0, 0.33))
PINHOLE = Intrinsics.from_fov(320, 240, ROBOT.cameras["camera_top"].hfov)
BALL = (1.8, 0.3)
SMALL = bytes(960 * 120)
MS = 1_000_000
SETTLED = 1_000 * MS
"""[ns] The gait knows the tilt of the torso from then on."""


def test_the_ball_of_a_rendered_image_arrives_with_its_stamp(probe: Probe, tmp_path: Path):
    pytest.importorskip("mujoco")
    scene = {
        "field": {},
        "goals": {},
        "ball": {"x": -3.0 + BALL[0], "y": 0.5 + BALL[1]},
        "robots": [
            {"name": "red1", "team": "red", "number": 1, "urdf": "nao_h21_v33",
             "pose": [-3.0, 0.5, 0.0]},
        ],
    }  # fmt: skip
    path = tmp_path / "alone.yaml"
    path.write_text(yaml.safe_dump(scene))
    below = ("--ros-args", "-r", "__ns:=/red1")
    infos = probe.subscribe(CameraInfo, "/red1/camera_top/camera_info")
    balls = probe.subscribe(PoseWithCovarianceStamped, "/red1/vision/ball")
    bridge = probe.start(
        "sim_bridge",
        engine="mujoco",
        scene=path,
        cameras=True,
        camera_rate=5.0,
        lockstep=True,
        real_time_factor=0.0,
    )
    probe.start("gait", *below)
    probe.start("vision", *below, cameras="camera_top", scene=path)

    def of_an_image() -> list[PoseWithCovarianceStamped]:
        """Balls that bear the stamp of an image, once the gait's estimate of the torso settled."""
        images = {stamp(info) for info in infos}
        return [ball for ball in balls if stamp(ball) in images and stamp(ball) > SETTLED]

    probe.wait(lambda: of_an_image() or bridge.status is not None, "the ball of an image")
    if bridge.status is not None and bridge.says("cameras: got"):
        pytest.skip("no images here")
    ball = of_an_image()[-1]
    assert ball.header.frame_id == "base_footprint"
    place = ball.pose.pose.position
    assert math.dist((place.x, place.y), BALL) < 0.06 * math.hypot(*BALL)
    variances = np.array(ball.pose.covariance).reshape(6, 6).diagonal()[:2]
    assert (variances > 0.0).all()


class Body:
    """A robot that stands still and looks at the ball: what the bridge and the gait would send."""

    def __init__(self, probe: Probe) -> None:
        self._model = CameraModel(ROBOT, "camera_top", PINHOLE)
        self._joints = probe.publisher(JointState, "joint_states")
        self._torso = probe.publisher(PoseStamped, "gait/torso_pose")
        self._info = probe.publisher(CameraInfo, "camera_top/camera_info")
        self._image = probe.publisher(Image, "camera_top/image_raw")
        view = self._model.view(ROBOT.stand_pose, TORSO, np.eye(3))
        self._pixels = picture(view, BALL)

    def move(self, now: int) -> None:
        """Joints and torso of the 20 ms until `now` [ns]."""
        for tick in (now - 20 * MS, now - 10 * MS, now):
            position = [float(angle) for angle in ROBOT.stand_pose]
            joints = JointState(name=list(ROBOT.joint_names), position=position)
            self._joints.publish(set_stamp(joints, tick))
            torso = set_stamp(PoseStamped(), tick)
            torso.pose.position.z = float(TORSO[2])
            torso.pose.orientation.w = 1.0
            self._torso.publish(torso)

    def introduce(self) -> None:
        """Publish `camera_info`."""
        pinhole = PINHOLE
        k = [pinhole.fx, 0.0, pinhole.cx, 0.0, pinhole.fy, pinhole.cy, 0.0, 0.0, 1.0]
        self._info.publish(CameraInfo(width=pinhole.width, height=pinhole.height, k=k))

    def show(self, now: int, **changes: Any) -> None:
        """Publish an image with some fields replaced."""
        fields = {"width": 320, "height": 240, "encoding": "rgb8", "step": 960,
                  "data": self._pixels.tobytes(), **changes}  # fmt: skip
        self._image.publish(set_stamp(Image(**fields), now))


def test_what_cannot_be_used_is_one_line_and_the_next_image_is_seen(probe: Probe):
    balls = probe.subscribe(PoseWithCovarianceStamped, "vision/ball")
    robots = probe.subscribe(PoseArray, "vision/robots")
    vision = probe.start("vision", cameras="camera_top")
    body = Body(probe)
    now = 1_000 * MS

    def refused(reason: str, what: Any) -> None:
        """Repeat until the log has the reason: discovery may lose messages."""
        probe.wait(lambda: vision.says(reason), f"refusal {reason}", every=what)

    refused("image_raw: got 'no camera_info'; allowed: camera_top/camera_info before the first",
            lambda: body.show(now))  # fmt: skip

    def seen(after: int) -> int:
        """The time of an image with the ball."""
        time = after

        def again() -> None:
            nonlocal time
            time += 100 * MS
            body.introduce()
            body.move(time)
            body.show(time)

        probe.wait(lambda: balls and stamp(balls[-1]) > after, "the ball", every=again)
        return time

    for reason, changes in (
        ("image_raw size: got '160 x 120'", {"width": 160, "height": 120, "data": SMALL}),
        ("image_raw encoding: got 'mono8'; allowed: one of rgb8", {"encoding": "mono8"}),
        ("image_raw data: got '3 bytes'", {"data": b"123"}),
    ):
        now = seen(now) + 100 * MS
        refused(reason, lambda now=now, changes=changes: body.show(now, **changes))
    now = seen(now)
    refused(r"at the time of the image: got '0.100 s'; allowed: .* s, without gaps",
            lambda: body.show(100 * MS))  # fmt: skip
    seen(now)
    place = balls[-1].pose.pose.position
    assert (place.x, place.y) == pytest.approx(BALL, abs=0.05)
    assert robots[-1].header.frame_id == "base_footprint"
    assert "Traceback" not in vision.log
    warnings = [line for line in vision.log.splitlines() if "WARN" in line]
    assert len(warnings) <= 10, "a repeated warning is held back"


@pytest.mark.parametrize(
    ("parameter", "reason"),
    [
        ("colors", r"colors: colour table .*no_ball\.yaml: ball: got 'nothing'"),
        ("scene", "scene: scene .*: field: got 'nothing'; allowed: a scene with a field"),
        ("cameras", "cameras: got 'camera_left'; allowed: one of camera_top"),
    ],
)
def test_a_parameter_that_cannot_be_used_is_one_line(
    probe: Probe, tmp_path: Path, parameter: str, reason: str
):
    table = yaml.safe_load(find("vision", "pitch").read_text(encoding="utf-8"))
    del table["ball"]
    (tmp_path / "no_ball.yaml").write_text(yaml.safe_dump(table))
    (tmp_path / "no_field.yaml").write_text("robots: []\n")
    value = {"colors": tmp_path / "no_ball.yaml", "scene": tmp_path / "no_field.yaml",
             "cameras": "camera_left"}[parameter]  # fmt: skip
    vision = probe.start("vision", **{parameter: value})
    assert vision.wait() == 2
    assert vision.says(reason), vision.log
    assert len(vision.log.strip().splitlines()) == 1
