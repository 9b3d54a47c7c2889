"""The second paper's walk: its equations hold, and it starts, stops and steers like a walk."""

import math
from collections.abc import Sequence

import numpy as np
import pytest

from nao_lipm_gait.gait import Gait
from nao_lipm_gait.parameters import GaitParameters, load_preset
from nao_lipm_gait.walks.base import BodyTargets, SoleTarget, Walk, make_walk
from nao_lipm_gait.walks.lipm.walk import LipmWalk
from nao_lipm_gait.walks.preview.walk import PreviewWalk
from nao_lipm_gait.walks.zmp.trajectories import (
    entry_speed,
    lift,
    lift_up,
    sway,
    swing_in,
    swing_out,
    travel,
)
from nao_lipm_gait.walks.zmp.walk import ZmpWalk
from robot_core.errors import NaoGaitError
from robot_core.geometry import compose
from robot_core.robot import load_robot
from robot_core.types import GRAVITY, STANDSTILL, GaitState, SensorFrame, VelocityCommand

DT = 0.01
ZMP = GaitParameters(walk="zmp")
W = math.sqrt(GRAVITY / 0.24)
HALF = 0.35
C_3 = 0.75
"""c_3 as published."""
DOUBLE_SUPPORT = 1.0 - math.cos(C_3)
FORWARD = VelocityCommand(0.1, 0.0, 0.0)


# -- the equations ---------------------------------------------------------------------------------


@pytest.mark.parametrize("t", np.linspace(-HALF / 2, HALF / 2, 9))
def test_sway_solves_the_pendulum_and_keeps_the_desired_zmp(t: float) -> None:
    y, velocity, acceleration = sway(t, HALF, 0.05, W)
    assert acceleration == pytest.approx(W * W * (y - 0.05)), "(1) with tau = 0"
    assert y - acceleration / (W * W) == pytest.approx(0.05), "(3)"
    step = 1e-6
    slope = (sway(t + step, HALF, 0.05, W)[0] - sway(t - step, HALF, 0.05, W)[0]) / (2.0 * step)
    assert velocity == pytest.approx(slope, abs=1e-6)


def test_sway_is_as_published() -> None:
    c_1 = -0.05 / (math.exp(W * HALF / 2) + math.exp(-W * HALF / 2))  # T/4 is half a half stride
    for t in (-0.1, 0.0, 0.07):
        published = c_1 * math.exp(W * t) + c_1 * math.exp(-W * t) + 0.05
        assert sway(t, HALF, 0.05, W)[0] == pytest.approx(published)
    assert sway(HALF / 2, HALF, 0.05, W)[0] == pytest.approx(0.0, abs=1e-15)


def test_neighbouring_half_strides_meet_with_one_speed() -> None:
    leaving, entering = sway(HALF / 2, HALF, 0.05, W), sway(-HALF / 2, HALF, 0.05, W)
    assert leaving[1] == pytest.approx(-entering[1])
    assert entry_speed(HALF, 0.05, W) == entering[1] > 0.0


@pytest.mark.parametrize("share", np.linspace(0.0, 1.0, 11))
def test_lift_is_the_published_arcsine_above_the_ground(share: float) -> None:
    raw = math.pi / 2.0 - math.asin(1.0 - share) - C_3
    top = math.pi / 2.0 - C_3
    assert lift_up(share, DOUBLE_SUPPORT) == pytest.approx(max(0.0, raw / top), abs=1e-12)
    assert lift(share / 2.0, DOUBLE_SUPPORT) == pytest.approx(lift_up(share, DOUBLE_SUPPORT))
    assert lift(1.0 - share / 2.0, DOUBLE_SUPPORT) == pytest.approx(
        lift(share / 2.0, DOUBLE_SUPPORT)
    )


def test_a_foot_travels_evenly_and_only_while_it_is_up() -> None:
    shares = np.linspace(0.0, 1.0, 201)
    gone = np.array([travel(share, 0.2) for share in shares])
    up = np.array([lift(share, 0.2) > 0.0 for share in shares])
    moves = np.diff(gone)
    assert gone[0] == 0.0
    assert gone[-1] == pytest.approx(1.0)
    assert (moves[~up[:-1] & ~up[1:]] == 0.0).all()
    inside = moves[up[:-1] & up[1:]]
    assert inside == pytest.approx(inside[0])
    assert [travel(share, 0.0) for share in shares] == pytest.approx(shares), "(4) as printed"


