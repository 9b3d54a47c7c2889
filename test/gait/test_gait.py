"""The gait as a whole, with joints that obey at once and a torso that stays upright."""

import math

import numpy as np
import pytest

from nao_lipm_gait.gait import Gait
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.robot import RobotDescription
from nao_lipm_gait.types import (
    STANDSTILL,
    GaitState,
    JointTargets,
    SensorFrame,
    VelocityCommand,
)
from nao_lipm_gait.whole_body.joint_limits import JointLimits

PERIOD = 10_000_000
GRAVITY = np.array([0.0, 0.0, 9.81])
FORWARD = VelocityCommand(0.15, 0.0, 0.0)
P = GaitParameters(torso_pitch=0.0, heading_lean=0.0)
"""The obedient robot below keeps its torso upright whatever its legs say."""


class ObedientRobot:
    """Joints go where they are told; what they report is `delay` ticks old."""

    def __init__(self, robot: RobotDescription, parameters: GaitParameters = P):
        self.gait = Gait(robot, parameters)
        ticks = round(parameters.feedback_delay / 0.01)
        self.shown = [np.array(robot.stand_pose)] * max(1, ticks)
        self.stamp = 0
        self.force = GRAVITY

    def frame(self, stamp: int | None = None) -> SensorFrame:
        joints = self.shown[0]
        return SensorFrame(
            self.stamp if stamp is None else stamp, joints, 0.0 * joints, np.zeros(3), self.force
        )

    def tick(self, command: VelocityCommand) -> JointTargets:
        targets = self.gait.step(self.frame(), command)
        self.stamp += PERIOD
        self.shown = [*self.shown[1:], targets.position]
        return targets

    def run(self, command: VelocityCommand, seconds: float) -> list[JointTargets]:
        return [self.tick(command) for _ in range(round(seconds * 100))]

    def lose(self) -> None:
        """A frame that does not arrive: the joints hold their last targets."""
        self.stamp += PERIOD
        self.shown = [*self.shown[1:], self.shown[-1]]

    def states(self, command: VelocityCommand, seconds: float) -> list[GaitState]:
        states = []
        for _ in range(round(seconds * 100)):
            self.tick(command)
            states.append(self.gait.state)
        return states


def test_stands_walks_stops_and_stands(robot: RobotDescription) -> None:
    nao = ObedientRobot(robot)
    assert set(nao.states(STANDSTILL, 1.0)) == {GaitState.STAND}
    walking = nao.states(FORWARD, 5.0)
    assert walking[-1] is GaitState.WALK
    stopping = nao.states(STANDSTILL, 4.0)
    assert stopping[-1] is GaitState.STAND
    order = [state for i, state in enumerate(stopping) if i == 0 or stopping[i - 1] is not state]
    assert order == [GaitState.WALK, GaitState.STOP, GaitState.STAND]


def test_what_is_measured_is_what_was_expected(robot: RobotDescription) -> None:
    # A perfect robot closes the loop through kinematics, CoM, observer and prediction.
    nao = ObedientRobot(robot)
    nao.run(STANDSTILL, 1.0)
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
    nao.run(STANDSTILL, 1.0)
    nao.run(FORWARD, 3.0)
    before = nao.gait.status.base_footprint_in_odom
    nao.run(FORWARD, 10.0)
    after = nao.gait.status.base_footprint_in_odom
    assert after[0] - before[0] == pytest.approx(1.5, rel=0.05)
    assert abs(after[1] - before[1]) < 0.02


def test_mirrored_commands_give_mirrored_joints(robot: RobotDescription) -> None:
    # The robot's masses are not quite mirrored; what listens for small differences stays out.
    parameters = P.replace(push_velocity=0.0, speed_time=0.0)
    walks = []
    for side in (1.0, -1.0):
        nao = ObedientRobot(robot, parameters)
        nao.run(STANDSTILL, 1.0)
        command = VelocityCommand(0.1, 0.03 * side, 0.2 * side)
        walks.append(np.array([targets.position for targets in nao.run(command, 3.0)]))
    index = robot.index
    for left, right in zip(robot.left_leg.names, robot.right_leg.names, strict=True):
        sign = -1.0 if "Roll" in left else 1.0
        np.testing.assert_allclose(
            walks[0][:, index(left)], sign * walks[1][:, index(right)], atol=5e-4
        )


