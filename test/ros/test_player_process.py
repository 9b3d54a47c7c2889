"""`player` and `referee` as processes: obedience over UDP; foreign packets are ignored."""

import math
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import (
    PointStamped,
    PoseWithCovarianceStamped,
    TransformStamped,
    Twist,
)
from nav_msgs.msg import Odometry
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Empty, String

from nao_soccer.game_state import Phase
from nao_soccer.referee.protocol import (
    VERSIONS,
    ControlMessage,
    Penalty,
    PlayerInfo,
    ReturnMessage,
    TeamInfo,
    decode_return,
)
from nao_soccer.ros import vision_messages
from nao_soccer.team.udp import UdpLink
from nao_soccer.vision.percepts import Kind, Percept, Percepts
from pitch_percepts import Eyes
from robot_core.geometry import compose
from robot_core.ros.messages import with_prefix
from ros_probe import LOST, Probe, set_stamp, stamp

MS = 1_000_000
PERIOD = 20 * MS


def values(message: DiagnosticArray) -> dict[str, str]:
    return {pair.key: pair.value for status in message.status for pair in status.values}


def control(phase: Phase, version: int, penalty: Penalty = Penalty.NONE, packet: int = 0) -> bytes:
    """What a GameController would say to team 7, whose player 2 has the penalty."""
    players = (PlayerInfo(), PlayerInfo(penalty, 10))
    teams = (TeamInfo(7, players=players), TeamInfo(4, players=(PlayerInfo(), PlayerInfo())))
    return ControlMessage(teams, phase, packet=packet, players_per_team=2, version=version).encode()


class StandingRobot:
    """What gait and vision of a robot would send that stands a metre before the ball."""

    def __init__(self, probe: Probe) -> None:
        self.stamp = 0
        self._odometry = probe.publisher(Odometry, "odom")
        self._percepts = probe.publisher(PointCloud2, "vision/percepts")

    def step(self, *, blind: bool = False) -> None:
        """The next period: odometry, and now and then an image."""
        self.stamp += PERIOD
        message = set_stamp(Odometry(), self.stamp)
        message.pose.pose.orientation.w = 1.0
        self._odometry.publish(message)
        if self.stamp % (5 * PERIOD) == 0 and not blind:
            ball = Percept(Kind.BALL, (1.0, 0.1), (1e-4, 0.0, 1e-4))
            view = np.array(((0.2, -1.0), (3.0, -2.0), (3.0, 2.0), (0.2, 1.0)))
            percepts = Percepts(self.stamp, ball, visible=view)
            self._percepts.publish(vision_messages.percept_cloud(percepts))


def test_a_player_obeys_a_game_controller_of_each_version(probe: Probe) -> None:
    numbers = probe.udp_ports
    player = probe.start(
        "player", scene="pitch_small", number=2, team_number=7, start="'-1.5 0.0 0.0'", **numbers
    )
    reports = probe.subscribe(DiagnosticArray, "behavior")
    walks = probe.subscribe(Twist, "cmd_vel")
    robot = StandingRobot(probe)
    referee = UdpLink(numbers["control_port"])
    listener = UdpLink(numbers["return_port"], "127.0.0.1")  # as a GameController
    heard = []
    packet = 0

    def say(phase: Phase, version: int, penalty: Penalty = Penalty.NONE) -> None:
        nonlocal packet
        for _ in range(3):
            robot.step()
        packet += 1
        referee.send(control(phase, version, penalty, packet % 256))
        heard.extend(data for data, _ in listener.received())

    def walks_now() -> bool:
        return bool(walks) and any(
            math.hypot(each.linear.x, each.linear.y) + abs(each.angular.z) > 0.05
            for each in walks[-3:]
        )

    try:
        # Without a referee it stands.
        probe.wait(lambda: reports and len(walks) > 5, "a first report", every=robot.step)
        assert values(reports[-1])["phase"] == "initial"
        assert not walks_now()
        for version in VERSIONS:
            probe.wait(walks_now, "walking", every=lambda v=version: say(Phase.PLAYING, v))
            probe.wait(
                lambda: not walks_now(),
                "standing in a penalty",
                every=lambda v=version: say(Phase.PLAYING, v, Penalty.PUSHING),
            )
        path = values(reports[-1])
        assert path["option_0"].startswith("player: upright (")
        # Foreign, truncated and wrong packets change nothing and are one line each.
        good = control(Phase.PLAYING, 18)
        for bad in (b"", b"hello", good[:50], good[:4] + b"\x63" + good[5:]):
            referee.send(bad)
        probe.wait(
            lambda: player.says("control message"), "a warning",
            every=lambda: say(Phase.SET, 18),
        )  # fmt: skip
        probe.wait(lambda: values(reports[-1])["phase"] == "set", "set",
                   every=lambda: say(Phase.SET, 18))  # fmt: skip
        probe.wait(lambda: heard, "a return message", every=lambda: say(Phase.SET, 18))
        message = decode_return(heard[-1])
        assert (message.player, message.team) == (2, 7)
    finally:
        referee.close()
        listener.close()


