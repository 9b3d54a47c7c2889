"""Torso orientation, measured CoM and odometry against rotations computed another way."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from nao_lipm_gait.estimation.com_measurement import (
    LevelFrame,
    level_frame,
    measured_acceleration_in_q,
    measured_com_in_q,
)
from nao_lipm_gait.estimation.odometry import Odometry
from nao_lipm_gait.estimation.torso_orientation import TorsoOrientation
from nao_lipm_gait.whole_body.body_model import SolePose

DT = 0.01
GRAVITY = 9.81
LEVEL = (0.0, 0.0, 1.0)
tilts = st.floats(-0.3, 0.3)
yaws = st.floats(-3.0, 3.0)


def sole_pose(rotation: Rotation, position: np.ndarray) -> SolePose:
    matrix = rotation.as_matrix()
    return SolePose(tuple(position), tuple(matrix[:, 0]), tuple(matrix[:, 2]))


@given(roll=tilts, pitch=tilts, yaw=yaws, sole_yaw=yaws)
def test_measured_com_undoes_the_torsos_rotation(
    roll: float, pitch: float, yaw: float, sole_yaw: float
) -> None:
    torso_in_world = Rotation.from_euler("ZYX", [yaw, pitch, roll])
    sole_in_world = Rotation.from_euler("Z", sole_yaw)
    from_sole = np.array([0.02, -0.04, 0.25])
    com = np.array([0.01, 0.002, -0.05])
    offset = torso_in_world.inv().apply(sole_in_world.apply(from_sole))
    sole = sole_pose(torso_in_world.inv() * sole_in_world, com - offset)
    up = tuple(torso_in_world.inv().apply([0.0, 0.0, 1.0]))
    measured = level_frame(sole, up).coordinates(tuple(com))
    assert measured == pytest.approx(tuple(from_sole), abs=1e-9)


def test_measured_com_is_relative_to_the_soles_pose_in_q() -> None:
    sole = LevelFrame((0.0, 0.0, -0.25), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), LEVEL)
    x, y, z = measured_com_in_q(
        sole.coordinates((0.02, -0.03, 0.0)), (0.1, 0.05, math.pi / 2)
    )
    assert (x, y, z) == pytest.approx((0.1 + 0.03, 0.05 + 0.02, 0.25))


@given(roll=tilts, pitch=tilts, yaw=yaws, sole_yaw=yaws, yaw_in_q=yaws)
def test_measured_acceleration_contains_no_gravity(
    roll: float, pitch: float, yaw: float, sole_yaw: float, yaw_in_q: float
) -> None:
    torso_in_world = Rotation.from_euler("ZYX", [yaw, pitch, roll])
    in_q = np.array([3.0, -1.5, 2.0])
    in_world = Rotation.from_euler("Z", sole_yaw - yaw_in_q).apply(in_q)
    force = torso_in_world.inv().apply(in_world + np.array((0.0, 0.0, GRAVITY)))
    sole = sole_pose(
        torso_in_world.inv() * Rotation.from_euler("Z", sole_yaw), np.array([0.0, 0.05, -0.33])
    )
    up = tuple(torso_in_world.inv().apply([0.0, 0.0, 1.0]))
    level = level_frame(sole, up)
    measured = measured_acceleration_in_q(
        level.components(tuple(force)), (0.0, 0.05, yaw_in_q)
    )
    assert measured == pytest.approx(tuple(in_q[:2]), abs=1e-9)


@given(x=st.floats(-0.1, 0.1), y=st.floats(-0.2, 0.2), yaw=st.floats(-1.0, 1.0), pitch=tilts)
def test_pose_of_the_other_sole(
    x: float, y: float, yaw: float, pitch: float
) -> None:
    torso = Rotation.from_euler("Y", pitch)
    reference = sole_pose(torso.inv(), np.array([0.0, 0.05, -0.33]))
    offset = torso.inv().apply([x, y, 0.0])
    other = sole_pose(
        torso.inv() * Rotation.from_euler("Z", yaw), np.array([0.0, 0.05, -0.33]) + offset
    )
    up = tuple(torso.inv().apply([0.0, 0.0, 1.0]))
    assert level_frame(reference, up).pose_of(other) == pytest.approx((x, y, yaw), abs=1e-9)


def test_gyro_follows_a_turning_torso() -> None:
    orientation = TorsoOrientation(1e9, 1e9)
    orientation.reset((0.0, 0.0, GRAVITY))
    rotation = Rotation.identity()
    rng = np.random.default_rng(4)
    for _ in range(200):
        rate = rng.normal(0.0, 0.5, 3)
        rotation = rotation * Rotation.from_rotvec(rate * DT)
        orientation.update(tuple(rate), (0.0, 0.0, 0.0), LEVEL, DT)
    np.testing.assert_allclose(
        orientation.up_in_torso, rotation.inv().apply([0.0, 0.0, 1.0]), atol=2e-3
    )


def test_signs_are_those_of_rep_103() -> None:
    orientation = TorsoOrientation(1.0, 1.0)
    # Nose down by 0.1 rad: the accelerometer sees gravity's reaction point backward.
    force = Rotation.from_euler("Y", 0.1).inv().apply([0.0, 0.0, GRAVITY])
    orientation.reset(tuple(force))
    assert (orientation.roll, orientation.pitch) == pytest.approx((0.0, 0.1))
    assert orientation.tilt == pytest.approx(0.1)
    orientation.reset(tuple(Rotation.from_euler("X", 0.2).inv().apply([0.0, 0.0, GRAVITY])))
    assert (orientation.roll, orientation.pitch) == pytest.approx((0.2, 0.0))


def test_accelerometer_corrects_a_gyro_bias_on_average() -> None:
    orientation = TorsoOrientation(1.0, 1e9)
    orientation.reset((0.0, 0.0, GRAVITY))
    rng = np.random.default_rng(5)
    for _ in range(1000):
        shaken = rng.normal(0.0, 2.0, 3) + np.array((0.0, 0.0, GRAVITY))
        orientation.update((0.02, -0.02, 0.0), tuple(shaken), LEVEL, DT)
    # The gyro's bias alone would turn it by 0.2 rad.
    assert orientation.tilt < 0.06


def test_a_robot_that_moves_at_the_start_is_not_tilted_by_an_impact() -> None:
    orientation = TorsoOrientation(4.0, 1e9)
    impact = tuple(Rotation.from_euler("X", 0.6).inv().apply([0.0, 0.0, GRAVITY]))
    orientation.reset_moving(impact)
    for _ in range(10):
        orientation.update((0.0, 0.0, 0.0), impact, LEVEL, DT)
    assert orientation.tilt < 0.2
    for _ in range(200):  # no impact: it leans
        orientation.update((0.0, 0.0, 0.0), impact, LEVEL, DT)
    assert orientation.tilt > 0.5


def test_an_impact_in_the_first_sample_is_soon_forgotten() -> None:
    orientation = TorsoOrientation(4.0, 4.0)
    orientation.reset((7.0, 0.0, 7.0))
    for _ in range(100):
        orientation.update((0.0, 0.0, 0.0), (0.0, 0.0, GRAVITY), None, DT)
    assert orientation.tilt < 0.01


def test_flat_stance_sole_corrects_only_while_nearly_upright() -> None:
    normal = tuple(Rotation.from_euler("X", 0.1).inv().apply([0.0, 0.0, 1.0]))
    near = TorsoOrientation(1e9, 0.5)
    far = TorsoOrientation(1e9, 0.5)
    far.reset(tuple(Rotation.from_euler("X", 0.6).inv().apply([0.0, 0.0, GRAVITY])))
    for _ in range(300):
        near.update((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), normal, DT)
        far.update((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), normal, DT)
    assert near.roll == pytest.approx(0.1, abs=0.01)
    assert far.roll == pytest.approx(0.6, abs=0.01)


def test_without_a_force_the_orientationstarts_upright() -> None:
    orientation = TorsoOrientation(1.0, 1.0)
    orientation.reset((0.0, 0.0, 0.0))
    assert orientation.up_in_torso == (0.0, 0.0, 1.0)


def feet(left: tuple[float, float], right: tuple[float, float]) -> tuple[SolePose, SolePose]:
    forward, up = (1.0, 0.0, 0.0), LEVEL
    return SolePose((*left, -0.33), forward, up), SolePose((*right, -0.33), forward, up)


def test_odometry_counts_the_steps_of_both_feet() -> None:
    odometry = Odometry()
    left, right = feet((0.0, 0.05), (0.0, -0.05))
    odometry.update(1, level_frame(left, LEVEL), right, DT)
    assert odometry.base_footprint_in_odom == pytest.approx((0.0, 0.0, 0.0))
    # Left carries, the torso moves 6 cm, the right sole lands 6 cm ahead of the left one...
    left, right = feet((-0.06, 0.05), (0.0, -0.05))
    odometry.update(1, level_frame(left, LEVEL), right, DT)
    assert odometry.base_footprint_in_odom == pytest.approx((0.03, 0.0, 0.0))
    # ...then the right one carries and the left one swings 6 cm past it.
    odometry.update(-1, level_frame(right, LEVEL), left, DT)
    assert odometry.base_footprint_in_odom == pytest.approx((0.03, 0.0, 0.0))
    left, right = feet((0.0, 0.05), (-0.06, -0.05))
    odometry.update(-1, level_frame(right, LEVEL), left, DT)
    assert odometry.base_footprint_in_odom == pytest.approx((0.09, 0.0, 0.0))
    assert odometry.velocity[0] > 0.0


def test_odometry_turns_with_the_feet() -> None:
    odometry = Odometry()
    left, right = feet((0.0, 0.05), (0.0, -0.05))
    odometry.update(1, level_frame(left, LEVEL), right, DT)
    turned = SolePose(right.position, (math.cos(0.2), math.sin(0.2), 0.0), LEVEL)
    odometry.update(1, level_frame(left, LEVEL), turned, DT)
    assert odometry.base_footprint_in_odom[2] == pytest.approx(0.1)
