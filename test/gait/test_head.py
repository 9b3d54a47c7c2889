"""The head: looks where it shall, within limits and speeds, whatever the body does."""

import math

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nao_lipm_gait.estimation.torso_place import TorsoPlace
from nao_lipm_gait.gait import Gait
from nao_lipm_gait.head.gaze import CAMERA, neck_of
from nao_lipm_gait.head.head_control import (
    LOST,
    SPEED,
    SWEEP_SPEED,
    SWEEP_TILTS,
    SWEEP_WIDTH,
    HeadControl,
    sweep,
)
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.runtime.inputs import head_angles, head_mode, head_point
from nao_lipm_gait.whole_body.body_model import BodyModel
from robot_core.errors import NaoGaitError
from robot_core.geometry import rotation_from_rpy
from robot_core.head_goals import Angles, Follow, Frame, LookAt, Search
from robot_core.robot import load_robot
from robot_core.types import STANDSTILL, GaitState, SensorFrame, VelocityCommand

ROBOT = load_robot()
PAN, TILT = "HeadYaw", "HeadPitch"
I_PAN, I_TILT = ROBOT.index(PAN), ROBOT.index(TILT)
DT = 0.01
NECK = neck_of(ROBOT)
BODY = BodyModel(ROBOT)
OTHERS = {
    name: (load_robot(name), BodyModel(load_robot(name)))
    for name in ("nao_h21_v33", "bruno", "booster_t1", "op3")
}


def standing(up: tuple[float, float, float] = (0.0, 0.0, 1.0)) -> TorsoPlace:
    BODY.set_joints(ROBOT.stand_pose)
    return TorsoPlace(up, BODY.sole_in_torso(1), BODY.sole_in_torso(-1), (0.0, 0.0, 0.0))


def turned(control: HeadControl, ticks: int, place: TorsoPlace | None = None) -> np.ndarray:
    """(ticks, 2) pan and tilt."""
    way = []
    for _ in range(ticks):
        position = np.array(ROBOT.stand_pose)
        control.apply(position, place or standing(), DT)
        way.append((position[I_PAN], position[I_TILT]))
    return np.array(way)


@pytest.mark.parametrize("name", OTHERS)
@settings(max_examples=50)
@given(st.floats(0.2, 4.0), st.floats(-1.5, 1.5), st.floats(-1.0, 0.6))
def test_the_camera_points_at_the_point(name: str, x: float, y: float, z: float) -> None:
    """By the forward kinematics of the URDF, not by the formula turned around."""
    robot, body = OTHERS[name]
    neck = neck_of(robot)
    assert neck is not None
    assert robot.head is not None
    angles = neck.angles_to((x, y, z))
    assert angles is not None
    model = body.model
    data, q = model.createData(), pin.neutral(model)
    for joint, angle, sign in zip(robot.head, angles, neck.signs, strict=True):
        q[model.joints[model.getJointId(joint)].idx_q] = sign * angle
    pin.framesForwardKinematics(model, data, q)
    camera = data.oMf[model.getFrameId(CAMERA, pin.FrameType.BODY)]
    torso = data.oMf[model.getFrameId(robot.torso_frame, pin.FrameType.BODY)]
    seen = camera.actInv(torso.act(np.array((x, y, z))))
    assert seen[0] > 0.0
    np.testing.assert_allclose(seen[1:], 0.0, atol=1e-9)


def test_a_point_inside_the_head_cannot_be_looked_at() -> None:
    assert NECK is not None
    assert NECK.angles_to(NECK.position) is None
    control = HeadControl(ROBOT)
    control.ask(LookAt(NECK.position, Frame.TORSO))
    assert np.isfinite(turned(control, 5)).all()


def test_angles_are_reached_at_the_heads_speed_and_cut_at_its_limits() -> None:
    control = HeadControl(ROBOT)
    control.ask(Angles(9.0, -9.0))
    way = turned(control, 200)
    steps = np.abs(np.diff(np.vstack([[0.0, 0.0], way]), axis=0))
    assert steps.max() <= SPEED * DT + 1e-12
    assert way[-1] == pytest.approx((ROBOT.upper[I_PAN], ROBOT.lower[I_TILT]))


def test_without_a_goal_the_head_is_left_alone_and_given_back_smoothly() -> None:
    control = HeadControl(ROBOT)
    assert (turned(control, 3) == 0.0).all()
    control.ask(Angles(0.5, 0.1))
    turned(control, 100)
    control.ask(None)
    way = turned(control, 100)
    assert abs(way[0, 0]) > 0.4
    assert np.abs(np.diff(way, axis=0)).max() <= SPEED * DT + 1e-12
    assert (way[-1] == 0.0).all()
    assert control.is_free


def test_a_point_on_the_ground_is_kept_while_the_torso_leans() -> None:
    assert NECK is not None
    control = HeadControl(ROBOT)
    control.ask(LookAt((1.0, 0.0, 0.0), Frame.FOOTPRINT))
    upright = turned(control, 150)[-1]
    lean = 0.2  # forward: the vertical leans back in the torso frame
    leaning = turned(control, 150, standing((-math.sin(lean), 0.0, math.cos(lean))))[-1]
    assert upright[1] > 0.2, "down to the ground"
    assert leaning[1] == pytest.approx(upright[1] - lean, abs=0.06)


def test_a_point_in_odom_stays_behind_when_the_robot_turns() -> None:
    control = HeadControl(ROBOT)
    control.ask(LookAt((2.0, 0.0, 0.3), Frame.ODOM))
    place = standing()._replace(base_footprint_in_odom=(0.0, 0.0, 0.6))
    assert turned(control, 100, place)[-1][0] == pytest.approx(-0.6, abs=0.02)


