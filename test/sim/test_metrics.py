"""The metrics on walks whose answer is known beforehand."""

import dataclasses
import math

import numpy as np
import pytest

from made_walk import HEIGHT, LEFT, quaternion, walk
from robot_core.errors import NaoGaitError
from sim_bridge.trials import metrics
from sim_bridge.trials.metrics import measure
from sim_bridge.trials.trace import DOUBLE, RIGHT


def test_a_circle_walker_scores_its_own_speed_and_its_yaw_drift() -> None:
    # 20 s around a circle of 0.25 m/s back to the start: displacement zero, path speed 0.25 m/s.
    ticks, speed = 2000, 0.25
    time = np.arange(ticks) * 0.01
    rate = 2 * math.pi / 20.0
    radius = speed / rate
    trace = walk(
        ticks,
        torso_position=np.stack(
            (radius * np.sin(rate * time), radius * (1 - np.cos(rate * time)), 0 * time + HEIGHT), 1
        ),
        torso_quaternion=quaternion(yaw=rate * time),
        torso_velocity=np.tile((speed, 0.0, 0.0), (ticks, 1)),
    )
    result = measure(trace, 0.0, 20.0)
    assert result.speed_x == pytest.approx(speed)
    assert result.speed_y == pytest.approx(0.0, abs=1e-12)
    assert result.turn_rate == pytest.approx(rate)
    displacement = np.linalg.norm(trace.torso_position[-1] - trace.torso_position[0])
    assert displacement < 0.01


def test_yaw_drift_counts_every_turn() -> None:
    time = np.arange(3000) * 0.01
    trace = walk(3000, torso_quaternion=quaternion(yaw=1.6 * time))
    assert measure(trace, 0.0, 30.0).turn_rate == pytest.approx(1.6)


def test_velocity_is_levelled_before_it_counts_as_speed() -> None:
    # Falling straight down while pitched must not look like walking.
    pitch = 0.4
    down_in_torso = (math.sin(pitch), 0.0, -math.cos(pitch))
    trace = walk(
        torso_quaternion=np.tile(quaternion(pitch=pitch, yaw=1.0), (1000, 1)),
        torso_velocity=np.tile(down_in_torso, (1000, 1)),
    )
    assert measure(trace, 0.0, 10.0).speed_x == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("yaw", [0.0, 0.7, 2.5, -3.0])
def test_speed_is_in_the_heading_whatever_the_direction(yaw: float) -> None:
    trace = walk(
        torso_quaternion=np.tile(quaternion(yaw=yaw), (1000, 1)),
        torso_velocity=np.tile((0.1, -0.2, 0.0), (1000, 1)),
    )
    result = measure(trace, 0.0, 10.0)
    assert (result.speed_x, result.speed_y) == pytest.approx((0.1, -0.2))


def test_only_the_window_counts() -> None:
    velocity = np.zeros((1000, 3))
    velocity[500:, 0] = 0.3
    trace = walk(torso_velocity=velocity)
    assert measure(trace, 5.0, 10.0).speed_x == pytest.approx(0.3)
    assert measure(trace, 0.0, 10.0).speed_x == pytest.approx(0.15)
    assert measure(trace, 5.0, 10.0).duration == pytest.approx(5.0)


def test_flight_needs_both_soles_unloaded() -> None:
    force = np.full((1000, 2), 25.0)
    force[:300, 0] = 1.9
    force[200:600, 1] = 0.0
    assert measure(walk(sole_force=force), 0.0, 10.0).flight_share == pytest.approx(0.1)


def test_slip_is_of_the_sole_that_carries() -> None:
    force = np.tile((40.0, 0.0), (1000, 1))
    force[500:] = (0.0, 0.0)
    slip = np.tile((0.02, 0.9), (1000, 1))
    result = measure(walk(sole_force=force, sole_slip=slip), 0.0, 10.0)
    assert result.slip_speed == pytest.approx(0.02)
    assert result.flight_share == pytest.approx(0.5)
    assert result.faults == ("flight",)


def test_contact_and_saturation_are_counted() -> None:
    touch = np.zeros(1000, dtype=bool)
    touch[10:13] = True
    saturated = np.zeros(1000, dtype=np.int64)
    saturated[:250] = 3
    result = measure(walk(legs_touch=touch, saturated=saturated), 0.0, 10.0)
    assert result.contact_ticks == 3
    assert result.saturated_share == pytest.approx(0.25)
    assert result.faults == ("contact",)


