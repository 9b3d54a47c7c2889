"""`gait` as a process; the test is the robot: a perfect one that stands still."""

import math
from typing import Any

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PointStamped, Twist, TwistStamped, Vector3
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import DescribeParameters, GetParameters, SetParameters
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Bool, Float64MultiArray, String
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory

from nao_lipm_gait.parameters import PARAMETERS, load_preset
from robot_core.robot import load_robot
from robot_core.ros.topics import LATCHED
from ros_probe import LOST, Probe, bits, set_stamp, stamp

ROBOT = load_robot()
NAMES = list(ROBOT.joint_names)
PERIOD = 10_000_000


class StandingRobot:
    """Sends what a robot in its stand pose feels, and collects the answers."""

    def __init__(self, probe: Probe, command: type = JointState, **parameters: object) -> None:
        self.probe = probe
        self.commands = probe.subscribe(command, "joint_command")
        # What it tests does not depend on the gyro's bias.
        self.gait = probe.start("gait", **{"bias_wait": 0.0, **parameters})
        self.imu = probe.publisher(Imu, "imu/data")
        self.joints = probe.publisher(JointState, "joint_states")
        self.now = 1_000_000_000
        self.pose = ROBOT.stand_pose.tolist()
        # Best effort may lose what is sent before both ends know of each other.
        probe.wait(self._answered, "the first joint_command", every=self.send)
        self.commands.clear()

    def _answered(self) -> bool:
        return bool(self.commands)

    def joint_state(self, **fields: Any) -> JointState:
        zeros = [0.0] * len(NAMES)
        given = {"name": NAMES, "position": self.pose, "velocity": zeros, "effort": zeros}
        return set_stamp(JointState(**(given | fields)), self.now)

    def imu_message(self) -> Imu:
        message = Imu()
        message.orientation_covariance[0] = -1.0
        # With noise: an IMU that repeats itself counts as stuck.
        message.linear_acceleration.z = 9.81 + 1e-3 * math.sin(self.now * 1e-6)
        return set_stamp(message, self.now)

    def send(self, imu: Imu | None = None, joints: JointState | None = None) -> None:
        self.imu.publish(self.imu_message() if imu is None else imu)
        self.joints.publish(self.joint_state() if joints is None else joints)

    def tick(self, count: int = 1) -> None:
        """Good frames, each one answered; the robot follows its targets at once."""
        for _ in range(count):
            self.now += PERIOD
            answered = len(self.commands)
            self.probe.wait(
                lambda n=answered: self._is_answered(n), "a joint_command", every=self.send,
                pause=LOST,
            )  # fmt: skip
            if isinstance(self.commands[-1], JointState):
                self.pose = list(self.commands[-1].position)

    def _is_answered(self, before: int) -> bool:
        """The frame of now, and not one that was still on its way."""
        if len(self.commands) <= before:
            return False
        last = self.commands[-1]
        return not isinstance(last, JointState) or stamp(last) == self.now

    def check_answers(self) -> None:
        """Never a NaN, never beyond a limit."""
        for message in self.commands:
            position = np.array(message.position)
            assert np.isfinite(position).all()
            assert (position >= ROBOT.lower).all()
            assert (position <= ROBOT.upper).all()


def test_every_frame_is_answered_with_its_stamp(probe: Probe):
    latched = probe.subscribe(String, "gait/support", LATCHED)
    points = {
        name: probe.subscribe(PointStamped, f"gait/com_{name}")
        for name in ("expected", "measured", "estimated")
    }
    odometry = probe.subscribe(Odometry, "odom")
    robot = StandingRobot(probe)
    robot.tick(5)
    answered = [stamp(m) for m in robot.commands if stamp(m) > 1_000_000_000]
    assert answered == [1_000_000_000 + PERIOD * n for n in range(1, 6)]
    last = robot.commands[-1]
    assert list(last.name) == NAMES
    assert list(last.effort) == [1.0] * len(NAMES)
    robot.check_answers()
    probe.wait(
        lambda: latched and odometry and all(points.values()), "support, odometry and CoM points"
    )
    assert latched[-1].data.startswith("stand")
    assert (odometry[-1].header.frame_id, odometry[-1].child_frame_id) == ("odom", "base_footprint")
    assert all(m[-1].header.frame_id == "Q" for m in points.values())


