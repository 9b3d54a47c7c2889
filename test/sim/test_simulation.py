"""The Python API: the ten lines of the README, and what it refuses."""

import math
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

import nao_lipm_gait
from nao_lipm_gait import (
    Gait,
    JointTargets,
    NaoGaitError,
    Observation,
    SensorFrame,
    Simulation,
    Velocity,
)
from robot_core.head_goals import Angles, Frame, LookAt
from sim_bridge.trials.tasks import find_task
from sim_bridge.trials.tasks import walk as walk_task
from sim_bridge.trials.trial import TimedCommands, TrialSpec, make_gait, make_world, run
from sim_bridge.world import World

ROOT = Path(__file__).resolve().parents[2]
README = ROOT / "README.md"
ROBOT = "nao_h21_v33"
STAND_TICKS = 100


def ten_lines() -> str:
    return re.findall(r"```python\n(from nao_lipm_gait import .*?)```", README.read_text(), re.S)[0]


def test_readme_and_docstring_show_the_same_lines() -> None:
    lines = ten_lines()
    assert len(lines.splitlines()) == 9
    shown = [line.strip() for line in nao_lipm_gait.__doc__.splitlines()]  # type: ignore[union-attr]
    assert all(line.strip() in shown for line in lines.splitlines())


def test_the_lines_that_measure_a_walk_measure_what_bench_does(mujoco_only: None) -> None:
    page = (ROOT / "docs" / "python.md").read_text()
    (lines,) = re.findall(r"```python\n(from nao_lipm_gait import load_preset.*?)```", page, re.S)
    names: dict = {}
    exec(lines, names)
    task = replace(find_task("side=25").lasting(8.0), name="bench")
    score = names["rollout"](replace(names["spec"], task=task)).metrics
    assert names["metrics"] == score
    assert score.speed_y > 0.2
    assert 0.0 < score.com_error_y < 0.02


@pytest.fixture
def sim(mujoco_only: None) -> Iterator[Simulation]:
    with Simulation(ROBOT) as simulation:
        yield simulation


@pytest.fixture(scope="module")
def gait() -> Gait:
    return Gait(ROBOT)


@pytest.fixture
def frame(gait: Gait) -> SensorFrame:
    upright = np.array((0.0, 0.0, 9.81))
    return SensorFrame(0, np.array(gait.robot.stand_pose), np.zeros(3), upright)


def test_the_ten_lines_end_where_the_trial_loop_ends(engine: str) -> None:
    spec = TrialSpec(robot_seed=40, engine=engine, urdf=ROBOT)
    walker = make_gait(spec)
    walker.set_parameters(Gait(ROBOT, swing_lift=0.025).parameters)

    def command_at(time: float) -> Velocity:
        return Velocity(0.2 if round(time / 0.01) > STAND_TICKS else 0.0)

    with make_world(spec) as world:
        *_, last = islice(run(world, walker, TimedCommands(command_at)), 501)
    names: dict = {}
    exec(ten_lines().replace('"mujoco"', repr(engine)), names)
    truth = names["obs"].truth
    assert truth.base_footprint == last.truth.base_footprint
    assert np.array_equal(truth.joint_position, last.truth.joint_position)
    assert truth.base_footprint[0] > 0.5, "it walked"
    assert not names["obs"].fallen


def walk(sim: Simulation, gait: Gait, ticks: int) -> list[Observation]:
    seen, targets = [sim.reset()], None
    for _ in range(ticks):
        seen.append(sim.step(targets))
        if seen[-1].frame is not None:
            targets = gait.step(seen[-1].frame, Velocity(0.1))
    return seen


def test_a_reset_repeats_the_run_and_restarts_the_gait(sim: Simulation) -> None:
    gait = Gait(ROBOT, level_soles=False)
    first, second = walk(sim, gait, 60), walk(sim, gait, 60)
    assert [obs.truth.base_footprint for obs in first] == [
        obs.truth.base_footprint for obs in second
    ]
    assert [obs.time for obs in second] == pytest.approx([0.01 * tick for tick in range(61)])
    sim.reset(seed=3)
    assert sim.world.robot.spec.seed == 3
    assert not np.array_equal(sim.step(None).truth.com, first[1].truth.com)


