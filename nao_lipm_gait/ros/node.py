"""The gait as a ROS 2 node: converts messages, checks them, and leaves the walking to `Gait`."""

import time
from collections.abc import Callable
from functools import partial
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PointStamped, Twist, TwistStamped, WrenchStamped
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from rclpy.subscription import Subscription
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.gait import ON_THE_WAY
from nao_lipm_gait.head.goals import Goal
from nao_lipm_gait.motion.library import library_of
from nao_lipm_gait.parameters import BY_NAME, PARAMETERS, GaitParameters
from nao_lipm_gait.presets import preset_for
from nao_lipm_gait.robot import load_robot
from nao_lipm_gait.ros.diagnostics import diagnostics
from nao_lipm_gait.ros.messages import (
    COMMAND_WRITERS,
    StatusWriter,
    footsteps,
    imu_input,
    joint_input,
    load_input,
    support_text,
    twist_input,
)
from nao_lipm_gait.ros.parameters import (
    NodeParameter,
    accepted,
    as_mapping,
    declare,
    of_type,
    refused,
    unknown_overrides,
    used_as,
)
from nao_lipm_gait.runtime.controller import GaitController, Settings
from nao_lipm_gait.runtime.diagnostics import Level, Others
from nao_lipm_gait.runtime.garbage import GarbageKeeper
from nao_lipm_gait.runtime.head_input import head_angles, head_follow, head_mode, head_point
from nao_lipm_gait.runtime.inputs import Input
from nao_lipm_gait.runtime.warm_up import warm_up
from nao_lipm_gait.types import GaitStatus, JointTargets

URDF = NodeParameter("urdf", "nao_h21_v33", "robot model: a shipped name or a URDF file")
PRESET = NodeParameter(
    "preset", "default", "gait parameters: a shipped name (default: the robot's own) or a YAML file"
)
CONTROL_PERIOD = NodeParameter(
    "control_period", 0.01, "distance of two joint states", "s", 0.002, 0.05
)
STAMPED = NodeParameter("enable_stamped_cmd_vel", False, "cmd_vel is a TwistStamped, not a Twist")
TIMEOUT = NodeParameter(
    "cmd_vel_timeout", 0.5, "a velocity command older than this means stop", "s", 0.05, 1e4
)
INTERFACE = NodeParameter(
    "command_interface",
    "joint_state",
    "message type of joint_command",
    choices=tuple(COMMAND_WRITERS),
)
MOTIONS = NodeParameter(
    "motions", "", "folder of motion files; empty = those that are shipped for this robot"
)
NODE_PARAMETERS = (URDF, PRESET, MOTIONS, CONTROL_PERIOD, STAMPED, TIMEOUT, INTERFACE)

WATCHDOG_PERIOD = 0.25
MARKER_TICKS = 10
"""Footsteps are drawn with every support change and every so many ticks."""

_LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class GaitNode(Node):
    """Each joint state drives one tick; timers are only for the watchdog and the diagnostics."""

    def __init__(self) -> None:
        super().__init__("gait", automatically_declare_parameters_from_overrides=True)
        text = partial(of_type, kind=str)
        self._robot = used_as(URDF, load_robot, text(declare(self, URDF)))
        preset = used_as(
            PRESET, partial(preset_for, self._robot), text(declare(self, PRESET))
        )
        motions = used_as(MOTIONS, partial(library_of, self._robot), text(declare(self, MOTIONS)))
        period = of_type(declare(self, CONTROL_PERIOD), float)
        stamped = of_type(declare(self, STAMPED), bool)
        timeout = of_type(declare(self, TIMEOUT), float)
        interface = text(declare(self, INTERFACE))
        parameters = self._declare_table(preset)
        settings = Settings(period, timeout)
        warm_up(self._robot, parameters, settings)
        self._entry = GaitController(
            self._robot, parameters, settings, self, time.monotonic, motions
        )
        self._garbage = GarbageKeeper()
        self._loads: list[Subscription] = []
        self._support = ""
        self._step_count = -1
        self._tick_count = 0

        self._command_writer = COMMAND_WRITERS[interface](self._robot.joint_names, period)
        self._status_writer = StatusWriter()
        self._make_publishers()
        self._make_subscriptions(stamped)
        known = frozenset({p.name for p in NODE_PARAMETERS} | set(BY_NAME))
        for name in unknown_overrides(self, known):
            self.get_logger().warning(
                f"parameter {name}: unknown and ignored; see `ros2 param list`"
            )
        self.get_logger().info(
            f"{self._robot.name} from {self._robot.urdf_path}; waiting for joint_states, imu/data"
        )

    # -- making ------------------------------------------------------------------------------------

    def _declare_table(self, preset: GaitParameters) -> GaitParameters:
        defaults = preset.as_dict()
        values = {
            parameter.name: declare(self, parameter, defaults[parameter.name], read_only=False)
            for parameter in PARAMETERS
        }
        self.add_on_set_parameters_callback(self._check_parameters)
        self.add_post_set_parameters_callback(self._apply_parameters)
        return GaitParameters.from_mapping(values)

    def _make_publishers(self) -> None:
        self._command = self.create_publisher(
            self._command_writer.message_type, "joint_command", 10
        )
        self._odom = self.create_publisher(Odometry, "odom", 10)
        self._diagnostics = self.create_publisher(DiagnosticArray, "diagnostics", 10)
        self._com_expected = self.create_publisher(PointStamped, "~/com_expected", 10)
        self._com_measured = self.create_publisher(PointStamped, "~/com_measured", 10)
        self._com_estimated = self.create_publisher(PointStamped, "~/com_estimated", 10)
        self._support_topic = self.create_publisher(String, "~/support", _LATCHED)
        self._footsteps = self.create_publisher(MarkerArray, "~/footsteps", 10)
        self._transforms = _make_transform_broadcaster(self)

    def _make_subscriptions(self, stamped: bool) -> None:
        # In this order the executor serves what is ready at the same time: IMU before joints.
        kind = TwistStamped if stamped else Twist
        self._drivers = self._subscribe(kind, "cmd_vel", twist_input, 10)
        self._subscribe(Imu, "imu/data", imu_input, qos_profile_sensor_data)
        self._sensors = self._subscribe(
            JointState, "joint_states", joint_input, qos_profile_sensor_data
        )
        self.create_subscription(String, "~/motion", self._on_motion, 10)
        self._listen_for_the_head()
        self.create_service(Trigger, "~/stand", self._on_stand)
        self.create_service(Trigger, "~/get_up", self._on_get_up)
        self.create_service(Trigger, "~/relax", self._on_relax)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        fenced, watch = self._entry.fenced, self._entry.watch
        self.create_timer(1.0, partial(fenced, "diagnostics", self._diagnose), clock=steady)
        self.create_timer(WATCHDOG_PERIOD, partial(fenced, "watchdog", watch), clock=steady)

    def _subscribe(
        self, kind: type, topic: str, read: Callable[[Any], Input], qos: Any
    ) -> Subscription:
        return self.create_subscription(
            kind, topic, lambda message: self._receive(topic, partial(read, message)), qos
        )

    def _receive(self, topic: str, make: Callable[[], Input]) -> None:
        self._entry.receive(topic, make)
        self._garbage.after_tick(resting=self._entry.state not in ON_THE_WAY)

    # -- what the entry lets out -------------------------------------------------------------------

    def command(self, targets: JointTargets) -> None:
        self._command.publish(self._command_writer.write(targets))
        if self._entry.wants_loads != bool(self._loads):
            self._listen_to_soles(self._entry.wants_loads)

    def _listen_to_soles(self, listen: bool) -> None:
        """Two more messages per tick are only paid for while there is no IMU."""
        while self._loads:
            self.destroy_subscription(self._loads.pop())
        if listen:
            self._loads = [
                self._subscribe(
                    WrenchStamped, f"{frame}/wrench", partial(load_input, side),
                    qos_profile_sensor_data,
                )
                for side, frame in enumerate(self._robot.sole_frames)
            ]  # fmt: skip

    def log(self, level: Level, text: str) -> None:
        logger = self.get_logger()
        # One call each: rclpy wants one severity per place in the source.
        if level >= Level.ERROR:
            logger.error(text)
        else:
            logger.warning(text)

    def status(self, status: GaitStatus) -> None:
        writer = self._status_writer
        self._odom.publish(writer.odometry(status))
        if self._transforms is not None:
            self._transforms.sendTransform(writer.transform(status))
        for publisher, point in (
            (self._com_expected, status.com_expected_in_q),
            (self._com_measured, status.com_measured_in_q),
            (self._com_estimated, status.com_estimated_in_q),
        ):
            publisher.publish(writer.point_in_q(point, status.stamp))
        support = support_text(status)
        if support != self._support:
            self._support = support
            self._support_topic.publish(String(data=support))
        self._tick_count += 1
        if status.step_count != self._step_count or self._tick_count >= MARKER_TICKS:
            self._step_count = status.step_count
            self._tick_count = 0
            if self._footsteps.get_subscription_count():
                self._footsteps.publish(footsteps(status))

    # -- services and parameters -------------------------------------------------------------------

    def _on_stand(self, _request: Any, response: Trigger.Response) -> Trigger.Response:
        response.success, response.message = True, self._entry.stand()
        return response

    def _on_relax(self, _request: Any, response: Trigger.Response) -> Trigger.Response:
        response.success, response.message = True, self._entry.relax()
        return response

    def _on_motion(self, message: String) -> None:
        self._entry.fenced("~/motion", partial(self._entry.request_motion, message.data))

    def _listen_for_the_head(self) -> None:
        robot = self._robot

        def on(kind: type, topic: str, goal: Callable[[Any], Goal | None]) -> None:
            def receive(message: Any) -> None:
                self._entry.fenced(topic, lambda: self._entry.look(goal(message)))

            self.create_subscription(kind, topic, receive, 10)

        on(JointState, "~/head", lambda m: head_angles(m.name, m.position, robot))
        on(String, "~/head_mode", lambda m: head_mode(m.data))
        on(PointStamped, "~/look_at", lambda m: head_point(
            "~/look_at", (m.point.x, m.point.y, m.point.z), m.header.frame_id, robot
        ))  # fmt: skip
        on(PointStamped, "~/follow", lambda m: head_follow(
            (m.point.x, m.point.y, m.point.z), m.header.frame_id, robot
        ))  # fmt: skip

    def _on_get_up(self, _request: Any, response: Trigger.Response) -> Trigger.Response:
        try:
            response.success, response.message = True, self._entry.get_up()
        except NaoGaitError as error:
            response.success, response.message = False, str(error)
        return response

    def _check_parameters(self, parameters: list[RosParameter]) -> SetParametersResult:
        """All or none: the reason names parameter, value and what is allowed."""
        try:
            self._entry.with_changes(as_mapping(parameters))
        except NaoGaitError as error:
            return refused(error)
        return accepted()

    def _apply_parameters(self, parameters: list[RosParameter]) -> None:
        self._entry.change_parameters(as_mapping(parameters))

    # -- watching ----------------------------------------------------------------------------------

    def _diagnose(self) -> None:
        self._entry.see_others(
            Others(
                cmd_vel=self.count_publishers(self._drivers.topic_name),
                joint_states=self.count_publishers(self._sensors.topic_name),
                joint_command=self.count_publishers(self._command.topic_name),
            )
        )
        self._diagnostics.publish(
            diagnostics(self.get_name(), self._robot.name, self._entry.health())
        )


def _make_transform_broadcaster(node: Node) -> Any:
    """A TF broadcaster, or None where tf2_ros is not installed (PyPI has no wheel of it)."""
    try:
        from tf2_ros import TransformBroadcaster
    except ImportError:
        return None
    return TransformBroadcaster(node)