def test_bad_messages_are_named_and_the_gait_goes_on(probe: Probe):
    robot = StandingRobot(probe)
    velocity = probe.publisher(Twist, "cmd_vel")
    robot.tick(3)
    pose, zeros = list(robot.pose), [0.0] * len(NAMES)
    nan_at_knee = [math.nan if name == "RKneePitch" else 0.0 for name in NAMES]
    bad_joints = {
        r"position\[RKneePitch\]: got nan": {"position": nan_at_knee},
        r"position\[HeadYaw\]: got 99.0; allowed: a finite number": {"position": [99.0, *pose[1:]]},
        r"name: got 'no HeadYaw'": {
            "name": NAMES[1:], "position": pose[1:], "velocity": zeros[1:], "effort": zeros[1:]
        },
        r"HeadPitch more than once": {
            "name": [*NAMES, "HeadPitch"], "position": [*pose, 0.0], "velocity": []
        },
        r"position: got '23 values'": {"position": [*pose, 0.0]},
        r"name: got 'no HeadYaw, HeadPitch, .*': *": {"name": [], "position": [], "velocity": []},
    }  # fmt: skip
    for pattern, fields in bad_joints.items():
        robot.now += PERIOD
        pattern = pattern.removesuffix(": *")
        probe.wait(
            lambda p=pattern: robot.gait.says(f"joint_states .*{p}"), pattern,
            every=lambda f=fields: robot.send(joints=robot.joint_state(**f)), pause=LOST,
        )  # fmt: skip
    for axis in ("x", "z"):
        robot.now += PERIOD
        imu = robot.imu_message()
        setattr(imu.angular_velocity, axis, math.inf)
        probe.wait(
            lambda a=axis: robot.gait.says(rf"imu/data angular_velocity\.{a}: got inf"), axis,
            every=lambda i=imu: robot.send(imu=i), pause=LOST,
        )  # fmt: skip
    for value in (math.nan, math.inf, 1e9):
        twist = Twist()
        twist.linear.x = value
        velocity.publish(twist)
    probe.wait(lambda: robot.gait.says(r"cmd_vel linear\.x: got nan; allowed"), "cmd_vel refused")
    robot.tick(3)
    shuffled = robot.joint_state(
        name=[*NAMES[::-1], "LHand"], position=[*robot.pose[::-1], 7e9], velocity=[], effort=[]
    )
    robot.now += PERIOD
    answered = len(robot.commands)
    robot.send(joints=set_stamp(shuffled, robot.now))
    probe.wait(lambda: len(robot.commands) > answered, "reordered joints with one too many")
    robot.check_answers()
    assert "Traceback" not in robot.gait.log


def test_zero_quaternion_is_reported_but_the_robot_walks_on(probe: Probe):
    robot = StandingRobot(probe)
    robot.tick(2)
    robot.now += PERIOD
    imu = robot.imu_message()
    imu.orientation_covariance[0] = 0.01
    imu.orientation.w = 0.0
    answered = len(robot.commands)
    robot.send(imu=imu)
    probe.wait(lambda: len(robot.commands) > answered, "an answer all the same")
    named = r"imu/data orientation: got \(0.0, 0.0, 0.0, 0.0\); allowed: a unit"
    probe.wait(lambda: robot.gait.says(named), "a word about it")


