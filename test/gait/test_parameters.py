"""Gait parameters: documented, checked, and read from presets."""

import math
import pickle
from pathlib import Path

import pytest

from gait_lab import cli
from nao_lipm_gait.parameters import PARAMETERS, GaitParameters, load_preset
from nao_lipm_gait.walk_engines import WALKS
from nao_lipm_gait.walks.lipm.parameters import EXTENSIONS_OFF
from robot_core.errors import NaoGaitError
from robot_core.resources import names
from robot_core.schema import Field

ENGINES = {walk: GaitParameters(walk=walk) for walk in WALKS}


@pytest.mark.parametrize("parameter", PARAMETERS, ids=lambda parameter: parameter.name)
def test_every_parameter_is_documented_and_checked(parameter: Field) -> None:
    assert parameter.meaning[0].isupper() or "_" in parameter.meaning.split()[0]
    assert parameter.meaning.endswith(".")
    having = [p for p in ENGINES.values() if hasattr(p, parameter.name)]
    assert having, "an engine uses it"
    wrong: list[object] = ["1", None, [1.0]]
    if parameter.is_switch:
        wrong += [1, 0.0]
    elif parameter.is_number:
        wrong += [True, math.nan, math.inf, 10**400]
        wrong += [parameter.maximum + 1.0, parameter.minimum - 1.0]
    for value in wrong:
        with pytest.raises(NaoGaitError) as refused:
            having[0].replace(**{parameter.name: value})
        assert refused.value.field == parameter.name
        assert refused.value.allowed == parameter.allowed


@pytest.mark.parametrize("walk", WALKS)
def test_an_engine_refuses_the_parameters_of_the_others(walk: str) -> None:
    p = ENGINES[walk]
    assert p.walk == walk
    for parameter in PARAMETERS:
        if not hasattr(p, parameter.name):
            with pytest.raises(NaoGaitError, match=f"{parameter.name}: .*only with walk: "):
                p.replace(**{parameter.name: parameter.default})
            values = {"walk": walk, parameter.name: parameter.default}
            with pytest.raises(NaoGaitError, match=f"a: {parameter.name}: .*only with walk: "):
                GaitParameters.from_mapping(values, "a: ")


def test_another_engine_keeps_what_both_have() -> None:
    lipm = GaitParameters(swing_lift=0.01, step_duration_min=0.1)
    zmp = lipm.replace(walk="zmp", zmp_offset_y=0.06)
    assert zmp == GaitParameters(walk="zmp", swing_lift=0.01, zmp_offset_y=0.06)
    assert zmp.replace(walk="lipm") == GaitParameters(swing_lift=0.01)
    assert pickle.loads(pickle.dumps(zmp)) == zmp


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
    assert {name: getattr(paper, name) for name in EXTENSIONS_OFF} == EXTENSIONS_OFF


def test_without_extensions_those_are_on_that_are_named() -> None:
    default, off = GaitParameters(), GaitParameters(extensions=False)
    assert default.replace(extensions=False) == off
    assert off.replace(extensions=True) == default
    one = off.replace(offset_time=2.0)
    assert one == GaitParameters(extensions=False, offset_time=2.0)
    assert one.offset_time == 2.0
    assert one.arm_swing == 0.0
    assert default.replace(offset_time=2.0).replace(extensions=False) == off
    for name, value in EXTENSIONS_OFF.items():
        assert getattr(default, name) != value, "an extension is on by default"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("swing_lift: high", r"bad\.yaml: swing_lift: got 'high'; allowed: a number from 0 to"),
        ("swing_lfit: 0.02", r"lfit: got 0.02; did you mean swing_lift\? allowed: one of the keys"),
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


def test_a_preset_names_only_what_differs_from_its_base(tmp_path: Path) -> None:
    (tmp_path / "slow.yaml").write_text("base: zmp\nstep_forward_max: 0.02\nstep_side_max: 0.03\n")
    (tmp_path / "mine.yaml").write_text("base: slow\nstep_side_max: 0.04\n")
    expected = load_preset("zmp").replace(step_forward_max=0.02, step_side_max=0.04)
    assert load_preset(tmp_path / "mine.yaml") == expected
    (tmp_path / "mine.yaml").write_text("base: slowly\n")
    with pytest.raises(NaoGaitError, match=r"mine\.yaml: base: got 'slowly'; allowed: .*zmp"):
        load_preset(tmp_path / "mine.yaml")


def test_an_empty_preset_is_the_default(tmp_path: Path) -> None:
    path = tmp_path / "empty.yaml"
    path.write_text("")
    assert load_preset(path) == GaitParameters()


def test_the_document_is_up_to_date() -> None:
    assert cli.main(["write", "parameters", "--check"]) == 0, "run nao_gait write parameters"
