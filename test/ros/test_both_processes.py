"""Both nodes as processes: the robot walks, runs repeat, and all of it ends cleanly."""

import math
import os
import re
import signal
import time
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import Twist, Vector3, Wrench, WrenchStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger

from robot_core.errors import NaoGaitError
from robot_core.robot import load_robot
from robot_core.ros.topics import LATCHED
from ros_probe import Driver, Probe, bits, stamp

LOCKSTEP = {"lockstep": True, "real_time_factor": 0.0}
FAST = {**LOCKSTEP, "engine": "mujoco"}
PACED = {"real_time_factor": 0.2}
"""By the wall clock, but slow enough for a machine that does other things too."""


def test_robot_moves_forward_on_cmd_vel_and_stops_without(probe: Probe):
    driver = Driver(probe)
    truth = probe.subscribe(Odometry, "ground_truth/odom")
    odometry = probe.subscribe(Odometry, "odom")
    support = probe.subscribe(String, "gait/support", LATCHED)
    probe.start("gait", bias_wait=1.0)
    probe.start("sim_bridge", **LOCKSTEP)
    probe.wait(lambda: support and support[-1].data.startswith("stand"), "a stand")
    probe.wait(lambda: truth and stamp(truth[-1]) > 3_000_000_000, "3 s of simulated time")
    start = truth[-1].pose.pose.position  # settled
    probe.wait(lambda: stamp(truth[-1]) > 5_000_000_000, "2 s more")

    def walked(message: Odometry) -> float:
        position = message.pose.pose.position
        return math.hypot(position.x - start.x, position.y - start.y)

    assert walked(truth[-1]) < 0.01, "stands without a command"
    driver.forward = 0.15
    begin = stamp(truth[-1])
    probe.wait(lambda: walked(truth[-1]) > 0.4, "0.4 m of way")
    assert stamp(truth[-1]) - begin < 20_000_000_000, "at 15 cm/s 3 s, a start, late commands"
    assert truth[-1].pose.pose.position.z > 0.25
    driver.forward = None
    probe.wait(lambda: support[-1].data.startswith("stand"), "a stand after the timeout")
    position = odometry[-1].pose.pose.position
    assert math.hypot(position.x, position.y) == pytest.approx(walked(truth[-1]), rel=0.35)
    assert truth[-1].pose.pose.position.z > 0.25
    for process in probe.processes:
        assert "Traceback" not in process.log


def test_a_paced_robot_steps_and_is_not_ahead_of_the_wall_clock(probe: Probe):
    driver = Driver(probe)
    truth = probe.subscribe(Odometry, "ground_truth/odom")
    support = probe.subscribe(String, "gait/support", LATCHED)
    probe.start("gait", bias_wait=0.0)
    began = time.monotonic()
    probe.start("sim_bridge", **PACED)
    driver.forward = 0.1
    probe.wait(lambda: support and support[-1].data.startswith("walk"), "a walk")
    factor = PACED["real_time_factor"]
    assert stamp(truth[-1]) * 1e-9 <= factor * (time.monotonic() - began) + 0.2


def test_walks_on_under_a_flood_of_bad_messages(probe: Probe):
    """A second sender on every topic of both nodes, with every number bad."""
    driver = Driver(probe)
    truth = probe.subscribe(Odometry, "ground_truth/odom")
    commands = probe.subscribe(JointState, "joint_command")
    gait = probe.start("gait", bias_wait=0.0)
    # What is shown here is not speed: a busy machine must not be what fells the robot.
    bridge = probe.start("sim_bridge", **FAST)
    probe.wait(lambda: truth and stamp(truth[-1]) > 2_000_000_000, "2 s of simulated time")
    driver.forward = 0.15
    names = list(load_robot().joint_names)
    nan = [math.nan] * len(names)
    bad: list[tuple[str, Any]] = [
        ("joint_states", JointState(name=names, position=nan, velocity=nan)),
        ("joint_states", JointState(name=names[3:], position=nan[3:])),
        ("joint_states", JointState(name=["x" * 100] * 50)),
        ("imu/data", Imu(linear_acceleration=Vector3(x=math.inf))),
        ("imu/data", Imu(angular_velocity=Vector3(z=math.nan))),
        ("joint_command", JointState(name=names, position=nan)),
        ("joint_command", JointState(name=names, position=[])),
        ("joint_command", JointState(name=["Tail"], position=[0.0])),
        ("cmd_vel", Twist(linear=Vector3(x=math.nan))),
        ("cmd_vel", Twist(angular=Vector3(z=-1e300))),
        ("push", WrenchStamped(wrench=Wrench(force=Vector3(x=math.inf)))),
    ]
    publishers = {topic: probe.publisher(type(message), topic) for topic, message in bad}
    start, begin = truth[-1].pose.pose.position, stamp(truth[-1])
    again = begin
    while stamp(truth[-1]) < begin + 3_000_000_000:
        for topic, message in bad:
            publishers[topic].publish(message)
        again += 20_000_000
        probe.wait(lambda n=again: stamp(truth[-1]) > n, "the world to continue")
    now = truth[-1].pose.pose.position
    assert now.z > 0.25, "upright"
    assert math.hypot(now.x - start.x, now.y - start.y) > 0.15, "and on its way"
    good = [m for m in commands if len(m.position) == len(names) and m.effort]
    assert len(good) > 200
    assert all(math.isfinite(q) for m in good for q in m.position)
    for process in (gait, bridge):
        assert process.status is None
        assert "Traceback" not in process.log
        assert len(process.log.splitlines()) < 400, "the log stays readable"
    assert gait.says("joint_states position.*nan")
    assert gait.says("imu/data linear_acc.*inf")
    assert bridge.says("joint_command header.stamp.*in lockstep"), "no word in time"
    assert bridge.says("push wrench.force.x.*inf")


