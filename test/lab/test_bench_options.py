"""Suites are found by scanning; their options, help, checks and commands come from themselves."""

import math
import shlex
import sys
from pathlib import Path
from typing import Any

import pytest
from scores import options

from gait_lab import cli
from gait_lab.bench import registry, suites
from gait_lab.bench.options import command_line, with_settings
from gait_lab.bench.registry import Run, plan
from gait_lab.bench.rows import Row, as_text, table_text, tables
from nao_lipm_gait.parameters import GaitParameters, load_preset
from nao_soccer.behavior.duel import DuelSettings
from robot_core.errors import NaoGaitError
from robot_core.schema import fields

NEW_SUITE = '''
from gait_lab.bench.options import Option
from gait_lab.bench.rows import Row
from gait_lab.bench.suite import suite

@suite("hop", "Hopping", "hops", quick=({"hops": 1},),
       options={"robots": 3, "hops": Option(2, "number of hops", "N", minimum=1, maximum=9)})
def hop(options):
    yield Row("", "hops", "hops", options.robots * options.hops)
'''


@pytest.fixture
def new_suite(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """A file that was dropped into the folder of the suites."""
    (tmp_path / "hopping.py").write_text(NEW_SUITE)
    monkeypatch.setattr(suites, "__path__", [*suites.__path__, str(tmp_path)])
    registry.suites.cache_clear()
    yield
    registry.suites.cache_clear()
    sys.modules.pop("gait_lab.bench.suites.hopping", None)


def test_a_file_in_the_folder_is_a_suite(
    new_suite: None, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "rows.json"
    assert cli.main(["bench", "hop", "--hops", "4", "--json", str(file)]) == 0
    assert '"value": 12' in file.read_text()
    assert cli.main(["bench", "hop", "--hops", "10"]) != 0
    assert "hops: got 10; allowed: a whole number from 1 to 9" in capsys.readouterr().err
    (run,) = (run for run in plan("all", {}) if run.suite.name == "hop")
    assert run.command == "nao_gait bench hop --hops 1"


def test_help_names_the_options_of_a_suite_alone(capsys: pytest.CaptureFixture[str]) -> None:
    for name, own, other in (("push", "--impulse", "--metres"), ("endurance", "--metres", "--no")):
        with pytest.raises(SystemExit):
            cli.main(["bench", name, "--help"])
        text = capsys.readouterr().out
        assert own in text
        assert other not in text


def test_all_runs_every_suite_that_applies() -> None:
    every = set(registry.suites()) - {"rcss", "rcss_match"}  # they install a server
    assert {run.suite.name for run in plan("all", {})} == every
    wide = {run.suite.name: run.options.robots for run in plan("all", {"robots": 9})}
    assert wide["speed"] == wide["start"] == 9
    other = {run.suite.name for run in plan("all", {"urdf": "bruno"})}
    assert other == every - {"heat", "paper", "peers", "soles", "zeros"}, "made for the NAO"
    other = {run.suite.name for run in plan("all", {"engine": "pybullet"})}
    assert other == every - {"plant"}


@pytest.mark.parametrize("run", plan("all", {}), ids=lambda run: run.suite.name)
def test_the_command_of_a_run_gives_its_options(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    words = shlex.split(run.command)
    found: list[Run] = []
    monkeypatch.setattr(registry, "run", lambda name, asked, **_: found.extend(plan(name, asked)))
    assert cli.main(words[1:]) == 0
    assert [each.options for each in found] == [run.options]


def test_every_option_survives_the_command_line(monkeypatch: pytest.MonkeyPatch) -> None:
    given = {
        "robots": 3, "seed": 10, "engine": "pybullet", "plant": "worn", "urdf": "a b.urdf",
        "tasks": ("spot", "forward=20"), "open_loop": "only", "impulses": (0.75, 2.0),
        "directions": ("left",), "phases": 4,
        "plant_options": (("motor.play", 0.035), ("variation.friction", (0.2, 0.3))),
    }  # fmt: skip
    found: list[dict[str, Any]] = []
    monkeypatch.setattr(registry, "run", lambda name, asked, **kw: found.append({**asked, **kw}))
    of = {name: each.options for name, each in registry.suites().items()}
    line = command_line("push", of["push"], given, "paper", ("swing_lift=0.03",))
    assert cli.main(shlex.split(line)[1:]) == 0
    assert found[0]["preset"] == "paper"
    assert found[0]["settings"] == ["swing_lift=0.03"]
    assert {name: found[0][name] for name in given} == given
    line = command_line("speed", of["speed"], {"half_speed": False, "window": 2.5, "jobs": 2})
    assert line == "nao_gait bench speed --seconds 2.5 --no-half"


def test_the_command_line_fills_in_what_the_suite_usually_runs_on() -> None:
    (of_plant,) = plan("plant", {"plant_options": (("motor.play", 0.035),)})
    assert (of_plant.options.robots, of_plant.options.window) == (2, 5.0)
    assert of_plant.options.plant_title == "reference motor.play=0.035"
    (of_speed,) = plan("speed", {"robots": 3})
    assert (of_speed.options.robots, of_speed.options.window) == (3, 20.0)
    assert {run.options.engine for run in plan("all", {})} == {"mujoco"}
    assert of_speed.options.parameters == load_preset("default")


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
     (["bench", "solo", "--set", "swing_lift=0.03"], "--set"),
     (["bench", "ablation", "--changes", "/no/file"], "/no/file"),
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
    [({"robots": 0}, "robots"), ({"seed": -2}, "seed"), ({"open_loop": "maybe"}, "open-loop"),
     ({"phases": 0}, "phases"), ({"impulses": (math.nan,)}, "impulse")],
)  # fmt: skip
def test_options_out_of_range_are_refused(change: dict[str, Any], field: str) -> None:
    with pytest.raises(NaoGaitError, match=f"^{field}: got"):
        options("push", **change)
    with pytest.raises(NaoGaitError, match=r"metres.*an option of the suite push: .*--impulse"):
        plan("push", {"metres": 3.0})


def test_settings_are_typed_and_checked() -> None:
    parameters = with_settings(GaitParameters(), ["swing_lift=0.03", "feedback=false"])
    assert parameters.swing_lift == 0.03
    assert parameters.feedback is False
    for bad in ("swing_lift", "nothing=1", "swing_lift=high", "swing_lift=9", "feedback=1"):
        with pytest.raises(NaoGaitError):
            with_settings(GaitParameters(), [bad])


# -- rows ------------------------------------------------------------------------------------------


ROWS = (
    Row("forward", "median", "cm/s", 40.04, 31.0), Row("forward", "falls", "", 1),
    Row("turn", "median", "deg/s", math.nan, 92.0), Row("turn", "falls", "", 12),
    Row("all", "share", "%", 3.14159),
)  # fmt: skip


def test_tables_have_a_line_for_each_subject_and_a_column_for_each_quantity() -> None:
    (heads, lines), (other, ((_, share),)) = tables(ROWS)
    assert heads == ["", "median", "median (paper)", "falls"]
    assert lines == [["forward", "40.0 cm/s", 31.0, 1], ["turn", "- deg/s", 92.0, 12]]
    assert other == ["", "share [%]"]
    assert share == 3.14159
    text = table_text(heads, lines, markdown=True)
    assert all(line.startswith("|") for line in text.splitlines())
    text = as_text("A title", ROWS, ("word " * 50,))
    assert text.startswith("A title\n\n")
    assert max(map(len, text.splitlines())) <= 100


def test_tables_say_yes_or_no_where_the_rows_have_a_number() -> None:
    ((heads, lines),) = tables([Row("a", "counts", "bool", 1.0), Row("b", "counts", "bool", 0.0)])
    assert heads == ["", "valid speed"]
    assert lines == [["a", "yes"], ["b", "no"]]


@pytest.mark.parametrize("suite", ["duel", "match"])
def test_the_help_says_what_a_policy_may_change(
    suite: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        cli.main(["bench", suite, "--help"])
    shown = " ".join(capsys.readouterr().out.split())
    for each in fields(DuelSettings):
        assert f"{each.name} {each.default:g} {each.unit}".rstrip() in shown
        assert each.meaning in shown


def test_a_suite_that_cannot_be_imported_gives_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def missing() -> None:
        raise ModuleNotFoundError("No module named 'cv2'", name="cv2")

    monkeypatch.setattr("gait_lab.bench.registry.suites", missing)
    assert cli.main(["bench", "speed"]) == cli.EXIT_FAILED
    assert capsys.readouterr().err == (
        "nao_gait bench: needs cv2, which is not installed; in the checkout: "
        "pip install '.[vision]'; beside an installed ROS: docs/ros.md\n"
    )
