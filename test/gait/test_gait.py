"""The gait as a whole, with joints that reach their targets at once and an upright torso."""

import math

import numpy as np
import pytest

from nao_lipm_gait.whole_body.step_kick import LONGER
from obedient_robot import PARAMETERS as P
from obedient_robot import PERIOD, UPRIGHT, ObedientRobot
from robot_core.errors import NaoGaitError
from robot_core.joint_limits import JointLimits
from robot_core.robot import RobotDescription
from robot_core.types import STANDSTILL, GaitState, VelocityCommand

FORWARD = VelocityCommand(0.15, 0.0, 0.0)
ON_BACK = (9.81, 0.0, 0.0)


def test_stands_walks_stops_and_stands(robot: RobotDescription) -> None:
    nao = ObedientRobot(robot)
    assert nao.states(1.0) == [GaitState.STAND]
    assert nao.states(5.0, FORWARD) == [GaitState.WALK]
    assert nao.states(4.0) == [GaitState.WALK, GaitState.STOP, GaitState.STAND]


def test_what_is_measured_is_what_was_expected(robot: RobotDescription) -> None:
    # A perfect robot closes the loop through kinematics, CoM, observer and prediction.
    nao = ObedientRobot(robot)
    nao.run(1.0)
    worst = 0.0
    for _ in range(600):
        nao.tick(VelocityCommand(0.12, 0.03, 0.3))
        status = nao.gait.status
        if status.step_count > 1:
            worst = max(
                worst, math.dist(status.com_expected_in_q[:2], status.com_measured_in_q[:2])
            )
    assert worst < 5e-4


def test_odometry_follows_the_command(robot: RobotDescription) -> None:
    nao = ObedientRobot(robot)
    nao.run(1.0)
    nao.run(3.0, FORWARD)
    before = nao.gait.status.base_footprint_in_odom
    nao.run(10.0, FORWARD)
    after = nao.gait.status.base_footprint_in_odom
    assert after[0] - before[0] == pytest.approx(1.5, rel=0.05)
    assert abs(after[1] - before[1]) < 0.02


def test_mirrored_commands_give_mirrored_joints(robot: RobotDescription) -> None:
    # The robot's masses are not quite mirrored; what listens for small differences stays out.
    parameters = P.replace(push_velocity=0.0, speed_time=0.0)
    walks = []
    for side in (1.0, -1.0):
        nao = ObedientRobot(robot, parameters)
        nao.run(1.0)
        command = VelocityCommand(0.1, 0.03 * side, 0.2 * side)
        walks.append(np.array([targets.position for targets in nao.run(3.0, command)]))
    index = robot.index
    for left, right in zip(robot.left_leg.names, robot.right_leg.names, strict=True):
        sign = -1.0 if "Roll" in left else 1.0
        np.testing.assert_allclose(
            walks[0][:, index(left)], sign * walks[1][:, index(right)], atol=5e-4
        )


def test_same_frames_give_the_same_targets(robot: RobotDescription) -> None:
    def walk() -> np.ndarray:
        nao = ObedientRobot(robot)
        nao.run(1.0)
        return np.array([targets.position for targets in nao.run(2.0, FORWARD)])

    np.testing.assert_array_equal(walk(), walk())


def test_targets_stay_inside_the_limits_whatever_is_sensed(robot: RobotDescription) -> None:
    rng = np.random.default_rng(11)
    nao = ObedientRobot(robot)
    limits = JointLimits(robot)
    for _ in range(1500):
        joints = np.array(robot.stand_pose) + rng.normal(0.0, 0.3, len(robot.joint_names))
        nao.rate = tuple(rng.normal(0, 3, 3))
        nao.force = tuple(rng.normal(0, 8, 3) + UPRIGHT)
        command = VelocityCommand(*rng.normal(0.0, 3.0, 3))
        position = nao.tick(command, nao.frame(joints)).position
        assert np.isfinite(position).all()
        assert limits.cut(position.copy()) == 0


