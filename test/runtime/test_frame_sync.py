"""The IMU sample and the joint sample of one instant come together."""

import math

import numpy as np
import pytest

from nao_lipm_gait.runtime.frame_sync import FrameSync
from nao_lipm_gait.runtime.validation import ImuSample, JointSample
from robot_core.errors import NaoGaitError
from robot_core.types import GRAVITY

MS = 1_000_000


def imu(ms: int) -> ImuSample:
    return ImuSample(ms * MS, np.full(3, float(ms)), np.zeros(3))


def sync_at_rest() -> FrameSync:
    return FrameSync(10 * MS)


def joints(ms: int) -> JointSample:
    return JointSample(ms * MS, np.full(2, 0.1 * ms))


def test_frame_has_the_imu_sample_of_its_own_stamp():
    sync = sync_at_rest()
    for ms in (10, 20, 30):
        assert sync.add_imu(imu(ms)) is None
    (frame,) = sync.add_joints(joints(20))
    assert (frame.stamp, frame.angular_velocity[0]) == (20 * MS, 20.0)


def test_joints_that_come_first_wait_for_their_imu_sample():
    sync = sync_at_rest()
    sync.add_imu(imu(10))
    assert sync.add_joints(joints(20)) == ()
    frame = sync.add_imu(imu(20))
    assert frame is not None
    assert frame.angular_velocity[0] == 20.0


def test_lost_imu_sample_costs_one_tick_of_delay_and_no_frame():
    sync = sync_at_rest()
    sync.add_imu(imu(10))
    assert sync.add_joints(joints(20)) == ()
    sync.add_imu(imu(30))
    frames = sync.add_joints(joints(30))
    assert [(f.stamp, f.angular_velocity[0]) for f in frames] == [(20 * MS, 10.0), (30 * MS, 30.0)]


def test_stamps_that_never_agree_cause_no_delay_in_the_end():
    sync = sync_at_rest()
    frames: tuple = ()
    for ms in range(10, 210, 10):
        sync.add_imu(imu(ms - 3))
        frames = sync.add_joints(joints(ms))
    assert [(f.stamp, f.angular_velocity[0]) for f in frames] == [(200 * MS, 197.0)]


