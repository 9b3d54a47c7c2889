"""The parameter table: ranges hold, presets load, and what people read agrees with the code."""

import math
from pathlib import Path

import pytest

from gait_lab.parameter_docs import documents
from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.parameters import PARAMETERS, GaitParameters, Parameter, load_preset


@pytest.mark.parametrize("parameter", PARAMETERS, ids=lambda parameter: parameter.name)
def test_every_parameter_is_documented_and_guarded(parameter: Parameter) -> None:
    assert parameter.meaning
    assert parameter.group
    assert parameter.check(parameter.default) == parameter.default
    wrong = ["1", None, [1.0]]
    if parameter.is_switch:
        wrong += [1, 0.0]
    else:
        beyond = parameter.maximum + 1.0
        wrong += [True, math.nan, math.inf, beyond, parameter.minimum - 1.0]
    for value in wrong:
        with pytest.raises(NaoGaitError) as refused:
            GaitParameters.from_mapping({parameter.name: value})
        assert parameter.name in str(refused.value)
        assert parameter.allowed in str(refused.value)


def test_replace_checks_as_well() -> None:
    parameters = GaitParameters()
    assert parameters.replace(swing_lift=0.01).swing_lift == 0.01
    with pytest.raises(NaoGaitError, match="swing_lift"):
        parameters.replace(swing_lift=1.0)
    with pytest.raises(NaoGaitError, match="no_such_thing"):
        parameters.replace(no_such_thing=1.0)
    with pytest.raises(NaoGaitError, match="com_height"):
        GaitParameters(com_height=-1.0)


def test_shipped_presets() -> None:
    assert load_preset("default") == GaitParameters()
    paper = load_preset("paper")
    assert paper.pendulum_shift_max == 0.004
    assert paper.offset_time == paper.gyro_pitch_gain == paper.gyro_roll_gain == 0.0


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("swing_lift: high", "swing_lift"),
        ("swing_lfit: 0.02", "swing_lfit"),
        ("- 1\n- 2", "mapping"),
        ("a: [unclosed", "readable YAML"),
        ("!!python/object/apply:os.getcwd []", "readable YAML"),
    ],
)
def test_bad_preset_files_are_refused(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "bad.yaml"
    path.write_text(text)
    with pytest.raises(NaoGaitError, match=said):
        load_preset(path)


def test_an_empty_preset_is_the_default(tmp_path: Path) -> None:
    path = tmp_path / "empty.yaml"
    path.write_text("")
    assert load_preset(path) == GaitParameters()


def test_written_documents_are_up_to_date() -> None:
    for path, text in documents().items():
        assert path.read_text(encoding="utf-8") == text, (
            f"{path} is old: run `python -m gait_lab.parameter_docs`"
        )