def test_frames_are_held_back_by_the_sensor_delay(sim: Simulation) -> None:
    sim.reset()
    ages = []
    for _ in range(8):
        obs = sim.step(None)
        ages.append(obs.frame and obs.truth.stamp - obs.frame.stamp)
    assert ages == [None] * 3 + [40_000_000] * 5


def test_no_targets_hold_the_last_ones(sim: Simulation) -> None:
    pose = np.array(sim.world.robot.description.stand_pose)
    shoulder = sim.world.robot.description.index("LShoulderPitch")
    pose[shoulder] += 0.2
    sim.reset()
    sim.step(pose)
    for _ in range(100):
        obs = sim.step(None)
    assert obs.truth.joint_position[shoulder] == pytest.approx(pose[shoulder], abs=0.05)


def test_a_push_moves_the_torso_along_its_direction(sim: Simulation) -> None:
    sim.reset()
    sim.push(2.0, math.pi / 2.0)
    for _ in range(8):
        obs = sim.step(None)
    assert obs.truth.torso_linear_velocity_in_torso[1] > 0.1


def test_a_simulation_with_a_ball_and_another_plant() -> None:
    with Simulation(engine="pybullet", plant="ideal", ball=(0.3, 0.1)) as sim:
        sim.reset()
        assert sim.step(None).frame is not None, "the ideal plant has no delay"
        assert sim.world.ball is not None


def test_an_observer_of_ones_own_is_asked(frame: SensorFrame) -> None:
    from nao_lipm_gait.walks.lipm.kalman_observer import kalman_observer

    asked = []
    gait = Gait(ROBOT, make_observer=lambda p: asked.append(p) or kalman_observer(p))
    assert asked
    gait.step(frame, Velocity())
    with pytest.raises(NaoGaitError, match="make_observer: got 'zmp'"):
        Gait(ROBOT, "zmp", make_observer=kalman_observer)


REFUSED: dict[str, Callable[[], object]] = {
    "robot: got 'nao_h22'": lambda: Gait("nao_h22"),
    "swing_lifts: got 0.03": lambda: Gait(ROBOT, swing_lifts=0.03),
    "swing_lift: got 3; allowed: a number from 0 to 0.06 m": lambda: Gait(ROBOT, swing_lift=3),
    "preset: got 'fast'; allowed: a shipped name": lambda: Gait(ROBOT, "fast"),
    "control_period: got 0": lambda: Gait(ROBOT, control_period=0),
    "control_period: got 100; allowed: a number from 0.002 to 0.05 s":
        lambda: Gait(ROBOT, control_period=100),
    "control_period: got 1000000000.0; allowed: a number from 0.002 to 1 s":
        lambda: Simulation(control_period=1e9),
    "robot: got 'hans'": lambda: Simulation("hans"),
    "engine: got 'bullet'": lambda: Simulation(engine="bullet"),
    "plant: got 'moon'": lambda: Simulation(plant="moon"),
    "seed: got -2": lambda: Simulation(seed=-2),
    "seed: got 0.5": lambda: Simulation(seed=0.5),  # type: ignore[arg-type]
    "noise_seed: got -1": lambda: Simulation(noise_seed=-1),
    "make_observer: got 3": lambda: Gait(ROBOT, make_observer=3),  # type: ignore[arg-type]
    "control_period: got 'x'": lambda: Simulation(control_period="x"),  # type: ignore[arg-type]
    "control_period: got nan": lambda: Simulation(control_period=math.nan),
    "axis: got 'z'; allowed: one of x, y, yaw": lambda: walk_task("side", y=0.2, axis="z"),
    "ball: got 1": lambda: Simulation(ball=1),  # type: ignore[arg-type]
}  # fmt: skip


@pytest.mark.parametrize("text", REFUSED)
def test_a_wrong_argument_ends_in_one_line(text: str, mujoco_only: None) -> None:
    with pytest.raises(NaoGaitError) as caught:
        REFUSED[text]()
    assert str(caught.value).startswith(text)
    assert "\n" not in str(caught.value)