def test_same_frames_give_the_same_targets(robot: RobotDescription) -> None:
    def walk() -> np.ndarray:
        nao = ObedientRobot(robot)
        nao.run(STANDSTILL, 1.0)
        return np.array([targets.position for targets in nao.run(FORWARD, 2.0)])

    np.testing.assert_array_equal(walk(), walk())


def test_targets_stay_inside_the_limits_whatever_is_sensed(robot: RobotDescription) -> None:
    rng = np.random.default_rng(11)
    gait = Gait(robot, P)
    limits = JointLimits(robot)
    for tick in range(1500):
        joints = np.array(robot.stand_pose) + rng.normal(0.0, 0.3, len(robot.joint_names))
        frame = SensorFrame(
            tick * PERIOD, joints, 0.0 * joints, rng.normal(0, 3, 3), rng.normal(0, 8, 3) + GRAVITY
        )
        command = VelocityCommand(*rng.normal(0.0, 3.0, 3))
        position = gait.step(frame, command).position
        assert np.isfinite(position).all()
        assert limits.cut(position.copy()) == 0


def test_lost_frames_do_not_stop_the_walk(robot: RobotDescription) -> None:
    nao = ObedientRobot(robot)
    nao.run(STANDSTILL, 1.0)
    nao.run(FORWARD, 2.0)
    complete = ObedientRobot(robot)
    complete.run(STANDSTILL, 1.0)
    complete.run(FORWARD, 2.0)
    complete.run(FORWARD, 0.05)
    nao.stamp += 5 * PERIOD
    a, b = nao.tick(FORWARD).position, complete.tick(FORWARD).position
    np.testing.assert_allclose(a, b, atol=0.02)
    assert nao.gait.state is GaitState.WALK


def test_lost_frames_do_not_change_the_walked_speed(robot: RobotDescription) -> None:
    def walked(every: int | None) -> float:
        nao = ObedientRobot(robot, P.replace(speed_time=0.0))
        nao.run(STANDSTILL, 1.0)
        nao.run(FORWARD, 3.0)
        speeds = []
        for tick in range(600):
            if every is not None and tick % every == 0:
                nao.lose()
                continue
            nao.tick(FORWARD)
            speeds.append(nao.gait.status.velocity[0])
        return float(np.mean(speeds))

    complete = walked(None)
    assert complete > 0.05
    assert walked(7) == pytest.approx(complete, rel=0.05)


def test_lost_frames_do_not_hide_how_the_torso_turned(robot: RobotDescription) -> None:
    def pitch(every: int | None) -> float:
        gait = Gait(robot, P.replace(tilt_stance_time=10.0))
        joints = np.array(robot.stand_pose)
        for tick in range(340):
            if every is not None and tick % every == 0 and tick > 0:
                continue
            rate = np.array((0.0, 0.3 if tick >= 301 else 0.0, 0.0))
            gait.step(SensorFrame(tick * PERIOD, joints, 0.0 * joints, rate, GRAVITY), STANDSTILL)
        return gait.status.torso_pitch

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
    gait = Gait(robot, P.replace(tilt_stance_time=10.0, tilt_accelerometer_time=10.0))
    joints = np.array(robot.stand_pose)

    def pitch(tick: int, rate: float) -> float:
        turning = np.array((0.0, rate, 0.0))
        gait.step(SensorFrame(tick * PERIOD, joints, 0.0 * joints, turning, GRAVITY), STANDSTILL)
        return gait.status.torso_pitch

    for tick in range(300):
        pitch(tick, 0.0)
    start = pitch(300, before)
    assert pitch(301 + lost, after) - start == pytest.approx(turned, rel=0.05)


