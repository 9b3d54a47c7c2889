"""The gait as a ROS 2 node: converts messages and publishes what `GaitController` returns."""

import time
from collections.abc import Callable
from functools import partial
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PointStamped, PoseStamped, Twist, TwistStamped, WrenchStamped
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import SetParametersResult
from rclpy.callback_groups import CallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter
from rclpy.qos import qos_profile_sensor_data
from rclpy.subscription import Subscription
from sensor_msgs.msg import Imu, JointState, Temperature
from std_msgs.msg import Bool, Float32, String
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

from nao_lipm_gait.calibration_file import calibration_of
from nao_lipm_gait.frame_check import PERIOD
from nao_lipm_gait.parameters import BY_NAME, PARAMETERS, GaitParameters
from nao_lipm_gait.presets import preset_for
from nao_lipm_gait.ros.messages import (
    COMMAND_WRITERS,
    StatusWriter,
    footsteps,
    imu_input,
    joint_input,
    kick_of,
    load_input,
    support_text,
    temperature_input,
    twist_input,
)
from nao_lipm_gait.ros.overdue_timer import OverdueTimer
from nao_lipm_gait.ros.sampled_group import NEWEST, SampledGroup
from nao_lipm_gait.runtime.commands import LONGEST_BIAS_WAIT
from nao_lipm_gait.runtime.controller import ControllerSettings, GaitController, Output
from nao_lipm_gait.runtime.inputs import Input, head_angles, head_follow, head_mode, head_point
from nao_lipm_gait.runtime.latency import GarbageScheduler, warm_up
from nao_lipm_gait.runtime.reporter import PublisherCounts
from robot_core.errors import NaoGaitError
from robot_core.head_goals import Goal
from robot_core.motion.library import library_of
from robot_core.ros.messages import diagnostic_array
from robot_core.ros.parameters import (
    FRAME_PREFIX,
    ROBOT,
    URDF,
    accepted,
    as_mapping,
    declare,
    keep_types,
    load_parameter_file,
    load_robot_parameter,
    node_parameter,
    refused,
    set_in_turns,
    warn_of_unknown_overrides,
)
from robot_core.ros.topics import (
    LATCHED,
    MOTORS,
    RELIABLE,
    publisher,
    subscription,
    transform_broadcaster,
    unheard_senders,
    write_log,
)
from robot_core.types import BUSY, GaitStatus, Pose6

PRESET = node_parameter(
    "preset", "default", "gait parameters: a shipped name (default: the robot's own) or a YAML file"
)
CONTROL_PERIOD = node_parameter(
    "control_period", 0.01, "time between two joint states", "s", PERIOD.minimum, PERIOD.maximum
)
STAMPED = node_parameter("enable_stamped_cmd_vel", False, "cmd_vel is a TwistStamped, not a Twist")
TIMEOUT = node_parameter(
    "cmd_vel_timeout", 0.5, "a velocity command older than this means stop", "s", 0.05, 1e4
)
INTERFACE = node_parameter(
    "command_interface",
    "joint_state",
    "message type of joint_command",
    choices=tuple(COMMAND_WRITERS),
)
MOTIONS = node_parameter(
    "motions", "", "folder of motion files; empty = those that are shipped for this robot"
)
CALIBRATION = node_parameter(
    "calibration", "", "calibration file of this robot, by `nao_gait calibrate`; empty = none"
)
BIAS_WAIT = node_parameter(
    "bias_wait", LONGEST_BIAS_WAIT,
    "longest stand until the gyro's bias is known, before the first walk", "s", 0.0, 60.0,
)  # fmt: skip
HOT_SPEED = node_parameter(
    "hot_speed", 1.0, "factor on the commanded velocity while a motor is hot", "", 0.0, 1.0
)
SENSOR_AGE = node_parameter(
    "sensor_age", False,
    "measure the age of the sensors by the clock of this node; not where a simulator waits for it",
)
COAST = node_parameter(
    "coast", False,
    "walk on for a few control periods whose sensors are lost; not where a simulator waits for it",
)
NODE_PARAMETERS = (
    URDF, ROBOT, PRESET, MOTIONS, CALIBRATION, CONTROL_PERIOD, STAMPED, TIMEOUT, INTERFACE,
    BIAS_WAIT, HOT_SPEED, SENSOR_AGE, COAST, FRAME_PREFIX,
)  # fmt: skip

