"""Calibration: files, corrected sensors and targets, and the IMU against the soles of a stand."""

import math
from pathlib import Path

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from nao_lipm_gait.calibration import NOT_CALIBRATED, Calibration, SensorCorrection
from nao_lipm_gait.calibration_file import (
    CalibrationFile,
    Deviation,
    calibration_of,
    load_calibration,
)
from nao_lipm_gait.estimation.stand_alignment import SETTLING_TIME, StandAlignment
from nao_lipm_gait.gait import Gait
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.runtime.calibration_monitor import Measurement
from nao_lipm_gait.whole_body.body_model import BodyModel
from robot_core.errors import NaoGaitError
from robot_core.robot import RobotDescription, load_robot
from robot_core.types import LEFT, RIGHT, FloatArray, SensorFrame

ROBOT = load_robot()
CALIBRATION = Calibration(
    sole_pitch=0.03, sole_roll=-0.02, lean=0.01, imu_roll=0.04, imu_pitch=-0.05,
    gyro_bias_x=0.01, gyro_bias_y=-0.02, gyro_bias_z=0.03,
)  # fmt: skip
DT = 0.01
GRAVITY = 9.81
tilts = st.floats(-0.15, 0.15)
components = st.floats(-5.0, 5.0)
vectors = st.tuples(components, components, components)


def frame_of(
    position: FloatArray, rate: FloatArray | None = None, force: FloatArray | None = None
) -> SensorFrame:
    return SensorFrame(
        7, position,
        np.array((0.1, 0.2, 0.3)) if rate is None else rate,
        np.array((0.0, 0.0, GRAVITY)) if force is None else force,
    )  # fmt: skip


def contents(frame: SensorFrame) -> tuple[object, ...]:
    return (
        frame.stamp, frame.joint_position, frame.angular_velocity, frame.linear_acceleration
    )


# -- correction ------------------------------------------------------------------------------------


@given(pitch=tilts, roll=tilts, seed=st.integers(0, 1000))
def test_targets_come_back_as_the_joint_angles_of_the_model(
    pitch: float, roll: float, seed: int
) -> None:
    correction = SensorCorrection(ROBOT, Calibration(sole_pitch=pitch, sole_roll=roll))
    wanted = np.random.default_rng(seed).uniform(-0.5, 0.5, len(ROBOT.joint_names))
    sent = correction.for_motors(wanted)
    np.testing.assert_allclose(correction.sensed(frame_of(sent)).joint_position, wanted, atol=1e-15)
    np.testing.assert_allclose(correction.for_model(sent), wanted, atol=1e-15)


def test_without_errors_nothing_changes() -> None:
    frame = frame_of(np.array(ROBOT.stand_pose))
    correction = SensorCorrection(ROBOT, NOT_CALIBRATED)
    sensed = correction.sensed(frame)
    for before, after in zip(contents(frame), contents(sensed), strict=True):
        np.testing.assert_array_equal(before, after)
    np.testing.assert_array_equal(correction.for_motors(frame.joint_position), ROBOT.stand_pose)


@pytest.mark.parametrize(("pitch", "roll"), [(0.04, 0.0), (0.0, 0.03), (-0.02, 0.05)])
def test_joint_angles_that_say_parallel_show_the_tilt_of_the_soles(
    pitch: float, roll: float
) -> None:
    correction = SensorCorrection(ROBOT, Calibration(sole_pitch=pitch, sole_roll=roll))
    body = BodyModel(ROBOT)
    body.set_joints(correction.sensed(frame_of(np.array(ROBOT.stand_pose))).joint_position)
    left, right = (np.array(body.sole_in_torso(leg).normal) for leg in (LEFT, RIGHT))
    expected = Rotation.from_euler("xyz", (roll, pitch, 0.0)).apply((0.0, 0.0, 1.0))
    np.testing.assert_allclose((left - right)[:2], expected[:2], atol=2e-4)