@pytest.mark.parametrize("jump", [-1_000_000_000, -10_000_000, 0, 5_000_000_000])
def test_a_time_jump_is_a_new_beginning(robot: RobotDescription, jump: int) -> None:
    nao = ObedientRobot(robot)
    nao.run(STANDSTILL, 1.0)
    nao.run(FORWARD, 2.0)
    shown = nao.shown[0]
    nao.stamp += jump - PERIOD
    targets = nao.tick(FORWARD)
    assert nao.gait.state is GaitState.STAND
    # The stand begins where the joints are: no jerk.
    np.testing.assert_allclose(targets.position, shown, atol=0.01)


def test_a_fallen_robot_is_relaxed_until_it_is_put_up_again(robot: RobotDescription) -> None:
    nao = ObedientRobot(robot)
    nao.run(STANDSTILL, 1.0)
    nao.run(FORWARD, 1.0)
    nao.force = np.array([9.81, 0.0, 0.0])
    fallen = nao.run(FORWARD, 20.0)
    assert nao.gait.state is GaitState.FALLEN
    assert fallen[-1].stiffness == 0.0
    nao.force = GRAVITY
    nao.run(STANDSTILL, 20.0)
    assert nao.gait.state is GaitState.STAND
    assert nao.tick(STANDSTILL).stiffness == 1.0


def test_relax_and_stand_on_request(robot: RobotDescription) -> None:
    nao = ObedientRobot(robot)
    nao.run(STANDSTILL, 1.0)
    nao.gait.request_relax()
    assert nao.tick(FORWARD).stiffness == 0.0
    nao.run(FORWARD, 1.0)
    assert nao.gait.state is GaitState.RELAXED
    nao.gait.request_stand()
    assert nao.tick(STANDSTILL).stiffness == 1.0
    assert nao.gait.state is GaitState.STAND
    nao.run(STANDSTILL, 1.0)
    nao.run(FORWARD, 2.0)
    nao.gait.request_stand()
    states = nao.states(FORWARD, 4.0)
    assert GaitState.STAND in states


def test_parameters_change_between_ticks(robot: RobotDescription) -> None:
    nao = ObedientRobot(robot)
    nao.run(STANDSTILL, 1.0)
    nao.run(FORWARD, 2.0)
    nao.gait.set_parameters(P.replace(swing_lift=0.03, step_forward_max=0.01))
    nao.run(FORWARD, 3.0)
    before = nao.gait.status.base_footprint_in_odom[0]
    nao.run(FORWARD, 4.0)
    assert nao.gait.status.base_footprint_in_odom[0] - before < 0.25


def test_open_loop_hears_neither_gyro_nor_com(robot: RobotDescription) -> None:
    def walk(disturbed: bool, feedback: bool) -> np.ndarray:
        nao = ObedientRobot(robot, P.replace(feedback=feedback))
        nao.run(STANDSTILL, 1.0)
        rows = []
        for _ in range(150):
            frame = nao.frame()
            if disturbed:
                joints = frame.joint_position + 0.02
                frame = SensorFrame(
                    frame.stamp, joints, 0.0 * joints, np.array([0.1, -0.1, 0.0]), GRAVITY
                )
            rows.append(nao.gait.step(frame, FORWARD).position)
            nao.stamp += PERIOD
            nao.shown = [*nao.shown[1:], rows[-1]]
        return np.array(rows)

    np.testing.assert_array_equal(walk(True, False), walk(False, False))
    assert np.abs(walk(True, True) - walk(False, True)).max() > 0.01


def test_a_relaxed_robot_that_lies_stands_once_it_is_upright(robot: RobotDescription) -> None:
    nao = ObedientRobot(robot)
    nao.run(STANDSTILL, 1.0)
    nao.gait.request_relax()
    nao.force = np.array([9.81, 0.0, 0.0])
    nao.run(STANDSTILL, 20.0)
    assert nao.gait.state is GaitState.RELAXED
    nao.gait.request_stand()
    assert nao.tick(STANDSTILL).stiffness == 0.0
    nao.force = GRAVITY
    nao.run(STANDSTILL, 20.0)
    assert nao.gait.state is GaitState.STAND