WATCHDOG_PERIOD = 0.25
"""[s]"""
LOAD_TICKS = 4
"""Of the wrenches of the soles one in so many is taken; each costs as much as a tenth of a tick."""
MARKER_TICKS = 10
"""Footsteps are published with every support change and every so many ticks."""


class GaitNode(Node):
    """Each joint state leads to one tick; timers only watch and report.

    Args:
        times_arrival: The middleware says when a joint state arrived; without, it arrived when it
            is served.
    """

    def __init__(self, *, times_arrival: bool = True) -> None:
        super().__init__("gait", automatically_declare_parameters_from_overrides=True)
        self._robot = load_robot_parameter(self)
        preset = load_parameter_file(self, PRESET, partial(preset_for, self._robot))
        motions = load_parameter_file(self, MOTIONS, partial(library_of, self._robot))
        calibration_of_robot = partial(calibration_of, self._robot)
        calibration = load_parameter_file(self, CALIBRATION, calibration_of_robot)
        period = declare(self, CONTROL_PERIOD)
        stamped = declare(self, STAMPED)
        timeout = declare(self, TIMEOUT)
        bias_wait = declare(self, BIAS_WAIT)
        hot_speed = declare(self, HOT_SPEED)
        self._measures_age: bool = declare(self, SENSOR_AGE)
        coasts = declare(self, COAST)
        interface = declare(self, INTERFACE)
        self._prefix: str = declare(self, FRAME_PREFIX)
        parameters = self._declare_gait_parameters(preset)
        warm_up(self._robot, parameters, ControllerSettings(period, timeout))
        settings = ControllerSettings(period, timeout, bias_wait=bias_wait, hot_speed=hot_speed)
        self._controller = GaitController(
            self._robot, parameters, settings, time.monotonic, motions, calibration
        )
        self._garbage = GarbageScheduler()
        self._times_arrival = times_arrival
        self._loads: list[Subscription] = []
        self._load_group = SampledGroup(LOAD_TICKS)
        self._support = ""
        self._step_count = -1
        self._tick_count = 0

        self._command_writer = COMMAND_WRITERS[interface](self._robot.joint_names, period)
        self._status_writer = StatusWriter(self._robot.base_frame, self._prefix)
        self._make_publishers()
        self._stamped = stamped
        self._make_subscriptions()
        self._make_services()
        self._overdue = OverdueTimer(self, period, self._walk_on) if coasts else None
        warn_of_unknown_overrides(self, {p.name for p in NODE_PARAMETERS} | set(BY_NAME))
        self.get_logger().info(
            f"{self._robot.name} from {self._robot.urdf_path}; waiting for joint_states, imu/data"
        )

    # -- making ------------------------------------------------------------------------------------

    def _declare_gait_parameters(self, preset: GaitParameters) -> GaitParameters:
        given = filter(self.has_parameter, BY_NAME)
        parameters = preset.replace(**{name: self.get_parameter(name).value for name in given})
        for parameter in PARAMETERS:  # those of other walk engines have their defaults
            value = getattr(parameters, parameter.name, parameter.default)
            declare(self, parameter, value, read_only=False)
        keep_types(self, PARAMETERS)
        set_in_turns(self)
        self.add_pre_set_parameters_callback(self._with_implied)
        self.add_on_set_parameters_callback(self._check_parameters)
        self.add_post_set_parameters_callback(self._apply_parameters)
        return parameters

    def _make_publishers(self) -> None:
        self._command = publisher(self, self._command_writer.message_type, "joint_command")
        self._odom = publisher(self, Odometry, "odom")
        # Absolute: aggregators subscribe to this one topic, whatever the namespace of the node.
        self._diagnostics = publisher(self, DiagnosticArray, "/diagnostics")
        self._com_expected = publisher(self, PointStamped, "~/com_expected")
        self._com_measured = publisher(self, PointStamped, "~/com_measured")
        self._com_estimated = publisher(self, PointStamped, "~/com_estimated")
        self._torso_pose = publisher(self, PoseStamped, "~/torso_pose")
        self._support_topic = publisher(self, String, "~/support", LATCHED)
        self._motion_result = publisher(self, String, "~/motion_result", LATCHED)
        self._footsteps = publisher(self, MarkerArray, "~/footsteps")
        self._transforms = transform_broadcaster(self)
        if self._transforms is None:
            self.get_logger().info(
                "tf2_ros is not installed (normal without ROS): no transforms are published"
            )

    def _make_subscriptions(self) -> None:
        # The executor serves messages that are ready together in this order: IMU before joints.
        kind = TwistStamped if self._stamped else Twist
        self._cmd_vel = self._subscribe(kind, "cmd_vel", twist_input, RELIABLE)
        self._subscribe(Imu, "imu/data", imu_input, qos_profile_sensor_data)
        self._joint_states = subscription(
            self,
            JointState,
            "joint_states",
            self._receive_joints if self._times_arrival else self._receive_joints_now,
            qos_profile_sensor_data,
        )
        self._subscribe(Temperature, "temperature", temperature_input, MOTORS)
        controller, robot = self._controller, self._robot

        def on(
            kind: type, topic: str, act: Callable[[Any], object], qos: Any = RELIABLE
        ) -> Subscription:
            def receive(message: Any) -> None:
                self._publish(controller.run(topic, partial(act, message)))

            return subscription(self, kind, topic, receive, qos)

        def look(kind: type, topic: str, goal: Callable[[Any], Goal | None]) -> None:
            on(kind, topic, lambda message: controller.look(goal(message)))

        self._motors_ready, self._motors_unheard = True, False
        self._motors_topic = on(Bool, "motors_ready", self._receive_motors, LATCHED)
        on(String, "~/motion", lambda m: controller.request_motion(m.data))
        on(Float32, "~/lift", lambda m: controller.lift(m.data))
        on(PoseStamped, "~/kick", lambda m: controller.kick(kick_of(m, self._unprefixed(m))))
        look(JointState, "~/head", lambda m: head_angles(m.name, m.position, robot))
        look(String, "~/head_mode", lambda m: head_mode(m.data))
        look(PointStamped, "~/look_at", lambda m: head_point(
            "~/look_at", (m.point.x, m.point.y, m.point.z), self._unprefixed(m), robot
        ))  # fmt: skip
        look(PointStamped, "~/follow", lambda m: head_follow(
            (m.point.x, m.point.y, m.point.z), self._unprefixed(m), robot
        ))  # fmt: skip

    def _unprefixed(self, message: PointStamped | PoseStamped) -> str:
        """The frame of a place, whether it is named with `frame_prefix` or without."""
        return str(message.header.frame_id).removeprefix(self._prefix)

    def _make_services(self) -> None:
        controller = self._controller
        for name, act in (
            ("~/stand", controller.stand),
            ("~/get_up", controller.get_up),
            ("~/relax", controller.relax),
        ):
            self.create_service(Trigger, name, partial(self._answer, act))
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(1.0, self._report, clock=steady)
        self.create_timer(WATCHDOG_PERIOD, self._watch, clock=steady)

    def _answer(
        self, act: Callable[[], str], _request: Any, response: Trigger.Response
    ) -> Trigger.Response:
        response.success, response.message = self._controller.answer(act)
        return response

    def _subscribe(
        self, kind: type, topic: str, read: Callable[[Any], Input], qos: Any,
        group: CallbackGroup | None = None,
    ) -> Subscription:  # fmt: skip
        def receive(message: Any) -> None:
            self._receive(topic, partial(read, message))

        return subscription(self, kind, topic, receive, qos, group)

    # -- messages ----------------------------------------------------------------------------------

    def _receive(self, topic: str, read: Callable[[], Input]) -> None:
        controller = self._controller
        self._publish(controller.receive(topic, read))
        if controller.needs_loads != bool(self._loads):
            self._subscribe_to_soles(controller.needs_loads)
        self._garbage.after_tick(resting=controller.state not in BUSY)

    def _receive_joints(self, message: JointState, info: dict[str, int]) -> None:
        arrived = self.get_clock().now().nanoseconds if self._measures_age else None
        read = partial(joint_input, message, info, time.time_ns(), arrived)
        self._receive("joint_states", read)
        self._load_group.count()

    def _receive_joints_now(self, message: JointState) -> None:
        self._receive_joints(message, {"received_timestamp": time.time_ns()})

    def _walk_on(self) -> None:
        self._publish(self._controller.overdue())

    def _subscribe_to_soles(self, wanted: bool) -> None:
        """Sample the sole wrenches while they are needed."""
        while self._loads:
            self.destroy_subscription(self._loads.pop())
        if wanted:
            self._loads = [
                self._subscribe(
                    WrenchStamped, f"{frame}/wrench", partial(load_input, side), NEWEST,
                    self._load_group,
                )
                for side, frame in enumerate(self._robot.sole_frames)
            ]  # fmt: skip

    def _publish(self, output: Output) -> None:
        if output.answers and self._overdue is not None:
            self._overdue.restart()
        for answer in output.answers:
            self._command.publish(self._command_writer.write(answer.targets))
            if answer.status is not None and answer.torso_pose is not None:
                self._publish_status(answer.status, answer.torso_pose)
        for result in output.motion_results:
            self._motion_result.publish(String(data=result))
        for line in output.log:
            write_log(self, line)

    def _publish_status(self, status: GaitStatus, torso_pose: Pose6) -> None:
        writer = self._status_writer
        self._odom.publish(writer.odometry(status))
        if self._transforms is not None:
            self._transforms.sendTransform(
                [
                    writer.transform(status),
                    writer.base_transform(status.stamp, torso_pose),
                ]
            )
        for topic, point in (
            (self._com_expected, status.com_expected_in_q),
            (self._com_measured, status.com_measured_in_q),
            (self._com_estimated, status.com_estimated_in_q),
        ):
            topic.publish(writer.point_in_q(point, status.stamp))
        if self._torso_pose.get_subscription_count():
            self._torso_pose.publish(writer.torso_pose(status.stamp, torso_pose))
        support = support_text(status)
        if support != self._support:
            self._support = support
            self._support_topic.publish(String(data=support))
        self._tick_count += 1
        if status.step_count != self._step_count or self._tick_count >= MARKER_TICKS:
            self._step_count = status.step_count
            self._tick_count = 0
            if self._footsteps.get_subscription_count():
                self._footsteps.publish(footsteps(status, self._prefix))

    # -- parameters and diagnostics ----------------------------------------------------------------

    def _with_implied(self, parameters: list[RosParameter]) -> list[RosParameter]:
        """Another walk engine, or no extensions, changes other parameters too."""
        asked = as_mapping(parameters)
        try:
            changed = self._controller.with_changes(asked).as_dict()
        except NaoGaitError:
            return parameters  # refused by `_check_parameters`
        implied = [
            RosParameter(name, value=value) for name, value in changed.items()
            if name not in asked and value != self.get_parameter(name).value
        ]  # fmt: skip
        return parameters + implied

    def _check_parameters(self, parameters: list[RosParameter]) -> SetParametersResult:
        """All or none: the reason names parameter, value and what is allowed."""
        try:
            self._controller.with_changes(as_mapping(parameters))
        except NaoGaitError as error:
            return refused(error)
        return accepted()

    def _apply_parameters(self, parameters: list[RosParameter]) -> None:
        self._controller.change_parameters(as_mapping(parameters))

    def _report(self) -> None:
        self._publish(self._controller.run("diagnostics", self._publish_reports))

    def _publish_reports(self) -> None:
        controller = self._controller
        controller.note_publishers(
            PublisherCounts(
                cmd_vel=self.count_publishers(self._cmd_vel.topic_name),
                joint_states=self.count_publishers(self._joint_states.topic_name),
                joint_command=self.count_publishers(self._command.topic_name),
                mismatched=self._mismatched_senders(),
                clock=self.count_publishers("/clock"),
            )
        )
        status = controller.last_status
        self._diagnostics.publish(
            diagnostic_array(
                self.get_fully_qualified_name().lstrip("/"),
                self._robot.name,
                None if status is None else status.stamp,
                controller.reports(),
            )
        )

    def _watch(self) -> None:
        if (unheard := bool(unheard_senders(self, self._motors_topic))) != self._motors_unheard:
            self._motors_unheard = unheard
            self._note_motors()
        self._publish(self._controller.watch())

    def _receive_motors(self, message: Bool) -> None:
        self._motors_ready = message.data
        self._note_motors()

    def _note_motors(self) -> None:
        """A sender of `motors_ready` that is not heard may say that they are not."""
        self._controller.note_motors(self._motors_ready and not self._motors_unheard)

    def _mismatched_senders(self) -> str:
        """Senders that this node subscribes to and cannot receive, described; empty if none."""
        for each in self.subscriptions:
            for text in unheard_senders(self, each):
                if each is self._cmd_vel and "TwistStamped" in text:
                    flag = "false" if self._stamped else "true"
                    text += f", or set enable_stamped_cmd_vel to {flag}"
                return text
        return ""
