"""The search: Optuna keeps the trials and proposes the next ones, worker processes run them.

A trial is in the storage before it walks. A trial that was under way when the tuner was killed is
found there when the study is resumed, and walks again at the same point.
"""

import fcntl
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import optuna
from optuna.distributions import FloatDistribution
from optuna.storages import RDBStorage
from optuna.trial import FrozenTrial, TrialState
from sqlalchemy import create_engine, inspect
from sqlalchemy.engine import make_url
from sqlalchemy.exc import SQLAlchemyError

from gait_lab.tune.protocols import Measures
from gait_lab.tune.samplers import make_sampler
from gait_lab.tune.study import Place, Study
from gait_lab.tune.workers import Workers
from nao_lipm_gait.parameters import GaitParameters
from robot_core.errors import NaoGaitError
from sim_bridge.trials.calibration import calibrate
from sim_bridge.trials.trial import TrialSpec

DATABASE = "study.db"
"""File in the folder of a study that holds its trials, unless another storage is named."""
_HELPER = "helper"
"""Attribute of a trial that another tuner than the leading one has begun."""


# -- one trial -------------------------------------------------------------------------------------


def walk_robots(
    study: Study,
    parameters: GaitParameters,
    robots: Sequence[int],
    place: Place,
    confirm: bool = False,
) -> list[Measures]:
    """Run the study's protocol on each robot; `confirm`: with the options of the confirmation."""
    options = study.confirm_options if confirm else study.options
    found = []
    for seed in robots:
        spec = TrialSpec(
            robot_seed=seed,
            parameters=parameters,
            engine=place.engine,
            plant=place.plant,
            urdf=study.file.urdf,
        )
        if study.file.calibrated:
            calibration = calibrate(spec)
            if calibration is None:
                raise NaoGaitError("study.robots", seed, f"one that can be calibrated in {place}")
            spec = replace(spec, calibration=calibration)
        found.append(study.protocol.run(spec, options))
    return found


def best_of(trials: Sequence[FrozenTrial]) -> FrozenTrial:
    """The trial with the best score, the earliest of equal ones."""
    return max(trials, key=lambda trial: (trial.value, -trial.number))


# -- the storage -----------------------------------------------------------------------------------


@contextmanager
def one_line_storage_errors(where: str) -> Iterator[None]:
    """Turn what a database or a file system refuses into one line."""
    try:
        yield
    except (OSError, SQLAlchemyError, optuna.exceptions.StorageInternalError) as error:
        reason = str(getattr(error.__cause__, "orig", None) or getattr(error, "orig", error))
        allowed = "what can be read and written, with space left; then --resume"
        raise NaoGaitError(f"results in {where}", " ".join(reason.split()), allowed) from error