def test_fall_by_tilt_ends_the_measurement() -> None:
    roll = np.zeros(1000)
    roll[600:] = math.radians(46)
    velocity = np.tile((0.2, 0.0, 0.0), (1000, 1))
    velocity[600:] = (9.0, 0.0, 0.0)
    trace = walk(torso_quaternion=quaternion(roll=roll), torso_velocity=velocity)
    result = measure(trace, 4.0, 10.0)
    assert result.fell
    assert result.fall_time == pytest.approx(6.0)
    assert result.duration == pytest.approx(2.0)
    assert result.speed_x == pytest.approx(0.2)
    assert "fall" in result.faults
    assert not result.walks


def test_fall_by_height_and_before_the_window() -> None:
    position = np.tile((0.0, 0.0, HEIGHT), (1000, 1))
    position[100:, 2] = 0.49 * HEIGHT
    result = measure(walk(torso_position=position), 4.0, 10.0)
    assert result.fall_time == pytest.approx(1.0)
    assert result.duration == 0.0
    assert math.isnan(result.speed_x)
    assert not result.walks


def test_44_degrees_and_a_crouch_are_no_fall() -> None:
    position = np.tile((0.0, 0.0, HEIGHT), (1000, 1))
    position[100:, 2] = 0.51 * HEIGHT
    tilted = np.tile(quaternion(pitch=math.radians(-44), yaw=2.0), (1000, 1))
    assert not measure(walk(torso_position=position, torso_quaternion=tilted), 0.0, 10.0).fell


def test_com_error_is_taken_at_the_sampling_time_and_in_q() -> None:
    # The CoM sways; the gait expects 4 mm more than the truth of 40 ms ago; the world is turned.
    ticks, yaw = 1000, 0.8
    time = np.arange(ticks) * 0.01
    in_q = np.stack((0.01 * np.cos(5 * time), 0.03 * np.sin(9 * time), 0 * time + 0.26), axis=1)
    sole_in_q = np.array((0.02, 0.055))
    offset = in_q[:, :2] - sole_in_q
    cos, sin = math.cos(yaw), math.sin(yaw)
    com = np.stack(
        (1.0 + cos * offset[:, 0] - sin * offset[:, 1], sin * offset[:, 0] + cos * offset[:, 1],
         in_q[:, 2]), axis=1
    )
    sole_position = np.zeros((ticks, 2, 3))
    sole_position[:, 0, 0] = 1.0
    sole_position[:, 1] = 77.0
    late = np.vstack((np.repeat(in_q[:1], 4, axis=0), in_q[:-4]))
    trace = walk(
        ticks,
        com=com,
        sole_position=sole_position,
        sole_yaw=np.tile((yaw, 9.0), (ticks, 1)),
        support_sole_in_q=np.tile((*sole_in_q, 0.0), (ticks, 1)),
        com_expected_in_q=late + (0.002, -0.004, 0.0),
        com_measured_in_q=late + (0.0, 0.003, 0.0),
    )
    result = measure(trace, 1.0, 9.0)
    assert result.com_error_x == pytest.approx(0.002, abs=1e-9)
    assert result.com_error_y == pytest.approx(0.004, abs=1e-9)
    assert result.com_error_x_measured == pytest.approx(0.002, abs=1e-9)
    assert result.com_error_y_measured == pytest.approx(0.007, abs=1e-9)


def test_com_error_uses_the_support_side_and_skips_double_support() -> None:
    support = np.full(1000, RIGHT)
    support[500:] = DOUBLE
    sole_in_q = np.tile((0.0, -0.05, 0.0), (1000, 1))
    expected = np.tile((0.0, 0.006, 0.26), (1000, 1))
    expected[500:] = 5.0
    trace = walk(support=support, support_sole_in_q=sole_in_q, com_expected_in_q=expected)
    assert measure(trace, 0.0, 10.0).com_error_y == pytest.approx(0.006)
    standing = dataclasses.replace(trace, support=np.full(1000, DOUBLE))
    assert math.isnan(measure(standing, 0.0, 10.0).com_error_y)


def test_a_trace_that_does_not_fit_is_refused() -> None:
    with pytest.raises(NaoGaitError, match=r"trace\.com: got '3 rows'; allowed: 1000 rows"):
        walk(com=np.zeros((3, 3)))
    with pytest.raises(NaoGaitError, match="strictly increasing"):
        walk(2, stamp=np.array((5, 5)))