def test_lost_frames_do_not_stop_the_walk(robot: RobotDescription) -> None:
    nao = ObedientRobot(robot)
    nao.run(1.0)
    nao.run(2.0, FORWARD)
    complete = ObedientRobot(robot)
    complete.run(1.0)
    complete.run(2.0, FORWARD)
    complete.run(0.05, FORWARD)
    nao.stamp += 5 * PERIOD
    a, b = nao.tick(FORWARD).position, complete.tick(FORWARD).position
    np.testing.assert_allclose(a, b, atol=0.02)
    assert nao.gait.state is GaitState.WALK


def test_lost_frames_do_not_change_the_walked_speed(robot: RobotDescription) -> None:
    def walked(every: int | None) -> float:
        nao = ObedientRobot(robot, P.replace(speed_time=0.0))
        nao.run(1.0)
        nao.run(3.0, FORWARD)
        speeds = []
        for tick in range(600):
            if every is not None and tick % every == 0:
                nao.lose_frame()
                continue
            nao.tick(FORWARD)
            speeds.append(nao.gait.status.velocity[0])
        return float(np.mean(speeds))

    complete = walked(None)
    assert complete > 0.05
    assert walked(7) == pytest.approx(complete, rel=0.05)


def test_lost_frames_do_not_hide_how_the_torso_turned(robot: RobotDescription) -> None:
    def pitch(every: int | None) -> float:
        nao = ObedientRobot(robot)
        for tick in range(340):
            nao.rate = (0.0, 0.3 if tick >= 301 else 0.0, 0.0)
            if every is not None and tick % every == 0 and tick > 0:
                nao.lose_frame()
            else:
                nao.tick()
        return nao.gait.status.torso_pitch

    complete = pitch(None)
    assert complete > 0.08
    assert pitch(4) == pytest.approx(complete, rel=0.04)


@pytest.mark.parametrize(
    ("lost", "before", "after", "turned"),
    [
        (0, 0.0, 0.4, 0.4 * 0.01),
        (2, 0.0, 0.4, 0.2 * 0.03),
        (2, 0.4, 0.4, 0.4 * 0.03),
        (15, 0.4, 0.4, 0.4 * 0.05),
    ],
    ids=["none", "mean of both ends", "steady", "no further than 50 ms"],
)
def test_the_gyro_bridges_a_gap(
    robot: RobotDescription, lost: int, before: float, after: float, turned: float
) -> None:
    nao = ObedientRobot(robot)
    nao.run(3.0)
    nao.rate = (0.0, before, 0.0)
    nao.tick()
    start = nao.gait.status.torso_pitch
    for _ in range(lost):
        nao.lose_frame()
    nao.rate = (0.0, after, 0.0)
    nao.tick()
    assert nao.gait.status.torso_pitch - start == pytest.approx(turned, rel=0.05)


@pytest.mark.parametrize("jump", [-1_000_000_000, -10_000_000, 0, 5_000_000_000])
def test_a_time_jump_is_a_new_beginning(robot: RobotDescription, jump: int) -> None:
    nao = ObedientRobot(robot)
    nao.run(1.0)
    nao.run(2.0, FORWARD)
    shown = nao.shown[0]
    nao.stamp += jump - PERIOD
    targets = nao.tick(FORWARD)
    assert nao.gait.state is GaitState.STAND
    # The stand begins where the joints are: no jerk.
    np.testing.assert_allclose(targets.position, shown, atol=0.01)


def test_a_fallen_robot_is_limp_until_it_is_put_on_its_feet(robot: RobotDescription) -> None:
    nao = ObedientRobot(robot)
    nao.run(1.0)
    nao.run(1.0, FORWARD)
    nao.force = ON_BACK
    fallen = nao.run(20.0, FORWARD)
    assert nao.gait.state is GaitState.FALLEN
    assert fallen[-1].stiffness == 0.0
    nao.force = UPRIGHT
    nao.run(20.0)
    assert nao.gait.state is GaitState.STAND
    assert nao.tick().stiffness == 1.0


def test_relax_and_stand_on_request(robot: RobotDescription) -> None:
    nao = ObedientRobot(robot)
    nao.run(1.0)
    nao.gait.request_relax()
    assert nao.tick(FORWARD).stiffness == 0.0
    nao.run(1.0, FORWARD)
    assert nao.gait.state is GaitState.RELAXED
    nao.gait.request_stand()
    assert nao.tick().stiffness == 1.0
    assert nao.gait.state is GaitState.STAND
    nao.run(1.0)
    nao.run(2.0, FORWARD)
    nao.gait.request_stand()
    states = nao.states(4.0, FORWARD)
    assert GaitState.STAND in states


