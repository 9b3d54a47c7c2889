"""A player's body: sensors and motors by the server's names and units, drops and landings."""

import math

import numpy as np
import pytest

from nao_lipm_gait import load_robot
from rcss_bridge import codec
from rcss_bridge.body import CYCLE, Body, stamp_of
from rcss_bridge.joints import ROBOTS, server_robot
from rcss_bridge.landing import CALM_TIME, FREE_TIME, LANDING_MAX, Landing
from rcss_server import cycle_message
from robot_core.errors import NaoGaitError
from robot_core.types import GRAVITY, JointTargets, SensorFrame


@pytest.fixture(params=list(ROBOTS))
def server(request: pytest.FixtureRequest):
    return server_robot(request.param)


@pytest.fixture
def robot(server):
    return load_robot(server.robot)


def test_every_joint_has_an_effector_of_its_own(server, robot):
    assert sorted(server.effectors) == sorted(robot.joint_names)
    assert len(set(server.effectors.values())) == len(robot.joint_names)
    assert all(server.sensor(each) for each in robot.joint_names)


def test_a_frame_is_sorted_by_joint_whatever_the_order_of_the_server(server, robot):
    degrees = {server.sensor(name): index for index, name in enumerate(robot.joint_names)}
    angles = [degrees[server.sensor(joint)] for joint in server.effectors]
    message = cycle_message(server, 0.5, angles=angles, gyro=(90, 0, -45), force=(1, 2, 3))
    frame = Body(server, robot).frame(codec.percepts(message))
    assert np.degrees(frame.joint_position) == pytest.approx(np.arange(len(robot.joint_names)))
    assert frame.angular_velocity == pytest.approx((math.pi / 2, 0, -math.pi / 4))
    assert frame.linear_acceleration == pytest.approx((1, 2, 3))
    assert frame.stamp == 500_000_000


def test_stamps_are_cycles_however_the_server_cuts_the_time():
    for count in range(40_000):
        exact = count * CYCLE
        for told in (int(exact * 100) / 100.0, int((exact + 1e-9) * 100) / 100.0):
            assert stamp_of(told) == count * 20_000_000


def test_a_message_without_a_joint_is_refused(server, robot):
    message = cycle_message(server, 0.0).replace(b"q_llj4", b"q_other")
    with pytest.raises(NaoGaitError, match="llj4"):
        Body(server, robot).frame(codec.percepts(message))


def test_targets_reach_the_motor_of_their_joint(server, robot):
    position = 0.01 * np.arange(len(robot.joint_names))
    motors = Body(server, robot).motors(JointTargets(0, position, 0.5))
    for name, angle in zip(robot.joint_names, position, strict=True):
        motor = motors[server.effectors[name]]
        assert motor.position == angle
        assert motor.kp == 0.5 * robot.motors[name].stiffness
        assert motor.kd == 0.5 * robot.motors[name].damping


def test_a_limp_robot_only_brakes(server, robot):
    motors = Body(server, robot).motors(JointTargets(0, robot.stand_pose, 0.0))
    assert all(each.kp == each.torque == 0.0 < each.kd for each in motors.values())


def test_a_robot_that_is_not_the_servers_is_refused(server):
    with pytest.raises(NaoGaitError, match="HeadYaw"):
        Body(server, load_robot("nao_h21_v33"))


def test_a_robot_that_the_server_does_not_have_is_refused():
    with pytest.raises(NaoGaitError, match="K1, T1"):
        server_robot("NAO")


# -- landing ---------------------------------------------------------------------------------------


def frames(robot, force: float, pose: np.ndarray, seconds: float) -> list[SensorFrame]:
    return [
        SensorFrame(count * 20_000_000, pose, np.zeros(3), np.array((0.0, 0.0, force)))
        for count in range(round(seconds / CYCLE))
    ]


def answers(landing: Landing, given: list[SensorFrame]) -> list[JointTargets | None]:
    return [landing.update(each) for each in given]


def test_a_drop_is_answered_before_the_ground_and_the_walk_goes_on_after_rest(robot):
    landing, straight = Landing(robot), np.zeros(len(robot.joint_names))
    assert all(each is None for each in answers(landing, frames(robot, 9.8, straight, 1.0)))
    falling = answers(landing, frames(robot, 0.1, straight, 0.4))
    assert None not in falling[round(FREE_TIME / CYCLE) :]
    knee = robot.index(robot.left_leg.knee_pitch)
    assert all(each.position[knee] > 0.3 for each in falling if each is not None)
    resting = answers(landing, frames(robot, GRAVITY, robot.stand_pose, CALM_TIME + 0.1))
    assert resting[0] is not None
    assert resting[-1] is None
    assert landing.count == 1


def test_a_drop_out_of_a_walk_is_noticed_before_the_fall_is_felt(robot):
    """The commands of the walk act for a cycle: the bent legs kick, and the torso feels a force."""
    landing = Landing(robot)
    walk = frames(robot, 9.8, robot.stand_pose, 1.0)
    assert all(each is None for each in answers(landing, walk))
    kick = frames(robot, 40.0, 0.3 * robot.stand_pose, 0.1)
    later = [each._replace(stamp=walk[-1].stamp + 20_000_000 + each.stamp) for each in kick]
    assert None not in answers(landing, later)
    assert landing.count == 1


def test_a_leg_as_fast_as_its_motor_is_no_drop(robot):
    landing, knee = Landing(robot), robot.index(robot.left_leg.knee_pitch)
    pose, speed = np.array(robot.stand_pose), robot.motors[robot.left_leg.knee_pitch].no_load_speed
    for cycle in (0, 1, 4):  # two messages are lost on the way
        pose[knee] = robot.stand_pose[knee] - speed * cycle * CYCLE
        frame = frames(robot, 9.8, pose.copy(), CYCLE)[0]
        assert landing.update(frame._replace(stamp=cycle * 20_000_000)) is None


def test_who_does_not_come_to_rest_is_the_walks_again(robot):
    landing = Landing(robot)
    answers(landing, frames(robot, 0.1, np.zeros(len(robot.joint_names)), 0.2))
    shaken = answers(landing, frames(robot, 14.0, robot.stand_pose, LANDING_MAX + 0.1))
    assert shaken[0] is not None
    assert shaken[-1] is None


def test_who_lies_with_straight_legs_and_is_pushed_has_not_been_dropped(robot):
    landing, straight = Landing(robot), np.zeros(len(robot.joint_names))
    for force, seconds in ((9.8, 0.4), (0.1, FREE_TIME - CYCLE), (9.8, CYCLE), (0.1, CYCLE)):
        pushed = frames(robot, force, straight, seconds)
        assert all(each is None for each in answers(landing, pushed))
    assert landing.count == 0


def test_a_hop_with_bent_legs_is_no_drop(robot):
    landing = Landing(robot)
    assert all(each is None for each in answers(landing, frames(robot, 0.1, robot.stand_pose, 1.0)))
