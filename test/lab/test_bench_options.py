"""Suites are found by scanning; their options, help, checks and commands come from themselves."""

import math
import shlex
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from gait_lab import cli
from gait_lab.bench import BenchOptions, Column, SuiteResult, Table, suite, suites
from gait_lab.bench.options import command_line, with_settings
from gait_lab.bench.suite import Run, plan
from gait_lab.bench.suites import push, speed
from nao_lipm_gait.parameters import GaitParameters, load_preset
from robot_core.errors import NaoGaitError

NEW_SUITE = '''
from dataclasses import dataclass
from gait_lab.bench import BenchOptions, Measurement, Suite, SuiteResult, option

@dataclass(frozen=True)
class Options(BenchOptions):
    robots: int = 3
    hops: int = option(2, "number of hops", "N", minimum=1, maximum=9)

def hop(options):
    row = Measurement("hops", "hops", options.robots * options.hops)
    return SuiteResult((row,), "Hops", ())

SUITE = Suite("hop", "Hopping", "hops", hop, Options, ("robots",), ({"hops": 1},))
'''


@pytest.fixture
def new_suite(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """A file that was dropped into the folder of the suites."""
    (tmp_path / "hopping.py").write_text(NEW_SUITE)
    monkeypatch.setattr(suites, "__path__", [*suites.__path__, str(tmp_path)])
    suite.suites.cache_clear()
    yield
    suite.suites.cache_clear()
    sys.modules.pop("gait_lab.bench.suites.hopping", None)


def test_a_file_in_the_folder_is_a_suite(
    new_suite: None, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "rows.json"
    assert cli.main(["bench", "hop", "--hops", "4", "--json", str(file)]) == 0
    assert '"value": 12' in file.read_text()
    assert cli.main(["bench", "hop", "--hops", "10"]) != 0
    assert "hops: got 10; allowed: 1 to 9" in capsys.readouterr().err
    (run,) = (run for run in plan("all", {}) if run.suite.name == "hop")
    assert run.command == "nao_gait bench hop --engine mujoco --hops 1"


def test_help_names_the_options_of_a_suite_alone(capsys: pytest.CaptureFixture[str]) -> None:
    for name, own, other in (("push", "--impulse", "--metres"), ("endurance", "--metres", "--no")):
        with pytest.raises(SystemExit):
            cli.main(["bench", name, "--help"])
        text = capsys.readouterr().out
        assert own in text
        assert other not in text


def test_all_runs_every_suite_that_applies() -> None:
    assert {run.suite.name for run in plan("all", {})} == set(suite.suites())
    wide = {run.suite.name: run.options.robots for run in plan("all", {"robots": 9})}
    assert wide["speed"] == wide["start"] == 9
    other = {run.suite.name for run in plan("all", {"urdf": "bruno"})}
    assert other == set(suite.suites()) - {"heat", "paper", "peers", "soles"}, "made for the NAO"
    other = {run.suite.name for run in plan("all", {"engine": "pybullet"})}
    assert other == set(suite.suites()) - {"plant"}


@pytest.mark.parametrize("run", plan("all", {}), ids=lambda run: run.suite.name)
def test_the_command_of_a_run_gives_its_options(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    words = shlex.split(run.command)
    found: list[Run] = []
    monkeypatch.setattr(suite, "run", lambda name, asked, **_: found.extend(plan(name, asked)))
    assert cli.main(words[1:]) == 0
    assert [each.options for each in found] == [run.options]


def test_every_option_survives_the_command_line(monkeypatch: pytest.MonkeyPatch) -> None:
    given = {
        "robots": 3, "seed": 10, "engine": "mujoco", "plant": "worn", "urdf": "a b.urdf",
        "tasks": ("spot", "forward=20"), "open_loop": "only", "impulses": (0.75, 2.0),
        "directions": ("left",), "phases": 4,
        "plant_options": (("motor.play", 0.035), ("variation.friction", (0.2, 0.3))),
    }  # fmt: skip
    found: list[dict[str, Any]] = []
    monkeypatch.setattr(suite, "run", lambda name, asked, **kw: found.append({**asked, **kw}))
    line = command_line("push", push.Options, given, "paper", ("swing_lift=0.03",))
    assert cli.main(shlex.split(line)[1:]) == 0
    assert found[0]["preset"] == "paper"
    assert found[0]["settings"] == ["swing_lift=0.03"]
    assert {name: found[0][name] for name in given} == given
    line = command_line("speed", speed.Options, {"half_speed": False, "window": 2.5, "jobs": 2})
    assert line == "nao_gait bench speed --seconds 2.5 --no-half"


@pytest.mark.parametrize(
    ("arguments", "word"),
    [(["bench", "hop"], "SUITE"), (["bench", "push", "--direction", "up"], "direction"),
     (["bench", "push", "--impulse", "-1"], "impulse"),
     (["bench", "push", "--robots", "many"], "whole number"),
     (["bench", "endurance", "--metres", "0"], "metres"),
     (["bench", "speed", "--engine", "none", "--jobs", "1"], "engine"),
     (["bench", "delay", "--task", "fly"], "task"),
     (["bench", "speed", "--task", "forward=0"], "task"),
     (["bench", "speed", "--plant-set", "motor.wings=2"], "motor.wings"),
     (["bench", "start", "--task", "forward=20"], "--task"),
     (["bench", "compute", "--robots", "20"], "--robots"),
     (["bench", "faults", "--open-loop", "off"], "--open-loop"),
     (["bench", "ablation", "--changes", "/no/file"], "/no/file"),
     (["bench", "loss", "--task", "turn=50"], "forward walks"),
     (["bench", "all", "--changes", "/no/file"], "/no/file"),
     (["bench", "all", "--task", "turn"], "forward")],
)  # fmt: skip
def test_bad_arguments_give_one_line_and_a_bad_exit_status(
    arguments: list[str], word: str, capsys: pytest.CaptureFixture[str]
) -> None:
    try:
        status = cli.main(arguments)
    except SystemExit as stop:  # argparse
        status = int(stop.code or 0)
    assert status != 0
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert word in error


@pytest.mark.parametrize(
    ("change", "field"),
    [({"robots": 0}, "robots"), ({"seed": -2}, "seed"), ({"window": math.nan}, "seconds"),
     ({"open_loop": "maybe"}, "open-loop"), ({"phases": 0}, "phases"),
     ({"impulses": (-1.0,)}, "impulse"), ({"impulses": (math.nan,)}, "impulse")],
)  # fmt: skip
def test_options_out_of_range_are_refused(change: dict[str, Any], field: str) -> None:
    with pytest.raises(NaoGaitError, match=f"^{field}: got"):
        push.Options(**change)


def test_a_suite_refuses_the_options_of_another() -> None:
    with pytest.raises(NaoGaitError, match=r"metres.*an option of the suite push: .*--impulse"):
        plan("push", {"metres": 3.0})


def test_the_closed_loop_is_the_preset_and_the_open_one_only_lacks_feedback() -> None:
    preset = load_preset("default")
    options = BenchOptions(parameters=preset)
    assert options.loop_parameters(True) == preset
    assert options.loop_parameters(False) == preset.replace(feedback=False)
    assert [replace(options, open_loop=mode).loops for mode in ("beside", "off", "only")] == [
        (True, False), (True,), (False,)
    ]  # fmt: skip


def test_settings_are_typed_and_checked() -> None:
    parameters = with_settings(GaitParameters(), ["swing_lift=0.03", "feedback=false"])
    assert parameters.swing_lift == 0.03
    assert parameters.feedback is False
    for bad in ("swing_lift", "nothing=1", "swing_lift=high", "swing_lift=9", "feedback=1"):
        with pytest.raises(NaoGaitError):
            with_settings(GaitParameters(), [bad])


# -- tables ----------------------------------------------------------------------------------------


TABLE = Table(
    (Column("task"), Column("speed", "cm/s"), Column("falls"), Column("error", "mm", 2)),
    [("forward", 40.04, 1, math.nan), ("back", None, 12, 3.14159)],
)


def test_a_table_aligns_numbers_and_shows_what_is_missing() -> None:
    lines = TABLE.text().splitlines()
    assert [line.split() for line in lines[:2]] == [
        ["task", "speed", "falls", "error"], ["cm/s", "mm"]
    ]  # fmt: skip
    assert lines[-2].split() == ["forward", "40.0", "1", "-"]
    assert lines[-1].split() == ["back", "-", "12", "3.14"]
    assert lines[-2].index("1") == lines[-1].index("12") + 1, "numbers end below each other"


def test_a_table_is_the_same_after_json_and_has_a_markdown_form() -> None:
    again = Table.of(TABLE.as_dict())
    assert again.text() == TABLE.text()
    markdown = again.text(markdown=True)
    heads = [cell.strip() for cell in markdown.splitlines()[0].split("|")]
    assert heads[1:-1] == ["task", "speed [cm/s]", "falls", "error [mm]"]
    assert all(line.startswith("|") for line in markdown.splitlines())


def test_a_result_shows_title_tables_and_wrapped_notes() -> None:
    result = SuiteResult((), "A title", (TABLE,), ("word " * 50,))
    text = result.text
    assert text.startswith("A title\n\n")
    assert TABLE.text() in text
    assert max(map(len, text.splitlines())) <= 100


def test_a_suite_that_cannot_be_imported_gives_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def missing() -> None:
        raise ModuleNotFoundError("No module named 'cv2'", name="cv2")

    monkeypatch.setattr("gait_lab.bench.suite.suites", missing)
    assert cli.main(["bench", "speed"]) == cli.EXIT_FAILED
    assert capsys.readouterr().err == (
        "nao_gait bench: needs cv2, which is not installed; in the checkout: "
        "pip install '.[vision]'; beside an installed ROS: docs/ros.md\n"
    )
