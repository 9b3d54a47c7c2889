"""From messages to frames: each joint state leads to a frame, an old answer or a refusal."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nao_lipm_gait.runtime.diagnostics import Diagnostics
from nao_lipm_gait.runtime.inputs import ImuInput, JointInput
from nao_lipm_gait.runtime.intake import ASKED_AGAIN, Intake, Taken
from robot_core.errors import NaoGaitError
from robot_core.robot import load_robot
from robot_core.types import JointTargets

ROBOT = load_robot()
NAMES = list(ROBOT.joint_names)
MS = 1_000_000


class Fed:
    """An intake that is fed with a robot that stands; stamps in ms."""

    def __init__(self) -> None:
        self.now = 0.0
        self.say = Diagnostics(lambda: self.now)
        self.intake = Intake(ROBOT, 0.01, self.say)
        self.pose = ROBOT.stand_pose.tolist()
        self._noise = 1e-6

    def imu(self, ms: int) -> Taken:
        self._noise = -self._noise
        stamp = divmod(ms * MS, 1_000 * MS)
        return self.intake.imu(ImuInput(*stamp, (0.0, 0.0, 0.0), (0.0, 0.0, 9.81 + self._noise)))

    def joints(self, ms: int, arrived: int | None = None) -> Taken:
        self.now += 0.01
        age = None if arrived is None else arrived * MS
        message = JointInput(*divmod(ms * MS, 1_000 * MS), NAMES, self.pose, arrived=age)
        return self.intake.joints(message, self.now, walking=False, tilt=(0.0, 0.0))

    def tick(self, ms: int) -> Taken:
        """A frame that is answered."""
        self.imu(ms)
        taken = self.joints(ms)
        for frame in taken.frames:
            self.intake.sent(JointTargets(frame.stamp, ROBOT.stand_pose))
        return taken


def test_a_joint_state_with_its_imu_sample_is_a_frame() -> None:
    fed = Fed()
    for ms in range(10, 60, 10):
        taken = fed.tick(ms)
        (frame,) = taken.frames
        assert (frame.stamp, frame.late, taken.refused) == (ms * MS, 0, None)
        np.testing.assert_array_equal(frame.joint_position, ROBOT.stand_pose)
        assert (taken.new_time is not None) == (ms == 10)
    assert fed.intake.stamp == 50 * MS


@pytest.mark.parametrize("waits", [0.0, 2 * ASKED_AGAIN])
def test_a_repeated_stamp_gets_the_same_answer_and_is_a_fault_only_at_once(waits: float) -> None:
    fed = Fed()
    fed.tick(10)
    fed.now += waits
    taken = fed.joints(10)
    assert taken.repeated
    assert taken.frames == ()
    assert taken.again is not None
    assert taken.again.stamp == 10 * MS
    assert bool(fed.say.take_log()) == (waits == 0.0)


def test_a_sender_that_sets_no_stamp_is_named() -> None:
    fed = Fed()
    fed.tick(0)
    taken = fed.joints(0)
    assert "header.stamp: got '0 s again'" in str(taken.refused)
    assert taken.again is None


def test_an_early_stamp_is_refused_and_answered_with_the_last_targets() -> None:
    fed = Fed()
    fed.tick(10)
    taken = fed.joints(14)
    assert taken.again is not None
    assert taken.again.stamp == 14 * MS
    assert "0.004 s after the last" in str(taken.refused)
    assert fed.tick(20).frames


def test_a_late_stamp_is_refused() -> None:
    fed = Fed()
    for ms in (10, 20, 40):
        fed.tick(ms)
    taken = fed.joints(30)
    assert (taken.frames, taken.again) == ((), None)
    assert "late" in str(taken.refused)
    assert fed.intake.missed == 1


@pytest.mark.parametrize("moved", [False, True])
@pytest.mark.parametrize("jump", [-5_000, 9_000])
def test_a_new_time_begins_with_the_second_stamp_that_continues_it(jump: int, moved: bool) -> None:
    fed = Fed()
    for ms in range(6_000, 6_100, 10):
        fed.tick(ms)
    if moved:
        fed.now += 1.0
    assert fed.tick(6_100 + jump) == Taken(), "one stamp alone proves nothing"
    taken = fed.tick(6_110 + jump)
    assert taken.new_time is not None
    assert (taken.new_time.first, taken.new_time.steady) == (False, not moved)
    assert taken.frames[-1].stamp == (6_110 + jump) * MS


def test_without_any_imu_the_joint_states_are_refused_in_the_end() -> None:
    fed = Fed()
    taken = [fed.joints(ms) for ms in range(10, 400, 10)]
    assert taken[0] == Taken(new_time=taken[0].new_time), "its IMU sample may still come"
    assert not any(each.frames for each in taken)
    assert all("nothing received" in str(each.refused) for each in taken[-10:])


def test_an_imu_that_is_gone_shows_as_a_gap_and_so_do_joints_that_cannot_be_read() -> None:
    fed = Fed()
    for ms in range(10, 200, 10):
        fed.tick(ms)
    gaps = [fed.joints(ms).gaps for ms in range(200, 400, 10)]
    assert gaps[-1].blind_since is not None
    assert gaps[-1].imu_behind is None
    assert fed.tick(400).gaps.blind_since is None
    fed.pose[3] = float("nan")
    assert fed.tick(410).gaps.unread_since == 410 * MS
    fed.pose = ROBOT.stand_pose.tolist()
    assert fed.tick(420).gaps.unread_since is None


def test_frames_that_are_older_than_the_walk_assumes_are_late() -> None:
    fed = Fed()
    fed.intake.set_delay(0.04 + ROBOT.command_lag)
    fed.imu(10)
    (frame,) = fed.joints(10, arrived=10 + 60).frames
    assert frame.late == 2


@pytest.mark.parametrize("jump", [-90, -300, -700, 400])
def test_a_clock_that_is_set_makes_no_frame_older(jump: int) -> None:
    """Seen from the clock of the arrivals, set back it looks like sensors that come late."""
    fed = Fed()
    fed.intake.set_delay(0.04 + ROBOT.command_lag)
    late = []
    for ms in range(6_000, 6_200, 10):
        stamp = ms if ms < 6_100 else ms + jump
        fed.imu(stamp)
        late += [frame.late for frame in fed.joints(stamp, arrived=ms + 60).frames]
    assert set(late) == {2}
    assert len(late) > 15


@given(st.lists(st.tuples(st.sampled_from(("imu", "joints")), st.integers(0, 2_000)), max_size=50))
def test_whatever_the_stamps_are_frames_of_one_time_go_forward(
    messages: list[tuple[str, int]],
) -> None:
    fed, last = Fed(), -1
    for kind, ms in messages:
        taken = fed.imu(10 * ms) if kind == "imu" else fed.joints(10 * ms)
        if taken.new_time is not None:
            last = -1
        for frame in taken.frames:
            assert frame.stamp > last
            last = frame.stamp


def test_what_cannot_be_read_changes_nothing() -> None:
    fed = Fed()
    fed.tick(10)
    fed.pose.pop()
    with pytest.raises(NaoGaitError, match="joint_states position"):
        fed.joints(4_000)
    fed.pose = ROBOT.stand_pose.tolist()
    assert fed.intake.stamp == 10 * MS
    assert fed.tick(20).frames
