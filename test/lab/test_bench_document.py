"""`bench all`, its page and figures, the commands on it, and the list of the ablation."""

import shlex
from pathlib import Path
from typing import Any

import pytest

from gait_lab import cli
from gait_lab.bench import BenchOptions, Report, Row, catalogue, running
from gait_lab.bench.changes import load_changes
from gait_lab.bench.command import command_line
from gait_lab.bench.document import TITLES, Section, write
from gait_lab.bench.figures import push_figure, speed_figure
from gait_lab.bench.suites.ablation import PUSHES, ablation
from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.parameters import GaitParameters, load_preset

PNG = b"\x89PNG"


def test_all_runs_every_suite() -> None:
    assert {run.suite for run in catalogue.runs("all", {})} == set(catalogue.SUITES)
    wide = catalogue.runs("all", {"robots": 9})
    assert {run.options.robots for run in wide} == {9}
    # The peers are made for NAOs.
    other = catalogue.runs("all", {"urdf": "bruno"})
    assert {run.suite for run in other} == set(catalogue.SUITES) - {"peers"}


@pytest.mark.parametrize("run", catalogue.runs("all", {}), ids=lambda run: run.suite)
def test_the_command_on_the_page_gives_the_options_of_the_run(
    run: catalogue.Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    words = shlex.split(command_line(run.suite, run.given))
    assert words[0] == "nao_gait"
    found: list[BenchOptions] = []

    def take(suite: str, asked: dict[str, Any], **_: object) -> None:
        found.append(catalogue.options_for(suite, asked))

    monkeypatch.setattr(running, "run", take)
    assert cli.main(words[1:]) == 0
    assert found == [run.options]


def test_every_option_survives_the_command_line(monkeypatch: pytest.MonkeyPatch) -> None:
    given = {
        "robots": 3, "seed": 10, "engine": "mujoco", "plant": "worn", "urdf": "a b.urdf",
        "tasks": ("spot", "forward=20"), "window": 2.5, "open_loop": "only",
        "ingredients": ("friction",), "impulses": (0.75, 2.0), "directions": ("left",),
        "phases": 4, "half_speed": False, "metres": 7.5, "changes": Path("a.yaml"),
        "placo_python": "a b/python",
        "plant_options": (("motor.play", 0.035), ("variation.friction", (0.2, 0.3))),
    }  # fmt: skip
    found: list[dict[str, Any]] = []
    monkeypatch.setattr(running, "run", lambda suite, asked, **kw: found.append({**asked, **kw}))
    line = command_line("push", given, "paper", ("swing_lift=0.03",))
    assert cli.main(shlex.split(line)[1:]) == 0
    assert found[0]["preset"] == "paper"
    assert found[0]["settings"] == ["swing_lift=0.03"]
    assert {name: found[0][name] for name in given} == given


def report(**values: float | None) -> Report:
    suite = "push" if any(name.startswith("push") for name in values) else "speed"
    return Report(tuple(Row(suite, name, "", value) for name, value in values.items()), "a table")


SPEED = report(forward_worst=20.0, forward_median=25.0, forward_counts=1.0,
               forward_open_loop_worst=None, forward_open_loop_median=None,
               forward_open_loop_counts=0.0)  # fmt: skip
PUSH = Report(
    tuple(
        Row("push", f"push_spot_{way}_{name}", "", value)
        for way in ("forward", "left", "back", "right")
        for name, value in (("max", 1.5), ("1.5_survival", 100.0), ("1.75_survival", 0.0))
    )
    + (Row("push", "push_spot_tried", "impulses", 2.0),),
    "pushes",
)


def test_the_page_holds_tables_commands_and_figures(tmp_path: Path) -> None:
    page = tmp_path / "docs" / "page.md"
    options = BenchOptions()
    sections = [
        Section("speed", "nao_gait bench speed", options, SPEED),
        Section("push", "nao_gait bench push --robots 2", options, PUSH),
        Section("push", "nao_gait bench push --task stand", options, PUSH),
    ]
    written = write(page, sections, "nao_gait bench all")
    text = page.read_text()
    assert text.count("## Pushes") == 1
    assert text.count("$ nao_gait bench push") == 2
    assert "a table" in text
    assert "Written by `nao_gait bench all" in text
    for file in written[1:]:
        assert file.read_bytes().startswith(PNG)
        assert file.stat().st_size < 100_000
        assert f"images/{file.name}" in text
    assert len(written) == 3


def test_no_rows_no_figure(tmp_path: Path) -> None:
    assert speed_figure({}, tmp_path / "a.png") is None
    one_impulse = {"push_spot_left_max": 1.0, "push_spot_tried": 1.0}
    assert push_figure(one_impulse, tmp_path / "b.png") is None
    assert not list(tmp_path.iterdir())


def test_the_shipped_list_changes_what_it_says() -> None:
    base = load_preset("default")
    changes = {change.name: change for change in load_changes()}
    assert changes["open_loop"].parameters(base) == base.replace(feedback=False)
    assert changes["paper"].parameters(base) == load_preset("paper")
    for change in changes.values():
        assert change.parameters(base) != base
    without = [change for change in changes.values() if change.name.startswith("without_")]
    assert without
    for change in without:
        start, changed = base.as_dict(), change.parameters(base).as_dict()
        assert {name for name in start if start[name] != changed[name]} <= set(change.settings)


@pytest.mark.parametrize(
    "text",
    ["", "[1, 2]", "a: {}", "a: {sett: {}}", "a: {set: {wings: 2}}", "a: {set: [1]}",
     "a: {preset: 3}", "a: {preset: nobody}", "A b: {set: {feedback: false}}", "a: {set: {",
     "unchanged: {set: {feedback: false}}"],
)  # fmt: skip
def test_a_bad_list_is_one_clear_error(text: str, tmp_path: Path) -> None:
    file = tmp_path / "list.yaml"
    file.write_text(text)
    with pytest.raises(NaoGaitError):
        load_changes(file)
    with pytest.raises(NaoGaitError):
        load_changes(tmp_path / "missing.yaml")


def test_an_ablation_measures_every_change_on_the_same_robots(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    file = tmp_path / "list.yaml"
    file.write_text("same: {set: {feedback: true}}\nopen_loop: {set: {feedback: false}}\n")
    options = BenchOptions(
        robots=1, engine="mujoco", parameters=GaitParameters(), tasks=("forward",), window=0.5,
        phases=1, changes=file, jobs=1, show=False,
    )  # fmt: skip
    rows = {row.metric: row.value for row in ablation(options).rows}
    of = {
        name: {metric.removeprefix(f"{name}_"): value for metric, value in rows.items()
               if metric.startswith(f"{name}_")}
        for name in ("unchanged", "same", "open_loop")
    }  # fmt: skip
    assert of["unchanged"] == of["same"] != of["open_loop"]
    for direction, impulse in PUSHES:
        assert f"push_{direction}_{impulse:g}_survival" in of["unchanged"]
    assert "fall_lead_median" in of["unchanged"]


def test_the_list_is_checked_before_the_first_suite(tmp_path: Path) -> None:
    said: list[str] = []
    with pytest.raises(NaoGaitError):
        running.run("all", {"changes": tmp_path / "none.yaml"}, out=said.append)
    assert not said


def test_every_suite_has_a_title() -> None:
    assert set(TITLES) == set(catalogue.SUITES)