def changed(array: np.ndarray, index: int, value: float) -> np.ndarray:
    copy = np.array(array)
    copy[index] = value
    return copy


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (lambda f: None, "frame: got None"),
        (lambda f: f._replace(joint_position=changed(f.joint_position, 2, math.nan)),
         "frame.joint_position[2]: got nan; allowed: a finite number"),
        (lambda f: f._replace(angular_velocity=np.array((0.0, math.inf, 0.0))),
         "frame.angular_velocity[1]: got inf"),
        (lambda f: f._replace(linear_acceleration=np.zeros(2)),
         "frame.linear_acceleration: got 'shape (2,)'"),
        (lambda f: f._replace(joint_position=f.joint_position[1:]),
         "frame.joint_position: got 'shape (21,)'; allowed: an array of shape (22,)"),
        (lambda f: f._replace(joint_position=f.joint_position.tolist()),
         "frame.joint_position: got ["),
    ],
)  # fmt: skip
def test_a_bad_frame_is_refused_and_changes_nothing(
    gait: Gait, frame: SensorFrame, change: Callable, text: str
) -> None:
    gait.step(frame, Velocity())
    before = gait.status
    with pytest.raises(NaoGaitError) as caught:
        gait.step(change(frame), Velocity())
    assert text in str(caught.value)
    assert gait.status == before


@pytest.mark.parametrize("command", [0.2, None, Velocity(math.nan), Velocity("fast")])
def test_a_bad_command_is_refused(gait: Gait, frame: SensorFrame, command: Velocity) -> None:
    with pytest.raises(NaoGaitError, match="command"):
        gait.step(frame, command)


def test_a_step_needs_a_reset_before_and_no_close(sim: Simulation) -> None:
    with pytest.raises(NaoGaitError, match="step: got 'no reset before it'"):
        sim.step(None)
    sim.reset()
    sim.close()
    for act in (lambda: sim.step(None), sim.reset, lambda: sim.push(1.0)):
        with pytest.raises(NaoGaitError, match="a closed simulation"):
            act()
    sim.close()


@pytest.mark.parametrize(
    "targets",
    ["stand", [0.0] * 21, [math.nan] * 22, JointTargets(0, np.zeros(22), 2.0),
     JointTargets(0, np.zeros(22), "stiff"), Velocity(0.1)],
)  # fmt: skip
def test_bad_targets_are_refused_and_the_simulation_goes_on(
    sim: Simulation, targets: object
) -> None:
    sim.reset()
    with pytest.raises(NaoGaitError, match="targets"):
        sim.step(targets)  # type: ignore[arg-type]
    assert sim.step(None).time == pytest.approx(0.01)


@pytest.mark.parametrize("impulse", [math.nan, 1e6, "hard", None])
def test_a_push_must_be_one_that_a_robot_can_get(sim: Simulation, impulse: float) -> None:
    sim.reset()
    with pytest.raises(NaoGaitError, match=r"impulse: .* allowed: a number from -200 to 200 N s"):
        sim.push(impulse)


WRONG = (
    math.nan, math.inf, 10**400, "x", b"x", ["x"], {"x": 1}, 1j, int, object(),
    np.zeros((2, 2)), np.array(["x"]), [[1.0], [1.0, 2.0]],
)  # fmt: skip
"""What no argument can be."""


