"""Checks of what comes in from outside: velocity commands, joints, IMU, stamps. No ROS needed."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.robot_description import load_robot
from nao_lipm_gait.ros.domain import DomainClaim
from nao_lipm_gait.ros.frame_assembly import FrameAssembler, ImuSample, JointSample
from nao_lipm_gait.ros.frozen_sensors import IMU_REPEATS, FrozenSensors
from nao_lipm_gait.ros.readings import (
    JointReader,
    check_orientation,
    read_vector,
    read_velocity,
    stamp_of,
)
from nao_lipm_gait.ros.spike_filter import SpikeFilter
from nao_lipm_gait.ros.stamp_watch import StampWatch, Step
from nao_lipm_gait.ros.throttle import Throttle
from nao_lipm_gait.ros.tick_statistics import TickStatistics
from nao_lipm_gait.ros.velocity_input import VelocityInput
from nao_lipm_gait.signals import STANDSTILL, VelocityCommand

ROBOT = load_robot()
NAMES = list(ROBOT.joint_names)
POSE = ROBOT.stand_pose.tolist()
ZEROS = [0.0] * len(NAMES)
MS = 1_000_000
BAD_NUMBERS = (math.nan, math.inf, -math.inf)


def reader() -> JointReader:
    return JointReader(ROBOT, "joint_states")


# -- velocity commands -----------------------------------------------------------------------------


def test_planar_part_of_a_twist_is_taken():
    assert read_velocity((0.1, 0.2, 9.0), (1.0, 2.0, 0.3)) == VelocityCommand(0.1, 0.2, 0.3)


@pytest.mark.parametrize("bad", (*BAD_NUMBERS, 1e6, -1e6))
@pytest.mark.parametrize("place", range(6))
def test_bad_twist_is_refused_by_field(bad: float, place: int):
    values = [0.0] * 6
    values[place] = bad
    field = ("linear", "angular")[place // 3] + "." + "xyz"[place % 3]
    with pytest.raises(NaoGaitError, match=rf"cmd_vel {field}: got .*; allowed: a finite number"):
        read_velocity(values[:3], values[3:])


def test_command_counts_for_its_timeout_and_no_longer():
    velocity = VelocityInput(0.5)
    walk = VelocityCommand(x=0.1)
    velocity.receive(walk, 1000 * MS)
    assert velocity.at(1500 * MS) == walk
    assert velocity.at(1501 * MS) == STANDSTILL
    assert velocity.at(1400 * MS) == STANDSTILL, "an old command must not come back"


def test_command_before_the_first_frame_counts_from_that_frame():
    velocity = VelocityInput(0.5)
    walk = VelocityCommand(x=0.1)
    velocity.receive(walk, None)
    assert velocity.at(7000 * MS) == walk
    assert velocity.at(7500 * MS) == walk
    assert velocity.at(7501 * MS) == STANDSTILL


# -- joint states ----------------------------------------------------------------------------------


def test_joints_in_order_come_out_as_they_are():
    position, velocity = reader().read(NAMES, POSE, ZEROS)
    np.testing.assert_array_equal(position, POSE)
    np.testing.assert_array_equal(velocity, ZEROS)


@given(st.permutations(range(len(NAMES) + 2)))
def test_order_and_extra_joints_do_not_matter(order: list[int]):
    names = [*NAMES, "LHand", "RHand"]
    position = [*POSE, math.nan, 1e9]
    velocity = [*(0.1 * i for i in range(len(NAMES))), 0.0, 0.0]
    read = reader().read(
        [names[i] for i in order], [position[i] for i in order], [velocity[i] for i in order]
    )
    np.testing.assert_array_equal(read[0], POSE)
    assert read[1] is not None
    np.testing.assert_array_equal(read[1], velocity[:-2])


def test_a_changed_order_is_noticed():
    joints = reader()
    joints.read(NAMES, POSE, ZEROS)
    position, _ = joints.read(NAMES[::-1], POSE[::-1], ZEROS)
    np.testing.assert_array_equal(position, POSE)


def test_missing_joints_are_named():
    with pytest.raises(NaoGaitError, match="joint_states name: got 'no HeadYaw, HeadPitch'"):
        reader().read(NAMES[2:], POSE[2:], ZEROS[2:])


def test_joint_given_twice_is_named():
    with pytest.raises(NaoGaitError, match="LHipRoll more than once"):
        reader().read([*NAMES, "LHipRoll"], [*POSE, 0.0], [*ZEROS, 0.0])


def test_wrong_lengths_are_refused():
    with pytest.raises(NaoGaitError, match=r"joint_states position: got '21 values'"):
        reader().read(NAMES, POSE[:-1], ZEROS)
    with pytest.raises(NaoGaitError, match=r"joint_states velocity: got '21 values'"):
        reader().read(NAMES, POSE, ZEROS[:-1])
    with pytest.raises(NaoGaitError, match=r"joint_states name: got 'no "):
        reader().read([], [], [])


def test_no_velocity_at_all_is_allowed():
    assert reader().read(NAMES, POSE, [])[1] is None


@pytest.mark.parametrize("bad", (*BAD_NUMBERS, 7.0, -1e300))
@pytest.mark.parametrize("joint", ("HeadYaw", "LKneePitch", NAMES[-1]))
def test_bad_position_is_refused_by_joint(bad: float, joint: str):
    position = list(POSE)
    position[NAMES.index(joint)] = bad
    with pytest.raises(NaoGaitError, match=rf"joint_states position\[{joint}\]: got .*; allowed: "):
        reader().read(NAMES, position, ZEROS)


@pytest.mark.parametrize("bad", (*BAD_NUMBERS, 1e4))
def test_bad_velocity_is_refused_by_joint(bad: float):
    velocity = list(ZEROS)
    velocity[NAMES.index("RHipPitch")] = bad
    with pytest.raises(NaoGaitError, match=r"joint_states velocity\[RHipPitch\]: got"):
        reader().read(NAMES, POSE, velocity)


# -- IMU -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("bad", (*BAD_NUMBERS, 1e9))
def test_bad_vector_is_refused_by_axis(bad: float):
    with pytest.raises(NaoGaitError, match=r"imu/data angular_velocity\.y: got"):
        read_vector((0.0, bad, 0.0), "imu/data angular_velocity", 200.0, "rad/s")


@pytest.mark.parametrize("quaternion", ((0.0,) * 4, (math.nan, 0, 0, 1), (0, 0, 0, 3.0)))
def test_claimed_orientation_must_be_one(quaternion: tuple[float, ...]):
    with pytest.raises(NaoGaitError, match="imu/data orientation: got .*covariance.0. = -1"):
        check_orientation(quaternion, 0.0, "imu/data")
    check_orientation(quaternion, -1.0, "imu/data")  # none claimed, none checked


def test_unit_quaternion_passes():
    check_orientation((0.0, 0.6, 0.0, 0.8), 0.01, "imu/data")


# -- stamps ----------------------------------------------------------------------------------------


def test_stamp_is_whole_nanoseconds():
    assert stamp_of(2, 30_000_001, "x") == 2_030_000_001
    with pytest.raises(NaoGaitError, match="x.nanosec"):
        stamp_of(0, 1_000_000_000, "x")
    with pytest.raises(NaoGaitError, match="x.sec"):
        stamp_of(-1, 0, "x")


def seen(*stamps: int) -> tuple[StampWatch, list[Step]]:
    watch = StampWatch(10 * MS)
    return watch, [watch.see(ms * MS) for ms in stamps]


def test_stamps_are_told_apart_and_gaps_are_counted():
    watch, steps = seen(100, 110, 110, 150, 651, 661, 300, 310, 320)
    assert steps == [
        Step.NEXT, Step.NEXT, Step.REPEATED, Step.NEXT, Step.DOUBTFUL, Step.JUMP, Step.DOUBTFUL,
        Step.BACKWARDS, Step.NEXT,
    ]  # fmt: skip
    assert watch.missed == 3, "120, 130 and 140 ms; a jump is not a loss"


def test_one_stamp_alone_is_no_new_time():
    _, steps = seen(100, 110, 9_000_000, 120, 0, 130, 140)
    assert [s for s in steps if s is not Step.NEXT] == [Step.DOUBTFUL, Step.DOUBTFUL]


def test_an_overtaken_message_is_late_and_a_small_step_back_is_believed_in_the_end():
    _, steps = seen(100, 120, 110, 130, 140)
    assert steps == [Step.NEXT, Step.NEXT, Step.LATE, Step.NEXT, Step.NEXT]
    _, steps = seen(1000, 950, 960, 970, 980, 990)
    assert steps[1:5] == [Step.LATE, Step.LATE, Step.LATE, Step.BACKWARDS]
    assert steps[5] is Step.NEXT


def test_the_same_new_stamp_again_is_a_proof():
    """In lockstep the robot sends nothing else until it is answered."""
    assert seen(100, 900, 900)[1][-1] is Step.JUMP


@given(st.lists(st.integers(0, 2**62), max_size=60))
def test_any_stamps_have_a_step(stamps: list[int]):
    watch = StampWatch(10 * MS)
    for stamp in stamps:
        before = watch.last
        step = watch.see(stamp)
        left_out = step in (Step.LATE, Step.DOUBTFUL, Step.REPEATED)
        assert watch.last == (before if left_out else stamp)
        if step is Step.NEXT and before is not None:
            assert 0 < stamp - before <= watch.longest_gap


def imu(ms: int) -> ImuSample:
    return ImuSample(ms * MS, np.full(3, float(ms)), np.zeros(3))


def joints(ms: int, velocity: bool = True) -> JointSample:
    rate = np.zeros(2) if velocity else None
    return JointSample(ms * MS, np.full(2, 0.1 * ms), rate)


def test_frame_has_the_imu_sample_of_its_own_stamp():
    assembler = FrameAssembler()
    for ms in (10, 20, 30):
        assert assembler.add_imu(imu(ms)) is None
    (frame,) = assembler.add_joints(joints(20))
    assert (frame.stamp, frame.angular_velocity[0]) == (20 * MS, 20.0)


def test_joints_that_come_first_wait_for_their_imu_sample():
    assembler = FrameAssembler()
    assembler.add_imu(imu(10))
    assert assembler.add_joints(joints(20)) == ()
    frame = assembler.add_imu(imu(20))
    assert frame is not None and frame.angular_velocity[0] == 20.0


def test_lost_imu_sample_costs_one_tick_of_delay_and_no_frame():
    assembler = FrameAssembler()
    assembler.add_imu(imu(10))
    assert assembler.add_joints(joints(20)) == ()
    assembler.add_imu(imu(30))
    frames = assembler.add_joints(joints(30))
    assert [(f.stamp, f.angular_velocity[0]) for f in frames] == [(20 * MS, 10.0), (30 * MS, 30.0)]


def test_stamps_that_never_agree_are_served_without_delay_in_the_end():
    assembler = FrameAssembler()
    frames: tuple = ()
    for ms in range(10, 210, 10):
        assembler.add_imu(imu(ms - 3))
        frames = assembler.add_joints(joints(ms))
    assert [(f.stamp, f.angular_velocity[0]) for f in frames] == [(200 * MS, 197.0)]


def test_no_imu_near_the_joints_is_an_error():
    assembler = FrameAssembler()
    assembler.add_joints(joints(10))
    with pytest.raises(NaoGaitError, match="imu/data: got 'nothing received'"):
        assembler.add_joints(joints(20))
    assembler.add_imu(imu(20))
    assembler.add_joints(joints(200))
    with pytest.raises(NaoGaitError, match="imu/data header.stamp: got '0.180 s before"):
        assembler.add_joints(joints(210))


def test_a_robot_without_imu_feels_what_rest_would_feel():
    rest = np.array([0.1, 0.2, 9.8])
    assembler = FrameAssembler(lambda: rest)
    assembler.add_imu(imu(10))
    frames = [f for ms in range(20, 200, 10) for f in assembler.add_joints(joints(ms))]
    assert [f.stamp // MS for f in frames] == [*range(20, 190, 10), 190]
    blind = [f for f in frames if f.stamp > 60 * MS]
    assert all(not f.angular_velocity.any() for f in blind)
    assert all(f.linear_acceleration is rest for f in blind)
    assert assembler.blind_since == 70 * MS
    assembler.add_imu(imu(200))
    (frame,) = assembler.add_joints(joints(200))[-1:]
    assert frame.angular_velocity[0] == 200.0 and assembler.blind_since is None


def test_an_overtaken_imu_sample_does_not_clear_the_others():
    assembler = FrameAssembler()
    for ms in (10, 30, 20):
        assembler.add_imu(imu(ms))
    for ms in (20, 30):
        (frame,) = assembler.add_joints(joints(ms))
        assert frame.angular_velocity[0] == ms


def test_time_that_goes_back_does_not_bring_old_frames():
    assembler = FrameAssembler()
    assembler.add_imu(imu(500))
    assembler.add_joints(joints(510))
    assembler.add_imu(imu(20))
    (frame,) = assembler.add_joints(joints(20))
    assert frame.stamp == 20 * MS


def test_new_beginning_keeps_the_imu_sample_that_came_before_its_joints():
    assembler = FrameAssembler()
    assembler.add_imu(imu(500))
    assembler.add_imu(imu(20))
    assembler.begin_at(20 * MS)
    (frame,) = assembler.add_joints(joints(20))
    assert frame.angular_velocity[0] == 20.0


def test_missing_velocity_is_taken_from_the_positions():
    assembler = FrameAssembler()
    for ms in (10, 20):
        assembler.add_imu(imu(ms))
        (frame,) = assembler.add_joints(joints(ms, velocity=False))
    np.testing.assert_allclose(frame.joint_velocity, 100.0)  # 0.1 per ms


# -- log and statistics ----------------------------------------------------------------------------


def test_throttle_lets_one_through_and_counts_the_rest():
    throttle = Throttle(period=2.0)
    assert throttle.allow("a", 0.0) == 0
    assert throttle.allow("a", 0.5) is None
    assert throttle.allow("b", 0.5) == 0, "another fault is not held back"
    assert throttle.allow("a", 1.9) is None
    assert throttle.allow("a", 2.0) == 2
    assert throttle.allow("a", 4.5) == 0


def test_throttle_lets_a_burst_through():
    throttle = Throttle(period=2.0)
    assert [throttle.allow("a", 0.1 * i, burst=3) for i in range(5)] == [0, 0, 0, None, None]
    assert throttle.allow("a", 2.0, burst=3) == 2


def test_throttle_does_not_grow_with_hostile_keys():
    throttle = Throttle()
    for i in range(100_000):
        throttle.allow(str(i), 0.0)
    assert len(throttle._windows) < 1000


def test_tick_summary_is_of_the_time_since_the_last_one():
    ticks = TickStatistics()
    assert ticks.summarize() is None
    for duration in range(100, 0, -1):
        ticks.add(float(duration))
    summary = ticks.summarize()
    assert summary is not None
    assert (summary.count, summary.p50, summary.p99, summary.maximum) == (100, 50.0, 99.0, 100.0)
    assert ticks.summarize() is None


# -- domains ---------------------------------------------------------------------------------------


def test_two_runs_never_get_the_same_domain():
    with DomainClaim() as first, DomainClaim() as second:
        assert first.domain != second.domain
        environment = second.environment()
        assert environment["ROS_DOMAIN_ID"] == str(second.domain)
        assert environment["ROS_AUTOMATIC_DISCOVERY_RANGE"] == "LOCALHOST"

    with DomainClaim() as again:
        assert again.domain != second.domain, "its late messages may still be under way"


# -- values that cannot be -------------------------------------------------------------------------


def test_a_spike_is_held_and_a_new_state_is_believed_in_the_end():
    spikes = SpikeFilter(ROBOT)
    pose, knee = ROBOT.stand_pose, ROBOT.index("LKneePitch")
    off = pose.copy()
    off[knee] += 0.5
    believed = [spikes.joints(q, 0.01) for q in (pose, off, pose, off, off, off, off, off)]
    assert [float(q[knee] - pose[knee]) for q, _ in believed] == [0, 0, 0, 0, 0, 0, 0.5, 0.5]
    words = [word for _, word in believed]
    assert words[1] is not None and "LKneePitch" in words[1] and words[6] is None


def test_what_a_joint_can_do_is_no_spike():
    spikes = SpikeFilter(ROBOT)
    q = ROBOT.stand_pose.copy()
    for _ in range(20):
        believed, word = spikes.joints(q, 0.01)
        assert word is None
        np.testing.assert_array_equal(believed, q)
        q = q + 2.0 * 0.01 * np.asarray(ROBOT.velocity_limit)
    assert spikes.joints(q + 0.4, 0.05)[1] is None, "after lost frames a joint may be further"
    assert spikes.rotation(np.zeros(3))[1] is None
    assert spikes.rotation(np.array([3.0, -3.0, 0.0]))[1] is None
    assert spikes.rotation(np.array([30.0, 0.0, 0.0]))[1] is not None


def test_an_imu_that_says_the_same_while_joints_move_is_stuck():
    frozen = FrozenSensors()
    for tick in range(30):
        frozen.see_joints(np.full(3, 0.01 * tick))
        frozen.see_imu((0.1, 0.0, 0.0), (0.0, 0.0, 9.8))
        if tick < IMU_REPEATS:
            assert not frozen.imu
    assert frozen.imu
    frozen.see_imu((0.1, 0.0, 0.001), (0.0, 0.0, 9.8))
    assert not frozen.imu


def test_a_resting_robot_may_feel_the_same_for_ever():
    frozen = FrozenSensors()
    for _ in range(100):
        frozen.see_joints(np.zeros(3))
        frozen.see_imu((0.0, 0.0, 0.0), (0.0, 0.0, 9.81))
    assert not frozen.imu