@given(roll=tilts, pitch=tilts, bias=vectors, rate=vectors, force=vectors)
def test_a_tilted_imu_with_a_biased_gyro_reads_as_a_straight_one(
    roll: float,
    pitch: float,
    bias: tuple[float, float, float],
    rate: tuple[float, float, float],
    force: tuple[float, float, float],
) -> None:
    offset = 0.1 * np.array(bias)
    imu_in_torso = Rotation.from_euler("xyz", (roll, pitch, 0.0))
    calibration = Calibration(
        imu_roll=roll, imu_pitch=pitch,
        gyro_bias_x=offset[0], gyro_bias_y=offset[1], gyro_bias_z=offset[2],
    )  # fmt: skip
    measured = frame_of(
        np.array(ROBOT.stand_pose),
        imu_in_torso.inv().apply(rate) + offset, imu_in_torso.inv().apply(force),
    )  # fmt: skip
    sensed = SensorCorrection(ROBOT, calibration).sensed(measured)
    np.testing.assert_allclose(sensed.angular_velocity, rate, atol=1e-12)
    np.testing.assert_allclose(sensed.linear_acceleration, force, atol=1e-12)


def test_a_calibrated_gait_corrects_the_soles_from_its_first_tick() -> None:
    gait = Gait(ROBOT, GaitParameters(), calibration=CALIBRATION)
    assert gait.levelling.applied_pitch == CALIBRATION.sole_pitch
    assert gait.levelling.applied_roll == CALIBRATION.sole_roll
    assert gait.levelling.applied_lean == CALIBRATION.lean
    assert max(gait.levelling.sigma) < max(Gait(ROBOT, GaitParameters()).levelling.sigma)
    assert gait.calibration == CALIBRATION, "it keeps what it knows"


# -- stand -----------------------------------------------------------------------------------------


def stand(
    alignment: StandAlignment,
    seconds: float,
    torso: Rotation,
    imu: Rotation,
    gyro: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> None:
    """A stand on level soles. Torso: in the world; imu: in the torso."""
    up_in_torso = torso.inv().apply((0.0, 0.0, 1.0))
    force = GRAVITY * imu.inv().apply(up_in_torso)
    for _ in range(round(seconds / DT)):
        alignment.update(gyro, tuple(force), tuple(up_in_torso), tuple(up_in_torso), DT)


@given(roll=tilts, pitch=tilts)
def test_a_stand_measures_the_rotation_that_makes_the_imu_straight(
    roll: float, pitch: float
) -> None:
    imu = Rotation.from_euler("xyz", (roll, pitch, 0.0))
    alignment = StandAlignment()
    stand(alignment, SETTLING_TIME + 0.5, Rotation.identity(), imu, (0.01, -0.02, 0.03))
    assert (alignment.roll, alignment.pitch) == pytest.approx((roll, pitch), abs=1e-9)
    assert alignment.gyro == pytest.approx((0.01, -0.02, 0.03))
    assert alignment.time == pytest.approx(0.5, abs=2 * DT)


def test_the_lean_of_the_torso_is_no_error_of_the_imu() -> None:
    alignment = StandAlignment()
    leaning = Rotation.from_euler("xyz", (0.0, 0.1, 0.0))
    stand(alignment, SETTLING_TIME + 0.5, leaning, Rotation.identity())
    assert (alignment.roll, alignment.pitch) == pytest.approx((0.0, 0.0), abs=1e-12)


def test_nothing_is_measured_while_the_robot_settles() -> None:
    alignment = StandAlignment()
    tilted = Rotation.from_euler("xyz", (0.1, 0.0, 0.0))
    stand(alignment, SETTLING_TIME - 0.1, Rotation.identity(), tilted)
    assert (alignment.time, alignment.roll) == (0.0, 0.0)


def test_the_next_stand_replaces_the_values_of_the_last_one() -> None:
    alignment = StandAlignment()
    first, second = (Rotation.from_euler("xyz", (roll, 0.0, 0.0)) for roll in (0.1, 0.05))
    stand(alignment, SETTLING_TIME + 1.0, Rotation.identity(), first)
    alignment.restart()
    assert alignment.time == 0.0
    assert alignment.roll == pytest.approx(0.1), "kept until there are better ones"
    stand(alignment, SETTLING_TIME + 1.0, Rotation.identity(), second)
    assert alignment.roll == pytest.approx(0.05)


def test_a_robot_that_is_moved_has_to_come_to_rest_again() -> None:
    alignment = StandAlignment()
    bias = (0.02, 0.0, 0.0)
    straight = Rotation.identity()
    stand(alignment, SETTLING_TIME + 1.0, straight, straight, bias)
    stand(alignment, 0.2, straight, straight, (0.52, 0.0, 0.0))
    assert alignment.time == 0.0
    assert alignment.gyro == pytest.approx(bias), "of the quiet part"
    stand(alignment, SETTLING_TIME + 1.0, straight, straight, bias)
    assert alignment.time > 0.5
    assert alignment.gyro == pytest.approx(bias)


# -- files -----------------------------------------------------------------------------------------


def written(path: Path, robot: str = ROBOT.name) -> Path:
    file = CalibrationFile(robot, CALIBRATION, Deviation(0.002, 0.003), "2026-11-23 05:00 UTC")
    path.write_text(file.as_yaml())
    return path


def test_a_file_gives_back_what_was_written(tmp_path: Path) -> None:
    assert load_calibration(written(tmp_path / "c.yaml"), ROBOT) == CALIBRATION
    assert calibration_of(ROBOT, str(tmp_path / "c.yaml")) == CALIBRATION
    assert calibration_of(ROBOT, "") is NOT_CALIBRATED


def test_small_numbers_survive_the_rounding(tmp_path: Path) -> None:
    path = tmp_path / "c.yaml"
    path.write_text(CalibrationFile(ROBOT.name, Calibration(sole_pitch=math.pi / 100)).as_yaml())
    assert load_calibration(path, ROBOT).sole_pitch == pytest.approx(math.pi / 100, abs=1e-6)


@pytest.fixture(scope="module")
def bruno() -> RobotDescription:
    return load_robot("bruno")


def test_the_file_of_another_robot_is_refused(tmp_path: Path, bruno: RobotDescription) -> None:
    path = written(tmp_path / "c.yaml")
    with pytest.raises(NaoGaitError, match="robot: got 'nao_h21'; allowed: bruno"):
        load_calibration(path, bruno)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "allowed: a mapping of robot, calibration"),
        ("robot: nao_h21", "calibration: got 'nothing'"),
        ("calibration: {}", "robot: got 'nothing'"),
        ("robot: nao_h21\ncalibration: {sole_pitch: 2}", "sole_pitch: got 2; allowed: a number"),
        ("robot: nao_h21\ncalibration: {sole_yaw: 0}", "sole_yaw: got 0; allowed: one of the keys"),
        ("robot: nao_h21\ncalibration: {imu_roll: .nan}", "imu_roll: got nan"),
        ("robot: [", "a readable YAML file"),
    ],
)
def test_a_bad_file_is_refused_in_one_line(tmp_path: Path, text: str, reason: str) -> None:
    path = tmp_path / "c.yaml"
    path.write_text(text)
    with pytest.raises(NaoGaitError) as refusal:
        load_calibration(path, ROBOT)
    assert reason in str(refusal.value)
    assert str(path) in str(refusal.value)


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(NaoGaitError, match="a readable file"):
        load_calibration(tmp_path / "none.yaml", ROBOT)


