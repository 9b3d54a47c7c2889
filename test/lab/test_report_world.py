"""The report of what a player estimated: errors of its pose and ball against the bag's truth."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rclpy")
pytest.importorskip("mujoco")
pytest.importorskip("plotly")

from geometry_msgs.msg import PointStamped
from std_msgs.msg import Bool, String

from gait_lab.report.analysis import analyse
from gait_lab.report.figures import world
from nao_soccer.ros import player_messages
from nao_soccer.world.state import BallEstimate, PoseEstimate
from robot_core.ros.messages import to_time
from robot_core.types import PoseCovariance
from sim_bridge.scene import Scene, SceneRobot
from sim_bridge.trials.rollout import RolloutSpec
from sim_bridge.trials.tasks import TASKS
from walk_bag import write_walk

SPEC = RolloutSpec(task=TASKS["spot"].lasting(0.2), engine="mujoco", robot_seed=-1)
STAMPS = [round(1e8 * index) for index in range(2, 8)]
"""[ns] The robot still stands at the origin and looks along x."""
OFF, TURNED = (0.06, 0.08), 0.05
"""[m, rad] Errors of what it estimated."""
BALL = (1.0, 0.2)
"""[m] True place of the ball."""


@pytest.mark.parametrize(("team", "side"), [("red", 1.0), ("blue", -1.0)])
def test_errors_of_pose_and_ball_are_those_that_were_made(
    team: str, side: float, tmp_path: Path
) -> None:
    name = f"{team}1"
    variances = PoseCovariance(xx=0.04, yy=0.01, yaw=0.0025)
    yaw = TURNED + (0.0 if side > 0.0 else math.pi)
    rows: list[tuple[str, int, Any]] = []
    for stamp in STAMPS:
        true_ball = PointStamped()
        true_ball.header.stamp = to_time(stamp)
        true_ball.point.x, true_ball.point.y = BALL
        own = PoseEstimate((side * OFF[0], side * OFF[1], yaw), variances, stamp > STAMPS[2])
        estimated = (side * (BALL[0] + 0.1), side * BALL[1])
        flat = (0.01, 0.0, 0.01)
        ball = BallEstimate(
            (0.0, 0.0), (0.0, 0.0), flat, estimated, (0.0, 0.0), flat, flat, 0.0, True
        )
        rows += [
            ("/ground_truth/ball", stamp, true_ball),
            (f"/{name}/pose", stamp, player_messages.pose(stamp, own)),
            (f"/{name}/pose_valid", stamp, Bool(data=own.valid)),
            (f"/{name}/ball", stamp, player_messages.ball(stamp, ball, 0.05)),
        ]
    robot = SceneRobot(name=name, team=team, number=1, urdf="nao_h21_v33", pose=(0.0, 0.0, 0.0))
    rows.append(("/scene_description", 0, String(data=Scene("s", (robot,)).to_yaml())))
    bag = write_walk(tmp_path / "bag", SPEC, prefix=f"/{name}", also=rows).bag
    analysis = analyse(bag, name)
    found = analysis.world
    assert found is not None
    assert found.stamp.tolist() == STAMPS
    # The robot has swayed and slid by millimetres.
    assert found.place_error == pytest.approx(math.hypot(*OFF), abs=0.01)
    assert found.heading_error == pytest.approx(TURNED, abs=0.01)
    assert found.place_deviation == pytest.approx(0.2)
    assert found.heading_deviation == pytest.approx(0.05)
    assert found.valid.tolist() == [False] * 3 + [True] * 3
    assert found.ball_error == pytest.approx(0.1)
    assert np.array_equal(found.ball_stamp, found.stamp)
    assert {line.panel for line in world(analysis)} == {"place [cm]", "heading [°]", "ball [cm]"}
