"""`robot`: gait, vision and player of one robot in one process."""

from pathlib import Path

import pytest

pytest.importorskip("cv2")
pytest.importorskip("mujoco")

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import JointState, PointCloud2

from ros_probe import Probe
from sim_bridge.scene import load_scene

NODES = "gait", "vision", "player"


def test_the_three_nodes_walk_see_and_decide_in_one_process(probe: Probe, tmp_path: Path) -> None:
    scene = load_scene("pitch_small")
    alone = tmp_path / "alone.yaml"
    alone.write_text(scene.replace(robots=scene.robots[:1]).to_yaml())
    below = scene.robots[0].name
    commands = probe.subscribe(
        JointState, f"{below}/joint_command", qos_profile_sensor_data
    )
    percepts = probe.subscribe(PointCloud2, f"{below}/vision/percepts")
    reports = probe.subscribe(DiagnosticArray, f"{below}/behavior")
    probe.start(
        "sim_bridge", scene=str(alone), engine="mujoco", lockstep=True, real_time_factor=0.0,
        cameras=True,
    )  # fmt: skip
    arguments = ["-r", f"__ns:=/{below}"]
    for each in ("vision:scene", "player:scene"):
        arguments += ["-p", f"{each}:={alone}"]
    robot = probe.start("robot", "--ros-args", *arguments, "-p", "player:referee:=false")
    probe.wait(lambda: len(commands) > 100, "targets of the gait")
    probe.wait(lambda: len(percepts) > 5, "percepts")
    probe.wait(lambda: reports, "a report of the behaviour")
    values = {pair.key: pair.value for pair in reports[-1].status[0].values}
    assert values["option_0"].startswith("player: ")
    probe.wait(lambda: set(NODES) <= set(probe.node.get_node_names()), "the names of all three")
    assert not robot.says("unknown")


def test_a_parameter_of_one_of_them_that_cannot_be_ends_all(probe: Probe) -> None:
    robot = probe.start("robot", "--ros-args", "-p", "vision:scene:=nowhere")
    assert robot.wait() == 2
    (line,) = [each for each in robot.log.splitlines() if each.startswith("robot:")]
    assert "scene" in line
    assert "Traceback" not in robot.log
