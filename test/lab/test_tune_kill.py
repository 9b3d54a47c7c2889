"""Kill -9 in mid-run, for real: of a worker, and of the whole study."""

import os
import signal
import sqlite3
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import pytest
import yaml

pytest.importorskip("joblib")
pytest.importorskip("mujoco")
pytest.importorskip("cma")

from test_tune_study import GOOD

from gait_lab.tune.store import FILE, Store

ROOT = Path(__file__).resolve().parents[2]
TRIALS = 10
TIMEOUT = 120.0
PROC = Path("/proc")

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not PROC.is_dir(), reason="finds the workers in /proc"),
]


@pytest.fixture
def study(tmp_path: Path) -> Path:
    path = tmp_path / "tiny.yaml"
    path.write_text(yaml.safe_dump({**GOOD, "trials": TRIALS}), encoding="utf-8")
    return path


@pytest.fixture
def started() -> Iterator[list[subprocess.Popen[str]]]:
    """Whatever was started is gone after the test."""
    processes: list[subprocess.Popen[str]] = []
    yield processes
    for process in processes:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def tune(study: Path, out: Path, *more: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "gait_lab.cli", "tune", str(study), "--method", "cma",
               "--workers", "2", "--no-confirm", "--out", str(out), *more]  # fmt: skip
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "MPLBACKEND": "Agg"}
    return subprocess.Popen(
        command, cwd=ROOT, env=environment, text=True, start_new_session=True,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
    )  # fmt: skip


def finished(process: "subprocess.Popen[str]") -> str:
    said, _ = process.communicate(timeout=TIMEOUT)
    assert process.returncode == 0, said
    return said


def wait_for(predicate: Callable[[], bool], process: "subprocess.Popen[str]") -> None:
    end = time.monotonic() + TIMEOUT
    while not predicate():
        assert process.poll() is None, "ended too early: " + str(process.communicate()[0])
        assert time.monotonic() < end
        time.sleep(0.01)


def stored(out: Path) -> int:
    """Trials in the database, seen from outside."""
    try:
        with closing(sqlite3.connect(f"file:{out / FILE}?mode=ro", uri=True)) as database:
            return int(database.execute("SELECT count(*) FROM trial").fetchone()[0])
    except sqlite3.OperationalError:
        return 0


def workers_of(process: "subprocess.Popen[str]") -> list[int]:
    found = []
    for folder in PROC.iterdir():
        if folder.name.isdigit():
            try:
                parent = int((folder / "stat").read_text().rpartition(")")[2].split()[1])
                line = (folder / "cmdline").read_bytes()
            except (OSError, IndexError, ValueError):
                continue
            if parent == process.pid and b"popen_loky" in line:
                found.append(int(folder.name))
    return found


def results(out: Path) -> list[tuple[tuple[float, ...], float, str | None]]:
    store = Store.reopen(out)
    try:
        return [(trial.point, trial.score, trial.error) for trial in store.trials()]
    finally:
        store.close()


def test_killed_workers_and_a_killed_study_lose_nothing(
    study: Path, tmp_path: Path, started: list["subprocess.Popen[str]"]
) -> None:
    whole, worker, cut = tmp_path / "whole", tmp_path / "worker", tmp_path / "cut"
    started.append(tune(study, whole))
    finished(started[-1])
    expected = results(whole)
    assert len(expected) == TRIALS

    started.append(tune(study, worker))
    wait_for(lambda: stored(worker) >= 2 and bool(workers_of(started[-1])), started[-1])
    os.kill(workers_of(started[-1])[0], signal.SIGKILL)
    finished(started[-1])
    assert results(worker) == expected

    started.append(tune(study, cut))
    wait_for(lambda: stored(cut) >= 3, started[-1])
    os.killpg(started[-1].pid, signal.SIGKILL)
    started[-1].wait()
    kept = results(cut)
    assert 3 <= len(kept) < TRIALS
    assert all(result in expected for result in kept)
    started.append(tune(study, cut, "--resume"))
    said = finished(started[-1])
    assert results(cut) == expected
    assert f"{TRIALS - len(kept)} trials in" in said
    assert (cut / "best.yaml").read_text() == (whole / "best.yaml").read_text()

    started.append(tune(study, cut, "--resume", "--seed", "5"))
    said, _ = started[-1].communicate(timeout=TIMEOUT)
    assert started[-1].returncode == 2
    assert "resume: seed" in said
