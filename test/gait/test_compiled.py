"""The compiled gait: records spelled out line by line, and the same walks bit for bit."""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from gait_lab import compiled
from gait_lab.compiled import build
from gait_lab.compiled.records import spelled_out
from nao_lipm_gait.errors import NaoGaitError

SOURCE = '''\
from typing import NamedTuple

class Other:
    pass

class Reach(NamedTuple):
    """How far
    it goes."""

    x: float
    """[m]"""
    y: float = 0.5

    def doubled(self) -> "Reach":
        return Reach(2.0 * self.x, 2.0 * self.y)
'''

WALKS = """
import hashlib, sys
from gait_lab.compiled import is_compiled
from gait_lab.trials.rollout import RolloutSpec, rollout
from gait_lab.trials.trial import Push
from gait_lab.trials.tasks import find_task
from nao_lipm_gait.parameters import GaitParameters, load_preset

def run(task, parameters=GaitParameters(), end=5.0, push=None):
    task = find_task(task).measured(1.0, end)
    trace = rollout(
        RolloutSpec(task, robot_seed=3, parameters=parameters, push=push, keep_trace=True)
    ).trace
    bits = hashlib.md5(trace.com.tobytes() + trace.com_estimated_in_q.tobytes())
    print(task.name, len(trace), trace.alarm[-1], bits.hexdigest())

P = GaitParameters()
run("forward", end=6.0)
run("curve", P.replace(yaw_gyro=True), end=5.0)
run("spot", push=Push(4.5, 2.0, 0.8), end=6.0)
run("side", push=Push(5.0, 9.0, 1.6), end=6.5)
run("diagonal", load_preset("paper"), end=5.0)
run("forward=10", P.replace(walk="zmp"), end=4.5)
run("forward=10", P.replace(walk="preview"), end=4.5)
print("compiled" if is_compiled() else "as Python", file=sys.stderr)
"""


class Seen(NamedTuple):
    said: str
    walks: list[str]


def run(*arguments: str, folders: tuple[Path, ...]) -> subprocess.CompletedProcess[str]:
    """A Python that finds the gait in the first of these folders."""
    path = os.pathsep.join(map(str, (*folders, compiled.SOURCE.parent)))
    return subprocess.run(
        [sys.executable, *arguments], cwd=compiled.SOURCE.parent / "test",
        env={**os.environ, "PYTHONPATH": path}, capture_output=True, text=True,
    )  # fmt: skip


def walked(*folders: Path) -> Seen:
    done = run("-c", WALKS, folders=folders)
    return Seen(done.stderr.strip().splitlines()[-1], done.stdout.splitlines())


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("mypyc")
    if shutil.which("cc") is None and shutil.which("gcc") is None:
        pytest.skip("no C compiler")
    folder = tmp_path_factory.mktemp("gait") / "compiled"
    build.compile_gait(folder, lambda text: None, optimise=False)
    return folder


@pytest.mark.xdist_group("compiled")
def test_the_compiled_gait_walks_the_same_bit_for_bit(folder: Path) -> None:
    source, machine_code = walked(), walked(folder)
    assert (source.said, machine_code.said) == ("as Python", "compiled")
    assert len(source.walks) == 7
    assert source.walks == machine_code.walks


@pytest.mark.xdist_group("compiled")
def test_a_compiled_gait_of_other_sources_is_refused(folder: Path) -> None:
    def bench() -> subprocess.CompletedProcess[str]:
        return run("-m", "gait_lab.cli", "bench", "no_such_suite", folders=(folder,))

    assert "no_such_suite" in bench().stderr
    made_of = folder / compiled.MADE_OF
    text = made_of.read_text()
    try:
        made_of.write_text("0" + text[1:])
        refused = bench(), run("-c", WALKS, folders=(folder,))
    finally:
        made_of.write_text(text)
    assert refused[0].returncode == 2
    assert "compiled gait" in refused[0].stderr
    assert refused[1].returncode != 0
    assert "compiled gait" in refused[1].stderr


@pytest.mark.xdist_group("compiled")
def test_what_is_there_is_not_compiled_again(folder: Path) -> None:
    said: list[str] = []
    before = (folder / compiled.MADE_OF).stat().st_mtime_ns
    build.compile_gait(folder, said.append, optimise=False)
    assert not said
    assert (folder / compiled.MADE_OF).stat().st_mtime_ns == before


def test_a_record_becomes_a_class_on_the_same_lines() -> None:
    text = spelled_out(SOURCE)
    assert text.count("\n") == SOURCE.count("\n")
    for line in ("    x: float", "class Other:", "    def doubled(self) -> \"Reach\":"):
        assert text.split("\n").index(line) == SOURCE.split("\n").index(line)
    space: dict[str, Any] = {}
    exec(text, space)
    reach = space["Reach"](1.5)
    assert (reach.x, reach.y) == (1.5, 0.5)
    assert not isinstance(reach, tuple)
    assert reach.doubled().y == 1.0


@pytest.mark.parametrize(
    "record",
    [
        "\nclass Arm(NamedTuple):\n    x: float\n",
        "x = 1\nclass Arm(NamedTuple):\n    'An arm.'\n    x: float\n",
        "\nclass Arm(NamedTuple):\n    'An arm.'\n    x: float = max(\n    1.0, 2.0)\n",
        "\nclass Arm(\n    NamedTuple\n):\n    'An arm.'\n    x: float\n",
    ],
)
def test_a_record_that_cannot_be_spelled_out_is_named(record: str) -> None:
    with pytest.raises(NaoGaitError, match="arms.py: record Arm"):
        spelled_out(record, "arms.py")


@pytest.mark.parametrize("name", ["letters", "nao_lipm_gait"])
def test_a_folder_of_somebody_else_is_not_emptied(tmp_path: Path, name: str) -> None:
    (tmp_path / name).mkdir()
    with pytest.raises(NaoGaitError, match="folder"):
        build.compile_gait(tmp_path, lambda text: None)
    assert (tmp_path / name).is_dir()
    file = tmp_path / "file"
    file.write_text("mine")
    with pytest.raises(NaoGaitError, match="folder"):
        build.compile_gait(file, lambda text: None)
    assert file.read_text() == "mine"


def test_what_the_compiler_says_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    script = tmp_path / "extension.py"
    script.write_text("raise SystemExit('no compiler here')")
    monkeypatch.setattr(build, "__file__", str(tmp_path / "build.py"))
    with pytest.raises(NaoGaitError, match="no compiler here"):
        build.compile_gait(tmp_path / "new", lambda text: None)
    assert not (tmp_path / "new").exists()


def test_these_tests_walk_with_the_source() -> None:
    assert not compiled.is_compiled()
    compiled.check_fresh()