def test_parameters_change_between_ticks(robot: RobotDescription) -> None:
    nao = ObedientRobot(robot)
    nao.run(1.0)
    nao.run(2.0, FORWARD)
    nao.gait.set_parameters(P.replace(swing_lift=0.03, step_forward_max=0.01))
    nao.run(3.0, FORWARD)
    before = nao.gait.status.base_footprint_in_odom[0]
    nao.run(4.0, FORWARD)
    assert nao.gait.status.base_footprint_in_odom[0] - before < 0.25


def test_a_requested_lift_is_a_share_of_the_parameter(robot: RobotDescription) -> None:
    def walked(lift: float, share: float) -> np.ndarray:
        nao = ObedientRobot(robot, P.replace(swing_lift=lift))
        nao.gait.request_lift(share)
        nao.run(0.5)
        return np.array([targets.position for targets in nao.run(2.0, FORWARD)])

    low = walked(0.03, 0.5)
    np.testing.assert_array_equal(low, walked(0.015, 1.0))
    assert np.abs(low - walked(0.03, 1.0)).max() > 0.02
    for share in (-0.1, 1.1, math.nan):
        with pytest.raises(NaoGaitError, match="lift"):
            ObedientRobot(robot).gait.request_lift(share)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_kick_in_the_walk_swings_a_foot_farther_and_lands_it_a_little_farther(
    robot: RobotDescription, side: float
) -> None:
    def walked(*ball: float) -> tuple[np.ndarray, np.ndarray]:
        """How far each foot is ahead of base_footprint [m], and where the robot comes."""
        nao = ObedientRobot(robot)
        nao.run(1.0)
        nao.run(2.0, FORWARD)
        if ball:
            nao.gait.request_kick(ball[:2], ball[2])
        soles = []
        for _ in range(80):
            nao.tick(FORWARD)
            status = nao.gait.status
            soles.append((status.left_sole_in_odom[0], status.right_sole_in_odom[0]))
        return np.array(soles), np.array(nao.gait.status.base_footprint_in_odom)

    kicking = 0 if side > 0.0 else 1
    (plain, end), (kicked, farther_on) = walked(), walked(0.19, side * 0.06, 0.0)
    farther = kicked - plain
    assert farther[:, kicking].max() == pytest.approx(0.08, abs=0.03)
    longer = LONGER * P.kick_reach
    assert farther[-1] == pytest.approx([longer, longer], abs=0.01)
    assert (farther[:, kicking] > longer + 0.02).sum() < 15  # one step
    np.testing.assert_allclose(farther_on[0] - end[0], longer, atol=0.01)
    np.testing.assert_allclose(farther_on[1:], end[1:], atol=0.01)
    for beyond in ((0.4, side * 0.06, 0.0), (0.15, side * 0.2, 0.0), (-0.2, 0.06, 0.0)):
        np.testing.assert_array_equal(walked(*beyond)[0], plain)


def test_a_kick_of_no_numbers_is_refused(robot: RobotDescription) -> None:
    with pytest.raises(NaoGaitError, match="kick"):
        ObedientRobot(robot).gait.request_kick((math.nan, 0.0), 0.0)


def test_without_feedback_neither_gyro_nor_com_has_an_effect(robot: RobotDescription) -> None:
    def walk(disturbed: bool, feedback: bool) -> np.ndarray:
        nao = ObedientRobot(robot, P.replace(feedback=feedback))
        nao.run(1.0)
        nao.rate = (0.1, -0.1, 0.0) if disturbed else (0.0, 0.0, 0.0)
        offset = 0.02 if disturbed else 0.0
        return np.array(
            [nao.tick(FORWARD, nao.frame(nao.shown[0] + offset)).position for _ in range(150)]
        )

    np.testing.assert_array_equal(walk(True, False), walk(False, False))
    assert np.abs(walk(True, True) - walk(False, True)).max() > 0.01


