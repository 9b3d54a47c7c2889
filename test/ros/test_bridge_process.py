"""`sim_bridge` as a process; the test is the controller."""

import math
import re
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import PointStamped, WrenchStamped
from nav_msgs.msg import Odometry
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger

from robot_core.robot import load_robot
from ros_probe import LOST, Probe, bits, set_stamp, stamp

ROBOT = load_robot()
PERIOD = 10_000_000


class Controller:
    """Answers joint states one at a time, so that a lockstep bridge moves step by step."""

    def __init__(self, probe: Probe, **parameters: object) -> None:
        self.probe = probe
        self.joints = probe.subscribe(JointState, "joint_states")
        self.imu = probe.subscribe(Imu, "imu/data")
        self.odometry = probe.subscribe(Odometry, "ground_truth/odom")
        self.clock = probe.subscribe(Clock, "/clock")
        self.bridge = probe.start(
            "sim_bridge", lockstep=True, real_time_factor=0.0, **parameters
        )
        self.command = probe.publisher(JointState, "joint_command")
        probe.wait(lambda: self.joints, "the first joint_states")
        # What was published before both ends knew of each other is lost: begin when all arrives.
        while not (self.odometry and self.imu and self.clock):
            last = stamp(self.joints[-1])
            probe.wait(
                lambda n=last: stamp(self.joints[-1]) > n, "the next joint_states",
                every=self.answer, pause=LOST,
            )  # fmt: skip
        # The reading is sent again when it is not answered; by then nothing else is under way.
        count = len(self.joints)
        probe.wait(lambda: len(self.joints) > count, "the same joint_states again")

    def wait_for_reading(self, last: int, truth: int) -> None:
        """Wait for a whole reading and a truth later than these stamps [ns]."""
        self.probe.wait(
            lambda: stamp(self.joints[-1]) > last
            and stamp(self.imu[-1]) >= stamp(self.joints[-1])
            and stamp(self.odometry[-1]) > truth,
            f"sensors after {last} and ground_truth/odom after {truth}",
        )

    def answer(self, position: Any = ROBOT.stand_pose, **fields: Any) -> JointState:
        message = JointState(
            name=list(ROBOT.joint_names), position=[float(q) for q in position], **fields
        )
        set_stamp(message, stamp(self.joints[-1]))
        self.command.publish(message)
        return message

    def step(self, position: Any = ROBOT.stand_pose) -> None:
        last, truth = stamp(self.joints[-1]), stamp(self.odometry[-1])
        self.answer(position)
        self.wait_for_reading(last, truth)


def test_a_robot_whose_motors_give_way_gets_the_engine_that_has_them(probe: Probe):
    joints = probe.subscribe(JointState, "joint_states")
    bridge = probe.start("sim_bridge", robot="booster_t1", lockstep=True, real_time_factor=0.0)
    probe.wait(lambda: joints, "joint_states")
    assert "Waist" in joints[0].name
    assert bridge.says(r"engine mujoco: .* booster_t1 has a motor that gives way")


@pytest.mark.parametrize("delay_ms", [0, 40, 60])
def test_delay_through_ros_equals_the_parameter(probe: Probe, delay_ms: int):
    """By the stamps, and by a push: its jolt comes to the IMU that much after it happened."""
    robot = Controller(probe, sensor_delay=delay_ms * 1e-3, robot_seed=-1)
    robot.step()
    for _ in range(5):
        robot.step()
        assert stamp(robot.odometry[-1]) - stamp(robot.joints[-1]) == delay_ms * 1_000_000
        assert stamp(robot.imu[-1]) == stamp(robot.joints[-1])
    push = probe.publisher(WrenchStamped, "push")
    message = WrenchStamped()
    message.wrench.force.y = 100.0
    push.publish(message)

    def sideways() -> float:
        return abs(robot.odometry[-1].twist.twist.linear.y)

    pushed_at = felt_at = felt_stamp = None
    calm = sideways()
    for _ in range(300):
        robot.step()
        if pushed_at is None and sideways() > calm + 0.03:
            pushed_at = stamp(robot.odometry[-1])
        if abs(robot.imu[-1].linear_acceleration.y) > 5.0:
            felt_at, felt_stamp = stamp(robot.odometry[-1]), stamp(robot.imu[-1])
            break
    assert pushed_at is not None
    assert felt_at is not None
    assert felt_stamp is not None
    assert felt_stamp == pushed_at, "stamped at the sampling"
    assert felt_at - pushed_at == delay_ms * 1_000_000, "and available that much later"


def test_default_delay_is_the_plants(probe: Probe):
    robot = Controller(probe)
    for _ in range(2):
        robot.step()
    assert stamp(robot.odometry[-1]) - stamp(robot.joints[-1]) == 40_000_000


