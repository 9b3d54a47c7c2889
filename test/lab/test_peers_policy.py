"""Learned walks: what a policy sees, what its actions do, and what is refused."""

import json
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from scores import metrics, options

from gait_lab.bench import pushes, registry
from gait_lab.bench.pushes import Cell, PushSeries
from gait_lab.bench.suites import peers
from gait_lab.bench.walks import Variant
from gait_lab.peers.policy_walk import HOW_TO_GET_IT, PolicyWalk, PolicyWalker, TruePolicyWalker
from nao_lipm_gait.whole_body.body_model import BodyModel
from robot_core.errors import NaoGaitError
from robot_core.robot import load_robot
from robot_core.types import STANDSTILL, GaitState, SensorFrame, VelocityCommand
from sim_bridge.trials.rollout import RolloutResult, RolloutSpec, rollout
from sim_bridge.trials.tasks import find_task
from sim_bridge.trials.trial import make_world

DT = 0.01
NAO = load_robot("nao_h21_v33")
STAND = dict(zip(NAO.joint_names, map(float, NAO.stand_pose), strict=True))
COUNT = len(NAO.joint_names)
TERMS = [{"of": "gravity"}, {"of": "gyro"}, {"of": "command"}, {"of": "joints"}, {"of": "action"}]
SEEN = 9 + 2 * COUNT


def write(folder: Path, weights: np.ndarray, bias: float = 0.0, **keys: Any) -> str:
    """A policy whose actions (m,) are `weights` (m, n) times what it sees, plus `bias`."""
    onnx = pytest.importorskip("onnx", reason="onnx is not installed: pip install '.[dev]'")
    pytest.importorskip("onnxruntime", reason=f"onnxruntime is not installed: {HOW_TO_GET_IT}")
    helper, kind = onnx.helper, onnx.TensorProto.FLOAT
    actions, seen = weights.shape
    graph = helper.make_graph(
        [helper.make_node("Gemm", ["seen", "weights", "bias"], ["actions"], transB=1)], "policy",
        [helper.make_tensor_value_info("seen", kind, [1, seen])],
        [helper.make_tensor_value_info("actions", kind, [1, actions])],
        [onnx.numpy_helper.from_array(np.asarray(weights, dtype=np.float32), "weights"),
         onnx.numpy_helper.from_array(np.full(actions, bias, dtype=np.float32), "bias")],
    )  # fmt: skip
    opset = [helper.make_opsetid("", 17)]
    onnx.save(
        helper.make_model(graph, opset_imports=opset, ir_version=8), folder / "network.onnx"
    )
    return describe(folder, **keys)


def describe(folder: Path, **keys: Any) -> str:
    content = {"network": "network.onnx", "pose": STAND, "observations": TERMS, **keys}
    file = folder / "stands.yaml"
    file.write_text(yaml.safe_dump({k: v for k, v in content.items() if v is not None}))
    return str(file)


def walker(path: str, *, true_velocity: bool = False) -> PolicyWalker:
    return PolicyWalk(path, true_velocity)(NAO, find_task("spot"), DT)


def frame(stamp: float, **changes: Any) -> SensorFrame:
    seen = {"joint_position": np.array(NAO.stand_pose), "angular_velocity": np.zeros(3),
            "linear_acceleration": np.array((0.0, 0.0, 9.81)), **changes}  # fmt: skip
    return SensorFrame(stamp=round(stamp * 1e9), **seen)


