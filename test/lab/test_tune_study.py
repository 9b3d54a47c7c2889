"""Study files: the shipped ones are valid; a bad one gives one line and starts nothing."""

from pathlib import Path
from typing import Any

import pytest
import yaml

pytest.importorskip("joblib")
pytest.importorskip("mujoco")

from gait_lab.cli import EXIT_USAGE, main
from gait_lab.tune.study import METHODS, load_study, parse_study
from nao_lipm_gait.parameters import BY_NAME
from robot_core.errors import NaoGaitError
from robot_core.resources import share

GOOD: dict[str, Any] = {
    "parameters": {"step_forward_max": [0.02, 0.08], "swing_lift": [0.01, 0.03]},
    "start": {"step_forward_max": 0.03, "swing_lift": 0.012},
    "protocol": {"name": "growing_stride", "steps": 8},
    "objective": {"distance": 1.0},
    "robots": [0],
    "unseen": [5],
    "trials": 4,
}
SHIPPED = sorted(path.stem for path in share("config", "studies").glob("*.yaml"))


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_study_is_good_and_keeps_unseen_robots_apart(name: str) -> None:
    study = load_study(name)
    assert study.name == name
    assert len(study.file.unseen) >= 8
    assert not set(study.file.unseen) & {*study.file.robots, *study.file.finals.robots}
    for parameter, (low, high) in study.file.parameters.items():
        assert BY_NAME[parameter].minimum <= low < high <= BY_NAME[parameter].maximum
        assert low <= study.start_values[parameter] <= high


def test_the_second_papers_study_has_five_parameters_and_52_steps() -> None:
    study = load_study("speed")
    assert len(study.file.parameters) == 5
    assert study.options.as_dict()["steps"] == 52
    assert study.file.objective == {"distance": 1.0}
    in_finals = study.file.finals.candidates * len(study.file.finals.robots)
    assert study.file.trials * len(study.file.robots) + in_finals <= 74 * len(study.file.robots)


def test_another_robot_begins_at_its_own_preset_in_ranges_that_hold_it() -> None:
    study = load_study("omni", urdf="op3")
    shipped = load_study("omni").file.parameters
    assert study.file.urdf == "op3"
    assert study.start_values != load_study("omni").start_values
    for parameter, (low, high) in study.file.parameters.items():
        assert low <= study.start_values[parameter] <= high
        assert low <= shipped[parameter][0] < shipped[parameter][1] <= high


def test_a_robot_beside_the_study_is_found(tmp_path: Path) -> None:
    (tmp_path / "mine.urdf").write_text(share("urdf", "nao_h21_v40.urdf").read_text())
    study = tmp_path / "study.yaml"
    study.write_text(yaml.safe_dump({**GOOD, "urdf": "mine.urdf"}))
    assert load_study(str(study)).file.urdf == str(tmp_path / "mine.urdf")


def test_the_digest_sees_everything_that_a_score_depends_on(tmp_path: Path) -> None:
    soft, plant = "base: reference\nmotor: {lag: 0.02}\n", tmp_path / "mine.yaml"
    plant.write_text(soft, encoding="utf-8")
    base = {**GOOD, "plant": str(plant)}
    known = parse_study(base).digest()
    for change in (
        {"calibrated": True}, {"plant": "reference"}, {"robots": [1]}, {"engine": "pybullet"},
        {"objective": {"distance": 2.0}}, {"penalty": {"fall": 1.0}}, {"urdf": "nao_h21_v40"},
        {"preset": "paper"}, {"protocol": {"name": "growing_stride", "steps": 10}},
    ):  # fmt: skip
        assert parse_study({**base, **change}).digest() != known, change
    # What decides after the search may change, and so may the number of trials.
    later = {"trials": 9, "unseen": [7], "confirm": {"options": {"hold": 1.0}}, "method": "cma"}
    assert parse_study({**base, **later}).digest() == known
    plant.write_text(soft.replace("0.02", "0.03"), encoding="utf-8")
    assert parse_study(base).digest() != known
    elsewhere = tmp_path / "elsewhere.yaml"
    elsewhere.write_text(soft, encoding="utf-8")
    assert parse_study({**base, "plant": str(elsewhere)}).digest() == known


