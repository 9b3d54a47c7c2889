"""Values that cannot be: spikes, and sensors that are stuck."""

import numpy as np

from nao_lipm_gait.robot import load_robot
from nao_lipm_gait.runtime.validation import IMU_REPEATS, FrozenSensors, SpikeFilter

ROBOT = load_robot()


def test_a_spike_is_held_and_a_new_state_is_believed_in_the_end():
    spikes = SpikeFilter(ROBOT)
    pose, knee = ROBOT.stand_pose, ROBOT.index("LKneePitch")
    off = pose.copy()
    off[knee] += 0.5
    believed = [spikes.joints(q, 0.01) for q in (pose, off, pose, off, off, off, off, off)]
    assert [float(q[knee] - pose[knee]) for q, _ in believed] == [0, 0, 0, 0, 0, 0, 0.5, 0.5]
    words = [word for _, word in believed]
    assert words[1] is not None
    assert "LKneePitch" in words[1]
    assert words[6] is None


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