def test_reset_after_a_fall_and_the_gait_stands_again(probe: Probe):
    truth = probe.subscribe(Odometry, "ground_truth/odom")
    support = probe.subscribe(String, "gait/support", LATCHED)
    gait = probe.start("gait")
    bridge = probe.start("sim_bridge", **LOCKSTEP)
    push = probe.publisher(WrenchStamped, "push")
    probe.wait(lambda: truth and stamp(truth[-1]) > 2_000_000_000, "2 s of simulated time")
    probe.wait(lambda: support, "the gait's state")
    message = WrenchStamped()
    message.wrench.force.x = 500.0
    push.publish(message)
    probe.wait(lambda: support and support[-1].data.startswith("fallen"), "a fall")
    probe.wait(lambda: truth[-1].pose.pose.position.z < 0.2, "a robot on the floor")
    said = len(gait.log), len(bridge.log)
    assert probe.call(Trigger, "sim_bridge/reset", Trigger.Request()).success
    again = stamp(truth[-1])
    probe.wait(lambda: stamp(truth[-1]) > again + 4_000_000_000, "4 s after the reset")
    probe.wait(lambda: support[-1].data.startswith("stand"), "a stand")
    assert truth[-1].pose.pose.position.z > 0.26
    after = gait.log[said[0] :]
    assert re.search(r"INFO.*joint_states after a pause of 0.6. s: restarting from a stand", after)
    # A busy machine may send a reading again.
    assert not re.search(r"WARN.*\]: joint_states(?!.* again')", after)
    # A gait that the machine holds up is worth a line of its own.
    (line,) = [each for each in bridge.log[said[1] :].splitlines() if "lockstep: " not in each]
    assert re.search(r"INFO.*reset$", line)


def _run(folder: Path, seed: int, until: int) -> dict[int, bytes]:
    """Joint positions by stamp of a walk in lockstep, bit by bit.

    The sensors reach the gait through the probe, IMU and joints of a stamp together: the gait knows
    the probe before the robot starts, and best effort may lose what comes from somebody unknown.
    """
    folder.mkdir()
    probe = Probe(folder)
    try:
        kinds = {"imu/data": Imu, "joint_states": JointState}
        remap = [word for name in kinds for word in ("-r", f"{name}:=relayed/{name}")]
        probe.start("gait", "--ros-args", *remap, cmd_vel_timeout=1000.0, bias_wait=0.0)
        relays = {name: probe.publisher(kind, f"relayed/{name}") for name, kind in kinds.items()}
        newest: dict[str, Any] = {}

        def relay(name: str, message: Any) -> None:
            newest[name] = message
            if len({stamp(each) for each in newest.values()}) == 1 and len(newest) == 2:
                for each, publisher in relays.items():
                    publisher.publish(newest[each])

        for name, kind in kinds.items():
            joints = probe.subscribe(kind, name, 1000, partial(relay, name))
        velocity = probe.publisher(Twist, "cmd_vel")
        twist = Twist()
        twist.linear.x = 0.15
        twist.angular.z = 0.2
        velocity.publish(twist)
        assert velocity.wait_for_all_acked()  # the gait has it before the first frame
        probe.start("sim_bridge", robot_seed=seed, **FAST)
        probe.wait(lambda: joints and stamp(joints[-1]) >= until, "the end of the walk")
        return {stamp(message): bits(message.position) for message in joints}
    finally:
        probe.close()


