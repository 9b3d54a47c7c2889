"""The search: ask the method for points, run trials, store them, tell the method the losses.

Losses are told in the order of asking, and at most `window` trials run at a time. The points
therefore depend on the seed and the window only, not on the speed of the workers. A study that was
killed asks for the same points again, finds their results in its store, and continues.
"""

from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass
from typing import Any

from gait_lab.tune.evaluation import Trial, evaluate, failed
from gait_lab.tune.methods import Method, Point
from gait_lab.tune.store import Store
from gait_lab.tune.study import Study
from gait_lab.tune.workers import ATTEMPTS, Workers


def window_for(workers: int) -> int:
    """Return the number of trials that run or wait.

    One trial more than workers, so that no worker waits for the method; for a single worker no
    more, so that each point uses all earlier results.
    """
    return workers if workers == 1 else workers + 1


@dataclass(slots=True)
class _Running:
    number: int
    point: Point
    attempts: int


def search(
    study: Study,
    method: Method,
    store: Store,
    workers: Workers,
    *,
    window: int,
    note: Callable[[Trial], None] = lambda trial: None,
    evaluate: Callable[[Study, int, Point], Trial] = evaluate,
) -> list[Trial]:
    """Run the trials of a study that are not in its store.

    Args:
        study: The study.
        method: The search method.
        store: The trials so far; new ones are added.
        workers: Processes that run the trials.
        window: Largest number of trials that run or wait.
        note: Called with each completed trial, stored ones included.
        evaluate: Runs one trial.

    Returns:
        All trials by number.
    """
    ended = {trial.number: trial for trial in store.trials()}
    asked: list[Point] = []
    running: dict[Future[Any], _Running] = {}
    told = 0

    def begin(number: int, point: Point, attempts: int = 1) -> None:
        future = workers.submit(evaluate, study, number, point)
        running[future] = _Running(number, point, attempts)

    def end(trial: Trial) -> None:
        store.add(trial)
        ended[trial.number] = trial
        note(trial)

    for number in sorted(ended):
        if number < study.trials:
            note(ended[number])
    while told < study.trials:
        while len(asked) < study.trials and len(asked) - told < window:
            point = method.ask()
            if point is None:
                break
            number = len(asked)
            asked.append(point)
            if number not in ended:
                begin(number, point)
        while told not in ended:
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                job = running.pop(future)
                lost = future.exception()
                if lost is None:
                    end(future.result())
                elif job.attempts < ATTEMPTS:
                    begin(job.number, job.point, job.attempts + 1)
                else:
                    reason = f"lost {ATTEMPTS} workers, {type(lost).__name__}"
                    end(failed(study, job.number, job.point, reason))
        # The stored point, in case another version of a library asks for a different one.
        method.tell(ended[told].point, -ended[told].score)
        told += 1
    return [ended[number] for number in range(study.trials)]


def best_of(trials: list[Trial]) -> Trial:
    """Return the trial with the best score, the earliest of equal ones."""
    return max(trials, key=lambda trial: trial.score)
