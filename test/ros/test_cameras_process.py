"""`sim_bridge` with cameras: images and their `CameraInfo` over ROS."""

import numpy as np
import pytest
from sensor_msgs.msg import CameraInfo, Image

from robot_core.robot import load_robot
from robot_core.robot.camera import Intrinsics
from ros_probe import Probe, stamp


@pytest.mark.parametrize(("engine", "name"), [("pybullet", ""), ("mujoco", "red1")])
def test_images_and_their_camera_info(probe: Probe, engine: str, name: str):
    """A robot alone, and one of a scene; the other cameras of the scene are not rendered."""
    pytest.importorskip(engine)
    below = f"/{name}/" if name else "/"
    scene = {"scene": "pitch_small"} if name else {}
    images = probe.subscribe(Image, f"{below}camera_bottom/image_raw")
    infos = probe.subscribe(CameraInfo, f"{below}camera_bottom/camera_info")
    bridge = probe.start(
        "sim_bridge",
        engine=engine,
        cameras=True,
        camera_rate=20.0,
        camera_width=64,
        camera_height=48,
        real_time_factor=0.25,  # few images for a test that is held up
        **scene,
    )
    probe.wait(
        lambda: (len(images) > 3 and len(infos) > 3) or bridge.status is not None, "images"
    )
    if bridge.status is not None and bridge.says("cameras: got"):
        pytest.skip("no images here")
    assert (images[0].encoding, images[0].width, images[0].height) == ("rgb8", 64, 48)
    assert images[0].step == 192
    assert images[0].header.frame_id == "camera_bottom_optical_frame"
    pixels = np.array(images[-1].data, dtype=np.uint8).reshape(48, 64, 3)
    assert pixels.std() > 2.0
    stamps = [stamp(image) for image in images]
    assert set(np.diff(stamps).tolist()) == {50_000_000}
    assert set(stamps) >= {stamp(info) for info in infos[:3]}
    pinhole = Intrinsics.from_fov(64, 48, load_robot().cameras["camera_bottom"].hfov)
    info = infos[0]
    assert info.header.frame_id == images[0].header.frame_id
    assert info.k.tolist() == [pinhole.fx, 0, pinhole.cx, 0, pinhole.fy, pinhole.cy, 0, 0, 1]
    assert info.p.tolist() == [*info.k[:3], 0, *info.k[3:6], 0, *info.k[6:], 0]
    assert list(info.d) == [0.0] * 5


def test_what_cameras_need_is_one_line(probe: Probe):
    pytest.importorskip("mujoco")
    bridge = probe.start("sim_bridge", engine="mujoco", cameras=True, camera_width=4)
    assert bridge.wait() != 0
    assert bridge.says(r"camera_width: got 4; allowed: .*16")
    assert "Traceback" not in bridge.log
