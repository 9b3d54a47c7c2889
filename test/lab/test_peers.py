"""Other walks on our plant: plans are played unchanged, all walks get the same commands."""

import json
import math
import os
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from scores import metrics, options, score, values

from gait_lab.bench import registry
from gait_lab.bench.suites import peers
from gait_lab.bench.walks import Variant, tasks_of, walk_all
from gait_lab.peers.placo_walk import HOW_TO_GET_IT, Placo, request, with_placo_frames
from gait_lab.peers.player import BLEND_TIME, LAG, JointPlan, PeerPlayback
from nao_lipm_gait.parameters import load_preset
from robot_core.errors import NaoGaitError
from robot_core.robot import load_robot
from robot_core.types import STANDSTILL, GaitState, SensorFrame
from sim_bridge.trials.rollout import RolloutSpec, rollout
from sim_bridge.trials.tasks import find_task

DT = 0.01
NAO = load_robot("nao_h21_v33")
PLACO_PYTHON = os.environ.get("NAO_GAIT_PLACO_PYTHON")
"""Set it to test against placo itself."""
STAND_IN = """#!{python}
import json, sys
import numpy as np
if "-c" in sys.argv:
    raise SystemExit(0)
with open(sys.argv[-2]) as file:
    asked = json.load(file)
count = round(asked["end"] / asked["period"]) + 1
stand = {stand}
np.savez(sys.argv[-1], joints=np.tile(stand, (count, 1)), support=np.zeros(count, dtype=int),
         com=np.zeros((count, 3)))
"""
"""A process that answers like placo's, with a plan that stands."""


@pytest.fixture
def stand_in(tmp_path: Path) -> str:
    return made(tmp_path, STAND_IN.format(python=sys.executable, stand=NAO.stand_pose.tolist()))


def made(folder: Path, text: str) -> str:
    file = folder / "placo_python"
    file.write_text(text)
    file.chmod(0o755)
    return str(file)


def frame(stamp: float) -> SensorFrame:
    return SensorFrame(
        stamp=round(stamp * 1e9),
        joint_position=np.array(NAO.stand_pose),
        angular_velocity=np.zeros(3),
        linear_acceleration=np.array((0.0, 0.0, 9.81)),
    )


