"""LoLA's server, its bridge and the gait as processes: a walk, and what `kill -9` does to it."""

import math
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import BatteryState, Imu, JointState, Joy, Temperature
from std_msgs.msg import Bool, String

from robot_core.robot import load_robot
from robot_core.ros.topics import LATCHED
from ros_probe import Probe, Process

pytest.importorskip("mujoco")
ROBOT = load_robot("nao_v6")
UPRIGHT = 0.24
"""[m] Height of the torso of a robot that walks or stands; it sits at 0.2 m."""


class Robot:
    """The three processes, each of which can be killed and started again."""

    def __init__(self, probe: Probe, socket: Path, stiffness_ramp: float = 0.3) -> None:
        self.probe = probe
        self._parameters: dict[str, dict[str, object]] = {
            "gait": {
                "urdf": "nao_v6", "control_period": 0.012, "bias_wait": 0.5,
                # Simulated time may run ahead of whoever commands.
                "cmd_vel_timeout": 1000.0,
            },
            "lola_bridge": {
                "socket": socket, "lockstep": True, "stiffness_ramp": stiffness_ramp,
                "sit_time": 0.5,
            },
            "lola_server": {"socket": socket, "engine": "mujoco", "real_time_factor": 0},
        }  # fmt: skip
        self.truth = probe.subscribe(Odometry, "ground_truth/odom")
        self.commands = probe.subscribe(JointState, "joint_command")
        self.processes: dict[str, Process] = {}

    def start(self) -> "Robot":
        """Start the processes; time stands still until the probe knows their topics."""
        for name, parameters in self._parameters.items():
            if name == "lola_server":
                self.probe.wait(self._topics_are_known, "publishers of gait and bridge")
            self.processes[name] = self.probe.start(name, **parameters)
        return self

    def _topics_are_known(self) -> bool:
        topics = "joint_command", "gait/support", "motors_ready"
        return all(self.probe.node.count_publishers(topic) for topic in topics)

    def kill(self, name: str) -> None:
        """Kill a process and start it again."""
        process = self.processes[name]
        process.signal(signal.SIGKILL)
        process.wait()
        self.probe.processes.remove(process)
        self.truth.clear()
        server = self.processes["lola_server"]
        if name == "lola_bridge":
            # Then nothing waits: while a machine starts it slowly, minutes would be simulated.
            self.probe.wait(lambda: len(self.truth) > 150, "a robot that sits down")
            server.signal(signal.SIGSTOP)
        again = self.processes[name] = self.probe.start(name, **self._parameters[name])
        if name == "lola_bridge":
            self.probe.wait(lambda: again.says("nao_v6 at "), "the new bridge")
            server.signal(signal.SIGCONT)

    def walk(self) -> None:
        """Walk forward until the speed is right."""

        def walks() -> bool:
            speed = [message.twist.twist.linear.x for message in self.truth[-100:]]
            return len(speed) == 100 and float(np.mean(speed)) > 0.12

        self.drive_until(walks, "a walk")
        assert self.height > UPRIGHT

    def drive_until(self, reached: Callable[[], bool], what: str) -> None:
        """Command a walk until something holds."""
        twist = Twist()
        twist.linear.x = 0.2
        publisher = self.probe.publisher(Twist, "cmd_vel")
        self.probe.wait(reached, what, every=lambda: publisher.publish(twist))
        self.probe.node.destroy_publisher(publisher)

    @property
    def height(self) -> float:
        return float(self.truth[-1].pose.pose.position.z)


@pytest.fixture
def robot(probe: Probe, tmp_path: Path) -> Robot:
    return Robot(probe, tmp_path / "lola").start()


def finite(values: Any) -> bool:
    return all(map(math.isfinite, values))


def test_a_robot_behind_lola_walks_and_shows_its_sensors(robot: Robot, probe: Probe) -> None:
    imu = probe.subscribe(Imu, "imu/data")
    joints = probe.subscribe(JointState, "joint_states")
    battery = probe.subscribe(BatteryState, "battery")
    temperature = probe.subscribe(Temperature, "temperature")
    touch = probe.subscribe(Joy, "touch")
    robot.walk()
    probe.wait(lambda: len(imu) > 50, "readings of the IMU")
    assert np.mean([each.linear_acceleration.z for each in imu]) == pytest.approx(9.81, abs=0.7)
    assert set(ROBOT.joint_names) < set(joints[-1].name)
    assert finite(joints[-1].position)
    assert finite(joints[-1].velocity)
    assert 0.0 < battery[-1].percentage <= 1.0
    assert 20.0 < temperature[-1].temperature < 80.0
    assert len(touch[-1].buttons) == 14
    for command in robot.commands:
        assert (np.array(command.position) >= ROBOT.lower).all()
        assert (np.array(command.position) <= ROBOT.upper).all()


def test_it_does_not_step_before_it_is_stiff(probe: Probe, tmp_path: Path) -> None:
    robot = Robot(probe, tmp_path / "lola", stiffness_ramp=3.0)
    support: list[String] = []
    steps_before: list[int] = []

    def note(message: Bool) -> None:
        if message.data and not steps_before:
            steps_before.append(sum(each.data.startswith("walk") for each in support))

    probe.subscribe(Bool, "motors_ready", LATCHED, callback=note)
    probe.subscribe(String, "gait/support", callback=support.append)
    robot.start().walk()
    probe.wait(lambda: steps_before, "stiff motors")
    # The first step may be seen before the message that allowed it; a walk of 2 s has seven.
    assert steps_before[0] <= 1


@pytest.mark.parametrize("name", ["gait", "lola_bridge", "lola_server"])
def test_after_a_kill_the_robot_has_not_fallen_and_walks_on(robot: Robot, name: str) -> None:
    robot.walk()
    robot.kill(name)
    robot.walk()
    assert min(each.pose.pose.position.z for each in robot.truth) > 0.15