@contextmanager
def leading(out: Path) -> Iterator[None]:
    """Hold the folder of a study: only one tuner at a time leads it."""
    out.mkdir(parents=True, exist_ok=True)
    with (out / "tuner.lock").open("w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            allowed = "a folder on which no other tuner works; --join helps that one"
            raise NaoGaitError("out", str(out), allowed) from error
        yield


class Kept:
    """The stored trials of a study."""

    def __init__(self, study: Study, url: str) -> None:
        optuna.logging.set_verbosity(optuna.logging.WARNING)
        self.url = make_url(url).render_as_string(hide_password=True)
        self._study = study
        try:
            engine = create_engine(url)
            tables = inspect(engine).get_table_names()
            engine.dispose()
            if tables and "studies" not in tables:
                found = f"a database with the tables {', '.join(sorted(tables))}"
                allowed = "one of Optuna: a study of version 0.1 cannot be resumed; another --out"
                raise NaoGaitError(f"storage {self.url}", found, allowed)
            self._storage = RDBStorage(url)
        except (ImportError, RuntimeError) as error:
            reason = str(error).split(".")[0]
            allowed = "a database whose driver and Optuna version are the installed ones"
            raise NaoGaitError(f"storage {self.url}", reason, allowed) from error
        ranges = study.file.parameters
        self._space = {name: FloatDistribution(*ends) for name, ends in ranges.items()}

    def empty(self) -> bool:
        """Whether the storage holds no study: a tuner may be killed before it makes one."""
        return not optuna.get_all_study_names(self._storage)

    def open(self, about: dict[str, Any], existing: bool) -> None:
        """Open or create the study.

        Args:
            about: What a resumed study must have in common with the stored one.
            existing: Whether it must exist; otherwise it must not.

        Raises:
            NaoGaitError: It does not exist, exists, or is another study than the stored one.
        """
        try:
            load = optuna.load_study if existing else optuna.create_study
            more: Any = {} if existing else {"direction": "maximize"}
            self.trials = load(study_name=self._study.name, storage=self._storage, **more)
        except KeyError as error:
            allowed = "a storage that holds this study, to resume or to join"
            raise NaoGaitError("storage", self.url, allowed) from error
        except optuna.exceptions.DuplicatedStudyError as error:
            allowed = "a storage without this study; or --resume it"
            raise NaoGaitError("storage", self.url, allowed) from error
        stored = self.trials.user_attrs.get("about")
        if stored is None:
            self.trials.set_user_attr("about", about)
            self.trials.enqueue_trial(self._study.start_values)
            return
        for key, value in about.items():
            if stored.get(key) != value:
                allowed = f"{stored.get(key)}, as in {self.url}; or another --out"
                raise NaoGaitError(f"resume: {key}", value, allowed)

    def in_state(self, state: TrialState) -> list[FrozenTrial]:
        """The trials in a state, by number."""
        return self.trials.get_trials(deepcopy=False, states=(state,))

    def complete(self) -> list[FrozenTrial]:
        """The trials that have a score, by number."""
        return self.in_state(TrialState.COMPLETE)

    def interrupted(self) -> Iterator[FrozenTrial]:
        """The trials that were under way when the leading tuner was killed."""
        for trial in self.in_state(TrialState.RUNNING):
            if _HELPER in trial.user_attrs:
                continue
            if trial.params.keys() == self._space.keys():
                yield trial
            else:
                self.trials.tell(trial.number, state=TrialState.FAIL)

    def ask(self, method: str, seed: int, helping: bool) -> optuna.Trial:
        """Begin a trial at the next point."""
        number = len(self.trials.get_trials(deepcopy=False))
        start = self._study.start_values
        self.trials.sampler = make_sampler(method, self._space, start, seed, number)
        trial = self.trials.ask(dict(self._space))
        if helping:
            trial.set_user_attr(_HELPER, True)
        return trial

    def tell(self, number: int, measures: Sequence[Measures], error: str | None) -> float:
        """Complete a trial; one that failed scores as a robot that fell. Returns the score."""
        study_id = self._storage.get_study_id_from_name(self._study.name)
        trial = self._storage.get_trial_id_from_study_id_trial_number(study_id, number)
        kept = [(m.robot, dict(m.values), m.fell, m.excess) for m in measures]
        self._storage.set_trial_user_attr(trial, "measures", kept)
        self._storage.set_trial_user_attr(trial, "error", error)
        score = -self._study.file.penalty.fall if error else self._study.score(measures)
        self.trials.tell(number, score)
        return score


# -- the search ------------------------------------------------------------------------------------


def search(
    study: Study,
    kept: Kept,
    workers: Workers,
    method: str,
    seed: int,
    *,
    helping: bool = False,
    note: Callable[[int, float], object] = lambda number, score: None,
    evaluate: Callable[..., list[Measures]] = walk_robots,
) -> list[FrozenTrial]:
    """Run trials until the study has as many as it asks for.

    Args:
        study: The study.
        kept: Its stored trials.
        workers: Processes that run the trials.
        method: Search method.
        seed: Seed of the method.
        helping: Whether another tuner leads the study.
        note: Called with number and score of each trial that ends.
        evaluate: Runs one trial.

    Returns:
        The trials with a score, by number.
    """
    running: set[int] = set()

    def begin(number: int, values: dict[str, float]) -> None:
        running.add(number)
        parameters = study.start.replace(**values)
        workers.submit(number, evaluate, study, parameters, study.file.robots, study.place)

    def fill() -> None:
        while (
            len(running) < workers.count
            and len(kept.complete()) + len(running) < study.file.trials
        ):
            trial = kept.ask(method, seed, helping)
            begin(trial.number, trial.params)

    if not helping:
        for trial in kept.interrupted():
            begin(trial.number, trial.params)
    fill()
    for outcome in workers.results():
        running.discard(outcome.key)
        note(outcome.key, kept.tell(outcome.key, outcome.result or (), outcome.error))
        fill()
    return kept.complete()
