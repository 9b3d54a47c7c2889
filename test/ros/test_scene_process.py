"""`sim_bridge` with a scene: topics per robot, lockstep with all of them, reset of one."""

import math
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import pytest
import yaml
from geometry_msgs.msg import PointStamped, PoseStamped
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger

from robot_core.robot import RobotDescription, load_robot
from robot_core.ros.topics import LATCHED
from ros_probe import Messages, Probe, set_stamp, stamp

NAMES = ("red1", "blue1")
KINDS = {"red1": load_robot(), "blue1": load_robot("bruno")}
SCENE = {
    "field": {},
    "goals": {},
    "ball": {},
    "robots": [
        {"name": "red1", "team": "red", "number": 1, "urdf": "nao_h21_v33", "pose": [-1, 0, 0]},
        {"name": "blue1", "team": "blue", "number": 1, "urdf": "bruno", "pose": [1, 0, 3.1]},
    ],
}


class Side:
    """The controller of one robot.

    Attributes:
        answers: Whether it answers each joint state as it comes.
        answered: Latest stamp [ns] that it has answered.
    """

    def __init__(self, probe: Probe, name: str) -> None:
        self.robot: RobotDescription = KINDS[name]
        self.answers = False
        self.answered = -1
        self.joints: Messages = probe.subscribe(
            JointState, f"/{name}/joint_states", callback=self._on_joints
        )
        self.imu = probe.subscribe(Imu, f"/{name}/imu/data")
        self.odometry = probe.subscribe(Odometry, f"/{name}/ground_truth/odom")
        self.description = probe.subscribe(String, f"/{name}/robot_description", LATCHED)
        self._command = probe.publisher(JointState, f"/{name}/joint_command")

    def _on_joints(self, _message: JointState) -> None:
        if self.answers:
            self.answer()

    def answer(self) -> None:
        """Stand."""
        position = [float(angle) for angle in self.robot.stand_pose]
        message = JointState(name=list(self.robot.joint_names), position=position)
        self.answered = max(self.answered, stamp(self.joints[-1]))
        self._command.publish(set_stamp(message, stamp(self.joints[-1])))


class Pitch:
    """The bridge with a NAO and a Bruno in lockstep."""

    def __init__(self, probe: Probe, folder: Path) -> None:
        path = folder / "duel.yaml"
        path.write_text(yaml.safe_dump(SCENE))
        self.probe = probe
        self.clock = probe.subscribe(Clock, "/clock")
        self.place = probe.subscribe(String, "/ground_truth/ball_place", LATCHED)
        self.ball = probe.subscribe(PointStamped, "/ground_truth/ball")
        self.bridge = probe.start("sim_bridge", scene=path, lockstep=True, real_time_factor=0.0)
        self.sides = {name: Side(probe, name) for name in NAMES}
        for side in self.sides.values():
            probe.wait(lambda side=side: side.joints, "joint_states")

    @property
    def time(self) -> int:
        """[ns] of the world; -1 before the first message, which discovery may lose."""
        if not self.clock:
            return -1
        clock = self.clock[-1].clock
        return int(clock.sec) * 1_000_000_000 + int(clock.nanosec)

    def run(self, until: Callable[[], object], what: str) -> None:
        """Answer for all robots until something is true."""
        for side in self.sides.values():
            side.answers = True
            side.answer()
        self.probe.wait(until, what)
        for side in self.sides.values():
            side.answers = False

    def step(self) -> None:
        """Answer for all robots, until the world has made a step."""
        last = self.time
        self.run(lambda: self.time > last, "the next step")

    def rest(self) -> None:
        """Step on to a reading of all robots that nobody has answered yet."""
        last = max(side.answered for side in self.sides.values())

        def answer() -> None:
            for side in self.sides.values():
                if stamp(side.joints[-1]) <= last:
                    side.answer()

        self.probe.wait(
            lambda: all(stamp(side.joints[-1]) > last for side in self.sides.values()),
            "readings that wait", every=answer,
        )  # fmt: skip


@pytest.fixture
def pitch(probe: Probe, tmp_path: Path) -> Pitch:
    return Pitch(probe, tmp_path)


