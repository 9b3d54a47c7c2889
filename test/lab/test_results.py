"""The results in docs/: of the present walk, or marked as old."""

import json
import math
import re
import subprocess
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from gait_lab import cli
from gait_lab.bench import results
from gait_lab.bench.fingerprint import Fingerprint
from gait_lab.bench.options import Options, declared
from gait_lab.bench.registry import suites
from gait_lab.bench.results import CodeState, Plan, ResultsOptions, results_plan
from gait_lab.bench.rows import Row
from gait_lab.bench.suite import Suite
from robot_core.errors import NaoGaitError

DOCS = results.ROOT / "docs"
WALK = "mujoco/walk/default"
FOUND = Fingerprint(WALK, "0123456789abcdef", (1.0, 0.2, 0.1))
CODE = CodeState("a" * 40, "")


def test_the_shipped_results_are_of_the_present_walk() -> None:
    pytest.importorskip("mujoco")
    old = results.outdated(results.load(DOCS / "results.csv"), jobs=1)
    assert not old, (
        f"measured on an earlier walk: {', '.join(old)}; run nao_gait results, or nao_gait results "
        "--mark-stale"
    )


def test_the_page_is_that_of_the_results_and_short(tmp_path: Path) -> None:
    (tmp_path / "results.csv").write_text((DOCS / "results.csv").read_text())
    page = results.write_page(tmp_path).read_text()
    assert page == (DOCS / "results.md").read_text()
    assert len(re.findall(r"[\w.]+", page)) <= 1500


@pytest.mark.parametrize("name", results_plan().sections)
def test_every_section_can_be_planned_in_both_forms(name: str) -> None:
    section = results_plan().sections[name]
    for quick in (False, True):
        run = section.plan(quick)
        assert run.command.startswith(f"nao_gait bench {section.suite}")
        assert run.options.seed == 40


def test_a_walk_is_known_by_its_hash_or_by_its_end() -> None:
    digest, x, y, yaw = FOUND.as_list()
    assert FOUND.is_same_walk([digest, 9.0, y, yaw])
    assert FOUND.is_same_walk(["other", x + 0.015, y, yaw + math.radians(1.5)])  # type: ignore[operator]
    assert FOUND.is_same_walk(["other", x, y, yaw + math.tau])  # type: ignore[operator]
    assert not FOUND.is_same_walk(["other", x + 0.03, y, yaw])  # type: ignore[operator]
    assert not FOUND.is_same_walk(["other", x, y, yaw + math.radians(3.0)])  # type: ignore[operator]


