"""Gait parameters: documented, checked, and read from presets."""

import math
from pathlib import Path

import pytest

from gait_lab import cli
from nao_lipm_gait.parameters import PARAMETERS, GaitParameters, load_preset
from robot_core.errors import NaoGaitError
from robot_core.resources import names
from robot_core.schema import Field


@pytest.mark.parametrize("parameter", PARAMETERS, ids=lambda parameter: parameter.name)
def test_every_parameter_is_documented_and_checked(parameter: Field) -> None:
    assert parameter.meaning[0].isupper() or "_" in parameter.meaning.split()[0]
    assert parameter.meaning.endswith(".")
    wrong: list[object] = ["1", None, [1.0]]
    if parameter.is_switch:
        wrong += [1, 0.0]
    elif parameter.is_number:
        wrong += [True, math.nan, math.inf, 10**400]
        wrong += [parameter.maximum + 1.0, parameter.minimum - 1.0]
    for value in wrong:
        with pytest.raises(NaoGaitError) as refused:
            GaitParameters.from_mapping({parameter.name: value})
        assert refused.value.field == parameter.name
        assert refused.value.allowed == parameter.allowed


def test_replace_checks_as_well() -> None:
    parameters = GaitParameters()
    assert parameters.replace(swing_lift=0.01).swing_lift == 0.01
    with pytest.raises(NaoGaitError, match="swing_lift"):
        parameters.replace(swing_lift=1.0)
    with pytest.raises(NaoGaitError, match="no_such_thing"):
        parameters.replace(no_such_thing=1.0)
    with pytest.raises(NaoGaitError, match="com_height"):
        GaitParameters(com_height=-1.0)


def test_default_preset_is_the_defaults_and_every_shipped_preset_loads() -> None:
    assert load_preset("default") == GaitParameters()
    for name in names("gait"):
        load_preset(name)


def test_paper_is_the_method_without_extensions() -> None:
    paper = load_preset("paper")
    assert paper.pendulum_shift_max == paper.pendulum_shift_back_max  # one cap on |r_x|
    off = (
        "offset_time", "push_velocity", "pendulum_shift_side_max", "step_stretch_max",
        "step_capture", "step_capture_back", "step_catch_out", "step_catch_in", "stand_catch",
        "tilt_pitch_gain", "tilt_roll_gain", "tilt_com_gain", "gyro_pitch_gain", "gyro_roll_gain",
        "gyro_pitch_rate_gain", "gyro_roll_rate_gain", "heading_gain", "heading_lean",
        "speed_time", "arm_swing", "swing_toe_lift",
    )  # fmt: skip
    assert {name: getattr(paper, name) for name in off} == dict.fromkeys(off, 0.0)
    for switch in (paper.push_acceleration, paper.yaw_from_lean, paper.level_soles):
        assert not switch
    assert paper.step_hurry == 1.0


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("swing_lift: high", r"bad\.yaml: swing_lift: got 'high'; allowed: a number from 0 to"),
        ("swing_lfit: 0.02", r"bad\.yaml: swing_lfit: got 0.02; allowed: one of the keys walk"),
        ("- 1\n- 2", r"bad\.yaml: got \[1, 2\]; allowed: a mapping"),
        ("a: [unclosed", "readable YAML"),
        ("!!python/object/apply:os.getcwd []", "readable YAML"),
    ],
)
def test_a_bad_preset_file_is_refused_with_its_path(
    tmp_path: Path, text: str, expected: str
) -> None:
    path = tmp_path / "bad.yaml"
    path.write_text(text)
    with pytest.raises(NaoGaitError, match=expected):
        load_preset(path)


def test_an_empty_preset_is_the_default(tmp_path: Path) -> None:
    path = tmp_path / "empty.yaml"
    path.write_text("")
    assert load_preset(path) == GaitParameters()


def test_the_document_is_up_to_date() -> None:
    assert cli.main(["write", "parameters", "--check"]) == 0, "run nao_gait write parameters"
