"""Bruno's motions: kept limits, the CoM over the foot that stands, and how they end in physics."""

import math

import numpy as np
import pytest

from gait_lab.bench.suites.posture import soccer_task
from nao_lipm_gait.motion.player import MotionPlayer
from nao_lipm_gait.presets import load_preset
from nao_lipm_gait.whole_body.body_model import BodyModel
from robot_core.errors import NaoGaitError
from robot_core.motion.keyframes import Posture
from robot_core.motion.library import shipped_library
from robot_core.robot import load_robot
from robot_core.types import STANDSTILL, GaitState, VelocityCommand
from sim_bridge.trials.get_up import GetUpSpec, get_up
from sim_bridge.trials.kick import KickSpec, kick
from sim_bridge.trials.motions import MotionOutcome, MotionWatch
from sim_bridge.trials.rollout import RolloutSpec, make_pair, rollout
from sim_bridge.trials.tasks import AskedMotion, Task, find_task
from sim_bridge.trials.trial import HeldCommand, run

ROBOT = load_robot("bruno")
LIBRARY = shipped_library(ROBOT)
KICKS = sorted(name for name, motion in LIBRARY.motions.items() if motion.kick is not None)
BRUNO = load_preset("bruno")
FORWARD = VelocityCommand(0.3)


def spec(**changes: object) -> RolloutSpec:
    given = {"task": find_task("stand"), "robot_seed": 4, "urdf": "bruno", "engine": "mujoco",
             "parameters": BRUNO, **changes}  # fmt: skip
    return RolloutSpec(**given)  # type: ignore[arg-type]


def test_bruno_has_motions_of_its_own_and_kicks_in_pairs() -> None:
    assert {"stand", "sit", "relax", "get_up_front", "get_up_back"} <= set(LIBRARY.motions)
    assert {"block", "dive_left", "dive_right", "roll_over_left"} <= set(LIBRARY.motions)
    assert LIBRARY.motions.keys() != shipped_library(load_robot()).motions.keys()
    kinds = {name.rsplit("_", 1)[0] for name in KICKS}
    assert kinds == {"kick_front", "kick_side", "kick_diagonal", "kick_backheel"}
    for kind in kinds:
        left, right = LIBRARY.find(f"{kind}_left").kick, LIBRARY.find(f"{kind}_right").kick
        assert left is not None
        assert right is not None
        assert (left.x, left.y, left.direction) == (right.x, -right.y, -right.direction)


@pytest.mark.parametrize("name", sorted(LIBRARY.motions))
def test_played_it_keeps_joint_limits_and_speeds(name: str) -> None:
    stand = np.array(ROBOT.stand_pose)
    player = MotionPlayer(LIBRARY.find(name), ROBOT, stand, stand)
    way = [stand]
    while not player.finished:
        position = player.advance(0.01).position
        way.append(np.where(np.isnan(position), way[-1], position))
    table = np.array(way)
    assert (table >= ROBOT.lower - 1e-9).all()
    assert (table <= ROBOT.upper + 1e-9).all()
    assert (np.abs(np.diff(table, axis=0)) <= 0.01 * ROBOT.velocity_limit).all()


@pytest.mark.parametrize("name", KICKS)
def test_on_one_leg_the_com_is_well_inside_the_standing_sole_and_the_other_foot_is_free(
    name: str,
) -> None:
    body, motion = BodyModel(ROBOT), LIBRARY.find(name)
    assert motion.balance.roll > 0.0
    assert motion.balance.pitch > 0.0
    poses = [frame for frame in motion.keyframes if frame.support]
    assert len(poses) >= 5
    for frame in poses:
        assert frame.position is not None
        com = np.array(body.set_joints(np.where(np.isnan(frame.position), 0.0, frame.position)))
        standing = body.sole_in_torso(frame.support)
        other = body.sole_in_torso(-frame.support)
        normal, forward = np.array(standing.normal), np.array(standing.forward)
        left = np.cross(normal, forward)
        offset = com - np.array(standing.position)
        assert -0.05 < offset @ forward < 0.08
        assert abs(offset @ left) < 0.03
        lift = (np.array(other.position) - np.array(standing.position)) @ normal
        assert lift > 0.002, frame.pose