def test_every_number_of_a_calibration_is_in_the_file() -> None:
    text = CalibrationFile(ROBOT.name, CALIBRATION).as_yaml()
    for field in attrs.fields(Calibration):
        if field.name != "joint_zero":
            assert f"  {field.name}: {getattr(CALIBRATION, field.name)}\n" in text


def test_wrong_zeros_come_back_from_the_file_and_from_diagnostics(tmp_path: Path) -> None:
    zeros = (("LKneePitch", 0.05), ("RHipRoll", -0.02))
    calibration = attrs.evolve(CALIBRATION, joint_zero=zeros)
    file = tmp_path / "calibration.yaml"
    file.write_text(CalibrationFile(ROBOT.name, calibration).as_yaml())
    assert load_calibration(file, ROBOT) == calibration
    gait = Gait(ROBOT, GaitParameters(), calibration=calibration)
    assert gait.calibration.joint_zero == zeros
    measured = Measurement.of(gait, steps_measure=True)
    assert Measurement.read(measured.values()) == measured


@pytest.mark.parametrize(("joint", "zero", "reason"), [
    ("LElbow", 0.05, "joint_zero.LElbow: got 0.05; allowed: a joint of nao"),
    ("LKneePitch", 0.5, "joint_zero.LKneePitch: got 0.5; allowed: a number"),
])  # fmt: skip
def test_a_wrong_zero_of_no_joint_or_too_large_is_refused(
    tmp_path: Path, joint: str, zero: float, reason: str
) -> None:
    file = tmp_path / "calibration.yaml"
    file.write_text(f"robot: {ROBOT.name}\ncalibration: {{joint_zero: {{{joint}: {zero}}}}}\n")
    with pytest.raises(NaoGaitError) as refused:
        load_calibration(file, ROBOT)
    assert reason in str(refused.value)
