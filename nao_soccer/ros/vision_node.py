"""Vision as a ROS 2 node: converts messages and publishes what `VisionController` returns."""

from collections.abc import Callable
from functools import partial
from typing import Any

from geometry_msgs.msg import PoseArray, PoseStamped, PoseWithCovarianceStamped
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import CameraInfo, Image, JointState, PointCloud2

from nao_soccer.ros import vision_messages as convert
from nao_soccer.vision.colors import load_color_table
from nao_soccer.vision.controller import VisionController
from nao_soccer.vision.percepts import CROSSINGS, ROBOTS, Kind, Percepts
from nao_soccer.vision.settings import settings_of_scene
from robot_core.ros.lockstep import LockstepPartner
from robot_core.ros.messages import stamp_in, with_prefix
from robot_core.ros.parameters import (
    FRAME_PREFIX,
    ROBOT,
    URDF,
    declare,
    load_parameter_file,
    load_robot_parameter,
    node_parameter,
    warn_of_unknown_overrides,
)
from robot_core.ros.topics import Inputs, watch_senders
from robot_core.schema import Field, Text

RAW = "image_raw"
SCENE = node_parameter("scene", "pitch", "field, goals and ball: a shipped scene or a YAML file")
COLORS = node_parameter("colors", "pitch", "colour classes: a shipped table or a YAML file")
CAMERAS = node_parameter("cameras", "", "names of the cameras, with commas; empty = all")
IMAGES = Field(
    "images", RAW,
    Text(pattern=r"[A-Za-z]\w*(/[A-Za-z]\w*)*", description="a topic without / before it"),
    "topic of the images below each camera: of rectified ones image_rect",
)  # fmt: skip
NODE_PARAMETERS = (URDF, ROBOT, SCENE, COLORS, CAMERAS, IMAGES, FRAME_PREFIX)


class VisionNode(Node):
    """Each image leads to one message on every topic; nothing is remembered between two images."""

    def __init__(self) -> None:
        super().__init__("vision", automatically_declare_parameters_from_overrides=True)
        robot = load_robot_parameter(self)
        settings = load_parameter_file(self, SCENE, settings_of_scene)
        table = load_parameter_file(self, COLORS, load_color_table)
        names = tuple(name.strip() for name in declare(self, CAMERAS).split(",") if name)
        self._radius = settings.ball_radius
        self._images: str = declare(self, IMAGES)
        self._prefix: str = declare(self, FRAME_PREFIX)
        self._controller = VisionController(robot, table, settings, names or None, self._images)
        self._inputs = Inputs(self, burst=1)
        self._make_publishers()
        self._make_subscriptions()
        # Images wait for the joints and the torso pose of their time.
        LockstepPartner(self, self.get_fully_qualified_name().lstrip("/")).keep_up()
        warn_of_unknown_overrides(self, (p.name for p in NODE_PARAMETERS))
        watch_senders(self)
        self.get_logger().info(
            f"{robot.name}; waiting for images of {', '.join(self._controller.cameras)}"
        )

    def _make_publishers(self) -> None:
        make = self.create_publisher
        self._ball = make(PoseWithCovarianceStamped, "vision/ball", 10)
        self._lines = make(PointCloud2, "vision/lines", 10)
        self._percepts = make(PointCloud2, "vision/percepts", 10)
        self._arrays = [
            (make(PoseArray, f"vision/{topic}", 10), kinds)
            for topic, kinds in (
                ("goal_posts", (Kind.GOAL_POST,)),
                ("poles", (Kind.POLE,)),
                ("robots", ROBOTS),
                ("crossings", CROSSINGS),
            )
        ]
        self._debug = make(Image, "vision/debug", 2)

    def _make_subscriptions(self) -> None:
        self._subscribe(JointState, "joint_states", self._on_joints)
        self._subscribe(PoseStamped, "gait/torso_pose", self._on_torso)
        for name in self._controller.cameras:
            self._subscribe(CameraInfo, f"{name}/camera_info", partial(self._on_info, name))
            self._subscribe(Image, f"{name}/{self._images}", partial(self._on_image, name))

    def _subscribe(self, kind: type, topic: str, receive: Callable[[Any], None]) -> None:
        self._inputs.subscribe(kind, topic, partial(self._serve, receive), qos_profile_sensor_data)

    # -- messages ----------------------------------------------------------------------------------

    def _serve(self, receive: Callable[[Any], None], message: Any) -> None:
        """Take a message; then see the images whose joints and torso pose are there."""
        receive(message)
        for camera in self._controller.cameras:
            percepts = self._controller.see(camera)
            if percepts is not None:
                self._publish(camera, percepts)

    def _on_joints(self, message: JointState) -> None:
        stamp = stamp_in(message.header, "joint_states")
        self._controller.add_joints(stamp, message.name, message.position)

    def _on_torso(self, message: PoseStamped) -> None:
        self._controller.add_torso(*convert.torso_pose(message))

    def _on_info(self, camera: str, message: CameraInfo) -> None:
        topic = f"{camera}/camera_info"
        intrinsics = convert.intrinsics(message, topic, rectified=self._images != RAW)
        self._controller.set_camera(camera, intrinsics)

    def _on_image(self, camera: str, message: Image) -> None:
        self._controller.add_image(camera, convert.image_input(message, f"{camera}/{self._images}"))

    def _publish(self, camera: str, percepts: Percepts) -> None:
        framed = partial(with_prefix, self._prefix)
        if percepts.ball is not None:
            self._ball.publish(framed(convert.ball(percepts, percepts.ball, self._radius)))
        self._lines.publish(framed(convert.lines(percepts)))
        self._percepts.publish(framed(convert.percept_cloud(percepts)))
        for publisher, kinds in self._arrays:
            publisher.publish(framed(convert.poses(percepts, percepts.of(*kinds))))
        if self._debug.get_subscription_count():
            picture = self._controller.debug_image(camera, percepts)
            if picture is not None:
                self._debug.publish(framed(convert.debug(percepts, picture, camera)))