def test_a_referee_counts_a_goal_and_puts_the_ball_back(probe: Probe) -> None:
    numbers = probe.udp_ports
    referee = probe.start("referee", scene="pitch_small", minutes=1.0, **numbers)
    states = probe.subscribe(DiagnosticArray, "game_state")
    puts = probe.subscribe(PointStamped, "put_ball")
    whistles = probe.subscribe(Empty, "/whistle")
    balls = probe.publisher(PointStamped, "ground_truth/ball")
    link = UdpLink(numbers["control_port"])
    back = UdpLink(numbers["return_port"])
    sent: list[bytes] = []
    now, place = 0, (0.0, 0.0)

    def step() -> None:
        nonlocal now
        for _ in range(20):
            now += 100 * MS
            message = set_stamp(PointStamped(), now)
            message.point.x, message.point.y = place
            message.point.z = 0.05
            balls.publish(message)
            sent.extend(data for data, _ in link.received())

    def state(key: str) -> str:
        return values(states[-1]).get(key, "") if states else ""

    try:
        probe.wait(lambda: state("state") == "playing", "the kick-off", every=step)
        probe.wait(lambda: whistles, "the whistle", every=step)

        def answer() -> None:
            step()
            for team in (1, 9):
                back.send_to(ReturnMessage(2, team).encode(), "127.0.0.1")

        probe.wait(lambda: state("robots_heard") == "1", "a player", every=answer)
        probe.wait(lambda: state("robots_heard") == "0", "its silence", every=step)
        bad = PointStamped()
        bad.header.stamp.sec = -1
        probe.wait(
            lambda: referee.says("ground_truth/ball header.stamp"), "a warning",
            every=lambda: balls.publish(bad), pause=LOST,
        )  # fmt: skip
        place = (2.4, 0.0)
        probe.wait(lambda: state("red") == "1", "a goal", every=step)
        assert state("goal_1").split()[1] == "red"
        assert float(state("goal_1").split()[0]) <= float(state("time"))
        begins = [
            each.header.stamp.sec + 1e-9 * each.header.stamp.nanosec - float(values(each)["time"])
            for each in states
        ]
        assert max(begins) - min(begins) < 0.011, "time goes by the stamps, to 10 ms"
        place = (0.0, 0.0)
        probe.wait(lambda: len(puts) >= 2, "the ball in the middle", every=step)
        assert (puts[-1].point.x, puts[-1].point.y) == (0.0, 0.0)
        assert sent
        assert all(len(data) == 118 for data in sent)
    finally:
        link.close()
        back.close()


def test_a_parameter_that_cannot_be_used_is_one_line(probe: Probe) -> None:
    for name, parameters in (
        ("player", {"start": "here"}),
        ("referee", {"minutes": 0.0}),
    ):
        process = probe.start(name, **parameters)
        assert process.wait() == 2
        assert process.log.startswith(f"{name}: ")
        assert process.log.count("\n") == 1
        probe.processes.remove(process)