def test_clock_and_truth_come_at_the_control_rate_and_messages_are_complete(probe: Probe):
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    description = probe.subscribe(String, "robot_description", latched)
    com = probe.subscribe(PointStamped, "ground_truth/com")
    wrench = probe.subscribe(WrenchStamped, "l_sole/wrench")
    robot = Controller(probe, robot_seed=3)
    for _ in range(30):
        robot.step()
    times = [m.clock.sec * 10**9 + m.clock.nanosec for m in robot.clock]
    assert set(np.diff(times)) == {PERIOD}
    assert set(np.diff([stamp(m) for m in robot.odometry])) == {PERIOD}
    last = robot.joints[-1]
    assert list(last.name) == list(ROBOT.joint_names)
    assert len(last.position) == len(last.velocity) == len(last.effort) == len(ROBOT.joint_names)
    imu = robot.imu[-1]
    assert imu.orientation_covariance[0] == -1.0, "REP-145: no orientation is given"
    assert imu.linear_acceleration.z == pytest.approx(9.81, abs=0.8)
    assert imu.angular_velocity.z == 0.0
    assert imu.angular_velocity_covariance[8] > 1e3
    odometry = robot.odometry[-1]
    assert (odometry.header.frame_id, odometry.child_frame_id) == ("world", ROBOT.torso_frame)
    probe.wait(lambda: com and wrench and description, "com, wrench and description")
    assert com[-1].header.frame_id == "world"
    assert 0.2 < com[-1].point.z < 0.35
    assert wrench[-1].header.frame_id == "l_sole"
    assert wrench[-1].wrench.force.z > 5.0
    assert description[-1].data == ROBOT.urdf


def test_lockstep_waits_and_asks_again(probe: Probe):
    """Only the right stamp moves the world; an unanswered reading is sent again, unchanged."""
    robot = Controller(probe)
    for _ in range(2):
        robot.step()
    frozen, count = stamp(robot.odometry[-1]), len(robot.joints)
    head = JointState(name=["HeadYaw"], position=[0.1])
    robot.command.publish(set_stamp(head, stamp(robot.joints[-1]) - PERIOD))
    robot.command.publish(set_stamp(head, stamp(robot.joints[-1]) - 2 * PERIOD))
    wrong = "joint_command header.stamp: got .* in lockstep, the stamp of the"
    probe.wait(lambda: robot.bridge.says(wrong), "a word about the wrong stamp")
    probe.settle()
    again = len(robot.joints)
    probe.wait(lambda: len(robot.joints) >= again + 2, "the same reading twice again")
    assert stamp(robot.odometry[-1]) == frozen
    assert bits(robot.joints[-1].position) == bits(robot.joints[count - 1].position)
    assert len(re.findall(wrong, robot.bridge.log)) == 1, "a repeated answer is no mistake"
    probe.wait(lambda: robot.bridge.says("lockstep: no joint_command with"), "a complaint")
    robot.step()
    assert stamp(robot.odometry[-1]) == frozen + PERIOD


def test_bad_messages_are_refused_and_the_robot_stands_on(probe: Probe):
    robot = Controller(probe)
    push = probe.publisher(WrenchStamped, "push")
    names, pose = list(ROBOT.joint_names), ROBOT.stand_pose.tolist()
    bad_commands = {
        r"position\[LKneePitch\]: got nan": {
            "position": [math.nan if name == "LKneePitch" else 0.0 for name in names]
        },
        r"position\[HeadYaw\]: got inf": {"position": [math.inf, *pose[1:]]},
        r"position: got '21 values'": {"position": pose[1:]},
        r"position: got '0 values'": {"position": []},
        r"name: got .*Tail": {"name": ["Tail", *names[1:]], "position": pose},
        r"HeadYaw more than once": {"name": [*names, "HeadYaw"], "position": [*pose, 0.0]},
        r"name: got 'no joints'": {"name": [], "position": []},
        r"effort\[HeadYaw\]: got 7.0": {"position": pose, "effort": [7.0] * len(names)},
        r"position\[HeadYaw\]: got 1e\+30; .* stops at its limit": {"position": [1e30, *pose[1:]]},
    }
    for pattern, fields in bad_commands.items():
        last, truth = stamp(robot.joints[-1]), stamp(robot.odometry[-1])
        message = JointState(**{"name": names, **fields})
        robot.command.publish(set_stamp(message, last))
        # Refused or not, it was an answer: the world continues with the targets of before.
        robot.wait_for_reading(last, truth)
        assert robot.bridge.says(f"joint_command .*{pattern}"), pattern
    for pattern, force in ((r"force\.x: got nan", math.nan), (r"force\.x: got 1e\+30", 1e30)):
        message = WrenchStamped()
        message.wrench.force.x = force
        push.publish(message)
        probe.wait(lambda p=pattern: robot.bridge.says(f"push wrench.{p}"), pattern)
    for _ in range(100):
        robot.step()
    assert robot.odometry[-1].pose.pose.position.z > 0.26
    assert "Traceback" not in robot.bridge.log


