"""Kill -9 of a whole study in mid-run, for real; its continuation ends as if nothing had been."""

import signal
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

pytest.importorskip("mujoco")
pytest.importorskip("optuna")
pytest.importorskip("cmaes")
pytest.importorskip("plotly")
pytest.importorskip("sklearn")

from test_tune_study import GOOD

from gait_lab.tune.run import TuneOptions, run
from robot_core.errors import NaoGaitError

KILLED = """
import os, signal, sys
from pathlib import Path
from gait_lab.tune import run, search

told = search.Kept.tell

def tell(self, number, *rest):
    if number == 3:
        os.killpg(0, signal.SIGKILL)  # its workers, too
    return told(self, number, *rest)

search.Kept.tell = tell
if __name__ == "__main__":
    run.run(run.TuneOptions(sys.argv[1], method="cma", workers=1, out=Path(sys.argv[2])), print)
"""


def test_a_study_that_was_killed_ends_as_one_that_was_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # The version of a checkout changes with every edit of a file.
    monkeypatch.setattr("gait_lab.tune.report.code_version", lambda: "1")
    study, script = tmp_path / "tiny.yaml", tmp_path / "killed.py"
    short = {"protocol": {"name": "growing_stride", "steps": 4}, "trials": 6, "unseen": []}
    study.write_text(yaml.safe_dump({**GOOD, **short}), encoding="utf-8")
    script.write_text(KILLED, encoding="utf-8")
    whole, cut = (
        TuneOptions(str(study), method="cma", workers=1, out=tmp_path / name)
        for name in ("whole", "cut")
    )
    expected = run(whole, str)
    command = [sys.executable, str(script), str(study), str(tmp_path / "cut")]
    done = subprocess.run(command, start_new_session=True)
    assert done.returncode == -signal.SIGKILL
    with pytest.raises(NaoGaitError, match="--resume"):
        run(cut, str)
    resumed = run(
        TuneOptions(str(study), method="cma", workers=1, out=tmp_path / "cut", resume=True), str
    )
    assert expected is not None
    assert resumed is not None
    for a, b in zip(expected.trials, resumed.trials, strict=True):
        assert (a.number, a.params, a.value) == (b.number, b.params, b.value)
    best, again = (tmp_path / name / "best.yaml" for name in ("whole", "cut"))
    assert best.read_text(encoding="utf-8") == again.read_text(encoding="utf-8")