def test_stamps_that_stand_still_go_back_or_jump(probe: Probe):
    support = probe.subscribe(String, "gait/support", LATCHED)
    # Open loop: this robot has no delay and never tips, unlike what the observer expects.
    robot = StandingRobot(probe, feedback=False)
    velocity = probe.publisher(Twist, "cmd_vel")
    robot.tick(100)
    twist = Twist()
    twist.linear.x = 0.1

    def walk() -> None:
        for _ in range(200):
            velocity.publish(twist)
            robot.tick()
            if support and support[-1].data.startswith("walk"):
                return
        raise AssertionError("does not walk")

    walk()
    answered = len(robot.commands)
    robot.send()
    probe.wait(lambda: len(robot.commands) > answered, "the same answer again")
    assert bits(robot.commands[-1].position) == bits(robot.commands[-2].position)
    assert stamp(robot.commands[-1]) == stamp(robot.commands[-2])
    probe.wait(lambda: robot.gait.says("header.stamp: got '.* again'"), "a warning")

    def new_time(shift: int, word: str) -> None:
        """One stamp alone proves nothing; the next one does, and the robot stands."""
        robot.now += shift
        robot.send()
        robot.tick()
        probe.wait(lambda: robot.gait.says(f"joint_states header.stamp: {word}"), word)
        # A velocity that comes late makes it walk once more, for its time and a stop.
        for _ in range(100):
            robot.tick(10)
            if support[-1].data.startswith("stand"):
                return
        raise AssertionError(f"no stand after {word}")

    new_time(-400_000_000, "backwards")
    robot.tick(100)
    walk()
    new_time(2_000_000_000, "jump")
    robot.check_answers()
    assert "Traceback" not in robot.gait.log


@pytest.mark.parametrize("stamped", [False, True])
def test_a_sender_of_the_other_twist_is_named(probe: Probe, stamped: bool):
    robot = StandingRobot(probe, enable_stamped_cmd_vel=stamped)
    robot.tick()
    ours, theirs = (TwistStamped, Twist) if stamped else (Twist, TwistStamped)
    sender = probe.node.create_publisher(theirs, "cmd_vel", 10)
    names = f"got geometry_msgs/msg/{theirs.__name__} from probe, .*allowed: .*{ours.__name__},"
    probe.wait(lambda: robot.gait.says(names), "the type of the sender")
    probe.node.destroy_publisher(sender)


@pytest.mark.parametrize(
    ("topic", "kind", "got"),
    [("cmd_vel", Twist, "best effort"), ("gait/motion", String, "best effort"),
     ("temperature", Twist, "geometry_msgs/msg/Twist")],
)  # fmt: skip
def test_a_sender_that_an_input_does_not_receive_is_named(
    probe: Probe, topic: str, kind: type, got: str
) -> None:
    robot = StandingRobot(probe)
    robot.tick()
    sender = probe.node.create_publisher(kind, topic, qos_profile_sensor_data)
    names = f"{topic}: got {got} from probe, which is not received; allowed: "
    probe.wait(lambda: robot.gait.says(names), "what the sender offers")
    probe.node.destroy_publisher(sender)


def test_an_unheard_sender_of_motors_ready_means_that_they_are_not(probe: Probe) -> None:
    robot = StandingRobot(probe, bias_wait=0.0)
    sender = probe.node.create_publisher(Bool, "motors_ready", 10)  # volatile
    names = "motors_ready: got volatile from probe, .*allowed: transient local"
    robot.tick()
    probe.wait(lambda: robot.gait.says(names), "what the sender offers")
    velocity = probe.publisher(Twist, "cmd_vel")
    message = Twist()
    message.linear.x = 0.1
    for _ in range(60):
        velocity.publish(message)
        robot.tick()
    assert robot.gait.says("standing until the motors are ready")
    probe.node.destroy_publisher(sender)
    probe.wait(lambda: robot.gait.says("the motors are ready"), "the motors")