def test_gait_state_is_followed(probe: Probe) -> None:
    """A robot on the ground asks the gait to get it up."""
    numbers = probe.udp_ports
    probe.start("player", scene="pitch_small", referee=False, start="'-1.5 0.0 0.0'", **numbers)
    motions = probe.subscribe(String, "gait/motion")
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    support = probe.node.create_publisher(String, "gait/support", latched)
    robot = StandingRobot(probe)

    def fallen() -> None:
        support.publish(String(data="fallen double"))
        robot.step()

    probe.wait(lambda: motions, "a request", every=fallen)
    assert motions[-1].data == "get_up"


def test_a_gait_that_was_started_again_is_told_to_search(probe: Probe) -> None:
    probe.start("player", scene="pitch_small", referee=False, **probe.udp_ports)
    modes = probe.subscribe(String, "gait/head_mode")
    robot = StandingRobot(probe)

    def see_nothing() -> None:
        for _ in range(10):
            robot.step(blind=True)

    probe.wait(lambda: len(modes) > 2, "three searches", every=see_nothing)
    assert {each.data for each in modes} == {"search"}


TF2_ROS = """
from geometry_msgs.msg import TransformStamped

class TransformBroadcaster:
    # The interface of tf2_ros, of which there is no wheel; one transform per message.
    def __init__(self, node):
        self._topic = node.create_publisher(TransformStamped, "/transforms", 100)

    def sendTransform(self, transforms):
        for each in transforms if isinstance(transforms, list) else [transforms]:
            self._topic.publish(each)
"""


def planar(pose: Any) -> tuple[float, float, float]:
    at, q = pose.position, pose.orientation
    return at.x, at.y, 2.0 * math.atan2(q.z, q.w)


def test_map_to_odom_and_odom_to_the_robot_give_its_pose_with_a_prefix(
    probe: Probe, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "tf2_ros.py").write_text(TF2_ROS)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path), prepend=os.pathsep)
    probe.start("player", scene="pitch_small", start="'-1.0 0.5 0.3'", referee=False,
                frame_prefix="red1/", **probe.udp_ports)  # fmt: skip
    transforms = probe.subscribe(TransformStamped, "/transforms")
    poses = probe.subscribe(PoseWithCovarianceStamped, "pose")
    odometry = probe.publisher(Odometry, "odom")
    images = probe.publisher(PointCloud2, "vision/percepts")
    eyes, time = Eyes(), 0

    def step() -> None:
        nonlocal time
        time += PERIOD
        message = set_stamp(Odometry(), time)
        message.header.frame_id, message.child_frame_id = "red1/odom", "red1/base_footprint"
        message.pose.pose.position.x, message.pose.pose.orientation.w = 2.0, 1.0
        odometry.publish(message)
        if time % (5 * PERIOD) == 0:
            cloud = vision_messages.percept_cloud(eyes.see(time, (-1.0, 0.5, 0.3), (0.5, 0.4)))
            images.publish(with_prefix("red1/", cloud))

    def found() -> dict[int, TransformStamped]:
        return {stamp(each): each for each in transforms if each.child_frame_id == "red1/odom"}

    probe.wait(lambda: len(found()) > 5 and len(poses) > 5, "transforms", every=step, pause=0.0)
    assert {each.header.frame_id for each in transforms} == {"red1/map"}
    assert {each.child_frame_id for each in transforms} == {"red1/odom", "red1/field"}
    compared = 0
    for pose in poses:
        assert pose.header.frame_id == "red1/field"
        if (transform := found().get(stamp(pose))) is None:
            continue
        t, q = transform.transform.translation, transform.transform.rotation
        origin = t.x, t.y, 2.0 * math.atan2(q.z, q.w)
        robot = compose(origin, (2.0, 0.0, 0.0))
        assert robot == pytest.approx(planar(pose.pose.pose), abs=1e-6)
        compared += 1
    assert compared > 3