def test_one_sample_of_a_moving_robot_says_nothing_about_the_vertical(
    robot: RobotDescription,
) -> None:
    """A gait that begins while the robot is shaken takes the mean, not the first sample."""
    nao = ObedientRobot(robot)
    shaken = np.array([2.0, -5.0, 6.0])
    for tick in range(60):
        frame = nao.frame()
        force = shaken if tick == 0 else GRAVITY + shaken * (0.3 if tick % 2 else -0.3)
        frame = SensorFrame(
            frame.stamp, frame.joint_position, frame.joint_velocity, np.zeros(3), force
        )
        position = nao.gait.step(frame, STANDSTILL).position
        nao.stamp += PERIOD
        nao.shown = [*nao.shown[1:], position]
    status = nao.gait.status
    assert abs(status.torso_roll) < 0.03
    assert abs(status.torso_pitch) < 0.06
    assert nao.gait.state is GaitState.STAND


def test_a_robot_that_lies_when_the_gait_begins_is_seen_to_lie_at_once(
    robot: RobotDescription,
) -> None:
    gait = Gait(robot, P)
    zeros = np.zeros(len(robot.joint_names))
    frame = SensorFrame(0, robot.stand_pose, zeros, np.zeros(3), np.array([9.81, 0.0, 0.0]))
    assert gait.step(frame, FORWARD).stiffness == 0.0
    assert gait.state is GaitState.FALLEN


@pytest.mark.parametrize("walking", [False, True])
def test_height_and_lean_follow_a_change_without_a_jump(
    robot: RobotDescription, walking: bool
) -> None:
    obedient = ObedientRobot(robot)
    command = FORWARD if walking else STANDSTILL
    before = obedient.run(command, 3.0)
    usual = max(abs(np.diff([t.position for t in before[-100:]], axis=0)).max(), 1e-3)
    obedient.gait.set_parameters(P.replace(com_height=0.21, torso_pitch=0.1))
    changed = np.array([before[-1].position] + [t.position for t in obedient.run(command, 3.0)])
    steps = abs(np.diff(changed, axis=0)).max(axis=1)
    assert steps.max() < usual + 0.02, "[rad] a tick; the CoM sinks by 0.5 mm"
    fresh = ObedientRobot(robot, P.replace(com_height=0.21, torso_pitch=0.1))
    knee = robot.index("LKneePitch")
    if not walking:
        settled = fresh.run(command, 6.0)[-1].position
        assert changed[-1][knee] == pytest.approx(settled[knee], abs=1e-3)
        assert changed[-1][knee] > changed[0][knee] + 0.2


def test_a_walk_that_begins_again_learns_no_speed_from_its_start(
    robot: RobotDescription,
) -> None:
    obedient = ObedientRobot(robot)
    obedient.run(FORWARD, 8.0)
    learned = obedient.gait._speed_hold.offset[0]
    obedient.gait.request_stand()
    obedient.run(FORWARD, 3.0)
    walks = obedient.states(FORWARD, 3.0)
    assert GaitState.WALK in walks
    assert obedient.gait._speed_hold.offset[0] == pytest.approx(learned, abs=1e-3)


def test_lost_frames_do_not_slow_the_way_into_the_stand(robot: RobotDescription) -> None:
    def time_to_stand(lost: int) -> int:
        obedient = ObedientRobot(robot, P.replace(feedback_delay=0.0))
        obedient.shown = [obedient.shown[0] + 0.2]
        obedient.tick(STANDSTILL)
        while obedient.gait._blend.active:
            for _ in range(lost):
                obedient.lose()
            obedient.tick(STANDSTILL)
        return obedient.stamp

    assert time_to_stand(3) == pytest.approx(time_to_stand(0), abs=4 * PERIOD)