def test_silence_is_reported_in_log_and_diagnostics(probe: Probe):
    reports = probe.subscribe(DiagnosticArray, "/diagnostics")
    robot = StandingRobot(probe)
    robot.tick(20)

    def sensors(level: bytes) -> bool:
        found = [s for r in reports for s in r.status if s.name == "gait: sensors"]
        return any(s.level == level for s in found)

    probe.wait(lambda: robot.gait.says("no joint_states for over 1 s"), "an error")
    probe.wait(lambda: sensors(DiagnosticStatus.ERROR), "an error in the diagnostics")
    walk = next(s for r in reports for s in r.status if s.name == "gait: walk" and s.values)
    values = {pair.key: pair.value for pair in walk.values}
    assert values["state"] == "stand"
    assert float(values["tick p50 [us]"]) > 0.0
    assert {"IK residual [mm]", "observer innovation y [mm]", "tick p99 [us]"} <= set(values)
    robot.tick(3)


def test_a_second_robot_in_the_same_domain_is_reported(probe: Probe):
    """Its log waits for as long as discovery may keep a robot that was killed."""
    reports = probe.subscribe(DiagnosticArray, "/diagnostics")
    robot = StandingRobot(probe)
    robot.tick()

    def told() -> bool:
        return any(
            "2 publishers on joint_states" in status.message
            and status.level == DiagnosticStatus.ERROR
            for report in reports[-1:] for status in report.status
        )  # fmt: skip

    second = probe.publisher(JointState, "joint_states")
    probe.wait(told, "an error")
    probe.node.destroy_publisher(second)
    probe.wait(lambda: not told(), "its end")


def test_velocity_command_is_forgotten_on_the_clock_of_the_sensors(probe: Probe):
    support = probe.subscribe(String, "gait/support", LATCHED)
    # Open loop: this robot does not sway, unlike what the observer expects.
    robot = StandingRobot(
        probe, enable_stamped_cmd_vel=True, cmd_vel_timeout=0.3, feedback=False
    )
    velocity = probe.publisher(TwistStamped, "cmd_vel")
    robot.tick(100)
    message = TwistStamped()
    message.twist.linear.x = 0.1
    velocity.publish(message)
    for _ in range(100):
        robot.tick()
        if support[-1].data.startswith("walk"):
            break
    assert support[-1].data.startswith("walk")
    for _ in range(500):
        robot.tick()
        if support[-1].data.startswith("stand"):
            break
    assert support[-1].data.startswith("stand"), "the command was not repeated"


def test_relax_and_stand(probe: Probe):
    support = probe.subscribe(String, "gait/support", LATCHED)
    robot = StandingRobot(probe)
    robot.tick(3)
    assert probe.call(Trigger, "gait/relax", Trigger.Request()).success
    robot.tick(2)
    assert set(robot.commands[-1].effort) == {0.0}
    probe.wait(lambda: support[-1].data.startswith("relaxed"), "relaxed")
    assert probe.call(Trigger, "gait/stand", Trigger.Request()).success
    robot.tick(2)
    assert set(robot.commands[-1].effort) == {1.0}
    probe.wait(lambda: support[-1].data.startswith("stand"), "standing")


@pytest.mark.parametrize(
    ("interface", "kind"),
    [("forward_command", Float64MultiArray), ("joint_trajectory", JointTrajectory)],
)
def test_command_interfaces_of_ros2_control(probe: Probe, interface: str, kind: type):
    robot = StandingRobot(probe, command=kind, command_interface=interface)
    robot.tick(2)
    message = robot.commands[-1]
    if kind is Float64MultiArray:
        position = message.data
    else:
        assert list(message.joint_names) == NAMES
        (point,) = message.points
        assert point.time_from_start.nanosec == PERIOD
        position = point.positions
    np.testing.assert_allclose(position, ROBOT.stand_pose, atol=0.02)