def test_a_policy_that_stands_stands(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    path = write(tmp_path, np.zeros((COUNT, SEEN)))
    task = find_task("stand").measured(0.5, 1.5)
    done = rollout(RolloutSpec(task, engine="mujoco", walker=PolicyWalk(path)))
    assert not done.metrics.fell
    assert done.metrics.support_changes == 0
    assert abs(done.metrics.speed_x) < 0.01


def test_a_policy_sees_its_terms_in_their_order_and_scale(tmp_path: Path) -> None:
    terms = [
        {"of": "gyro", "scale": 2.0}, {"of": "gravity"}, {"of": "command"}, {"of": "phase"},
        {"of": "joints", "joints": ["RKneePitch", "LKneePitch"], "blank": ["LKneePitch"]},
        {"of": "joint_velocities", "joints": ["RKneePitch"], "scale": 0.1},
    ]  # fmt: skip
    count = 3 + 3 + 3 + 4 + 2 + 1
    asked = {"joints": list(NAO.joint_names[:count]), "scale": 0.1, "frequency": 12.5,
             "phases": [0.0, math.pi], "rest_phases": [math.pi, math.pi],
             "command_rate": 10.0, "observations": terms}  # fmt: skip
    learned = walker(write(tmp_path, np.eye(count), **asked))
    pose = np.array(NAO.stand_pose)
    gyro = np.array((0.1, -0.2, 0.3))
    rotated = {"linear_acceleration": 9.81 * np.array((0.6, 0, 0.8))}
    command = VelocityCommand(0.3, -0.1, 0.2)

    def seen(at: float, **changes: Any) -> np.ndarray:
        targets = learned.step(frame(at, **changes), command).position
        return (targets - pose)[:count] / 0.1

    first = seen(0.0, **rotated)
    assert first[:3] == pytest.approx(np.zeros(3), abs=1e-6)
    assert first[3:6] == pytest.approx((-0.6, 0.0, -0.8), abs=1e-6)
    assert first[6:9] == pytest.approx((0.2, -0.1, 0.2), abs=1e-6), "10 per s in 0.02 s"
    assert first[9:13] == pytest.approx((1.0, -1.0, 0.0, 0.0), abs=1e-6)
    assert first[13:] == pytest.approx(np.zeros(3), abs=1e-6)
    bent = pose.copy()
    bent[[NAO.index("RKneePitch"), NAO.index("LKneePitch")]] += 0.05
    held = seen(0.01, angular_velocity=gyro, joint_position=bent)
    assert held == pytest.approx(first, abs=1e-9), "it acts every 0.02 s"
    bent[NAO.index("RKneePitch")] += 0.02
    then = seen(0.02, angular_velocity=gyro, joint_position=bent)
    assert then[:3] == pytest.approx(2.0 * gyro, abs=1e-6)
    assert then[6:9] == pytest.approx((0.3, -0.1, 0.2), abs=1e-6)
    assert then[9:13] == pytest.approx((0.0, 0.0, 1.0, -1.0), abs=1e-6), "a quarter turn"
    assert then[13:] == pytest.approx((0.07, 0.0, 0.1 * 0.02 / DT), abs=1e-6)


def test_at_rest_a_policy_sees_no_phase_or_that_of_its_file(tmp_path: Path) -> None:
    asked = {"joints": list(NAO.joint_names[:2]), "observations": [{"of": "phase"}],
             "frequency": 1.5}  # fmt: skip
    pose = np.array(NAO.stand_pose)[:2]
    for rest_phases, shown in ((None, (0.0, 0.0)), ([math.pi], (-1.0, 0.0))):
        learned = walker(write(tmp_path, np.eye(2), rest_phases=rest_phases, scale=0.1, **asked))
        targets = learned.step(frame(0.0), STANDSTILL).position[:2]
        assert (targets - pose) / 0.1 == pytest.approx(shown, abs=1e-6)


def test_targets_are_clipped_actions_within_the_limits_of_the_joints(tmp_path: Path) -> None:
    path = write(tmp_path, np.zeros((COUNT, SEEN)), bias=3.0, clip=0.5, scale=0.2)
    found = walker(path).step(frame(0.0), STANDSTILL).position
    wanted = np.clip(np.array(NAO.stand_pose) + 0.2 * 0.5, NAO.lower, NAO.upper)
    assert found == pytest.approx(wanted)
    far = write(tmp_path, np.zeros((COUNT, SEEN)), bias=3.0, scale=10.0)
    assert walker(far).step(frame(0.0), STANDSTILL).position == pytest.approx(NAO.upper)


def test_the_velocity_is_that_over_the_standing_sole_or_the_true_one(tmp_path: Path) -> None:
    """The torso turns about the ankles, on soles that lie still."""
    pytest.importorskip("mujoco")
    asked = {"joints": list(NAO.joint_names[:3]), "observations": [{"of": "velocity"}],
             "scale": 0.1}  # fmt: skip
    path = write(tmp_path, np.eye(3), **asked)
    pose = np.array(NAO.stand_pose)
    rate = 0.2
    ankles = [NAO.index("LAnklePitch"), NAO.index("RAnklePitch")]

    def seen(learned: PolicyWalker) -> np.ndarray:
        for tick in range(61):
            turned = pose.copy()
            turned[ankles] -= rate * DT * tick
            found = learned.step(
                frame(tick * DT, joint_position=turned, angular_velocity=np.array((0, rate, 0))),
                STANDSTILL,
            )
        return (found.position - pose)[:3] / 0.1

    ahead, aside, _ = seen(walker(path))
    with make_world(RolloutSpec(find_task("stand"), engine="mujoco")) as world:
        truth = world.robot.truth()
    height = float(truth.torso_position[2])
    assert 0.6 * rate * height < ahead < rate * height, "the ankle is above the sole"
    assert aside == pytest.approx(0.0, abs=1e-3)
    told = walker(path, true_velocity=True)
    assert isinstance(told, TruePolicyWalker)
    told.see(truth._replace(torso_linear_velocity_in_torso=np.array((0.4, 0.3, 0.2))))
    assert seen(told) == pytest.approx((0.4, 0.3, 0.2), abs=1e-6)


def test_the_support_is_the_lower_sole(tmp_path: Path) -> None:
    learned = walker(write(tmp_path, np.zeros((COUNT, SEEN))))
    lifted = np.array(NAO.stand_pose)
    lifted[NAO.index("LHipPitch")] -= 0.2
    lifted[NAO.index("LKneePitch")] += 0.4
    lifted[NAO.index("LAnklePitch")] -= 0.2
    for stamp, position, support in ((0, None, "left"), (1, lifted, "right"), (2, None, "right")):
        changes = {} if position is None else {"joint_position": position}
        learned.step(frame(stamp * DT, **changes), STANDSTILL)
        assert learned.status.support == support
    assert learned.status.state is GaitState.WALK
    assert learned.status.step_count == 1


@pytest.mark.parametrize(
    ("changes", "text"),
    [({"observations": [{"of": "height"}]}, "height.*one of velocity, gyro"),
     ({"observations": []}, "observations"),
     ({"joints": ["Tail"]}, "joints.*Tail.*LKneePitch"),
     ({"pose": {"Tail": 0.1}}, "pose.*Tail"),
     ({"observations": [{"of": "joints", "joints": ["Tail"]}]}, "observations.*Tail"),
     ({"gains": {"Tail": [1.0, 0.1]}}, "gains.*Tail"),
     ({"gains": {"Knee": [1.0]}}, "gains.*Knee"),
     ({"observations": TERMS[1:]}, rf"takes {SEEN} numbers.*{SEEN - 3}"),
     ({"joints": list(NAO.joint_names[1:]), "observations": [*TERMS, {"of": "joints",
       "joints": list(NAO.joint_names[:2])}]}, rf"gives {COUNT} numbers.*{COUNT - 1}"),
     ({"network": "other.onnx"}, "other.onnx.*no such file"),
     ({"network": "stands.yaml"}, "stands.yaml.*an ONNX network"),
     ({"period": 0.025}, "period.*0.025.*multiple"),
     ({"rest_phases": [0.0, 0.0]}, "rest_phases.*1"),
     ({"speed": 3}, "speed")],
)  # fmt: skip
def test_a_policy_that_does_not_fit_is_refused_in_one_line(
    tmp_path: Path, changes: dict[str, Any], text: str
) -> None:
    path = write(tmp_path, np.zeros((COUNT, SEEN)), **changes)
    with pytest.raises(NaoGaitError, match=text) as refused:
        walker(path)
    assert "\n" not in str(refused.value)


def test_a_policy_that_answers_no_number_ends_the_run(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    path = write(tmp_path, np.zeros((COUNT, SEEN)), bias=math.nan)
    spec = RolloutSpec(find_task("stand").lasting(1.0), engine="mujoco", walker=PolicyWalk(path))
    with pytest.raises(NaoGaitError, match=r"policy: action.*nan.*finite"):
        rollout(spec)


def test_without_onnxruntime_its_extra_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "onnxruntime", None)
    with pytest.raises(NaoGaitError, match=r"onnxruntime is not installed.*\[policy\]"):
        walker(describe(tmp_path))


# -- the suite -------------------------------------------------------------------------------------


def run(tmp_path: Path, *paths: str) -> dict[str, float | None]:
    file = tmp_path / "rows.json"
    given = {"robots": 1, "window": 0.2, "jobs": 1, "show": False, "tasks": ("forward=10",),
             "policy": paths, "pushes": False, "metres": 0.1}  # fmt: skip
    registry.run("peers", given, json_file=file, out=lambda text: None)
    return {row["metric"]: row["value"] for row in json.loads(file.read_text())}


def test_the_gait_and_a_policy_with_and_without_the_true_velocity(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    terms = [*TERMS, {"of": "velocity"}]
    path = write(tmp_path, np.zeros((COUNT, SEEN + 3)), observations=terms)
    rows = run(tmp_path, path)
    for name in ("classical", "stands", "stands_true_velocity"):
        assert rows[f"{name}_forward_10_upright"] == 1
        tick = rows[f"{name}_tick_mean"]
        assert tick is not None
        assert tick > 0.0
        assert rows[f"{name}_random_robots_without_fall"] == 1
    assert rows["classical_random_distance"] == pytest.approx(1e-4, rel=0.9)
    assert rows["classical_random_falls_per_km"] == 0.0
    standing = rows["stands_random_distance"]
    assert standing is not None
    assert standing < 2e-5
    assert rows["stands_forward_10_median_of_upright"] == pytest.approx(0.0, abs=1.0)
    assert rows["classical_forward_10_median_of_upright"] == pytest.approx(10.0, abs=3.0)
    with pytest.raises(NaoGaitError, match=r"policy.*different names"):
        registry.plan("peers", {"policy": (path, path)})


def test_a_policy_walks_with_the_gains_of_its_file(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    t1 = load_robot("booster_t1")
    gains = {"Hip": [200.0, 5.0], "Left": [50.0, 3.0]}
    weights = np.zeros((len(t1.joint_names), 9))
    path = write(tmp_path, weights, pose={}, observations=TERMS[:3], gains=gains)
    (run,) = registry.plan("peers", {"policy": (path,), "urdf": "booster_t1"})
    (variant,) = peers.policies(run.options).values()
    spec = variant.spec(run.options, True, find_task("spot"), 0)
    with make_world(spec) as world:
        motors = world.robot.description.motors
    found = {name: (motor.stiffness, motor.damping) for name, motor in motors.items()}
    assert found["Left_Hip_Roll"] == (200.0, 5.0), "the first that fits"
    assert found["Left_Knee_Pitch"] == (50.0, 3.0)
    own = t1.motors["Right_Knee_Pitch"]
    assert found["Right_Knee_Pitch"] == (own.stiffness, own.damping)


# -- pushes ----------------------------------------------------------------------------------------


def test_impulses_are_those_of_a_kilogram(monkeypatch: pytest.MonkeyPatch) -> None:
    mass = BodyModel(NAO).total_mass
    edges = {"forward": 0.45, "left": 1.25, "back": 0.05}

    def push_all(wanted: Any, options: Any, *_: object) -> None:
        for each, direction, impulse in wanted:
            each.cells[direction, impulse] = Cell(int(impulse <= mass * edges[direction]), 1)

    monkeypatch.setattr(peers, "walk_unpushed", lambda series, options: None)
    monkeypatch.setattr(pushes, "push_all", push_all)
    rows = peers.largest_pushes(options("peers", robots=1), {"classical": Variant()})
    found = {row.metric: (row.value, row.unit) for row in rows}
    assert found["classical_push_forward_max"] == (pytest.approx(0.4), "N s/kg")
    assert found["classical_push_left_max"] == (pytest.approx(1.2), "N s/kg")
    assert found["classical_push_back_max"] == (None, "N s/kg")


@pytest.mark.parametrize("only_falls", [False, True])
def test_who_drifts_after_a_push_has_not_fallen(
    monkeypatch: pytest.MonkeyPatch, only_falls: bool
) -> None:
    drifting = metrics(speed_x=0.3, support_changes=9)
    monkeypatch.setattr(
        pushes, "run_all", lambda specs, **_: [RolloutResult(each, drifting) for each in specs]
    )
    series = PushSeries("spot", only_falls=only_falls)
    series.unpushed = [pushes.Unpushed((6.0,), metrics())]
    pushes.push_all([(series, "left", 1.0)], options("peers", robots=1))
    assert series.cells["left", 1.0].survived == int(only_falls)