@given(st.floats(0.0, 60.0), st.floats(-3.0, 3.0))
def test_a_search_moves_steadily_inside_its_width(time: float, start: float) -> None:
    pan, tilt = sweep(time, start)
    later, _ = sweep(time + 0.01, start)
    assert abs(pan) <= SWEEP_WIDTH + 1e-9
    assert tilt in SWEEP_TILTS
    assert abs(later - pan) <= SWEEP_SPEED * 0.01 + 1e-9
    assert sweep(0.0, start)[0] == pytest.approx(
        min(max(start, -SWEEP_WIDTH), SWEEP_WIDTH), abs=1e-9
    )


def test_follow_looks_at_what_is_seen_and_searches_for_what_is_lost() -> None:
    control = HeadControl(ROBOT)
    for _ in range(20):  # seen again and again
        control.ask(Follow((1.0, 0.5, -0.2), Frame.TORSO))
        seen = turned(control, 20)
    assert seen[-1][0] == pytest.approx(math.atan2(0.5, 1.0), abs=0.01)
    lost = turned(control, round((LOST + 6.0) / DT))
    assert lost[:, 0].max() > SWEEP_WIDTH - 0.1
    assert lost[:, 0].min() < -SWEEP_WIDTH + 0.1
    control.ask(Follow((1.0, -0.5, -0.2), Frame.TORSO))
    assert turned(control, 80)[-1][0] == pytest.approx(-math.atan2(0.5, 1.0), abs=0.01)


def test_asking_for_a_search_again_does_not_begin_it_anew() -> None:
    control = HeadControl(ROBOT)
    control.ask(Search())
    turned(control, 150)
    before = turned(control, 1)[-1]
    control.ask(Search())
    assert np.abs(turned(control, 1)[-1] - before).max() <= SPEED * DT


def walking(goal: object) -> tuple[np.ndarray, GaitState]:
    gait = Gait(ROBOT, GaitParameters(torso_pitch=0.0, feedback_delay=0.0))
    joints = np.array(ROBOT.stand_pose)
    way = []
    for tick in range(400):
        frame = SensorFrame(
            tick * 10_000_000, joints, np.zeros(3), np.array((0.0, 0.0, 9.81))
        )
        if tick == 150 and goal is not None:
            gait.request_look(goal)  # type: ignore[arg-type]
        command = VelocityCommand(0.1, 0.0, 0.0) if tick > 100 else STANDSTILL
        joints = gait.step(frame, command).position
        way.append(joints)
    return np.array(way), gait.state


def test_the_head_turns_while_the_body_walks_and_nothing_else_changes_much() -> None:
    plain, _ = walking(None)
    turning, state = walking(Angles(0.8, 0.2))
    assert state is GaitState.WALK
    assert turning[-1, I_PAN] == pytest.approx(0.8)
    np.testing.assert_array_equal(plain[:150], turning[:150])
    legs = [ROBOT.index(name) for name in ROBOT.leg_joints]
    assert np.abs(plain[:, legs] - turning[:, legs]).max() < 0.05


def test_a_motion_without_a_head_leaves_it_to_its_goal() -> None:
    gait = Gait(ROBOT, GaitParameters(torso_pitch=0.0, feedback_delay=0.0))
    joints = np.array(ROBOT.stand_pose)
    for tick in range(400):
        frame = SensorFrame(
            tick * 10_000_000, joints, np.zeros(3), np.array((0.0, 0.0, 9.81))
        )
        if tick == 100:
            gait.request_look(Angles(-0.5, 0.1))
            gait.request_motion("sit")
        joints = gait.step(frame, STANDSTILL).position
    assert gait.state is GaitState.MOTION
    assert joints[I_PAN] == pytest.approx(-0.5)


def test_messages_are_checked() -> None:
    assert head_angles([TILT, PAN], [5.0, 0.2], ROBOT) == Angles(0.2, ROBOT.upper[I_TILT])
    assert head_mode("free") is None
    assert head_mode("search") == Search()
    assert head_point("~/look_at", (1, 2, 3), "odom", ROBOT) == LookAt((1, 2, 3), Frame.ODOM)
    for bad in (
        lambda: head_angles([PAN], [0.1], ROBOT),
        lambda: head_angles([PAN, TILT], [0.1, math.nan], ROBOT),
        lambda: head_mode("sleep"),
        lambda: head_point("~/look_at", (1, 2, math.inf), "odom", ROBOT),
        lambda: head_point("~/look_at", (1, 2, 3), "moon", ROBOT),
    ):
        with pytest.raises(NaoGaitError, match="~/"):
            bad()


@settings(max_examples=50)
@given(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.tuples(*[st.floats(-1.0, 1.0)] * 3))
def test_the_pose_of_the_torso_undoes_the_way_of_a_point_into_the_torso(
    roll: float, pitch: float, point: tuple[float, float, float]
) -> None:
    up = (-math.sin(pitch), math.cos(pitch) * math.sin(roll), math.cos(pitch) * math.cos(roll))
    torso = standing(up)
    x, y, z, *angles = torso.in_footprint()
    rotation = np.array(rotation_from_rpy(*angles))
    lower = max(-np.dot(up, sole.position) for sole in (torso.left_sole, torso.right_sole))
    assert z == pytest.approx(lower), "the lower sole is on the ground"
    middle = np.mean([torso.left_sole.position, torso.right_sole.position], axis=0)
    ground = rotation @ np.array(torso.from_footprint(point)) + (x, y, -np.dot(up, middle))
    np.testing.assert_allclose(ground, point, atol=1e-9)
    assert angles[0] == pytest.approx(roll)
    assert angles[1] == pytest.approx(pitch)
