"""The search: ask, walk, store, tell.

Points are told strictly in the order of asking, one before the next is asked, and at most `window`
are under way. So what is asked depends on seed and window alone, not on which worker was quicker:
a study that was killed asks the same again, finds the answers in its store and goes on where it
was.
"""

from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass
from typing import Any

from gait_lab.tune.methods import Method, Point
from gait_lab.tune.store import Store
from gait_lab.tune.study import Study
from gait_lab.tune.trial import Trial, evaluate, failed
from gait_lab.tune.workers import ATTEMPTS, Workers


def window_for(workers: int) -> int:
    """Trials under way: one waits beside those that walk, so that no worker waits for a thought.

    A single worker gets none: each point then knows all results before it.
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
    """Trials until the study has all of its number; those in the store are not walked again.

    note: called with every trial as it ends, also with those that come from the store.
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
        # What was really walked, should another version of a library ask differently now.
        method.tell(ended[told].point, -ended[told].score)
        told += 1
    return [ended[number] for number in range(study.trials)]


def best_of(trials: list[Trial]) -> Trial:
    """The best trial; the earliest of equals."""
    return max(trials, key=lambda trial: trial.score)
