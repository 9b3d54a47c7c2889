"""The IMU sample and the joint sample of one instant come together."""

import numpy as np
import pytest

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.runtime.frame_sync import FrameSync, ImuSample, JointSample

MS = 1_000_000


def imu(ms: int) -> ImuSample:
    return ImuSample(ms * MS, np.full(3, float(ms)), np.zeros(3))


def joints(ms: int, velocity: bool = True) -> JointSample:
    rate = np.zeros(2) if velocity else None
    return JointSample(ms * MS, np.full(2, 0.1 * ms), rate)


def test_frame_has_the_imu_sample_of_its_own_stamp():
    assembler = FrameSync()
    for ms in (10, 20, 30):
        assert assembler.add_imu(imu(ms)) is None
    (frame,) = assembler.add_joints(joints(20))
    assert (frame.stamp, frame.angular_velocity[0]) == (20 * MS, 20.0)


def test_joints_that_come_first_wait_for_their_imu_sample():
    assembler = FrameSync()
    assembler.add_imu(imu(10))
    assert assembler.add_joints(joints(20)) == ()
    frame = assembler.add_imu(imu(20))
    assert frame is not None
    assert frame.angular_velocity[0] == 20.0


def test_lost_imu_sample_costs_one_tick_of_delay_and_no_frame():
    assembler = FrameSync()
    assembler.add_imu(imu(10))
    assert assembler.add_joints(joints(20)) == ()
    assembler.add_imu(imu(30))
    frames = assembler.add_joints(joints(30))
    assert [(f.stamp, f.angular_velocity[0]) for f in frames] == [(20 * MS, 10.0), (30 * MS, 30.0)]


def test_stamps_that_never_agree_are_served_without_delay_in_the_end():
    assembler = FrameSync()
    frames: tuple = ()
    for ms in range(10, 210, 10):
        assembler.add_imu(imu(ms - 3))
        frames = assembler.add_joints(joints(ms))
    assert [(f.stamp, f.angular_velocity[0]) for f in frames] == [(200 * MS, 197.0)]


def test_a_robot_that_insists_is_served_without_its_imu_sample():
    assembler = FrameSync()
    assembler.add_imu(imu(10))
    assert assembler.add_joints(joints(20)) == ()
    assert [assembler.insist(10 * MS), assembler.insist(20 * MS)] == [None, None]
    frame = assembler.insist(20 * MS)
    assert frame is not None
    assert (frame.stamp, frame.angular_velocity[0]) == (20 * MS, 10.0)
    assert assembler.insist(20 * MS) is None
    assert assembler.add_imu(imu(20)) is None
    assembler.add_imu(imu(30))
    assert [f.stamp // MS for f in assembler.add_joints(joints(30))] == [30]


def test_no_imu_near_the_joints_is_an_error():
    assembler = FrameSync()
    assembler.add_joints(joints(10))
    with pytest.raises(NaoGaitError, match="imu/data: got 'nothing received'"):
        assembler.add_joints(joints(20))
    assembler.add_imu(imu(20))
    assembler.add_joints(joints(200))
    with pytest.raises(NaoGaitError, match="imu/data header.stamp: got '0.180 s before"):
        assembler.add_joints(joints(210))


def test_a_robot_without_imu_feels_what_rest_would_feel():
    rest = np.array([0.1, 0.2, 9.8])
    assembler = FrameSync(lambda: rest)
    assembler.add_imu(imu(10))
    frames = [f for ms in range(20, 200, 10) for f in assembler.add_joints(joints(ms))]
    assert [f.stamp // MS for f in frames] == [*range(20, 190, 10), 190]
    blind = [f for f in frames if f.stamp > 60 * MS]
    assert all(not f.angular_velocity.any() for f in blind)
    assert all(f.linear_acceleration is rest for f in blind)
    assert assembler.blind_since == 70 * MS
    assembler.add_imu(imu(200))
    (frame,) = assembler.add_joints(joints(200))[-1:]
    assert frame.angular_velocity[0] == 200.0
    assert assembler.blind_since is None


def test_an_overtaken_imu_sample_does_not_clear_the_others():
    assembler = FrameSync()
    for ms in (10, 30, 20):
        assembler.add_imu(imu(ms))
    for ms in (20, 30):
        (frame,) = assembler.add_joints(joints(ms))
        assert frame.angular_velocity[0] == ms


def test_time_that_goes_back_does_not_bring_old_frames():
    assembler = FrameSync()
    assembler.add_imu(imu(500))
    assembler.add_joints(joints(510))
    assembler.add_imu(imu(20))
    (frame,) = assembler.add_joints(joints(20))
    assert frame.stamp == 20 * MS


def test_new_beginning_keeps_the_imu_sample_that_came_before_its_joints():
    assembler = FrameSync()
    assembler.add_imu(imu(500))
    assembler.add_imu(imu(20))
    assembler.begin_at(20 * MS)
    (frame,) = assembler.add_joints(joints(20))
    assert frame.angular_velocity[0] == 20.0


def test_missing_velocity_is_taken_from_the_positions():
    assembler = FrameSync()
    for ms in (10, 20):
        assembler.add_imu(imu(ms))
        (frame,) = assembler.add_joints(joints(ms, velocity=False))
    np.testing.assert_allclose(frame.joint_velocity, 100.0)  # 0.1 per ms


def test_a_clock_that_goes_back_while_the_imu_is_gone_is_served_blind():
    assembler = FrameSync(lambda: np.zeros(3))
    assembler.add_imu(imu(1000))
    assembler.begin_at(20 * MS)
    frames = [f for ms in (20, 30, 40) for f in assembler.add_joints(joints(ms))]
    assert [f.stamp // MS for f in frames] == [20, 30]
    assert assembler.blind_since == 20 * MS
    assert assembler.imu_behind is None


def test_an_imu_on_another_clock_is_told_from_one_that_is_gone():
    assembler = FrameSync(lambda: np.zeros(3))
    for ms in range(1000, 1100, 10):
        assembler.add_imu(imu(ms - 900))
        assembler.add_joints(joints(ms))
    assert assembler.blind_since is not None
    assert assembler.imu_behind == 890 * MS
    for ms in range(1100, 1200, 10):
        assembler.add_joints(joints(ms))
    assert assembler.imu_behind is None