def calls_of(gait: Gait, frame: SensorFrame, sim: Simulation) -> dict[str, Callable]:
    """Everything public that takes an argument, by what it is."""
    robot, stand, give = sim.world.robot, Velocity(), JointTargets(0, gait.robot.stand_pose)
    point = LookAt((1.0, 0.0, 0.0), Frame.TORSO)
    return {
        "gait": lambda v: Gait(v),
        **{name: lambda v, name=name: Gait(gait.robot, **{name: v})
           for name in ("parameters", "control_period", "motions", "calibration", "swing_lift")},
        "observer": lambda v: Gait(gait.robot, make_observer=lambda _: v),
        "frame": lambda v: gait.step(v, stand),
        "command": lambda v: gait.step(frame, v),
        **{name: lambda v, name=name: gait.step(frame._replace(**{name: v}), stand)
           for name in SensorFrame._fields},
        **{name: lambda v, name=name: gait.step(frame, stand._replace(**{name: v}))
           for name in Velocity._fields},
        "corrected": gait.corrected,
        "continue_at": gait.continue_at,
        "moved": lambda v: gait.restart(moved=v),
        "new parameters": gait.set_parameters,
        "motion": gait.request_motion,
        "lift": gait.request_lift,
        "look": gait.request_look,
        "pan": lambda v: gait.request_look(Angles(v, 0.0)),
        "point": lambda v: gait.request_look(replace(point, point=v)),
        "of the point": lambda v: gait.request_look(replace(point, point=(1.0, v, 0.0))),
        "frame of the point": lambda v: gait.request_look(replace(point, frame=v)),
        "ball to kick": lambda v: gait.request_kick(v, 0.0),
        "kick towards": lambda v: gait.request_kick((0.1, 0.0), v),
        "radius": lambda v: gait.request_kick((0.1, 0.0), 0.0, v),
        **{f"simulation {name}": lambda v, name=name: Simulation(**{name: v})
           for name in ("robot", "engine", "plant", "seed", "control_period", "ball")},
        "reset": sim.reset,
        "step": sim.step,
        **{name: lambda v, name=name: sim.step(give._replace(**{name: v}))
           for name in JointTargets._fields},
        "push": sim.push,
        "push towards": lambda v: sim.push(1.0, v),
        "force": lambda v: robot.push(v, 0.1),
        "duration": lambda v: robot.push(np.zeros(3), v),
        "weak joint": lambda v: robot.weaken(v, 0.5),
        "torque share": lambda v: robot.weaken("LKneePitch", v),
        "friction": robot.set_friction,
        "ball at": lambda v: sim.world.put_ball(v, 0.0),
        "ball velocity": lambda v: sim.world.put_ball(1.0, 0.0, v),
        "plant of a world": lambda v: World(v, [robot.spec]),
        "robots of a world": lambda v: World(robot.plant, v),
        **{f"task {name}": lambda v, name=name: walk_task("side", **{name: v})
           for name in ("x", "y", "yaw", "window")},
        "task": find_task,
        "robot": sim.world.reset_robot,
        "pose": lambda v: sim.world.reset_robot("", v),
    }  # fmt: skip


def refused(call: Callable, value: object) -> bool:
    try:
        call(value)
    except NaoGaitError as error:
        return "\n" not in str(error)
    return False


def test_every_argument_of_every_call_is_checked(gait: Gait, frame: SensorFrame) -> None:
    with Simulation(ROBOT, engine="pybullet", ball=(1.0, 0.0)) as sim:
        sim.reset()
        gait.step(frame, Velocity())
        for name, call in calls_of(gait, frame, sim).items():
            for wrong in WRONG:
                assert refused(call, wrong), f"{name}: {type(wrong)}"
        assert sim.step(None).time == pytest.approx(0.01)
        assert gait.step(frame._replace(stamp=10_000_000), Velocity()).stamp == 10_000_000


def test_numbers_of_numpy_are_numbers(frame: SensorFrame, mujoco_only: None) -> None:
    gaits = Gait(ROBOT), Gait(ROBOT, control_period=np.float32(0.01), swing_lift=np.float32(0.03))
    commands = Velocity(0.5), Velocity(np.float32(0.5), np.int64(0))
    for tick in range(5):
        now = frame._replace(stamp=tick * 10_000_000)
        one, other = (
            gait.step(now, command) for gait, command in zip(gaits, commands, strict=True)
        )
        assert one.position == pytest.approx(other.position, abs=1e-6)
    with Simulation(ROBOT, seed=np.int64(3)) as sim, Simulation(ROBOT, seed=3) as same:
        assert np.array_equal(sim.reset().truth.com, same.reset(np.int32(3)).truth.com)


def test_calls_after_close_and_before_a_frame_are_refused() -> None:
    with pytest.raises(NaoGaitError, match="torso_pose: got 'no frame so far'"):
        _ = Gait(ROBOT).torso_pose
    with Simulation(ROBOT, engine="pybullet", ball=(1.0, 0.0)) as sim:
        world = sim.world
    for act in (world.step, world.reset, lambda: world.put_ball(1.0, 0.0), lambda: world.ball):
        with pytest.raises(NaoGaitError, match="world: got 'a closed world'"):
            act()


def test_a_push_waits_for_the_reset() -> None:
    refused = pytest.raises(NaoGaitError, match="push: got 'no reset before it'")
    with Simulation(ROBOT) as sim, refused:
        sim.push(1.0)
