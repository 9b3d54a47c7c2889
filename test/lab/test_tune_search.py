"""The search: one worker repeats itself to the bit, a resumed study too; what dies begins again."""

import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("optuna")
pytest.importorskip("cmaes")
pytest.importorskip("sklearn")
pytest.importorskip("mujoco")

from deadly_jobs import bowl, kills_its_process_in_a_corner, square
from optuna.trial import TrialState
from test_tune_study import GOOD

from gait_lab.tune.search import Kept, best_of, leading, search
from gait_lab.tune.study import METHODS, parse_study
from gait_lab.tune.workers import ATTEMPTS, Outcome, Workers
from robot_core.errors import NaoGaitError

STUDY = parse_study({**GOOD, "trials": 9})
ABOUT = {"study": "a"}


class InProcess:
    """A worker that is this process; `killed` after so many jobs, as the tuner would be."""

    count = 1

    def __init__(self, killed: int = -1) -> None:
        self.ran: list[int] = []
        self._open: list[tuple[Any, ...]] = []
        self._killed = killed

    def submit(self, key: int, function: Any, *arguments: Any) -> None:
        self._open.append((key, function, *arguments))

    def results(self) -> Iterator[Outcome]:
        while self._open:
            key, function, *arguments = self._open.pop(0)
            if len(self.ran) == self._killed:
                raise KeyboardInterrupt
            self.ran.append(key)
            yield Outcome(key, function(*arguments))


def run(folder: Path, method: str, workers: Any, **more: Any) -> list[tuple[Any, ...]]:
    """A search in a folder, new or resumed; number, point and score of its trials."""
    kept = Kept(STUDY, f"sqlite:///{folder / 'study.db'}")
    kept.open(ABOUT, existing=not kept.empty())
    trials = search(STUDY, kept, workers, method, 1, evaluate=bowl, **more)
    assert not kept.in_state(TrialState.RUNNING)
    return [(t.number, t.params, t.value) for t in trials]


@pytest.mark.parametrize("method", METHODS)
def test_a_study_that_was_cut_off_goes_on_to_the_same_end(method: str, tmp_path: Path) -> None:
    for name in ("whole", "cut"):
        (tmp_path / name).mkdir()
    whole = run(tmp_path / "whole", method, InProcess())
    assert len(whole) == STUDY.file.trials
    assert whole[0][1] == STUDY.start_values
    with pytest.raises(KeyboardInterrupt):
        run(tmp_path / "cut", method, InProcess(killed=6))
    resumed = InProcess()
    assert run(tmp_path / "cut", method, resumed) == whole
    assert resumed.ran == [6, 7, 8]  # trial 6 was under way; nothing else walks twice


def test_a_helper_leaves_what_the_leading_tuner_has_begun(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        run(tmp_path, "random", InProcess(killed=3))
    helper = InProcess(killed=2)
    kept = Kept(STUDY, f"sqlite:///{tmp_path / 'study.db'}")
    kept.open(ABOUT, existing=True)
    with pytest.raises(KeyboardInterrupt):
        search(STUDY, kept, helper, "random", 1, helping=True, evaluate=bowl)
    assert helper.ran == [4, 5]
    leader = InProcess()
    trials = search(STUDY, kept, leader, "random", 1, evaluate=bowl)
    assert leader.ran == [3, 7, 8, 9]  # trial 6 is the helper's
    assert len(trials) == STUDY.file.trials
    assert best_of(trials).value == max(trial.value for trial in trials)
    assert trials[0].user_attrs["measures"][0][0] == STUDY.file.robots[0]


def test_one_tuner_leads_a_folder(tmp_path: Path) -> None:
    with (
        leading(tmp_path),
        pytest.raises(NaoGaitError, match="no other tuner"),
        leading(tmp_path),
    ):
        pass
    with leading(tmp_path):
        pass


def test_another_study_is_not_resumed(tmp_path: Path) -> None:
    run(tmp_path, "random", InProcess())
    kept = Kept(STUDY, f"sqlite:///{tmp_path / 'study.db'}")
    with pytest.raises(NaoGaitError, match="resume: study"):
        kept.open({"study": "b"}, existing=True)
    with pytest.raises(NaoGaitError, match="--resume"):
        kept.open(ABOUT, existing=False)
    other = Kept(parse_study({**GOOD, "name": "other"}), kept.url)
    with pytest.raises(NaoGaitError, match="holds this study"):
        other.open(ABOUT, existing=True)


def test_a_study_of_another_version_is_not_begun_again(tmp_path: Path) -> None:
    file = tmp_path / "study.db"
    with closing(sqlite3.connect(file)) as old:  # as version 0.1 made it
        old.execute("CREATE TABLE about (key TEXT PRIMARY KEY, value TEXT NOT NULL)")
        old.execute("CREATE TABLE trial (number INTEGER PRIMARY KEY)")
        old.commit()
    before = file.read_bytes()
    with pytest.raises(NaoGaitError, match=r"tables about, trial'; allowed: .* version 0\.1"):
        Kept(STUDY, f"sqlite:///{file}")
    assert file.read_bytes() == before


# -- processes that really die ---------------------------------------------------------------------


def test_a_job_whose_process_is_killed_begins_again_and_costs_no_other(tmp_path: Path) -> None:
    with Workers(2) as workers:
        for number in range(6):
            workers.submit(number, square, number, str(tmp_path / "killed"))
        found = {outcome.key: outcome for outcome in workers.results()}
        assert list(workers.map(square, [(2, ""), (1, ""), (0, "")])) == [4, 1, 0]
    assert (tmp_path / "killed").exists()
    assert {key: outcome.result for key, outcome in found.items()} == {
        0: 0, 1: 1, 2: 4, 3: 9, 4: None, 5: None,
    }  # fmt: skip
    assert f"{ATTEMPTS} times" in str(found[4].error)
    assert "ValueError: no square" in str(found[5].error)
    assert found[3].error is None


def test_jobs_left_over_by_an_error_give_no_result_to_the_next_caller() -> None:
    """Job 0 never ends, so it still runs when job 1 fails."""
    with Workers(2) as workers:
        with pytest.raises(NaoGaitError, match="no square"):
            list(workers.map(square, [(6, ""), (5, ""), (7, "")]))
        assert list(workers.map(square, [(2, ""), (1, "")])) == [4, 1]


def test_a_trial_that_kills_every_process_scores_as_a_fall(tmp_path: Path) -> None:
    study = parse_study({**GOOD, "trials": 3})
    kept = Kept(study, f"sqlite:///{tmp_path / 'study.db'}")
    kept.open(ABOUT, existing=False)
    with Workers(1) as workers:
        trials = search(study, kept, workers, "random", 3, evaluate=kills_its_process_in_a_corner)
    died = [t for t in trials if t.params["step_forward_max"] > 0.03]
    assert 0 < len(died) < len(trials) == 3
    assert all(t.value == -study.file.penalty.fall and t.user_attrs["error"] for t in died)
    assert all(t.user_attrs["error"] is None for t in trials if t not in died)
