"""The same search on a real local Dask and on a real local Ray cluster."""

import os
import signal
from pathlib import Path

import pytest

pytest.importorskip("joblib")
pytest.importorskip("mujoco")
pytest.importorskip("cma")

from test_tune_study import GOOD

from gait_lab.tune.evaluation import evaluate
from gait_lab.tune.methods import make_method
from gait_lab.tune.search import search
from gait_lab.tune.store import Store
from gait_lab.tune.study import parse_study
from gait_lab.tune.workers import make_workers, run_all
from robot_core.errors import NaoGaitError

STUDY = parse_study({**GOOD, "protocol": {"name": "growing_stride", "steps": 4}, "trials": 3})
MODULES = {"dask": "distributed", "ray": "ray"}


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("backend", MODULES)
def test_a_cluster_gives_what_this_process_gives(backend: str, tmp_path: Path) -> None:
    pytest.importorskip(MODULES[backend])
    mark = tmp_path / "killed"

    def kills_its_worker_once(number: int) -> int:
        if number == 1 and not mark.exists():
            mark.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return number * number

    store = Store.create(tmp_path / "out", {})
    workers = make_workers(backend, 1)
    try:
        method = make_method("cma", STUDY.start_point, seed=0, trials=STUDY.trials)
        trials = search(STUDY, method, store, workers, window=2)
        squares = run_all(workers, kills_its_worker_once, [(n,) for n in range(3)])
    finally:
        workers.close()
        store.close()
    here = [evaluate(STUDY, trial.number, trial.point) for trial in trials]
    assert [(t.score, t.error) for t in trials] == [(t.score, t.error) for t in here]
    assert mark.exists()
    assert squares == [0, 1, 4]


def test_an_address_is_for_clusters() -> None:
    with pytest.raises(NaoGaitError, match="address"):
        make_workers("loky", 1, "tcp://somewhere:8786")
