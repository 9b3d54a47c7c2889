"""The gait as a ROS 2 node: converts messages, checks them, and leaves the walking to `Gait`."""

import time
from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PointStamped, Twist, TwistStamped, Vector3
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
from nao_lipm_gait.gait import Gait
from nao_lipm_gait.motion.conductor import GET_UP
from nao_lipm_gait.motion.library import library_of
from nao_lipm_gait.parameters import BY_NAME, NEEDS_RESET, PARAMETERS, GaitParameters
from nao_lipm_gait.presets import preset_for
from nao_lipm_gait.robot_description import load_robot
from nao_lipm_gait.ros.diagnostics import SILENCE, Health, diagnostics
from nao_lipm_gait.ros.frame_assembly import FrameAssembler, ImuSample, JointSample
from nao_lipm_gait.ros.guarded_gait import GuardedGait
from nao_lipm_gait.ros.messages import COMMAND_WRITERS, StatusWriter, footsteps, support_text
from nao_lipm_gait.ros.node_parameters import (
    NodeParameter,
    accepted,
    as_mapping,
    declare,
    of_type,
    refused,
    unknown_overrides,
    used_as,
)
from nao_lipm_gait.ros.readings import (
    ACCELERATION_ABSURD,
    ROTATION_ABSURD,
    JointReader,
    check_orientation,
    read_vector,
    read_velocity,
    stamp_of,
)
from nao_lipm_gait.ros.stamp_watch import StampWatch, Step
from nao_lipm_gait.ros.throttle import Throttle
from nao_lipm_gait.ros.tick_statistics import TickStatistics
from nao_lipm_gait.ros.velocity_input import VelocityInput
from nao_lipm_gait.signals import GaitState, JointTargets, SensorFrame

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
Callback = Callable[[Any], None]


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
        self._gait_parameters = self._declare_table(preset)

        self._gait = Gait(self._robot, self._gait_parameters, period, motions)
        self._guarded = GuardedGait(self._gait, self._robot)
        self._joints = JointReader(self._robot, "joint_states")
        self._assembler = FrameAssembler()
        self._stamps = StampWatch(round(period * 1e9))
        self._velocity = VelocityInput(timeout)
        self._ticks = TickStatistics()
        self._throttle = Throttle()
        self._rejected: Counter[str] = Counter()
        self._faults = 0
        self._faults_told = 0
        self._last_targets: JointTargets | None = None
        self._sensors_at: float | None = None
        self._started_at = time.monotonic()
        self._support = ""
        self._step_count = -1
        self._tick_count = 0

        self._command_writer = COMMAND_WRITERS[interface](self._robot.joint_names, period)
        self._status_writer = StatusWriter()
        self._make_publishers()
        self._make_subscriptions(stamped)
        known = frozenset({p.name for p in NODE_PARAMETERS} | set(BY_NAME))
        for name in unknown_overrides(self, known):
            self._warn(name, f"parameter {name}: unknown and ignored; see `ros2 param list`")
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
        if stamped:
            self._subscribe(TwistStamped, "cmd_vel", self._on_stamped_velocity, 10)
        else:
            self._subscribe(Twist, "cmd_vel", self._on_velocity, 10)
        self._subscribe(Imu, "imu/data", self._on_imu, qos_profile_sensor_data)
        self._sensors = self._subscribe(
            JointState, "joint_states", self._on_joint_state, qos_profile_sensor_data
        )
        self._subscribe(String, "~/motion", self._on_motion, 10)
        self.create_service(Trigger, "~/stand", self._on_stand)
        self.create_service(Trigger, "~/get_up", self._on_get_up)
        self.create_service(Trigger, "~/relax", self._on_relax)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(1.0, partial(self._fenced, "diagnostics", self._diagnose), clock=steady)
        self.create_timer(
            WATCHDOG_PERIOD, partial(self._fenced, "watchdog", self._watch), clock=steady
        )

    def _subscribe(self, kind: type, topic: str, callback: Callback, qos: Any) -> Subscription:
        return self.create_subscription(
            kind, topic, lambda message: self._fenced(topic, partial(callback, message)), qos
        )

    def _fenced(self, topic: str, work: Callable[[], None]) -> None:
        """Run a callback; whatever it raises becomes a warning and never ends the node."""
        try:
            work()
        except NaoGaitError as error:
            self._rejected[topic] += 1
            self._warn(error.field, f"{error}; message ignored", burst=5)
        except Exception as error:  # noqa: BLE001 - a walking robot must not lose its gait
            self._rejected[topic] += 1
            self._warn(topic, f"{topic}: {type(error).__name__}: {error}; message ignored")

    # -- inputs ------------------------------------------------------------------------------------

    def _on_velocity(self, message: Twist) -> None:
        self._receive_velocity(message)

    def _on_stamped_velocity(self, message: TwistStamped) -> None:
        self._receive_velocity(message.twist)

    def _receive_velocity(self, twist: Twist) -> None:
        command = read_velocity(_xyz(twist.linear), _xyz(twist.angular))
        # Arrival counts, not the header: senders may live on another clock than the sensors.
        self._velocity.receive(command, self._stamps.last)

    def _on_imu(self, message: Imu) -> None:
        stamp = stamp_of(
            message.header.stamp.sec, message.header.stamp.nanosec, "imu/data header.stamp"
        )
        for field in ("angular_velocity", "linear_acceleration"):
            if getattr(message, f"{field}_covariance")[0] == -1.0:
                raise NaoGaitError(
                    f"imu/data {field}_covariance[0]", -1.0, "0 or more: this gait needs the field"
                )
        rotation, force = _xyz(message.angular_velocity), _xyz(message.linear_acceleration)
        sample = ImuSample(
            stamp,
            read_vector(rotation, "imu/data angular_velocity", ROTATION_ABSURD, "rad/s"),
            read_vector(force, "imu/data linear_acceleration", ACCELERATION_ABSURD, "m/s^2"),
        )
        quaternion = message.orientation
        try:
            check_orientation(
                (quaternion.x, quaternion.y, quaternion.z, quaternion.w),
                message.orientation_covariance[0],
                "imu/data",
            )
        except NaoGaitError as error:
            # Not used by the gait, which estimates its own; but someone should know.
            self._warn(error.field, f"{error}; the orientation is not used, walking goes on")
        frame = self._assembler.add_imu(sample)
        if frame is not None:
            self._tick(frame)

    def _on_joint_state(self, message: JointState) -> None:
        stamp = stamp_of(
            message.header.stamp.sec, message.header.stamp.nanosec, "joint_states header.stamp"
        )
        position, velocity = self._joints.read(message.name, message.position, message.velocity)
        self._sensors_at = time.monotonic()
        step = self._stamps.see(stamp)
        if step is Step.REPEATED:
            self._answer_again(stamp)
            return
        if step is not Step.NEXT:
            self._begin_anew(step, stamp)
        for frame in self._assembler.add_joints(JointSample(stamp, position, velocity)):
            self._tick(frame)

    def _answer_again(self, stamp: int) -> None:
        """The same stamp twice is no second tick, but the sender may have missed the answer."""
        if self._last_targets is not None and self._last_targets.stamp == stamp:
            self._command.publish(self._command_writer.write(self._last_targets))
        raise NaoGaitError(
            "joint_states header.stamp", f"{stamp * 1e-9:.3f} s again", "a stamp that rises"
        )

    def _begin_anew(self, step: Step, stamp: int) -> None:
        self._warn(
            f"stamp {step.value}",
            f"joint_states header.stamp: {step.value} to {stamp * 1e-9:.3f} s; allowed: steps of "
            f"{self._gait_period():g} s and no gap over 0.5 s; beginning anew from a stand",
        )
        self._assembler.begin_at(stamp)
        self._velocity.clear()
        relaxed = self._gait.state is GaitState.RELAXED
        self._gait.reset()
        if relaxed:
            self._gait.request_relax()  # nobody asked for a stiff robot

    def _gait_period(self) -> float:
        return float(self.get_parameter(CONTROL_PERIOD.name).value)

    # -- the tick ----------------------------------------------------------------------------------

    def _tick(self, frame: SensorFrame) -> None:
        command = self._velocity.at(frame.stamp)
        begin = time.perf_counter_ns()
        answer = self._guarded.step(frame, command)
        self._ticks.add((time.perf_counter_ns() - begin) * 1e-3)
        self._command.publish(self._command_writer.write(answer.targets))
        self._last_targets = answer.targets
        if answer.fault is not None:
            self._faults += 1
            self._error("tick", answer.fault)
        if not answer.held:
            self._publish_status()

    def _publish_status(self) -> None:
        status = self._gait.status
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
        self._velocity.clear()
        self._gait.request_stand()
        response.success = True
        response.message = "standing once the step is done, or once a lying robot is upright"
        return response

    def _on_relax(self, _request: Any, response: Trigger.Response) -> Trigger.Response:
        self._velocity.clear()
        self._gait.request_relax()
        response.success = True
        response.message = "relaxed from the next tick on; ~/stand makes it stiff again"
        return response

    def _on_motion(self, message: String) -> None:
        self._gait.request_motion(message.data)

    def _on_get_up(self, _request: Any, response: Trigger.Response) -> Trigger.Response:
        try:
            self._gait.request_motion(GET_UP)
            response.success = True
            response.message = "getting up once the robot has come to rest"
        except NaoGaitError as error:
            response.success = False
            response.message = str(error)
        return response

    def _check_parameters(self, parameters: list[RosParameter]) -> SetParametersResult:
        """All or none: the reason names parameter, value and what is allowed."""
        try:
            self._with(parameters)
        except NaoGaitError as error:
            return refused(error)
        return accepted()

    def _apply_parameters(self, parameters: list[RosParameter]) -> None:
        changed = self._with(parameters)
        if changed == self._gait_parameters:
            return
        needs_reset = bool(self._needing_reset(changed))
        self._gait_parameters = changed
        self._gait.set_parameters(changed)
        if needs_reset:
            self._gait.reset()  # the standing robot blends from its pose into the same one

    def _with(self, parameters: list[RosParameter]) -> GaitParameters:
        """The gait's parameters with these changes; others in the list are not ours to check."""
        changes = {
            name: BY_NAME[name].check(value)
            for name, value in as_mapping(parameters).items()
            if name in BY_NAME
        }
        changed = self._gait_parameters.replace(**changes)
        moving = self._gait.state in (GaitState.WALK, GaitState.STOP)
        needing = self._needing_reset(changed)
        if moving and needing:
            raise NaoGaitError(
                needing[0], getattr(changed, needing[0]), "no change while walking; stand first"
            )
        return changed

    def _needing_reset(self, changed: GaitParameters) -> list[str]:
        return [
            name
            for name in NEEDS_RESET
            if getattr(changed, name) != getattr(self._gait_parameters, name)
        ]

    # -- watching ----------------------------------------------------------------------------------

    def _watch(self) -> None:
        now = time.monotonic()
        silent_since = self._started_at if self._sensors_at is None else self._sensors_at
        patience = 4 * SILENCE if self._sensors_at is None else SILENCE
        if now - silent_since > patience:
            # Nothing can be commanded without sensors; the robot holds the last targets.
            self._warn("silence", f"no joint_states for {now - silent_since:.1f} s")

    def _diagnose(self) -> None:
        robots = self.count_publishers(self._sensors.topic_name)
        if robots > 1:
            self._warn(
                "robots",
                f"{robots} publishers on {self._sensors.topic_name}; allowed: one robot; does "
                "another run share this ROS_DOMAIN_ID?",
            )
        age = None if self._sensors_at is None else time.monotonic() - self._sensors_at
        new_faults = self._faults != self._faults_told
        self._faults_told = self._faults
        health = Health(
            ticks=self._ticks.summarize(),
            sensor_age=age,
            missed_ticks=self._stamps.missed,
            rejected=self._rejected,
            faults=self._faults,
            status=None if self._last_targets is None else self._gait.status,
        )
        self._diagnostics.publish(
            diagnostics(self.get_name(), self._robot.name, health, new_faults)
        )

    def _warn(self, key: str, message: str, burst: int = 1) -> None:
        held_back = self._throttle.allow(key, time.monotonic(), burst)
        if held_back is not None:
            self.get_logger().warning(message + _times(held_back))

    def _error(self, key: str, message: str) -> None:
        held_back = self._throttle.allow(key, time.monotonic())
        if held_back is not None:
            self.get_logger().error(message + _times(held_back))


def _xyz(vector: Vector3) -> Sequence[float]:
    return vector.x, vector.y, vector.z


def _times(held_back: int) -> str:
    return f" ({held_back} more like it)" if held_back else ""


def _make_transform_broadcaster(node: Node) -> Any:
    """A TF broadcaster, or None where tf2_ros is not installed (PyPI has no wheel of it)."""
    try:
        from tf2_ros import TransformBroadcaster
    except ImportError:
        return None
    return TransformBroadcaster(node)