def test_weight_swings_in_from_rest_and_out_to_rest() -> None:
    step = 1e-7
    for shape, at_start, at_end in ((swing_in, 0.0, 0.3), (swing_out, 0.3, 0.0)):
        for time, speed in ((0.0, at_start), (HALF, at_end)):
            assert shape(time, HALF, 0.3) == pytest.approx(0.0, abs=1e-15)
            slope = (shape(time + step, HALF, 0.3) - shape(time - step, HALF, 0.3)) / (2 * step)
            assert slope == pytest.approx(speed, abs=1e-6)


# -- the walk --------------------------------------------------------------------------------------


def walked(walk: Walk, command: VelocityCommand, seconds: float) -> list[BodyTargets]:
    targets = []
    for _ in range(round(seconds / DT)):
        walk.expect()
        walk.observe(0.0, 0.0)
        targets.append(walk.plan(command))
    return targets


def started(command: VelocityCommand = FORWARD, name: str = "zmp") -> Walk:
    walk = make_walk(GaitParameters(walk=name), DT)
    walked(walk, STANDSTILL, 0.3)
    walk.start(command)
    return walk


def in_odom(targets: BodyTargets, sole: SoleTarget) -> np.ndarray:
    x, y, yaw = compose(targets.q_in_odom, (sole.x, sole.y, sole.yaw))
    return np.array((x, y, sole.z, yaw))


@pytest.mark.parametrize(
    "command",
    [
        FORWARD,
        VelocityCommand(-0.1, 0.0, 0.0),
        VelocityCommand(0.0, 0.08, 0.0),
        VelocityCommand(0.0, 0.0, 0.6),
        VelocityCommand(0.1, -0.04, 0.4),
    ],
)
def test_nothing_jumps_and_a_standing_foot_stands(command: VelocityCommand) -> None:
    walk = started(command)
    targets = walked(walk, command, 5.0) + walked(walk, STANDSTILL, 4.0)
    assert walk.finished
    coms = np.array([compose(t.q_in_odom, (*t.com_in_q[:2], 0.0))[:2] for t in targets])
    assert np.abs(np.diff(coms, axis=0)).max() < 0.006
    lefts = np.array([in_odom(t, t.left_sole) for t in targets])
    rights = np.array([in_odom(t, t.right_sole) for t in targets])
    for soles in (lefts, rights):
        assert np.abs(np.diff(soles[:, :2], axis=0)).max() < 0.03
    moves = [np.abs(np.diff(soles, axis=0)).max(axis=1) > 1e-9 for soles in (lefts, rights)]
    assert not (moves[0] & moves[1]).any(), "one foot at a time"
    assert ((lefts[:, 2] == 0.0) | (rights[:, 2] == 0.0)).all()


@pytest.mark.parametrize("name", ["zmp", "preview"])
@pytest.mark.parametrize(
    ("command", "axis"),
    [
        (VelocityCommand(0.12, 0.0, 0.0), 0),
        (VelocityCommand(-0.1, 0.0, 0.0), 0),
        (VelocityCommand(0.0, 0.08, 0.0), 1),
        (VelocityCommand(0.0, 0.0, 0.5), 2),
    ],
)
def test_walks_at_the_commanded_speed(command: VelocityCommand, axis: int, name: str) -> None:
    walk = started(command, name)
    walked(walk, command, 4.0)
    before = walk.predicted.q_in_odom[axis]
    walked(walk, command, 7.0)  # a whole number of full strides of 0.7 s
    speed = (walk.predicted.q_in_odom[axis] - before) / 7.0
    assert speed == pytest.approx((command.x, command.y, command.yaw)[axis], rel=1e-6)


def test_both_feet_stand_for_the_published_share_of_a_step() -> None:
    walk = started()
    targets = walked(walk, FORWARD, 10.5)[350:]
    down = [t.left_sole.z == t.right_sole.z == 0.0 for t in targets]
    assert np.mean(down) == pytest.approx(DOUBLE_SUPPORT, abs=0.03)
    highest = max(max(t.left_sole.z, t.right_sole.z) for t in targets)
    assert highest == pytest.approx(ZMP.swing_lift, rel=0.1)


@pytest.mark.parametrize("name", ["zmp", "preview"])
def test_mirrored_commands_give_mirrored_walks(name: str) -> None:
    one, other = VelocityCommand(0.1, 0.05, 0.3), VelocityCommand(0.1, -0.05, -0.3)
    for a, b in zip(
        walked(started(one, name), one, 3.0), walked(started(other, name), other, 3.0), strict=True
    ):
        assert a.com_in_q == pytest.approx((b.com_in_q[0], -b.com_in_q[1], b.com_in_q[2]))
        left, right = a.left_sole, b.right_sole
        assert (left.x, left.y, left.z) == pytest.approx((right.x, -right.y, right.z))


