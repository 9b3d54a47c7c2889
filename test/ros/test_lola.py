"""LoLA's server, its bridge and the gait as processes: a walk, and what `kill -9` does to it."""

import math
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import BatteryState, Imu, JointState, Joy, Temperature

from nao_lipm_gait.robot import load_robot
from ros_probe import Probe

pytest.importorskip("mujoco")
ROBOT = load_robot("nao_v6")
UPRIGHT = 0.24
"""[m] Height of the torso of a robot that walks or stands; it sits at 0.2 m."""


class Robot:
    """The three processes, each of which can be killed and started again."""

    def __init__(self, probe: Probe, socket: Path) -> None:
        self.probe = probe
        self._parameters: dict[str, dict[str, object]] = {
            "lola_server": {"socket": socket, "engine": "mujoco", "real_time_factor": 0},
            "lola_bridge": {
                "socket": socket, "lockstep": True, "stiffness_ramp": 0.3, "sit_time": 0.5,
            },
            "gait": {"urdf": "nao_v6", "control_period": 0.012, "bias_wait": 0.5},
        }  # fmt: skip
        self.truth = probe.subscribe(Odometry, "ground_truth/odom")
        self.commands = probe.subscribe(JointState, "joint_command")
        self.processes = {name: probe.start(name, **p) for name, p in self._parameters.items()}

    def kill(self, name: str) -> None:
        """Kill a process and start it again."""
        process = self.processes[name]
        process.signal(signal.SIGKILL)
        process.wait()
        self.probe.processes.remove(process)
        self.truth.clear()
        self.processes[name] = self.probe.start(name, **self._parameters[name])

    def walk(self) -> None:
        """Walk forward until the speed is right."""
        twist = Twist()
        twist.linear.x = 0.2
        publisher = self.probe.publisher(Twist, "cmd_vel")

        def walks() -> bool:
            speed = [message.twist.twist.linear.x for message in self.truth[-100:]]
            return len(speed) == 100 and float(np.mean(speed)) > 0.12

        self.probe.wait(walks, "a walk", every=lambda: publisher.publish(twist))
        self.probe.node.destroy_publisher(publisher)
        assert self.height > UPRIGHT

    @property
    def height(self) -> float:
        return float(self.truth[-1].pose.pose.position.z)


@pytest.fixture
def robot(probe: Probe, tmp_path: Path) -> Robot:
    return Robot(probe, tmp_path / "lola")


def finite(values: Any) -> bool:
    return all(map(math.isfinite, values))


def test_a_robot_behind_lola_walks_and_shows_its_sensors(robot: Robot, probe: Probe) -> None:
    imu = probe.subscribe(Imu, "imu/data")
    joints = probe.subscribe(JointState, "joint_states")
    battery = probe.subscribe(BatteryState, "battery")
    temperature = probe.subscribe(Temperature, "temperature")
    touch = probe.subscribe(Joy, "touch")
    robot.walk()
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


@pytest.mark.parametrize("name", ["gait", "lola_bridge", "lola_server"])
def test_after_a_kill_the_robot_has_not_fallen_and_walks_on(robot: Robot, name: str) -> None:
    robot.walk()
    robot.kill(name)
    robot.walk()
    assert min(each.pose.pose.position.z for each in robot.truth) > 0.15