def test_a_relaxed_robot_that_lies_stands_once_it_is_upright(robot: RobotDescription) -> None:
    nao = ObedientRobot(robot)
    nao.run(1.0)
    nao.gait.request_relax()
    nao.force = ON_BACK
    nao.run(20.0)
    assert nao.gait.state is GaitState.RELAXED
    nao.gait.request_stand()
    assert nao.tick().stiffness == 0.0
    nao.force = UPRIGHT
    nao.run(20.0)
    assert nao.gait.state is GaitState.STAND


def test_the_first_sample_of_a_shaken_robot_does_not_set_the_vertical(
    robot: RobotDescription,
) -> None:
    nao = ObedientRobot(robot)
    shaken = np.array([2.0, -5.0, 6.0])
    nao.force = tuple(shaken)
    nao.tick()
    for tick in range(59):
        nao.force = tuple(UPRIGHT + shaken * (-0.3 if tick % 2 else 0.3))
        nao.tick()
    status = nao.gait.status
    assert abs(status.torso_roll) < 0.03
    assert abs(status.torso_pitch) < 0.06
    assert nao.gait.state is GaitState.STAND


def test_a_robot_that_lies_in_the_first_frame_is_fallen_at_once(robot: RobotDescription) -> None:
    nao = ObedientRobot(robot)
    nao.force = ON_BACK
    assert nao.tick(FORWARD).stiffness == 0.0
    assert nao.gait.state is GaitState.FALLEN


@pytest.mark.parametrize("walking", [False, True])
def test_height_and_lean_follow_a_change_without_a_jump(
    robot: RobotDescription, walking: bool
) -> None:
    nao = ObedientRobot(robot)
    command = FORWARD if walking else STANDSTILL
    before = nao.run(3.0, command)
    usual = max(abs(np.diff([t.position for t in before[-100:]], axis=0)).max(), 1e-3)
    nao.gait.set_parameters(P.replace(com_height=0.21, torso_pitch=0.1))
    changed = np.array([before[-1].position] + [t.position for t in nao.run(3.0, command)])
    steps = abs(np.diff(changed, axis=0)).max(axis=1)
    assert steps.max() < usual + 0.02, "[rad] a tick; the CoM sinks by 0.5 mm"
    fresh = ObedientRobot(robot, P.replace(com_height=0.21, torso_pitch=0.1))
    knee = robot.index("LKneePitch")
    if not walking:
        settled = fresh.run(6.0, command)[-1].position
        assert changed[-1][knee] == pytest.approx(settled[knee], abs=1e-3)
        assert changed[-1][knee] > changed[0][knee] + 0.2


def test_the_start_of_a_walk_does_not_change_the_learned_speed(robot: RobotDescription) -> None:
    def walked(nao: ObedientRobot) -> float:
        """Speed [m/s] of the steady walk: the last 3 s of 6 s."""
        nao.run(3.0, FORWARD)
        speeds = [(nao.tick(FORWARD), nao.gait.status.velocity[0])[1] for _ in range(300)]
        return float(np.mean(speeds))

    nao = ObedientRobot(robot)
    nao.run(8.0, FORWARD)
    learned = walked(nao)
    nao.gait.request_stand()
    assert GaitState.STAND in nao.states(3.0, FORWARD)
    assert walked(nao) == pytest.approx(learned, rel=0.01)


def test_lost_frames_do_not_slow_the_way_into_the_stand(robot: RobotDescription) -> None:
    def time_to_stand(lost: int) -> float:
        """Time [s] until all joints are within 0.01 rad of where they are after 6 s."""
        nao = ObedientRobot(robot, P.replace(feedback_delay=0.0))
        nao.shown = [nao.joints + 0.2]
        targets = []
        while nao.stamp < 600 * PERIOD:
            targets.append(nao.tick())
            for _ in range(lost):
                nao.lose_frame()
        way = np.abs([each.position - targets[-1].position for each in targets]).max(axis=1)
        return targets[int(np.argmax(way < 0.01))].stamp * 1e-9

    complete = time_to_stand(0)
    assert complete > 0.5
    assert time_to_stand(3) == pytest.approx(complete, abs=0.05)