def test_angles_agree_with_scipy() -> None:
    rotation = pytest.importorskip("scipy.spatial.transform").Rotation
    rotations = rotation.random(200, random_state=1)
    quaternions, matrices = rotations.as_quat(), rotations.as_matrix()
    np.testing.assert_allclose(metrics.yaw_of(quaternions), rotations.as_euler("ZYX")[:, 0])
    np.testing.assert_allclose(
        np.cos(metrics.tilt_of(quaternions)), matrices[:, 2, 2], atol=1e-12
    )


def test_the_lead_of_a_foreseen_fall_is_the_time_from_the_word_to_the_fall() -> None:
    quaternion = np.tile((0.0, 0.0, 0.0, 1.0), (1000, 1))
    quaternion[800:] = (math.sin(0.5), 0.0, 0.0, math.cos(0.5))
    alarm = np.arange(1000) >= 760
    measured = measure(walk(torso_quaternion=quaternion, alarm=alarm), 1.0, 10.0)
    assert measured.fall_lead == pytest.approx(0.4)
    assert not measured.false_alarm
    silent = measure(walk(torso_quaternion=quaternion), 1.0, 10.0)
    assert silent.fall_lead == 0.0
    upright = measure(walk(alarm=alarm), 1.0, 10.0)
    assert upright.fall_lead is None
    assert upright.false_alarm


def test_support_changes_are_counted_in_the_window() -> None:
    support = np.where(np.arange(1000) // 25 % 2, LEFT, metrics.RIGHT)
    assert measure(walk(support=support), 1.0, 2.0).support_changes == 3
    assert measure(walk(), 1.0, 2.0).support_changes == 0


OUTLINE = ((0.08, -0.04), (0.08, 0.05), (-0.07, 0.05), (-0.07, -0.04))
"""Of a left sole: 40 mm inwards of its ankle."""


@pytest.mark.parametrize(
    ("right", "yaw", "touches"),
    [
        ((0.0, -0.031, 0.0), 0.0, False),  # left at y = 50 mm: 81 mm apart, which is 80 mm wide
        ((0.0, -0.029, 0.0), 0.0, True),
        ((0.16, -0.029, 0.0), 0.0, False),  # one ahead of the other
        ((0.0, -0.029, 0.05), 0.0, False),  # swings over the other's shoe
        ((0.0, -0.031, 0.0), 0.3, True),  # the toes meet
    ],
)  # fmt: skip
def test_soles_that_overlap_are_a_contact(
    right: tuple[float, float, float], yaw: float, touches: bool
) -> None:
    position = np.tile(((0.0, 0.05, 0.0), right), (1000, 1, 1))
    turned = np.zeros((1000, 2))
    turned[:, 1] = yaw
    heading = 1.1  # the same, wherever the robot looks
    cos, sin = math.cos(heading), math.sin(heading)
    position[..., :2] = position[..., :2] @ np.array(((cos, sin), (-sin, cos)))
    trace = walk(sole_position=position, sole_yaw=turned + heading)
    assert measure(trace, 2.0, 10.0, OUTLINE).contact_ticks == (800 if touches else 0)
    assert measure(trace, 2.0, 10.0).contact_ticks == 0


def test_a_sole_that_has_just_landed_has_no_slip() -> None:
    slip = np.full((1000, 2), 0.02)
    slip[::10] = math.nan
    assert measure(walk(sole_slip=slip), 0.0, 10.0).slip_speed == pytest.approx(0.02)


def test_the_lead_is_that_of_the_alarm_in_whose_course_the_robot_falls() -> None:
    roll, alarm = np.zeros(1000), np.zeros(1000, dtype=bool)
    roll[600:] = math.radians(46)
    alarm[100:200] = alarm[580:] = True
    posture = quaternion(roll=roll)
    result = measure(walk(torso_quaternion=posture, alarm=alarm), 0.0, 10.0)
    assert result.fall_lead == pytest.approx(0.2)
    alarm[580:] = False
    result = measure(walk(torso_quaternion=posture, alarm=alarm), 0.0, 10.0)
    assert result.fall_lead == 0.0
    assert not result.false_alarm
    assert measure(walk(alarm=alarm), 0.0, 10.0).false_alarm


def test_a_printed_trace_is_a_line() -> None:
    text = repr(walk(200))
    assert "200 ticks" in text
    assert "com_measured_in_q" in text
    assert len(text) < 500
