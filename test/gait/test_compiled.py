"""The compiled gait: the same walks to the bit, and never one of other sources."""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest

from gait_lab.compiled import build
from robot_core.errors import NaoGaitError
from sim_bridge.trials import compiled

WALKS = """
import hashlib, sys
from sim_bridge.trials.compiled import is_compiled
from sim_bridge.trials.rollout import RolloutSpec, rollout
from sim_bridge.trials.trial import Push
from sim_bridge.trials.tasks import find_task
from nao_lipm_gait.parameters import GaitParameters, load_preset

def run(task, parameters=GaitParameters(), end=5.0, push=None, robot="nao_h21_v33"):
    task = find_task(task).measured(1.0, end)
    trace = rollout(
        RolloutSpec(
            task, robot_seed=3, parameters=parameters, push=push, keep_trace=True, urdf=robot
        )
    ).trace
    bits = hashlib.md5(trace.com.tobytes() + trace.com_estimated_in_q.tobytes())
    print(task.name, len(trace), trace.alarm[-1], bits.hexdigest())

P = GaitParameters()
run("forward", end=6.0)
run("curve", end=5.0, robot="nao_v6")
run("spot", push=Push(4.5, 2.0, 0.8), end=6.0)
run("side", push=Push(5.0, 9.0, 1.6), end=6.5)
run("diagonal", load_preset("paper"), end=5.0)
run("forward=10", P.replace(walk="zmp"), end=4.5)
run("forward=10", P.replace(walk="preview"), end=4.5)
print("compiled" if is_compiled() else "as Python", file=sys.stderr)
"""


REFUSALS = """
from nao_lipm_gait import Gait, NaoGaitError
gait = Gait("nao_h21_v33")
calls = (
    lambda v: gait.step(v, v), gait.corrected, gait.continue_at, gait.request_lift,
    lambda v: gait.request_kick(v, 0.0), lambda v: gait.request_kick((0.1, 0.0), v),
    lambda v: gait.restart(moved=v), lambda v: Gait(gait.robot, control_period=v),
)
for call in calls:
    for wrong in (None, "x", [], 10**400):
        try:
            call(wrong)
        except NaoGaitError as error:
            print(error)
"""


class Output(NamedTuple):
    kind: str
    walks: list[str]


def run(*arguments: str, folders: tuple[Path, ...]) -> subprocess.CompletedProcess[str]:
    """Run Python with the gait in the first of these folders."""
    path = os.pathsep.join(map(str, (*folders, compiled.SOURCE)))
    return subprocess.run(
        [sys.executable, *arguments], cwd=compiled.SOURCE / "test",
        env={**os.environ, "PYTHONPATH": path}, capture_output=True, text=True,
    )  # fmt: skip


def walked(*folders: Path) -> Output:
    done = run("-c", WALKS, folders=folders)
    return Output(done.stderr.strip().splitlines()[-1], done.stdout.splitlines())


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("mypyc")
    if shutil.which("cc") is None and shutil.which("gcc") is None:
        pytest.skip("no C compiler")
    folder = tmp_path_factory.mktemp("gait") / "compiled"
    build.compile_gait(folder, lambda text: None, optimise=False)
    return folder


@pytest.mark.slow
@pytest.mark.xdist_group("compiled")
def test_the_compiled_gait_walks_the_same_to_the_bit(folder: Path) -> None:
    source, machine_code = walked(), walked(folder)
    assert (source.kind, machine_code.kind) == ("as Python", "compiled")
    assert len(source.walks) == 7
    assert source.walks == machine_code.walks


@pytest.mark.slow
@pytest.mark.xdist_group("compiled")
def test_the_compiled_gait_refuses_in_the_same_words(folder: Path) -> None:
    source, machine_code = (run("-c", REFUSALS, folders=each) for each in ((), (folder,)))
    assert len(source.stdout.splitlines()) == 32
    assert source.stdout == machine_code.stdout


@pytest.mark.slow
@pytest.mark.xdist_group("compiled")
def test_a_compiled_gait_of_other_sources_is_refused(folder: Path) -> None:
    def bench() -> subprocess.CompletedProcess[str]:
        return run("-m", "gait_lab.cli", "bench", "speed", "--plant", "none", folders=(folder,))

    assert "plant: got 'none'" in bench().stderr
    made_of = folder / compiled.MADE_OF
    text = made_of.read_text()
    try:
        made_of.write_text(("1" if text[0] == "0" else "0") + text[1:])
        refused = bench(), run("-c", WALKS, folders=(folder,))
    finally:
        made_of.write_text(text)
    assert refused[0].returncode == 2
    assert "compiled gait" in refused[0].stderr
    assert refused[1].returncode != 0
    assert "compiled gait" in refused[1].stderr


@pytest.mark.slow
@pytest.mark.xdist_group("compiled")
def test_an_up_to_date_gait_is_not_compiled_again(folder: Path) -> None:
    said: list[str] = []
    before = (folder / compiled.MADE_OF).stat().st_mtime_ns
    build.compile_gait(folder, said.append, optimise=False)
    assert not said
    assert (folder / compiled.MADE_OF).stat().st_mtime_ns == before


@pytest.mark.parametrize("name", ["letters", "nao_lipm_gait"])
def test_a_folder_with_other_content_is_not_emptied(tmp_path: Path, name: str) -> None:
    (tmp_path / name).mkdir()
    with pytest.raises(NaoGaitError, match="folder"):
        build.compile_gait(tmp_path, lambda text: None)
    assert (tmp_path / name).is_dir()
    file = tmp_path / "file"
    file.write_text("mine")
    with pytest.raises(NaoGaitError, match="folder"):
        build.compile_gait(file, lambda text: None)
    assert file.read_text() == "mine"


def test_a_failure_shows_the_output_of_the_compiler(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    script = tmp_path / "extension.py"
    script.write_text("raise SystemExit('no compiler here')")
    monkeypatch.setattr(build, "__file__", str(tmp_path / "build.py"))
    with pytest.raises(NaoGaitError, match="no compiler here"):
        build.compile_gait(tmp_path / "new", lambda text: None)
    assert not (tmp_path / "new").exists()


def test_the_tests_use_the_source() -> None:
    assert not compiled.is_compiled()
    compiled.check_fresh()


def test_a_folder_that_another_process_has_just_filled_is_kept(tmp_path: Path) -> None:
    folder = tmp_path / "compiled"
    for name in ("first", "second"):
        library = tmp_path / "temporary" / name
        library.mkdir(parents=True)
        (library / build.MADE_OF).write_text(name, encoding="utf-8")
        build._put(library, folder)
    assert [each.name for each in folder.iterdir()] == [build.MADE_OF]
    assert (folder / build.MADE_OF).read_text(encoding="utf-8") == "first"
    assert sorted(each.name for each in tmp_path.iterdir()) == ["compiled", "temporary"]
