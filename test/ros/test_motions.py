"""Motions over ROS: asked for by name, refused in words, taught and played by the tool."""

import subprocess
import sys
from pathlib import Path
from typing import Any

from geometry_msgs.msg import PointStamped
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger

from robot_core.ros.topics import LATCHED
from ros_probe import TIMEOUT, Probe

FAST = {"lockstep": True, "real_time_factor": 0.0, "engine": "mujoco"}


def standing(probe: Probe, **parameters: object) -> tuple[list[Any], Any]:
    """The gait's states as they come, and its process."""
    support = probe.subscribe(String, "gait/support", LATCHED)
    gait = probe.start("gait")
    probe.start("sim_bridge", **{**FAST, **parameters})
    probe.wait(lambda: support and support[-1].data.startswith("stand"), "a stand")
    return support, gait


def test_a_kick_by_its_name_moves_the_ball_and_nonsense_is_refused(probe: Probe) -> None:
    ball = probe.subscribe(PointStamped, "ground_truth/ball")
    results = probe.subscribe(String, "gait/motion_result", LATCHED)
    support, gait = standing(probe, ball=True)
    put = probe.publisher(PointStamped, "sim_bridge/put_ball")
    spot = PointStamped()
    spot.point.x, spot.point.y = 0.16, 0.06
    put.publish(spot)
    probe.wait(lambda: ball and abs(ball[-1].point.x - 0.16) < 0.01, "the ball on its spot")
    ask = probe.publisher(String, "gait/motion")
    ask.publish(String(data="fly"))
    probe.wait(lambda: gait.says(r"motion: got 'fly'.*kick_front_left"), "a refusal")
    probe.wait(lambda: results[-1].data.startswith("fly: refused"), "the outcome")
    ask.publish(String(data="kick_front_left"))
    probe.wait(lambda: support[-1].data.startswith("motion"), "a motion")
    probe.wait(lambda: support[-1].data.startswith("stand"), "a stand")
    probe.wait(lambda: ball[-1].point.x > 0.5, "a ball on its way")
    probe.wait(lambda: results[-1].data == "kick_front_left: done", "the outcome")


def test_a_robot_on_the_floor_gets_up_when_asked(probe: Probe) -> None:
    support = probe.subscribe(String, "gait/support", LATCHED)
    gait = probe.start("gait")
    probe.start("sim_bridge", **FAST, start_state="lying_front")
    probe.wait(lambda: support and support[-1].data.startswith("fallen"), "a fallen robot")
    answer = probe.call(Trigger, "gait/get_up", Trigger.Request())
    assert answer.success
    probe.wait(lambda: any(m.data.startswith("getting_up") for m in support), "a get-up")
    probe.wait(lambda: support[-1].data.startswith("stand"), "a stand")
    for line in ("fallen, relaxed", "getting up: get_up_front", "stood up"):
        probe.wait(lambda text=line: gait.says(text), line)
    assert not gait.says("held or clipped")
    refused = probe.call(Trigger, "gait/get_up", Trigger.Request())
    assert not refused.success
    assert "standing" in refused.message


def test_the_head_turns_by_topic(probe: Probe) -> None:
    joints = probe.subscribe(JointState, "joint_states")
    standing(probe)
    head = probe.publisher(JointState, "gait/head")
    head.publish(JointState(name=["HeadYaw", "HeadPitch"], position=[0.6, 0.1]))

    def pan() -> float:
        return joints[-1].position[list(joints[-1].name).index("HeadYaw")]

    probe.wait(lambda: joints and abs(pan() - 0.6) < 0.03, "the head to the left")


def test_poses_are_taught_and_played_on_the_running_robot(probe: Probe, tmp_path: Path) -> None:
    standing(probe)
    file = tmp_path / "taught.yaml"
    environment = probe.domain.environment()
    tool = [sys.executable, "-m", "gait_lab.cli", "teach"]
    recorded = subprocess.run(
        [*tool, "record", str(file), "--stiff"], input="first\nfirst 0.5\nq\n", text=True,
        capture_output=True, timeout=TIMEOUT, env=environment,
    )  # fmt: skip
    assert recorded.returncode == 0, recorded.stderr
    assert "2 poses" in recorded.stdout
    played = subprocess.run(
        [*tool, "play", str(file)], text=True, capture_output=True, timeout=TIMEOUT, env=environment
    )
    assert played.returncode == 0, played.stderr
    assert "done, the gait is in stand" in played.stdout