def test_a_repeated_joint_sample_is_used_without_its_imu_sample():
    sync = sync_at_rest()
    sync.add_imu(imu(10))
    assert sync.add_joints(joints(20)) == ()
    assert [sync.repeat(10 * MS), sync.repeat(20 * MS)] == [None, None]
    frame = sync.repeat(20 * MS)
    assert frame is not None
    assert (frame.stamp, frame.angular_velocity[0]) == (20 * MS, 10.0)
    assert sync.repeat(20 * MS) is None
    assert sync.add_imu(imu(20)) is None
    sync.add_imu(imu(30))
    assert [f.stamp // MS for f in sync.add_joints(joints(30))] == [30]


def test_without_any_imu_sample_there_is_no_frame():
    sync = sync_at_rest()
    sync.add_joints(joints(10))
    with pytest.raises(NaoGaitError, match="imu/data: got 'nothing received'"):
        sync.add_joints(joints(20))


def test_without_a_near_imu_sample_the_frame_shows_a_body_at_rest():
    roll, pitch = 0.02, -0.1
    sync = sync_at_rest()
    sync.add_imu(imu(10))
    frames = [f for ms in range(20, 200, 10) for f in sync.add_joints(joints(ms), (roll, pitch))]
    assert [f.stamp // MS for f in frames] == [*range(20, 190, 10), 190]
    blind = [f for f in frames if f.stamp > 60 * MS]
    assert all(not f.angular_velocity.any() for f in blind)
    for force in (f.linear_acceleration for f in blind):
        assert math.atan2(force[1], force[2]) == pytest.approx(roll)
        assert math.asin(-force[0] / GRAVITY) == pytest.approx(pitch)
        assert np.linalg.norm(force) == pytest.approx(GRAVITY)
    assert sync.blind_since == 70 * MS
    sync.add_imu(imu(200))
    (frame,) = sync.add_joints(joints(200))[-1:]
    assert frame.angular_velocity[0] == 200.0
    assert sync.blind_since is None


def test_after_an_outage_joints_wait_again_for_imu_samples_that_follow_them():
    sync = sync_at_rest()
    frames = []
    for ms in range(10, 600, 10):
        frames += sync.add_joints(joints(ms)) if ms > 10 else []
        if not 200 < ms < 400:
            frames += [frame for frame in (sync.add_imu(imu(ms)),) if frame is not None]
    late = [frame for frame in frames if frame.stamp >= 420 * MS]
    assert [round(f.angular_velocity[0]) * MS for f in late] == [f.stamp for f in late]


def test_an_overtaken_imu_sample_does_not_clear_the_others():
    sync = sync_at_rest()
    for ms in (10, 30, 20):
        sync.add_imu(imu(ms))
    for ms in (20, 30):
        (frame,) = sync.add_joints(joints(ms))
        assert frame.angular_velocity[0] == ms


def test_time_that_goes_back_does_not_bring_old_frames():
    sync = sync_at_rest()
    sync.add_imu(imu(500))
    sync.add_joints(joints(510))
    sync.add_imu(imu(20))
    (frame,) = sync.add_joints(joints(20))
    assert frame.stamp == 20 * MS


def test_new_beginning_keeps_the_imu_sample_that_came_before_its_joints():
    sync = sync_at_rest()
    sync.add_imu(imu(500))
    sync.add_imu(imu(20))
    sync.restart(20 * MS)
    (frame,) = sync.add_joints(joints(20))
    assert frame.angular_velocity[0] == 20.0


def test_a_clock_that_goes_back_while_the_imu_is_gone_gives_blind_frames():
    sync = sync_at_rest()
    sync.add_imu(imu(1000))
    sync.restart(20 * MS)
    frames = [f for ms in (20, 30, 40) for f in sync.add_joints(joints(ms))]
    assert [f.stamp // MS for f in frames] == [20, 30]
    assert sync.blind_since == 20 * MS
    assert sync.imu_behind is None


def test_an_imu_on_another_clock_is_distinguished_from_one_that_is_gone():
    sync = sync_at_rest()
    for ms in range(1000, 1100, 10):
        sync.add_imu(imu(ms - 900))
        sync.add_joints(joints(ms))
    assert sync.blind_since is not None
    assert sync.imu_behind == 890 * MS
    for ms in range(1100, 1200, 10):
        sync.add_joints(joints(ms))
    assert sync.imu_behind is None


@pytest.mark.parametrize("seed", range(8))
def test_lost_samples_lose_no_rotation(seed: int) -> None:
    """The angular velocity grows evenly, so what is interpolated is what was lost."""
    random = np.random.default_rng(seed)
    sync, turned, before = sync_at_rest(), 0.0, 0
    for tick in range(1, 400):
        ms = 10 * tick
        whole = tick == 1 or tick % 4 == 0  # no gap is longer than 50 ms
        frames: list = []
        if whole or random.uniform() > 0.4:
            frames += [frame for frame in (sync.add_imu(imu(ms)),) if frame is not None]
        if whole or random.uniform() > 0.4:
            frames += sync.add_joints(joints(ms))
        for frame in frames:
            mean, own = frame.mean_angular_velocity, frame.angular_velocity
            turned += (frame.stamp / MS - before) * float((own if mean is None else mean)[0])
            before = round(frame.stamp / MS)
        if whole:
            assert turned == pytest.approx(10.0 * sum(range(10, ms + 1, 10)))


def test_complete_frames_have_no_other_mean() -> None:
    sync = sync_at_rest()
    for ms in range(10, 100, 10):
        sync.add_imu(imu(ms))
        (frame,) = sync.add_joints(joints(ms))
        assert frame.mean_angular_velocity is None


def test_a_long_gap_is_not_interpolated() -> None:
    sync = sync_at_rest()
    for ms in (10, 100):
        sync.add_imu(imu(ms))
        (frame,) = sync.add_joints(joints(ms))
    assert frame.mean_angular_velocity is None


def test_joints_that_are_repeated_before_any_imu_sample_still_wait_for_it() -> None:
    sync = sync_at_rest()
    assert sync.add_joints(joints(10)) == ()
    assert sync.repeat(10 * MS) is None
    for _ in range(3):
        with pytest.raises(NaoGaitError, match="nothing received"):
            sync.repeat(10 * MS)
    assert sync.add_imu(imu(10)) is not None
