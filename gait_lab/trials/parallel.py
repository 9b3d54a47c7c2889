"""The same function over many items, on all cores."""

import os
from collections.abc import Callable, Iterable
from typing import Any

from nao_lipm_gait.errors import NaoGaitError


def workers(asked: int | None = None) -> int:
    """Number of worker processes: the requested one, or all cores that this process may use.

    Raises:
        NaoGaitError: Fewer than one is asked for.
    """
    if asked is not None:
        if asked < 1:
            raise NaoGaitError("jobs", asked, "a number of processes, at least 1")
        return asked
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def parallel_map(
    function: Callable[[Any], Any],
    items: Iterable[Any],
    *,
    jobs: int | None = None,
    label: str = "rollouts",
    show: bool = True,
    note: Callable[[Any], str] | None = None,
) -> list[Any]:
    """Call `function` with every item, over all cores, with a progress bar.

    joblib runs it: on a cluster, another joblib backend takes the same call.

    Args:
        function: Picklable.
        items: Its arguments.
        jobs: Number of processes; None for all cores.
        label: Label of the progress bar.
        show: Show the progress bar on a terminal.
        note: A short text about a result, for the progress bar.

    Returns:
        The results in the order of the items.
    """
    from joblib import Parallel, delayed
    from tqdm import tqdm

    items = list(items)
    processes = min(workers(jobs), max(1, len(items)))
    done: Iterable[Any]
    if processes == 1:
        done = map(function, items)
    else:
        # Not unordered: joblib has that from 1.4 on, Ubuntu 24.04 ships 1.3.
        parallel = Parallel(n_jobs=processes, return_as="generator")
        done = parallel(delayed(function)(item) for item in items)
    results = []
    with tqdm(total=len(items), desc=label, disable=None if show else True, leave=False) as bar:
        for result in done:
            results.append(result)
            if note is not None:
                bar.set_postfix_str(note(result), refresh=False)
            bar.update()
    return results
