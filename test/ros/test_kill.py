"""`kill -9` of the gait at speed, and a second gait by mistake."""

import math
import signal
from typing import Any

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from robot_core.robot import load_robot
from robot_core.ros.topics import LATCHED
from ros_probe import Driver, Probe, stamp

pytest.importorskip("mujoco")
ROBOT = load_robot()
SECOND = 1_000_000_000
LOCKSTEP = {"real_time_factor": 0.0, "engine": "mujoco", "lockstep": True}
"""The robot waits for a gait that the machine holds up."""


def walking(probe: Probe) -> tuple[Any, Driver, list[Any], list[Any], list[Any]]:
    """A gait whose robot walks; it, its driver, the truth, the states and the commands."""
    driver = Driver(probe)
    truth = probe.subscribe(Odometry, "ground_truth/odom")
    support = probe.subscribe(String, "gait/support", LATCHED)
    commands = probe.subscribe(JointState, "joint_command")
    gait = probe.start("gait", bias_wait=0.0)
    probe.start("sim_bridge", **LOCKSTEP)
    driver.forward = 0.2
    probe.wait(lambda: fast(support, truth), "a walk at speed")
    return gait, driver, truth, support, commands


def fast(support: list[Any], truth: list[Any]) -> bool:
    speed = [message.twist.twist.linear.x for message in truth[-100:]]
    return (
        len(speed) == 100 and float(np.mean(speed)) > 0.12 and support[-1].data.startswith("walk")
    )


def check(commands: list[Any]) -> None:
    assert commands
    for message in commands:
        position = np.array(message.position)
        assert np.isfinite(position).all()
        assert (position >= ROBOT.lower).all()
        assert (position <= ROBOT.upper).all()


def test_a_killed_gait_comes_back_and_walks_or_says_that_it_is_down(probe: Probe) -> None:
    """The robot is in mid-stride, of which the new gait knows nothing."""
    gait, driver, truth, support, commands = walking(probe)
    driver.forward = None
    gait.signal(signal.SIGKILL)
    gait.wait()
    probe.processes.remove(gait)
    support.clear()
    again = probe.start("gait", bias_wait=0.0)
    probe.wait(lambda: support, "a word of the new gait")
    returned = stamp(truth[-1])

    def knows() -> bool:
        state, upright = support[-1].data.split()[0], truth[-1].pose.pose.position.z > 0.25
        late = stamp(truth[-1]) > returned + 4 * SECOND
        return late and state == ("walk" if upright else "fallen")

    driver.forward = 0.2
    probe.wait(knows, "a walk, or a fall that is known")
    check(commands)
    assert "Traceback" not in again.log


def test_a_killed_robot_comes_back_and_is_walked_again(probe: Probe) -> None:
    gait, driver, truth, support, commands = walking(probe)
    driver.forward = None
    bridge = next(process for process in probe.processes if process.name == "sim_bridge")
    bridge.signal(signal.SIGKILL)
    bridge.wait()
    probe.processes.remove(bridge)
    truth.clear()
    probe.start("sim_bridge", **LOCKSTEP)
    probe.wait(lambda: truth, "the truth about a new robot")
    probe.wait(
        lambda: gait.says("joint_states header.stamp: backwards"),
        "a word about its clock, which begins again",
    )

    truth.clear()
    driver.forward = 0.2
    probe.wait(lambda: fast(support, truth), "a walk of the new robot")
    assert truth[-1].pose.pose.position.z > 0.25
    check(commands)
    assert gait.status is None
    assert "Traceback" not in gait.log


def test_a_second_gait_is_reported_and_changes_nothing(probe: Probe) -> None:
    gait, _, truth, _, commands = walking(probe)
    reports = probe.subscribe(DiagnosticArray, "/diagnostics")
    second = probe.start("gait")

    def told() -> bool:
        statuses = [status for report in reports for status in report.status]
        return any(
            "publishers on joint_command" in status.message
            and status.level == DiagnosticStatus.ERROR
            for status in statuses
        )

    probe.wait(told, "an error about two gaits")
    start = stamp(truth[-1])
    probe.wait(lambda: stamp(truth[-1]) > start + 3 * SECOND, "3 s more")
    bridge = next(process for process in probe.processes if process.name == "sim_bridge")
    refused = "joint_command header.frame_id: got 'gait_.*one gait"
    probe.wait(lambda: bridge.says(refused), "a refusal of the second gait")
    # The bridge may know the second gait before this test does.
    probe.wait(lambda: len({each.header.frame_id for each in commands}) == 2, "commands of both")
    assert truth[-1].pose.pose.position.z > 0.25, "upright"
    assert math.isfinite(truth[-1].pose.pose.position.x)
    check(commands)
    for process in (gait, second):
        assert process.status is None
        assert "Traceback" not in process.log
