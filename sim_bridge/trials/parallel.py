"""The same function over many items, on all cores."""

import os
from collections.abc import Callable, Iterable
from typing import Any

from robot_core.schema import Number
from sim_bridge.trials.result_cache import ResultCache

MOST = 1024
"""Processes that can be asked for."""


def workers(asked: int | None = None) -> int:
    """Number of worker processes: the requested one, or all cores that this process may use.

    Raises:
        NaoGaitError: Fewer than one is asked for, or more than `MOST`.
    """
    if asked is not None:
        return int(Number(1, MOST, "processes", whole=True).check("jobs", asked))
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def parallel_map(
    function: Callable[[Any], Any],
    items: Iterable[Any],
    *,
    jobs: int | None = None,
    label: str = "rollouts",
    show: bool = True,
    note: Callable[[Any], str] | None = None,
    kept: ResultCache | None = None,
) -> list[Any]:
    """Call `function` with every item, over all cores, with its progress on stderr.

    joblib runs it: on a cluster, another joblib backend takes the same call.

    Args:
        function: Picklable.
        items: Its arguments.
        jobs: Number of processes; None for all cores.
        label: Label of the progress.
        show: Show the progress.
        note: A short text about a result, for the progress.
        kept: File of finished results: what is in it is not run again, others are added.

    Returns:
        The results in the order of the items.
    """
    from joblib import Parallel, delayed

    from sim_bridge.trials.progress import Progress

    items = list(items)
    results = [kept.result(item) if kept else None for item in items]
    open_items = [place for place, result in enumerate(results) if result is None]
    processes = min(workers(jobs), max(1, len(open_items)))
    done: Iterable[Any]
    if processes == 1:
        done = (function(items[place]) for place in open_items)
    else:
        # Not unordered: joblib has that from 1.4 on, Ubuntu 24.04 ships 1.3.
        parallel = Parallel(n_jobs=processes, return_as="generator")
        done = parallel(delayed(function)(items[place]) for place in open_items)
    finished = len(items) - len(open_items)
    with Progress(total=len(items), initial=finished, desc=label, show=show) as bar:
        for place, result in zip(open_items, done, strict=True):
            results[place] = result
            if kept is not None:
                kept.add(items[place], result)
            if note is not None:
                bar.set_postfix_str(note(result), refresh=False)
            bar.update()
    return results