def plan(count: int) -> JointPlan:
    """Each joint rises a little every tick; the feet change every ten."""
    joints = NAO.stand_pose + 1e-4 * np.arange(count)[:, None]
    support = np.where(np.arange(count) // 10 % 2, -1, 1)
    com = np.column_stack((np.arange(count) * 1e-3, np.zeros(count), np.full(count, 0.25)))
    return JointPlan(joints, support, com)


# -- the player ------------------------------------------------------------------------------------


def test_a_plan_is_played_by_time_even_if_frames_are_missing_and_held_at_its_end() -> None:
    planned = plan(200)
    player = PeerPlayback(NAO, planned, DT)
    assert player.step(frame(5.0), STANDSTILL).position == pytest.approx(NAO.stand_pose)
    for tick in (100, 101, 150):
        targets = player.step(frame(5.0 + tick * DT), STANDSTILL)
        expected = np.clip(planned.joints[tick], NAO.lower, NAO.upper)
        assert targets.position == pytest.approx(expected)
        assert targets.stamp == round((5.0 + tick * DT) * 1e9)
    last = player.step(frame(20.0), STANDSTILL).position
    assert last == pytest.approx(np.clip(planned.joints[-1], NAO.lower, NAO.upper))


def test_a_plan_begins_without_a_jump() -> None:
    joints = np.tile(np.clip(NAO.stand_pose + 0.1, NAO.lower, NAO.upper), (200, 1))
    player = PeerPlayback(NAO, JointPlan(joints, np.zeros(200), np.zeros((200, 3))), DT)
    positions = np.array([player.step(frame(i * DT), STANDSTILL).position for i in range(120)])
    assert np.abs(np.diff(positions, axis=0)).max() < 0.1 * 2.0 * DT / BLEND_TIME
    assert positions[-1] == pytest.approx(joints[0])
    assert player.status.state is GaitState.STAND
    assert player.status.support == "double"


def test_the_expected_com_is_that_of_a_lag_ago() -> None:
    player = PeerPlayback(NAO, plan(200), DT)
    for tick in range(58):
        player.step(frame(tick * DT), STANDSTILL)
    status = player.status
    assert status.com_expected_in_q[0] == pytest.approx((57 - round(LAG / DT)) * 1e-3)
    assert (status.support, status.step_count) == ("right", 6)
    assert math.isnan(status.com_measured_in_q[0])


# -- placo's process -------------------------------------------------------------------------------


def test_the_urdf_for_placo_has_its_three_frames() -> None:
    text = with_placo_frames(NAO, 0.024)
    model = pin.buildModelFromXML(text, pin.JointModelFreeFlyer())
    data = model.createData()
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    places = {f.name: data.oMf[i].translation for i, f in enumerate(model.frames)}
    assert places["left_foot"] - places["l_sole"] == pytest.approx((0.024, 0.0, 0.0))
    assert places["right_foot"] - places["r_sole"] == pytest.approx((0.024, 0.0, 0.0))
    assert places["trunk"] == pytest.approx(places["torso"])
    ours, theirs = ET.fromstring(NAO.urdf), ET.fromstring(text)
    assert len(theirs.findall("link")) == len(ours.findall("link")) + 3


def test_the_request_holds_the_command_and_the_joints_that_do_not_walk() -> None:
    task = find_task("forward=25")
    knots = tuple((t, c.x, c.y, c.yaw) for t, c in task.knots)
    asked = json.loads(json.dumps(request(NAO, knots, 12.0, DT)))
    assert asked["knots"] == [[3.0, 0.0, 0.0, 0.0], [6.0, 0.25, 0.0, 0.0]]
    assert set(asked["held"]).isdisjoint(NAO.leg_joints)
    assert asked["coupled"] == [["LHipYawPitch", "RHipYawPitch"]]
    assert asked["joints"] == list(NAO.joint_names)


def test_a_plan_comes_from_the_other_python(stand_in: str) -> None:
    maker = Placo(stand_in)
    maker.check()
    player = maker(NAO, find_task("forward=25").lasting(1.0), DT)
    for tick in range(200):
        targets = player.step(frame(tick * DT), STANDSTILL)
    assert targets.position == pytest.approx(NAO.stand_pose)


def test_a_python_that_cannot_plan_is_refused(tmp_path: Path) -> None:
    with pytest.raises(NaoGaitError, match="placo-python"):
        Placo(str(tmp_path / "nowhere")).check()
    without = made(tmp_path, f"#!{sys.executable}\nraise ImportError('No module named placo')\n")
    with pytest.raises(NaoGaitError, match=r"No module named placo.*pip install placo"):
        Placo(without).check()
    with pytest.raises(NaoGaitError, match="No module named placo"):
        Placo(without)(NAO, find_task("spot"), DT)
    silent = made(tmp_path, f"#!{sys.executable}\n")
    with pytest.raises(NaoGaitError, match="exit status 0"):
        Placo(silent)(NAO, find_task("spot"), DT)


@pytest.mark.skipif(PLACO_PYTHON is None, reason="NAO_GAIT_PLACO_PYTHON names no Python with placo")
def test_placo_walks_on_a_nao() -> None:
    pytest.importorskip("mujoco")
    asked = options("speed", robots=1, window=3.0, open_loop="off", tasks=("forward=25", "turn=50"))
    placo = Variant(walker=Placo(str(PLACO_PYTHON)))
    ((forward, turn),) = walk_all(asked, tasks_of(asked), [placo])
    assert len(forward.upright) == len(turn.upright) == 1
    assert 20.0 < forward.speeds[0] < 28.0
    assert 25.0 < turn.speeds[0] < 60.0
    assert forward.results[0].metrics.support_changes > 10
    assert forward.results[0].metrics.com_error_y < 0.012


# -- the suite -------------------------------------------------------------------------------------


def run(tmp_path: Path, **asked: object) -> tuple[dict[str, float | None], str]:
    file = tmp_path / "rows.json"
    said: list[str] = []
    given = {"robots": 1, "window": 0.5, "jobs": 1, "show": False, "phases": 1,
             "tasks": ("forward=10",), **asked}  # fmt: skip
    registry.run("peers", given, json_file=file, out=said.append)
    return {row["metric"]: row["value"] for row in json.loads(file.read_text())}, said[0]


def test_every_peer_walks_as_it_does_alone(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    names = ("zmp_gyro", "paper", "default")
    rows, text = run(tmp_path, only=names)
    task = find_task("forward=10").lasting(0.5)
    for name in names:
        parameters = peers.SWEEP.variants[name].variant.of(load_preset("default"))
        alone = rollout(RolloutSpec(task, engine="mujoco", parameters=parameters)).metrics
        assert rows[f"{name}_forward_upright"] == 1
        speed = rows[f"{name}_forward_median_of_upright"]
        assert speed == pytest.approx(100.0 * alone.speed_x)
        off = 100.0 * math.hypot(alone.speed_x - 0.1, alone.speed_y)
        assert rows[f"{name}_forward_off_worst"] == pytest.approx(off)
        turn = abs(math.degrees(alone.turn_rate))
        assert rows[f"{name}_forward_yaw_off_worst"] == pytest.approx(turn)
    assert rows["default_push_left_1.5_survival"] == 100.0
    assert not any(name.startswith("placo") for name in rows)
    assert HOW_TO_GET_IT in " ".join(text.split())


def test_the_worst_robot_is_the_farthest_from_the_command() -> None:
    turning = (metrics(turn_rate=math.radians(rate)) for rate in (45.0, 50.0, 62.0))
    rows = values(
        score("turn=50", *turning).rows("farthest", "median_of_upright", "yaw_off_worst")
    )
    assert rows["turn_worst"] == pytest.approx(62.0)
    assert rows["turn_median_of_upright"] == pytest.approx(50.0)
    assert rows["turn_yaw_off_worst"] == pytest.approx(12.0)
    fallen = score("turn=50", metrics(turn_rate=1.0, fell=True, fall_time=4.0))
    rows = values(fallen.rows("upright", "farthest", "yaw_off_worst"))
    assert rows["turn_upright"] == 0
    assert rows["turn_worst"] is rows["turn_yaw_off_worst"] is None


def test_placo_has_a_row_when_its_python_is_named(tmp_path: Path, stand_in: str) -> None:
    pytest.importorskip("mujoco")
    rows, text = run(tmp_path, placo_python=stand_in, only=("open_loop",))
    assert rows["placo_forward_upright"] == 1
    assert rows["placo_forward_median_of_upright"] == pytest.approx(0.0, abs=0.5), "it stands"
    assert rows["placo_push_left_1.5_survival"] == 0.0, "it does not step"
    assert "placo_falls" not in rows
    assert HOW_TO_GET_IT not in text


def test_only_naos_and_only_a_python_with_placo(tmp_path: Path) -> None:
    with pytest.raises(NaoGaitError, match="nao_h21"):
        run(tmp_path, urdf="bruno")
    with pytest.raises(NaoGaitError, match="placo-python"):
        run(tmp_path, placo_python=str(tmp_path / "nowhere"))
