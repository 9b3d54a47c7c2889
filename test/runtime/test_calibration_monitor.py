"""What the gait reports of its calibration."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nao_lipm_gait.calibration import Calibration
from nao_lipm_gait.gait import Gait
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.runtime.calibration_monitor import Measurement, calibration_report
from robot_core.errors import NaoGaitError
from robot_core.robot import load_robot

ROBOT = load_robot()
CALIBRATION = Calibration(sole_pitch=math.radians(1.25), sole_roll=math.radians(-0.5))
angles = st.floats(-0.2, 0.2)


@given(pitch=angles, roll=angles, deviation=st.floats(0.0, 1.0), steps=st.booleans())
def test_a_measurement_is_read_as_it_was_written(
    pitch: float, roll: float, deviation: float, steps: bool
) -> None:
    written = Measurement(
        sole_pitch=pitch, imu_roll=roll, sole_roll_deviation=deviation, steps_measure=steps
    )
    assert Measurement.read(written.values()) == written
    assert Measurement.read(written.values()).calibration == Calibration(
        sole_pitch=pitch, imu_roll=roll
    )


@pytest.mark.parametrize(
    ("label", "value"),
    [("sole pitch [rad]", "1 deg"), ("sole pitch [rad]", "nan"), ("steps measure", "perhaps")],
)
def test_a_measurement_that_is_wrong_is_refused(label: str, value: str) -> None:
    values = Measurement().values()
    assert label in values
    with pytest.raises(NaoGaitError):
        Measurement.read({**values, label: value})
    del values[label]
    with pytest.raises(NaoGaitError):
        Measurement.read(values)


def test_soles_are_level_when_their_tilt_is_known_and_corrected() -> None:
    known = {"sole_pitch": 0.02, "sole_pitch_deviation": 0.0025, "sole_roll_deviation": 0.0025}
    assert Measurement(**known, sole_pitch_applied=0.0199).soles_level
    assert not Measurement(**known, sole_pitch_applied=0.015).soles_level
    known["sole_roll_deviation"] = 0.007
    assert not Measurement(**known, sole_pitch_applied=0.0199).soles_level


def test_the_report_holds_the_measurement() -> None:
    gait = Gait(ROBOT, GaitParameters(), calibration=CALIBRATION)
    measured = Measurement.read(calibration_report(gait, steps_measure=True).values)
    assert measured.calibration == CALIBRATION
    assert measured.sole_pitch_applied == CALIBRATION.sole_pitch
    assert measured.soles_level


def test_soles_that_are_not_measured_are_reported_with_the_reason() -> None:
    gait = Gait(ROBOT, GaitParameters())
    assert "not known" in calibration_report(gait, steps_measure=True).message
    assert "level_soles" in calibration_report(gait, steps_measure=False).message


def test_a_measurement_that_no_calibration_may_hold_is_explained() -> None:
    class HeldAtATilt(Gait):
        @property
        def calibration(self) -> Calibration:
            return Calibration(imu_pitch=0.3)

    report = calibration_report(HeldAtATilt(ROBOT, GaitParameters()), steps_measure=True)
    assert "imu_pitch: got 0.3" in report.message
    assert report.values == {}
