"""The cameras of one robot as topics."""

import array

from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import CameraInfo, Image

from robot_core.robot.camera import Intrinsics
from robot_core.ros.messages import to_time
from sim_bridge.cameras.camera import CameraImage, SimulatedCamera

_QOS = QoSProfile(depth=5, reliability=ReliabilityPolicy.RELIABLE)


class CameraTopics:
    """Image and `CameraInfo` of one camera.

    Images that nobody listens to are not rendered.
    """

    def __init__(self, node: Node, camera: SimulatedCamera, below: str = "") -> None:
        """Make the publishers.

        Args:
            node: The bridge.
            camera: The camera.
            below: Prefix of the topics: empty, or the robot's name and a slash.
        """
        self._camera = camera
        name = f"{below}{camera.name}"
        self._images = node.create_publisher(Image, f"{name}/image_raw", _QOS)
        self._infos = node.create_publisher(CameraInfo, f"{name}/camera_info", _QOS)
        self._info = camera_info(camera.model.intrinsics)
        self._image = Image(
            height=self._info.height,
            width=self._info.width,
            encoding="rgb8",
            is_bigendian=0,
            step=3 * self._info.width,
        )
        self._info.header.frame_id = self._image.header.frame_id = camera.model.frame
        self._sent: CameraImage | None = None
        camera.enabled = False

    def publish(self, now: int) -> None:
        """Publish the image that can be used at `now` [ns], if it is a new one."""
        listeners = self._images.get_subscription_count() + self._infos.get_subscription_count()
        self._camera.enabled = listeners > 0
        image = self._camera.newest(now)
        if image is None or image is self._sent:
            return
        self._sent = image
        self._image.header.stamp = self._info.header.stamp = to_time(image.stamp)
        self._image.data = array.array("B", image.pixels.tobytes())
        self._infos.publish(self._info)
        self._images.publish(self._image)


def camera_info(pinhole: Intrinsics) -> CameraInfo:
    """A pinhole without distortion."""
    fx, fy, cx, cy = pinhole.fx, pinhole.fy, pinhole.cx, pinhole.cy
    return CameraInfo(
        height=pinhole.height,
        width=pinhole.width,
        distortion_model="plumb_bob",
        d=[0.0] * 5,
        k=[fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
        r=[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        p=[fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
    )