# -- on the simulated robot ------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "distance"), [("kick_front_left", 1.1), ("kick_side_right", 0.35)]
)
def test_a_kick_sends_the_ball_where_it_says_and_bruno_stands(name: str, distance: float) -> None:
    pytest.importorskip("mujoco")
    result = kick(KickSpec(name, robot_seed=23, parameters=BRUNO, urdf="bruno", engine="mujoco"))
    meant = LIBRARY.find(name).kick
    assert meant is not None
    assert result.stood
    assert result.distance > distance
    assert abs(math.remainder(result.direction - meant.direction, math.tau)) < 0.15


def test_kicks_from_a_stand_and_out_of_the_walk_and_walks_on_at_once() -> None:
    pytest.importorskip("mujoco")
    asked = (AskedMotion(1.5, "kick_front_right"), AskedMotion(6.0, "kick_front_left"))
    knots = ((4.0, STANDSTILL), (4.5, FORWARD))
    task = Task("kicks", knots, 1.0, 12.0, motions=asked)
    result = rollout(spec(task=task))
    assert not result.metrics.fell
    first, second = result.motions
    for outcome in (first, second):
        assert outcome.ball is not None
        assert outcome.ball > 0.5
    assert first.began == pytest.approx(1.5, abs=0.03)
    assert second.began is not None
    assert 6.1 < second.began < 8.5 + BRUNO.zmp_stop_pause, "it stops walking and rests first"
    assert second.ended is not None
    assert second.walked is not None
    assert second.walked - second.ended < 0.1, "the command was there: no pause"


def test_a_kick_begins_and_ends_without_a_jump_of_a_joint() -> None:
    pytest.importorskip("mujoco")
    simulation, gait = make_pair(spec())
    way: list[np.ndarray] = []
    walks: list[bool] = []
    states: list[GaitState] = []
    targets = None
    with simulation:
        for tick in range(690):
            simulation.robot.command(targets)
            simulation.step()
            frame = simulation.robot.sense()
            if frame is None:
                continue
            targets = gait.step(frame, FORWARD if tick > 100 else STANDSTILL)
            way.append(targets.position)
            walks.append(gait.state is GaitState.WALK)
            if not states or states[-1] is not gait.state:
                states.append(gait.state)
            if tick == 200:
                gait.request_motion("kick_front_left")
    assert states[-4:] == [GaitState.STAND, GaitState.MOTION, GaitState.STAND, GaitState.WALK]
    # With the ticks into and out of it; the steps of the walk have a speed of their own.
    between = ~(np.array(walks[:-1]) & np.array(walks[1:]))
    speed = np.abs(np.diff(way, axis=0))[between] / 0.01
    assert (speed <= ROBOT.velocity_limit).all()


def test_what_is_asked_of_a_fallen_robot_stays_undone() -> None:
    pytest.importorskip("mujoco")
    simulation, gait = make_pair(spec())
    asked = (AskedMotion(0.2, "kick_front_right"),)
    with simulation:
        watch = MotionWatch(simulation, gait, asked)
        for tick in run(simulation, gait, HeldCommand()):
            if tick.status is not None:
                gait.report_fall()
            watch.tick()
            if simulation.time >= 0.3e9:
                break
    assert watch.outcomes == (MotionOutcome(asked[0]),)


def test_a_motion_that_the_robot_does_not_have_is_refused_before_it_walks() -> None:
    pytest.importorskip("mujoco")
    task = Task("dance", ((0.0, STANDSTILL),), 1.0, 2.0, motions=(AskedMotion(1.0, "dance"),))
    with pytest.raises(NaoGaitError, match=r"dance.*kick_front_left"):
        rollout(spec(task=task))
    with pytest.raises(NaoGaitError, match="increasing times"):
        Task("two", ((0.0, STANDSTILL),), 1.0, 2.0,
             motions=(AskedMotion(1.5, "sit"), AskedMotion(1.0, "stand")))  # fmt: skip