def test_preset_override_and_change_of_parameters(probe: Probe):
    robot = StandingRobot(probe, preset="paper", com_height=0.25, swing_lift=0)
    robot.tick(2)
    names = [parameter.name for parameter in PARAMETERS]
    got = probe.call(GetParameters, "gait/get_parameters", GetParameters.Request(names=names))
    of_other_walks = {parameter.name: parameter.default for parameter in PARAMETERS}
    paper = load_preset("paper").as_dict()
    expected = of_other_walks | paper | {"com_height": 0.25, "swing_lift": 0.0}
    for name, value in zip(names, got.values, strict=True):
        kinds = {
            ParameterType.PARAMETER_BOOL: value.bool_value,
            ParameterType.PARAMETER_STRING: value.string_value,
        }
        assert kinds.get(value.type, value.double_value) == expected[name], name
    described = probe.call(
        DescribeParameters, "gait/describe_parameters", DescribeParameters.Request(names=names)
    )
    for parameter, descriptor in zip(PARAMETERS, described.descriptors, strict=True):
        assert parameter.meaning in descriptor.description
        if parameter.is_number:
            (limits,) = descriptor.floating_point_range
            assert (limits.from_value, limits.to_value) == (parameter.minimum, parameter.maximum)

    def set_to(name: str, **value: Any) -> Any:
        parameter = Parameter(name=name, value=ParameterValue(**value))
        request = SetParameters.Request(parameters=[parameter])
        (result,) = probe.call(SetParameters, "gait/set_parameters", request).results
        return result

    double, text = ParameterType.PARAMETER_DOUBLE, ParameterType.PARAMETER_STRING
    assert set_to("swing_lift", type=double, double_value=0.03).successful
    whole = ParameterType.PARAMETER_INTEGER
    assert set_to("stand_catch", type=whole, integer_value=0).successful
    assert not set_to("swing_lift", type=whole, integer_value=1).successful
    for refused, evidence in (
        (set_to("swing_lift", type=double, double_value=3.0), ("swing_lift", "3.0", "0.06")),
        (set_to("swing_lift", type=double, double_value=math.nan), ("swing_lift", "nan", "0.06")),
        (set_to("swing_lift", type=text, string_value="high"), ("swing_lift", "high", "0.06")),
        (set_to("urdf", type=text, string_value="x"), ("urdf",)),
        (set_to("zmp_offset_y", type=double, double_value=0.06), ("zmp_offset_y", "walk: zmp")),
    ):
        assert not refused.successful
        assert all(word in refused.reason for word in evidence), refused.reason
    names = ["swing_lift", "stand_catch"]
    got = probe.call(GetParameters, "gait/get_parameters", GetParameters.Request(names=names))
    assert got.values[0].double_value == 0.03
    assert (got.values[1].type, got.values[1].double_value) == (double, 0.0), "a float stays one"
    switch = ParameterType.PARAMETER_BOOL
    assert set_to("extensions", type=switch, bool_value=True).successful
    names = ["arm_swing"]
    got = probe.call(GetParameters, "gait/get_parameters", GetParameters.Request(names=names))
    assert got.values[0].double_value > 0.0, "the parameters of the extensions follow"
    robot.tick(5)
    robot.check_answers()


def test_it_walks_on_for_a_moment_without_sensors(probe: Probe):
    support = probe.subscribe(String, "gait/support", LATCHED)
    # Open loop: this robot has no delay and never tips, unlike what the observer expects.
    robot = StandingRobot(probe, coast=True, feedback=False)
    velocity = probe.publisher(Twist, "cmd_vel")

    def answers() -> list[JointState]:
        return [message for message in robot.commands if stamp(message) == robot.now]

    while support[-1].data.startswith("stand"):
        robot.now += PERIOD
        assert robot.now < 10_000_000_000
        velocity.publish(Twist(linear=Vector3(x=0.1)))
        robot.commands.clear()
        robot.send()
        probe.wait(lambda: bool(answers()), "a joint_command", every=robot.send)
        robot.pose = list(answers()[-1].position)
    probe.wait(
        lambda: any(stamp(message) > robot.now for message in robot.commands),
        "a joint_command without sensors",
    )
    robot.check_answers()
