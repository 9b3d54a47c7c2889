"""The search: what it asks depends on the seed alone; what dies is begun again; it resumes."""

import os
import signal
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from threading import Event
from typing import Any

import pytest

pytest.importorskip("joblib")
pytest.importorskip("mujoco")
pytest.importorskip("bayes_opt")

from test_tune_study import GOOD

from gait_lab.tune.evaluation import Trial
from gait_lab.tune.methods import METHODS, Point, make_method
from gait_lab.tune.search import best_of, search, window_for
from gait_lab.tune.store import FILE, Store
from gait_lab.tune.study import Study, parse_study
from gait_lab.tune.workers import ATTEMPTS, LokyWorkers, run_all
from robot_core.errors import NaoGaitError

STUDY = parse_study({**GOOD, "trials": 10})
Evaluate = Callable[[Study, int, Point], Trial]


def bowl(study: Study, number: int, point: Point) -> Trial:
    return Trial(number, point, -sum((x - 0.4) ** 2 for x in point), (), 0.0)


class Threads:
    """Workers that share this process."""

    count = 3

    def __init__(self) -> None:
        self._pool = ThreadPoolExecutor(8)

    def submit(self, function: Callable[..., Any], *arguments: Any) -> "Future[Any]":
        return self._pool.submit(function, *arguments)

    def close(self) -> None:
        self._pool.shutdown()


def run(out: Path, method: str, evaluate: Evaluate = bowl, **more: Any) -> list[Trial]:
    """A search over a new or, if there is one, the stored study in `out`."""
    store = Store.reopen(out) if (out / FILE).exists() else Store.create(out, {})
    workers = Threads()
    try:
        made = make_method(method, STUDY.start_point, seed=1, trials=STUDY.trials)
        return search(STUDY, made, store, workers, window=4, evaluate=evaluate, **more)
    finally:
        workers.close()
        store.close()


@pytest.mark.parametrize("method", METHODS)
def test_which_worker_is_quicker_changes_nothing(method: str, tmp_path: Path) -> None:
    ended = [Event() for _ in range(STUDY.trials + 1)]
    order: list[int] = []

    def reversed_in_pairs(study: Study, number: int, point: Point) -> Trial:
        if number % 2 == 0:
            ended[number + 1].wait(timeout=0.1)  # not asked yet at the end of a generation
        order.append(number)
        ended[number].set()
        return bowl(study, number, point)

    in_order = run(tmp_path / "a", method)
    out_of_order = run(tmp_path / "b", method, reversed_in_pairs)
    assert order != sorted(order)
    assert [trial.point for trial in in_order] == [trial.point for trial in out_of_order]


@pytest.mark.parametrize("method", METHODS)
def test_a_study_that_was_cut_off_goes_on_to_the_same_end(method: str, tmp_path: Path) -> None:
    whole = run(tmp_path / "whole", method)
    walked: list[int] = []

    def breaks_off(trial: Trial) -> None:
        if trial.number == 6:
            raise KeyboardInterrupt

    def counting(study: Study, number: int, point: Point) -> Trial:
        walked.append(number)
        return bowl(study, number, point)

    with pytest.raises(KeyboardInterrupt):
        run(tmp_path / "cut", method, note=breaks_off)
    kept = {trial.number for trial in _stored(tmp_path / "cut")}
    resumed = run(tmp_path / "cut", method, counting)
    assert 6 in kept
    assert sorted(walked) == sorted(set(range(STUDY.trials)) - kept)  # nothing walks twice
    assert [(t.point, t.score) for t in resumed] == [(t.point, t.score) for t in whole]
    assert best_of(resumed).number == best_of(whole).number


def _stored(out: Path) -> list[Trial]:
    store = Store.reopen(out)
    try:
        return store.trials()
    finally:
        store.close()


def test_a_trial_whose_worker_dies_is_begun_again(tmp_path: Path) -> None:
    begun: list[int] = []

    def dies_once(study: Study, number: int, point: Point) -> Trial:
        begun.append(number)
        if number == 3 and begun.count(3) == 1:
            raise RuntimeError("the worker is gone")
        return bowl(study, number, point)

    assert [t.error for t in run(tmp_path, "cma", dies_once)] == [None] * STUDY.trials
    assert begun.count(3) == 2
    assert len(begun) == STUDY.trials + 1


def test_a_trial_that_kills_every_worker_costs_itself_alone(tmp_path: Path) -> None:
    def always_dies(study: Study, number: int, point: Point) -> Trial:
        if number == 3:
            raise RuntimeError("the worker is gone")
        return bowl(study, number, point)

    trials = run(tmp_path, "cma", always_dies)
    assert [t.number for t in trials if t.error] == [3]
    assert f"{ATTEMPTS} workers" in str(trials[3].error)
    assert trials[3].score == -STUDY.penalty.fall
    assert _stored(tmp_path)[3].error == trials[3].error


def test_one_worker_knows_everything_before_it_and_more_have_one_waiting() -> None:
    assert [window_for(count) for count in (1, 2, 8)] == [1, 3, 9]


def test_a_folder_holds_one_study(tmp_path: Path) -> None:
    Store.create(tmp_path, {"method": "cma"}).close()
    with pytest.raises(NaoGaitError, match="--resume"):
        Store.create(tmp_path, {})
    with pytest.raises(NaoGaitError, match="to resume"):
        Store.reopen(tmp_path / "elsewhere")


def test_a_damaged_database_is_refused(tmp_path: Path) -> None:
    (tmp_path / FILE).write_bytes(b"this is no database" * 100)
    with pytest.raises(NaoGaitError, match="study database"):
        Store.reopen(tmp_path)


def test_loky_outlives_a_worker_that_is_killed(tmp_path: Path) -> None:
    mark = tmp_path / "killed"

    def kills_its_worker_once(number: int) -> int:
        if number == 2 and not mark.exists():
            mark.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return number * number

    workers = LokyWorkers(2)
    try:
        squares = run_all(workers, kills_its_worker_once, [(n,) for n in range(6)])
    finally:
        workers.close()
    assert mark.exists()
    assert squares == [0, 1, 4, 9, 16, 25]