def test_the_soccer_sequence_has_both_front_kicks_from_a_stand_and_from_a_walk() -> None:
    task = soccer_task(0.4)
    names = [asked.name for asked in task.motions]
    assert set(names) == {"kick_front_left", "kick_front_right"}
    assert len(names) == 4
    moving = {asked.name: task.command_at(asked.time + 0.1).is_zero for asked in task.motions}
    assert moving == {"kick_front_right": True, "kick_front_left": False}


def test_it_sits_and_stands_up_and_lets_itself_down_limp() -> None:
    pytest.importorskip("mujoco")
    simulation, gait = make_pair(spec())
    targets = None

    def run(seconds: float) -> GaitState:
        nonlocal targets
        for _ in range(round(seconds * 100)):
            simulation.robot.command(targets)
            simulation.step()
            frame = simulation.robot.sense()
            if frame is not None:
                targets = gait.step(frame, STANDSTILL)
        return gait.state

    with simulation:
        run(1.0)
        height = simulation.robot.truth().torso_position[2]
        gait.request_motion("sit")
        assert run(2.5) is GaitState.MOTION
        assert simulation.robot.truth().torso_position[2] < 0.7 * height
        gait.request_stand()
        assert run(2.5) is GaitState.STAND
        assert simulation.robot.truth().torso_position[2] == pytest.approx(height, abs=0.01)
        gait.request_motion("relax")
        assert LIBRARY.find("relax").ends is Posture.LYING_FRONT
        assert run(9.0) is GaitState.RELAXED
        assert simulation.robot.truth().torso_position[2] < 0.1
        force = simulation.robot.sense()
        assert force is not None
        assert force.linear_acceleration[0] < -8.0, "on its stomach"


@pytest.mark.parametrize(
    ("side", "time"), [("front", 8.0), ("back", 9.0), ("left", 10.5), ("right", 10.5)]
)
def test_bruno_gets_up_and_walks(side: str, time: float) -> None:
    pytest.importorskip("mujoco")
    given = GetUpSpec(side, robot_seed=7, parameters=BRUNO, urdf="bruno", engine="mujoco")
    result = get_up(given)
    assert result.at_once
    assert result.time is not None
    assert result.time < time
    assert result.torque_use.max() <= 1.0 + 1e-6


@pytest.mark.parametrize(("name", "side"), [("dive_left", 1.0), ("dive_right", -1.0)])
def test_it_dives_to_the_side_and_gets_up_again(name: str, side: float) -> None:
    pytest.importorskip("mujoco")
    simulation, gait = make_pair(spec())
    began = lay = None
    with simulation:
        for tick in run(simulation, gait, HeldCommand(), past_falls=True):
            time, torso = simulation.time * 1e-9, tick.truth.torso_position
            if gait.state is GaitState.STAND and began is None and time >= 1.0:
                gait.request_motion(name)
            if gait.status.motion == name:
                began = time if began is None else began
                lay = time if lay is None and torso[2] < 0.16 else lay
            elif began is not None and gait.state is GaitState.RELAXED:
                assert side * torso[1] > 0.15, "beside where it stood"
                gait.request_motion("get_up")
            elif began is not None and gait.state is GaitState.STAND:
                break
            assert time < 25.0
    assert began is not None
    assert lay is not None
    assert lay - began < 0.75


def test_a_block_holds_a_ball_and_bruno_stands_up_again() -> None:
    pytest.importorskip("mujoco")
    asked = (AskedMotion(1.0, "block"),)
    task = Task("block", ((0.0, STANDSTILL),), 1.0, 6.0, motions=asked)
    simulation, gait = make_pair(spec(task=task))
    with simulation:
        watch = MotionWatch(simulation, gait, asked)
        for _ in run(simulation, gait, HeldCommand()):
            watch.tick()
            if simulation.time == 1_500_000_000:
                simulation.put_ball(1.0, 0.18, (-1.8, 0.0))
            if simulation.time >= 5_500_000_000:
                break
        ball = simulation.ball
    (outcome,) = watch.outcomes
    assert outcome.ended is not None
    assert ball is not None
    assert ball.position[0] > -0.1