def test_fingerprints_are_compared_with_an_earlier_output(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    other = replace(FOUND, key="mujoco/walk/paper")
    found = {each.key: each for each in (FOUND, other)}
    monkeypatch.setattr("gait_lab.bench.fingerprint.fingerprints", lambda *_: found)
    assert cli.main(["fingerprint", "--engine", "mujoco"]) == 0
    file = tmp_path / "before.json"
    file.write_text(capsys.readouterr().out)
    compare = ["fingerprint", "--engine", "mujoco", "--compare", str(file)]
    assert cli.main(compare) == 0
    assert "2 reference rollouts, 0 changed" in capsys.readouterr().out
    file.write_text(file.read_text().replace(FOUND.digest, "another", 1))
    assert cli.main(compare) != 0
    assert "1 changed" in capsys.readouterr().out
    pybullet = json.dumps({"pybullet/walk/default": FOUND.as_list()})
    for text in ("[1]", "{}", "1", '{"mujoco/walk/default": ["a", 1.0, 2.0]}', pybullet, "{" * 999):
        file.write_text(text)
        assert cli.main(compare) != 0
        assert "compare: got" in capsys.readouterr().err


# -- measuring -------------------------------------------------------------------------------------


class Bench:
    """Two sections whose suites only count how often they run; `two` can be resumed."""

    def __init__(self) -> None:
        self.ran: list[str] = []
        self.kept: set[str] = set()
        self.code = CODE
        self.found = FOUND

    def suite(self, name: str) -> Suite:
        """A suite of one row."""

        def measure(options: Options) -> Iterator[Row | str]:
            self.ran.append(name)
            self.kept |= {options.resume} - {""}
            yield Row("", "speed", "cm/s", 40.04, 31.0)
            yield Row("", "nothing", "", None)

        return Suite(name, name, name, measure, declared({"resume": ...} if name == "two" else {}))


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> Bench:
    """The results with two sections of a stand-in suite, one walk and one commit."""
    made = Bench()
    names = ("one", "two")
    tables = [{"title": name.title(), "lines": {"it": name}, "columns": {"v": "{}/speed"}}
              for name in names]  # fmt: skip
    planned = Plan.from_mapping(
        {"sections": {name: {"suite": name} for name in names}, "page": tables}
    )
    fakes = {name: made.suite(name) for name in names}
    monkeypatch.setattr("gait_lab.bench.registry.suites", lambda: {**suites(), **fakes})
    monkeypatch.setattr(results, "results_plan", lambda: planned)
    monkeypatch.setattr(CodeState, "of", classmethod(lambda cls: made.code))

    def fingerprints_of(keys: Iterable[str], *_: object) -> dict[str, Fingerprint]:
        return {key: made.found for key in keys}

    monkeypatch.setattr(results, "fingerprints_of", fingerprints_of)
    return made


def run(docs: Path, **options: Any) -> str:
    """Measure into a folder; the text that was printed."""
    printed: list[str] = []
    results.measure(ResultsOptions(docs, **options), printed.append)
    return "\n".join(printed)


def test_each_section_and_the_page_say_how_they_came_about(bench: Bench, tmp_path: Path) -> None:
    assert "one: took" in run(tmp_path)
    one = results.load(tmp_path / "results.csv")["one"]
    assert one.head["commit"] == CODE.commit
    assert one.head["command"] == "nao_gait bench one --seed 40"
    assert one.head["fingerprints"] == {WALK: FOUND.as_list()}
    assert one.values == {"speed": 40.04, "nothing": None}
    assert one.rows[0] == {
        "suite": "one", "metric": "speed", "unit": "cm/s", "value": 40.04, "paper": 31.0,
        "engine": "mujoco", "plant": "reference", "robots": 1, "seed": 40,
    }  # fmt: skip
    page = (tmp_path / "results.md").read_text()
    assert f"Measured at commit {CODE.commit[:12]}" in page
    assert "| it | 40.0 |" in page
    assert page.index("## One") < page.index("nao_gait bench one") < page.index("## Two")


def test_a_resumed_campaign_does_not_say_how_long_its_last_part_took(
    bench: Bench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(results, "KEPT", tmp_path / "kept")
    run(tmp_path)
    assert all("took" in each.head for each in results.load(tmp_path / "results.csv").values())
    (tmp_path / "results.csv").unlink()
    (key,) = bench.kept
    Path(key).touch()
    assert "two: resumed, took" in run(tmp_path)
    measured = results.load(tmp_path / "results.csv")
    assert ["took" in measured[name].head for name in ("one", "two")] == [True, False]


def test_a_finished_section_is_not_run_again(bench: Bench, tmp_path: Path) -> None:
    run(tmp_path, only=("two",))
    assert bench.ran == ["two"]
    assert "two: finished before" in run(tmp_path)
    assert bench.ran == ["two", "one"]
    bench.code = replace(CODE, commit="b" * 40)
    run(tmp_path, only=("one",))
    assert bench.ran == ["two", "one", "one"]
    commits = [each.commit for each in results.load(tmp_path / "results.csv").values()]
    assert commits == ["b" * 12, "a" * 12]


def test_an_interrupted_campaign_goes_on_with_its_finished_runs(
    bench: Bench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("mujoco")
    section = {"suite": "faults", "full": {"runs": 2, "faults": ["silence"]}}
    planned = Plan.from_mapping({"sections": {"faults": section}, "page": []})
    monkeypatch.setattr(results, "results_plan", lambda: planned)
    monkeypatch.setattr(results, "KEPT", tmp_path / "kept")
    run(tmp_path, jobs=1)
    file = tmp_path / "results.csv"
    before = results.load(file)["faults"]
    assert "--resume" not in before.head["command"]
    file.unlink()
    monkeypatch.setattr("gait_lab.faults.campaign.make_world", None)  # a run would fail
    run(tmp_path, jobs=1)
    assert results.load(file)["faults"].rows == before.rows
    bench.code = replace(CODE, commit="b" * 40)
    with pytest.raises(TypeError):  # of another commit: nothing is taken from before
        run(tmp_path, jobs=1)


def test_another_walk_makes_results_old_until_they_are_marked(bench: Bench, tmp_path: Path) -> None:
    run(tmp_path)
    file = tmp_path / "results.csv"
    assert results.outdated(results.load(file)) == []
    bench.found = replace(FOUND, digest="other", pose=(2.0, 0.0, 0.0))
    assert results.outdated(results.load(file)) == ["one", "two"]
    results.mark_old(ResultsOptions(tmp_path, only=("one",)), lambda _: None)
    assert results.outdated(results.load(file)) == ["two"]
    assert (tmp_path / "results.md").read_text().count("**Earlier walk**") == 1
    run(tmp_path)
    assert bench.ran == ["one", "two"] * 2
    assert "**Earlier walk**" not in (tmp_path / "results.md").read_text()


def test_a_result_without_a_walk_that_its_section_depends_on_is_out_of_date(
    bench: Bench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run(tmp_path)
    sections = {"one": {"suite": "one"}, "two": {"suite": "two", "walks": [WALK, "mujoco/other"]}}
    planned = Plan.from_mapping({"sections": sections, "page": []})
    monkeypatch.setattr(results, "results_plan", lambda: planned)
    assert results.outdated(results.load(tmp_path / "results.csv")) == ["two"]


def test_uncommitted_changes_are_refused_unless_asked_for(bench: Bench, tmp_path: Path) -> None:
    bench.code = replace(CODE, changes="0123456789ab")
    with pytest.raises(NaoGaitError, match=r"uncommitted changes.*--allow-dirty"):
        run(tmp_path)
    run(tmp_path, allow_dirty=True)
    assert "with uncommitted changes" in (tmp_path / "results.md").read_text()
    run(tmp_path, quick=True)
    assert bench.ran == ["one", "two"], "the same command on the same changes"


def test_unknown_sections_and_broken_files_are_refused(bench: Bench, tmp_path: Path) -> None:
    with pytest.raises(NaoGaitError, match="only: got 'three'; allowed: one of one, two"):
        run(tmp_path, only=("three",))
    (tmp_path / "results.csv").write_text("section,metric\none,speed\n")
    with pytest.raises(NaoGaitError, match=r"results\.csv"):
        run(tmp_path)


# -- the state of the code -------------------------------------------------------------------------


def git(folder: Path, *arguments: str) -> None:
    """Run git as somebody."""
    who = ("-c", "user.name=a", "-c", "user.email=a@b.invalid", "-c", "commit.gpgsign=false")
    subprocess.run(["git", "-C", str(folder), *who, *arguments], check=True, capture_output=True)


def test_only_changes_of_the_code_count(tmp_path: Path) -> None:
    with pytest.raises(NaoGaitError, match="a git checkout"):
        CodeState.of(tmp_path)
    for folder in ("config", "docs", "gait_lab"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "file").write_text("1")
    git(tmp_path, "init", "-q")
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "-qm", "first")
    first = CodeState.of(tmp_path)
    assert len(first.commit) == 40
    assert first.changes == ""
    (tmp_path / "docs" / "file").write_text("2")
    git(tmp_path, "commit", "-qam", "documents")
    assert CodeState.of(tmp_path) == first
    (tmp_path / "config" / "file").write_text("2")
    changed = CodeState.of(tmp_path)
    assert changed.commit == first.commit
    assert changed.changes
    (tmp_path / "gait_lab" / "new").write_text("3")
    assert CodeState.of(tmp_path).changes not in ("", changed.changes)


def test_results_depend_on_every_package() -> None:
    packages = {each.parent.name for each in results.ROOT.glob("*/__init__.py")} - {"test"}
    assert "lola_bridge" in packages
    assert packages <= set(results.CODE)
    assert all((results.ROOT / name).is_dir() for name in results.CODE)
