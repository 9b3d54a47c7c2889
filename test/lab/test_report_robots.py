"""The report of one robot out of a bag with several: its walk, and what it saw."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rclpy")
pytest.importorskip("mujoco")
pytest.importorskip("plotly")

from geometry_msgs.msg import PointStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from gait_lab import cli
from gait_lab.report.analysis import analyse
from nao_soccer.ros.vision_messages import percept_cloud
from nao_soccer.vision.percepts import Kind, Percept, Percepts
from robot_core.errors import NaoGaitError
from robot_core.ros.messages import to_time
from sim_bridge.scene import Scene, SceneRobot
from sim_bridge.trials.rollout import RolloutSpec
from sim_bridge.trials.tasks import TASKS
from walk_bag import write_walk

SPEC = RolloutSpec(task=TASKS["forward"].lasting(1.0), engine="mujoco", robot_seed=-1)
"""The nominal robot: encoder offsets would turn its base_footprint."""
IMAGES = [round(1e8 * index) for index in range(5, 10)]
"""[ns] Times of the images; the robot still stands near the origin."""
BALL, BLUE = (1.0, 0.2), (2.0, -0.5)
"""[m] True places of the ball and of the other robot."""


def percepts(stamp: int) -> Any:
    """`vision/percepts` with the ball 3 cm too far and the robot 10 cm beside its place."""
    ball = Percept(Kind.BALL, (BALL[0] + 0.03, BALL[1]), (1e-4, 0.0, 1e-4))
    blue = Percept(Kind.ROBOT_BLUE, (BLUE[0], BLUE[1] + 0.1), (1e-4, 0.0, 1e-4))
    return percept_cloud(Percepts(stamp, ball, (blue,)))


def others() -> list[tuple[str, int, Any]]:
    """Topics of the world, of another robot, and of the vision of the first."""
    rows: list[tuple[str, int, Any]] = []
    for stamp in IMAGES:
        ball, blue, joints = PointStamped(), Odometry(), JointState()
        for message in (ball, blue, joints):
            message.header.stamp = to_time(stamp)
        ball.point.x, ball.point.y = BALL
        blue.pose.pose.position.x, blue.pose.pose.position.y = BLUE
        blue.pose.pose.orientation.w = 1.0
        joints.name, joints.position = ["HeadYaw"], [0.0]
        joints.velocity, joints.effort = [0.0], [0.0]
        rows += [
            ("/ground_truth/ball", stamp, ball),
            ("/blue1/ground_truth/odom", stamp, blue),
            ("/blue1/joint_states", stamp, joints),
            ("/red1/vision/percepts", stamp + 100_000_000, percepts(stamp)),
        ]
    robot = SceneRobot(name="red1", team="red", number=1, urdf="nao_h21_v33", pose=(0.0, 0.0, 0.0))
    return [*rows, ("/scene_description", 0, String(data=Scene("s", (robot,)).to_yaml()))]


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_walk(
        tmp_path_factory.mktemp("walk") / "bag", SPEC, prefix="/red1", also=others()
    ).bag


def test_one_robot_is_reported_with_what_it_saw(bag: Path, tmp_path: Path) -> None:
    page = tmp_path / "r.html"
    assert cli.main(["report", str(bag), "--robot", "red1", "-o", str(page)]) == 0
    text = page.read_text(encoding="utf-8")
    data = re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.S)
    assert data is not None
    figures = {each["id"] for each in json.loads(data[1].replace("<\\/", "</"))["figures"]}
    assert {"speeds", "com", "steps", "percepts"} <= figures
    assert 'id="seen"' in text


def test_errors_are_distances_from_the_truth(bag: Path) -> None:
    analysis = analyse(bag, "red1")
    seen = analysis.percepts
    assert seen is not None
    assert seen.stamp.tolist() == IMAGES
    ball, robots = seen.group("ball"), seen.group("robots")
    assert ball is not None
    assert robots is not None
    assert ball.position == pytest.approx(np.tile((BALL[0] + 0.03, BALL[1]), (5, 1)), abs=1e-6)
    # The robot has swayed and slid by millimetres.
    assert ball.error == pytest.approx(0.03, abs=0.01)
    assert robots.error == pytest.approx(0.1, abs=0.02)
    assert seen.group("crossings") is None
    assert analysis.walk.others.keys() == {"blue1"}
    assert len(analysis.walk.position) > 100, "the walk is that of red1"


@pytest.mark.parametrize("robot", ["", "green"])
def test_a_bag_of_several_robots_names_them(
    bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], robot: str
) -> None:
    given = ["--robot", robot] if robot else []
    assert cli.main(["report", str(bag), *given, "-o", str(tmp_path / "r.html")]) == 2
    said = capsys.readouterr().err
    got = robot or "nothing"
    assert f"--robot: got '{got}'; allowed: one of blue1, red1" in said
    assert len(said.splitlines()) == 1
    with pytest.raises(NaoGaitError):
        analyse(bag, robot)