def test_the_world_waits_for_every_robot(pitch: Pitch) -> None:
    probe, (red, blue) = pitch.probe, (pitch.sides[name] for name in NAMES)
    for _ in range(3):
        pitch.step()
    assert red.description[-1].data == red.robot.urdf
    assert blue.description[-1].data == blue.robot.urdf
    assert red.odometry[-1].pose.pose.position.x == pytest.approx(-1.0, abs=0.02)
    assert blue.odometry[-1].pose.pose.position.x == pytest.approx(1.0, abs=0.02)
    assert len(blue.joints[-1].name) == len(blue.robot.joint_names)
    pitch.rest()
    frozen, times_red, times_blue = stamp(red.joints[-1]), 0, 0

    def only_blue_is_asked() -> bool:
        """Blue is asked three times in a row; red, which has answered, not once."""
        nonlocal times_red, times_blue
        if len(red.joints) > times_red:
            times_red, times_blue = len(red.joints), len(blue.joints)
        return len(blue.joints) > times_blue + 2

    probe.wait(only_blue_is_asked, "blue1 alone to be asked again", every=red.answer)
    assert stamp(red.joints[-1]) == stamp(blue.joints[-1]) == frozen
    probe.wait(
        lambda: min(stamp(red.joints[-1]), stamp(blue.joints[-1])) > frozen, "both next readings",
        every=blue.answer,
    )  # fmt: skip


def test_the_ball_is_the_world_s(pitch: Pitch) -> None:
    pitch.step()
    assert pitch.place[-1].data == "in_play"
    put = pitch.probe.publisher(PointStamped, "/put_ball")
    for x, y, place in ((4.7, 0.2, "in_blue_goal"), (0.0, 3.5, "out"), (0.5, 0.0, "in_play")):
        message = PointStamped()
        message.point.x, message.point.y = x, y
        put.publish(message)

        def there(x: float = x, y: float = y, place: str = place) -> bool:
            point = pitch.ball[-1].point
            return abs(point.x - x) + abs(point.y - y) < 0.01 and pitch.place[-1].data == place

        pitch.run(there, f"the ball {place}")


def test_reset_of_one_robot_and_of_the_world(pitch: Pitch) -> None:
    probe = pitch.probe
    for _ in range(3):
        pitch.step()
    red, blue = (pitch.sides[name] for name in NAMES)

    def reset(service: str) -> None:
        answer = probe.call(Trigger, service, Trigger.Request())
        assert answer.success
        assert "back at the start" in answer.message

    def longest_gap(side: Side) -> int:
        stamps = sorted({stamp(message) for message in side.joints})
        return max(after - before for before, after in pairwise(stamps))

    reset("/red1/sim_bridge/reset")
    pitch.run(lambda: longest_gap(red) >= 600_000_000, "0.6 s without sensors of red1")
    assert longest_gap(blue) == 10_000_000, "the other robot's sensors went on"
    reset("/sim_bridge/reset")
    puts = probe.publisher(PoseStamped, "/red1/put_robot")
    message = PoseStamped()
    message.pose.position.x, message.pose.position.y = -1.6, 1.7
    message.pose.orientation.z, message.pose.orientation.w = -math.sqrt(0.5), math.sqrt(0.5)
    puts.publish(message)

    def away() -> bool:
        at = red.odometry[-1].pose.pose.position
        return math.dist((at.x, at.y), (-1.6, 1.7)) < 0.05

    pitch.run(away, "red1 beside the touch line")


@pytest.mark.parametrize(
    ("parameters", "reason"),
    [
        ({"scene": "stadium"}, "got 'stadium'; allowed: a shipped name .*pitch_small"),
        ({"scene": "pitch", "robot_seed": 3}, "robot_seed: got 3; .* scene pitch"),
        ({"scene": "pitch", "ball": True}, "ball: got True; .* scene pitch"),
        ({"scene": "pitch", "plant": "worn"}, "worn: motor.* with engine pybullet"),
    ],
)
def test_a_scene_that_cannot_be_is_one_line(
    probe: Probe, parameters: dict[str, object], reason: str
) -> None:
    bridge = probe.start("sim_bridge", **parameters)
    assert bridge.wait() == 2
    assert bridge.says(f"sim_bridge: (parameter scene: )?{reason}"), bridge.log
    assert len(bridge.log.strip().splitlines()) == 1
