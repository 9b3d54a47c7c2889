"""Study files: the shipped ones are valid; a bad one gives one line and starts nothing."""

from pathlib import Path
from typing import Any

import pytest
import yaml

pytest.importorskip("joblib")
pytest.importorskip("mujoco")

from gait_lab.cli import EXIT_USAGE, main
from gait_lab.tune.study import load_study, parse_study
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
    assert len(study.unseen) >= 8
    assert not set(study.unseen) & {*study.robots, *study.finals.robots}
    assert all(0.0 <= share_of <= 1.0 for share_of in study.start_point)
    for r in study.ranges:
        assert BY_NAME[r.name].minimum <= r.low < r.high <= BY_NAME[r.name].maximum


def test_the_second_papers_study_has_five_parameters_and_52_steps() -> None:
    study = load_study("speed")
    assert len(study.ranges) == 5
    assert study.options["steps"] == 52
    assert study.objective == {"distance": 1.0}
    walks = study.trials * len(study.robots) + study.finals.candidates * len(study.finals.robots)
    assert walks <= 74 * len(study.robots)


def test_points_are_shares_of_the_ranges() -> None:
    study = parse_study(GOOD)
    assert study.parameters_at(study.start_point).step_forward_max == pytest.approx(0.03)
    assert study.values_at((0.0, 1.0)) == {"step_forward_max": 0.02, "swing_lift": 0.03}
    # rounding must not leave the range of the table
    assert study.values_at((-1e-12, 1.0 + 1e-12))["swing_lift"] == 0.03


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
    "unknown method": ({"method": "guess"}, "surrogate, pso, cma"),
    "no trials": ({"trials": 0}, "from 1"),
    "unknown engine": ({"engine": "bullet3"}, "pybullet, mujoco"),
    "unknown plant": ({"plant": "moon"}, "moon"),
    "finals without robots": ({"finals": {"candidates": 2}}, "finals.robots"),
    "bad place": ({"confirm": {"places": ["mujoco"]}}, "ENGINE/PLANT"),
}


def test_the_first_papers_criterion_is_minimized_by_a_particle_swarm() -> None:
    assert load_study("com_error").method == "pso"
    assert parse_study(GOOD).method == "surrogate"


@pytest.mark.parametrize("case", BAD)
def test_a_bad_study_is_refused(case: str) -> None:
    change, said = BAD[case]
    with pytest.raises(NaoGaitError) as refused:
        parse_study({**GOOD, **change})
    assert said in str(refused.value)


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
    [["--method", "guess"], ["--backend", "mpi"], ["--trials", "0"], ["--workers", "0"],
     ["--seed", "-1"], ["--engine", "none"], ["--resume"], ["--confirm-on", "moon"],
     ["--address", "tcp://nowhere:1"]],
    ids=lambda more: more[0],
)  # fmt: skip
def test_a_bad_argument_gives_one_line_and_walks_nothing(
    more: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("bayes_opt")
    file, out = tmp_path / "good.yaml", tmp_path / "out"
    file.write_text(yaml.safe_dump(GOOD), encoding="utf-8")
    assert main(["tune", str(file), "--out", str(out), *more]) == EXIT_USAGE
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    assert not out.exists()


def test_a_plant_that_the_engine_cannot_honour_stops_the_study_before_it_starts(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("bayes_opt")
    file, out = tmp_path / "worn.yaml", tmp_path / "out"
    file.write_text(yaml.safe_dump({**GOOD, "plant": "worn"}), encoding="utf-8")
    assert main(["tune", str(file), "--out", str(out), "--engine", "pybullet"]) == EXIT_USAGE
    assert capsys.readouterr().err.count("\n") == 1
    assert not out.exists()