@pytest.mark.parametrize("name", ["zmp", "preview"])
def test_a_walk_is_the_same_wherever_it_begins(name: str) -> None:
    here, there = (make_walk(GaitParameters(walk=name), DT) for _ in range(2))
    there.stand_at((40.0, -7.0, 2.0))
    command = VelocityCommand(0.15, 0.03, 0.2)
    for walk in (here, there):
        walk.start(command)
    for a, b in zip(walked(here, command, 3.0), walked(there, command, 3.0), strict=True):
        assert a.com_in_q == pytest.approx(b.com_in_q, abs=1e-9)


def test_the_expected_com_was_sent_one_delay_ago() -> None:
    walk = started()
    sent, expected = [], []
    for _ in range(200):
        expected.append(walk.expect().com_in_q)
        walk.observe(0.0, 0.0)
        sent.append(walk.plan(FORWARD).com_in_q[:2])
    ticks = round(ZMP.feedback_delay / DT)
    assert expected[ticks:] == sent[:-ticks]


def test_parameters_change_with_the_next_half_stride_and_move_no_standing_foot() -> None:
    walk = ZmpWalk(ZMP, DT)
    (before,) = walked(walk, STANDSTILL, DT)
    walk.set_parameters(ZMP.replace(foot_spacing=0.15, foot_reference_x=0.0))
    after = walked(walk, STANDSTILL, 0.2)[-1]
    for side in ("left_sole", "right_sole"):
        one, other = getattr(after, side), getattr(before, side)
        assert (one.x, one.y, one.yaw) == (other.x, other.y, other.yaw)
    walk.start(FORWARD)
    targets = walked(walk, FORWARD, 3.0)[-1]
    assert abs(targets.left_sole.y - targets.right_sole.y) == pytest.approx(0.15, abs=1e-6)


# -- behind the gait -------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["zmp", "preview"])
def test_a_stop_lasts_longer_by_the_pause_and_nothing_moves_in_it(name: str) -> None:
    def stopping(pause: float) -> list[BodyTargets]:
        walk = make_walk(GaitParameters(walk=name, zmp_stop_pause=pause), DT)
        walk.start(FORWARD)
        for _ in range(300):
            walk.expect()
            walk.plan(FORWARD)
        targets: list[BodyTargets] = []
        while not walk.finished:
            assert len(targets) < 1000
            walk.expect()
            targets.append(walk.plan(STANDSTILL))
            assert not walk.finished or walk.stopping
        return targets

    at_once, later = stopping(0.0), stopping(0.5)
    assert len(later) - len(at_once) == pytest.approx(0.5 / DT)
    assert [each.com_in_q for each in later[: len(at_once) - 5]] == [
        each.com_in_q for each in at_once[:-5]
    ]
    resting = np.array([each.com_in_q for each in later[-50:]])
    assert np.ptp(resting, axis=0).max() < 1e-3, "at rest in the pause"


def test_the_parameter_chooses_the_walk() -> None:
    assert isinstance(make_walk(GaitParameters(), DT), LipmWalk)
    assert isinstance(make_walk(ZMP, DT), ZmpWalk)
    assert isinstance(make_walk(GaitParameters(walk="preview"), DT), PreviewWalk)
    with pytest.raises(NaoGaitError, match="lipm, zmp"):
        GaitParameters(walk="hop")


def frames(robot_joints: Sequence[float], count: int) -> list[SensorFrame]:
    return [
        SensorFrame(
            stamp=round((i + 1) * DT * 1e9),
            joint_position=np.array(robot_joints),
            angular_velocity=np.zeros(3),
            linear_acceleration=np.array((0.0, 0.0, GRAVITY)),
        )
        for i in range(count)
    ]


@pytest.mark.parametrize(
    ("robot_name", "preset"),
    [("nao_h21_v33", "zmp"), ("bruno", "bruno"), ("nao_h21_v33", "preview")],
)
def test_the_gait_walks_and_stops(robot_name: str, preset: str) -> None:
    robot = load_robot(robot_name)
    gait = Gait(robot, load_preset(preset))
    states = []
    for i, frame in enumerate(frames(robot.stand_pose, 700)):
        command = FORWARD if 100 <= i < 350 else STANDSTILL
        targets = gait.step(frame, command)
        assert np.isfinite(targets.position).all()
        states.append(gait.state)
    assert states[50] is GaitState.STAND
    assert states[300] is GaitState.WALK
    assert GaitState.STOP in states[350:]
    assert states[-1] is GaitState.STAND
    assert gait.status.step_count >= 5