def test_reset_stands_the_robot_up_and_the_clock_goes_on(probe: Probe):
    robot = Controller(probe, sensor_delay=0.0)
    start = robot.odometry[-1].pose.pose.position
    push = probe.publisher(WrenchStamped, "push")
    message = WrenchStamped()
    message.wrench.force.x = 400.0
    push.publish(message)
    for _ in range(300):
        robot.step()
        if robot.odometry[-1].pose.pose.position.z < 0.2:
            break
    fallen = robot.odometry[-1].pose.pose.position
    assert fallen.z < 0.2
    before = stamp(robot.odometry[-1])
    last = stamp(robot.joints[-1])
    answer = probe.call(Trigger, "sim_bridge/reset", Trigger.Request())
    assert answer.success
    robot.wait_for_reading(last, before + 500_000_000)
    assert stamp(robot.joints[-1]) - before > 500_000_000, "a gap that tells of the reset"
    for _ in range(100):
        robot.step()
    now = robot.odometry[-1].pose.pose.position
    assert now.z > 0.26
    assert math.hypot(now.x - start.x, now.y - start.y) < 0.03
    assert set(np.diff([stamp(m) for m in robot.odometry])) == {PERIOD}


def test_control_passes_to_another_gait_by_simulated_time(probe: Probe):
    """At a tenth of real time, 0.2 s of silence take 2 s: a slow machine changes no gait."""
    bridge = probe.start("sim_bridge", engine="mujoco", real_time_factor=0.1, sensor_delay=0.0)
    odometry = probe.subscribe(Odometry, "ground_truth/odom")
    joints = probe.subscribe(JointState, "joint_states")
    command = probe.publisher(JointState, "joint_command")

    def look(sender: str, yaw: float) -> None:
        message = JointState(name=["HeadYaw"], position=[yaw])
        message.header.frame_id = sender
        count = len(odometry)
        command.publish(message)
        probe.wait(lambda: len(odometry) > count, "a step")

    def yaw(reading: JointState) -> float:
        return reading.position[list(reading.name).index("HeadYaw")]

    probe.wait(lambda: joints and odometry, "the robot")
    refused = "got 'second'; allowed: one gait at a time; 'first' is in control"
    while True:
        while yaw(joints[-1]) > -0.05:
            look("first", -0.5)
        began = stamp(joints[-1])  # the bridge hears the first one later than that, however busy
        look("first", -0.5)
        look("second", 0.5)
        if bridge.says(refused):
            break
        # This test was held up, or the word is still to come: begin again with nobody in control.
        silent = stamp(odometry[-1]) + 300_000_000
        probe.wait(lambda n=silent: stamp(odometry[-1]) > n, "0.3 s of silence")
    while yaw(joints[-1]) < 0.0:
        look("second", 0.5)
    early = [each for each in joints if began <= stamp(each) < began + 190_000_000]
    assert all(yaw(each) < 0.0 for each in early)
    assert stamp(odometry[-1]) > began + 190_000_000


def test_another_publisher_of_its_topics_is_reported_until_it_is_gone(probe: Probe):
    bridge = probe.start("sim_bridge", engine="mujoco")
    joints = probe.subscribe(JointState, "joint_states")
    probe.wait(lambda: joints, "joint_states")
    other = probe.node.create_publisher(JointState, "joint_states", 10)
    clock = probe.node.create_publisher(Clock, "/clock", 10)
    probe.wait(lambda: bridge.says("2 publishers on /joint_states"), "a warning")
    probe.wait(lambda: bridge.says("2 publishers on /clock.*publish_clock:=false"), "a warning")
    for publisher in (other, clock):
        probe.node.destroy_publisher(publisher)
    probe.wait(lambda: bridge.says("one publisher on /joint_states again"), "its end")
    assert len(re.findall("2 publishers on", bridge.log)) == 2, "each is said once"


def test_a_sender_that_the_bridge_does_not_receive_is_named(probe: Probe):
    bridge = probe.start("sim_bridge", engine="mujoco")
    sender = probe.node.create_publisher(WrenchStamped, "push", qos_profile_sensor_data)
    names = "push: got best effort from probe, which is not received; allowed: reliable"
    probe.wait(lambda: bridge.says(names), "what the sender offers")
    probe.node.destroy_publisher(sender)
    probe.wait(lambda: bridge.says("every sender of an input is received"), "the end")


def test_robot_beside_the_one_that_publishes_the_clock(probe: Probe):
    probe.start("sim_bridge", engine="mujoco", publish_clock=False)
    joints = probe.subscribe(JointState, "joint_states")
    probe.wait(lambda: joints, "joint_states")
    assert probe.node.count_publishers("/clock") == 0