def test_same_seed_in_lockstep_gives_the_same_walk_bit_by_bit(tmp_path: Path):
    until = 3_000_000_000
    first = _run(tmp_path / "first", 3, until)
    second = _run(tmp_path / "second", 3, until)
    other = _run(tmp_path / "other", 4, 1_000_000_000)
    common = sorted(set(first) & set(second))
    common = [stamp for stamp in common if stamp <= until]
    assert len(common) > 290, "nearly every frame has to be compared"
    assert len({first[stamp] for stamp in common}) > 120, "it walked"
    different = [stamp for stamp in common if first[stamp] != second[stamp]]
    assert not different, f"differ from {different[0] * 1e-9:.2f} s on"
    shared = [stamp for stamp in common if stamp in other]
    assert len(shared) > 90
    assert any(other[stamp] != first[stamp] for stamp in shared)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signal_ends_both_with_status_0(probe: Probe, number: int):
    commands = probe.subscribe(JointState, "joint_command")
    gait = probe.start("gait")
    bridge = probe.start("sim_bridge")
    probe.wait(lambda: len(commands) > 20, "a running robot")
    for process in (gait, bridge):
        process.signal(number)
    for process in (gait, bridge):
        assert process.wait() == 0, process.log
        assert "Traceback" not in process.log, process.log
        assert "rror" not in process.log, process.log
        with pytest.raises(ProcessLookupError):
            os.killpg(process.pid, 0)  # no process is left in its group


@pytest.mark.parametrize(
    ("name", "arguments", "message"),
    [
        ("gait", ["-p", "preset:=nope"], "gait: parameter preset: .*'nope'; allowed: .*paper"),
        ("gait", ["-p", "swing_lift:=9.0"], "gait: swing_lift: got 9.0; allowed: .* 0 to 0.06 m"),
        ("gait", ["-p", "feedback:=3"], "gait: feedback: got 3; allowed: true or false"),
        ("gait", ["-p", "urdf:=/no.urdf"], "gait: parameter urdf: .*'/no.urdf'; allowed: "),
        ("gait", ["--params-file", "/no.yaml"], "gait: .*/no.yaml"),
        ("gait", ["-p", "frame_prefix:=/nao"], "gait: frame_prefix: .*; allowed: .* begin with /"),
        ("gait", ["-p", "motions:=/proc/self/task"], "gait: .*motions: .*; allowed: .*yaml"),
        ("sim_bridge", ["-p", "plant:=nope"], "parameter plant: .*'nope'; allowed: .*reference"),
        ("sim_bridge", ["-p", "sensor_delay:=-1.0"], "sensor_delay: got -1.0; allowed: .* 0 to 1"),
        ("sim_bridge", ["-p", "robot_seed:=two"], "robot_seed: got 'two'; allowed: a whole number"),
        ("sim_bridge", ["-p", "engine:=mojoco"], "engine: .*; did you mean mujoco.*pybullet"),
    ],
)
def test_bad_start_is_one_clear_line_and_status_2(
    probe: Probe, name: str, arguments: list[str], message: str
):
    process = probe.start(name, "--ros-args", *arguments)
    assert process.wait() == 2
    assert process.says(message), process.log
    assert len(process.log.strip().splitlines()) == 1, process.log


def test_names_of_frames_and_image_topics_are_checked() -> None:
    from nao_soccer.ros.vision_node import IMAGES
    from robot_core.ros.parameters import FRAME_PREFIX

    assert [IMAGES.check("left/image_rect"), FRAME_PREFIX.check("nao1/"), FRAME_PREFIX.check("")]
    for field, wrong in ((IMAGES, "/image"), (IMAGES, "a//b"), (IMAGES, ""), (FRAME_PREFIX, "/n")):
        with pytest.raises(NaoGaitError, match=rf"{field.name}: .*allowed: a (topic|name)"):
            field.check(wrong)


def test_urdf_without_a_joint_is_named(probe: Probe, tmp_path: Path):
    from robot_core.resources import find

    text = find("urdf", "nao_h21_v33").read_text(encoding="utf-8")
    broken = tmp_path / "broken.urdf"
    broken.write_text(text.replace('"LKneePitch"', '"LKneeFoo"'), encoding="utf-8")
    process = probe.start("gait", urdf=broken)
    assert process.wait() == 2
    assert process.says("LKneePitch"), process.log
    assert process.says("broken.urdf"), process.log
