"""The second robot and its walk on both nodes."""

from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from robot_core.robot import load_robot
from robot_core.ros.topics import LATCHED
from ros_probe import Driver, Probe, stamp
from test_both_processes import FAST


def test_bruno_walks_and_stops_by_cmd_vel(probe: Probe) -> None:
    robot = load_robot("bruno")
    driver = Driver(probe)
    truth = probe.subscribe(Odometry, "ground_truth/odom")
    support = probe.subscribe(String, "gait/support", LATCHED)
    commands = probe.subscribe(JointState, "joint_command")
    description = probe.subscribe(String, "robot_description", LATCHED)
    probe.start("gait", urdf="bruno", bias_wait=0.0)
    probe.start("sim_bridge", urdf="bruno", **FAST)
    probe.wait(lambda: support and support[-1].data.startswith("stand"), "a stand")
    probe.wait(lambda: commands, "a command")
    assert tuple(commands[-1].name) == robot.joint_names
    probe.wait(lambda: description, "its URDF")
    assert description[-1].data == robot.urdf
    driver.forward = 0.2
    probe.wait(lambda: truth[-1].pose.pose.position.x > 0.3, "30 cm of walking")
    driver.forward = 0.0
    probe.wait(lambda: support[-1].data.startswith("stand"), "a stand again")
    stood = stamp(truth[-1])
    probe.wait(lambda: stamp(truth[-1]) > stood + 1_000_000_000, "another second")
    assert truth[-1].pose.pose.position.z > 0.2
    # A late command on a busy machine may have made it stop once before.
    probe.wait(lambda: support[-1].data.startswith("stand"), "the stand that it ends in")