BAD: dict[str, tuple[dict[str, Any], str]] = {
    "unknown key": ({"parametres": {}}, "study.parametres"),
    "unknown parameter": ({"parameters": {"stride": [0, 1]}}, "parameters.stride"),
    "a switch": ({"parameters": {"feedback": [0, 1]}}, "parameters.feedback"),
    "outside the table": ({"parameters": {"swing_lift": [0.0, 0.5]}}, "from 0 to 0.06 m"),
    "ends swapped": ({"parameters": {"swing_lift": [0.03, 0.01]}}, "low < high"),
    "one end": ({"parameters": {"swing_lift": [0.03]}}, "[low, high]"),
    "no parameters": ({"parameters": {}}, "at least 1 entry"),
    "no robots": ({"robots": []}, "at least 1 item"),
    "a robot twice": ({"robots": [1, 1]}, "each item once"),
    "a word for a robot": ({"robots": ["one"]}, "whole number"),
    "seen and unseen": ({"unseen": [0, 1]}, "not used for tuning"),
    "empty objective": ({"objective": {}}, "at least 1 entry"),
    "zero objective": ({"objective": {"distance": 0}}, "at least one measure"),
    "unknown measure": ({"objective": {"beauty": 1}}, "objective.beauty"),
    "not a number": ({"objective": {"distance": float("nan")}}, "a number"),
    "unknown protocol": ({"protocol": {"name": "dance"}}, "growing_stride"),
    "unknown option": ({"protocol": {"name": "growing_stride", "step": 1}}, "protocol.step"),
    "half a step": ({"protocol": {"name": "growing_stride", "steps": 7.5}}, "whole number"),
    "start outside": ({"start": {"step_forward_max": 0.09}}, "inside its range"),
    "start unknown": ({"start": {"speed": 1}}, "start.speed"),
    "negative penalty": ({"penalty": {"fall": -1}}, "at least 0"),
    "unknown method": ({"method": "guess"}, "surrogate, pso, cma, tpe, random"),
    "no trials": ({"trials": 0}, "from 1"),
    "unknown engine": ({"engine": "bullet3"}, "pybullet, mujoco"),
    "unknown plant": ({"plant": "moon"}, "moon"),
    "finals without robots": ({"finals": {"candidates": 2}}, "finals.robots"),
    "bad place": ({"confirm": {"places": ["mujoco"]}}, "ENGINE/PLANT"),
}


def test_the_first_papers_criterion_is_minimized_by_a_particle_swarm() -> None:
    assert load_study("com_error").file.method == "pso"
    assert parse_study(GOOD).file.method == METHODS[0] == "surrogate"


@pytest.mark.parametrize("case", BAD)
def test_a_bad_study_is_refused(case: str) -> None:
    change, said = BAD[case]
    with pytest.raises(NaoGaitError) as refused:
        parse_study({**GOOD, **change})
    assert said in str(refused.value)


def test_cma_needs_two_parameters(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("optuna")
    file = tmp_path / "one.yaml"
    one = {**GOOD, "parameters": {"swing_lift": [0.01, 0.03]}, "start": {"swing_lift": 0.012}}
    file.write_text(yaml.safe_dump(one), encoding="utf-8")
    assert main(["tune", str(file), "--method", "cma"]) == EXIT_USAGE
    assert "single parameter" in capsys.readouterr().err


@pytest.mark.parametrize("missing", ["parameters", "protocol", "objective", "robots"])
def test_what_is_missing_is_named(missing: str) -> None:
    with pytest.raises(NaoGaitError, match=rf"study\.{missing}"):
        parse_study({key: value for key, value in GOOD.items() if key != missing})


@pytest.mark.parametrize("text", ["- a list", "just: [broken", "{}", ""])
def test_a_bad_file_gives_one_line_and_starts_nothing(
    text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, out = tmp_path / "bad.yaml", tmp_path / "out"
    file.write_text(text, encoding="utf-8")
    assert main(["tune", str(file), "--out", str(out)]) == EXIT_USAGE
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith("nao_gait tune: ")
    assert said.err.count("\n") == 1
    assert not out.exists()


@pytest.mark.parametrize(
    "more",
    [["--method", "guess"], ["--trials", "0"], ["--workers", "0"], ["--seed", "-1"],
     ["--resume"], ["--join"], ["--confirm-on", "moon"]],
    ids=" ".join,
)  # fmt: skip
def test_a_bad_argument_gives_one_line_and_walks_nothing(
    more: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("optuna")
    file, out = tmp_path / "good.yaml", tmp_path / "out"
    file.write_text(yaml.safe_dump(GOOD), encoding="utf-8")
    assert main(["tune", str(file), "--out", str(out), *more]) == EXIT_USAGE
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    assert not out.exists()


@pytest.mark.parametrize(
    "more",
    [["--out", "good.yaml/out"], ["--storage", "no URL"], ["--storage", "sqlite:////no/study.db"],
     ["--storage", "oracle://somewhere/study"]],
    ids=" ".join,
)  # fmt: skip
def test_results_that_cannot_be_kept_are_refused_before_a_walk(
    more: list[str],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pytest.importorskip("optuna")
    monkeypatch.chdir(tmp_path)
    Path("good.yaml").write_text(yaml.safe_dump(GOOD), encoding="utf-8")
    # A folder below a file: not even root can write there.
    assert main(["tune", "good.yaml", *more]) == EXIT_USAGE
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1


def test_a_damaged_database_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("optuna")
    file = tmp_path / "good.yaml"
    file.write_text(yaml.safe_dump(GOOD), encoding="utf-8")
    (tmp_path / "study.db").write_bytes(b"this is no database" * 100)
    assert main(["tune", str(file), "--out", str(tmp_path), "--resume"]) == EXIT_USAGE
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "not a database" in said


def test_a_plant_that_the_engine_cannot_honour_stops_the_study_before_it_starts(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("optuna")
    file, out = tmp_path / "worn.yaml", tmp_path / "out"
    file.write_text(yaml.safe_dump({**GOOD, "plant": "worn"}), encoding="utf-8")
    assert main(["tune", str(file), "--out", str(out), "--engine", "pybullet"]) == EXIT_USAGE
    assert capsys.readouterr().err.count("\n") == 1
    assert not out.exists()
