"""Worker processes for trials: on this machine (loky) or on a Dask or Ray cluster.

All three give a future per trial. joblib.Parallel would run on the same three, but there a worker
that dies takes the whole call with it; a future takes one trial.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import Future
from typing import Any, Protocol

from nao_lipm_gait.errors import NaoGaitError

ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
"""One simulation per process keeps a core busy; threads below it would only fight."""
ATTEMPTS = 3
"""So often is a piece of work begun when its worker dies."""
IDLE_TIME = 600
"""[s] after which an idle local worker goes; longer than any pause between two trials."""


class Workers(Protocol):
    """Runs functions elsewhere. A future that raises has lost its worker."""

    count: int

    def submit(self, function: Callable[..., Any], *arguments: Any) -> "Future[Any]": ...

    def close(self) -> None: ...


class LokyWorkers:
    """Processes on this machine, by joblib's loky; replaced by themselves when they die."""

    def __init__(self, count: int) -> None:
        self.count = count

    def _executor(self) -> Any:
        try:
            from joblib.externals.loky import get_reusable_executor
        except ModuleNotFoundError:  # some distributions ship joblib without its copy
            from loky import get_reusable_executor

        # Gives a fresh one where the last one broke.
        return get_reusable_executor(max_workers=self.count, timeout=IDLE_TIME, env=ONE_THREAD)

    def submit(self, function: Callable[..., Any], *arguments: Any) -> "Future[Any]":
        try:
            future: Future[Any] = self._executor().submit(function, *arguments)
        except Exception as error:  # a worker died between the two calls: the trial is lost
            future = Future()
            future.set_exception(error)
        return future

    def close(self) -> None:
        self._executor().shutdown(wait=True, kill_workers=True)


class DaskWorkers:
    """A Dask cluster: the scheduler at `address`, or processes on this machine."""

    def __init__(self, count: int, address: str | None = None) -> None:
        from distributed import Client, LocalCluster

        self.count = count
        self._cluster = None
        if address is None:
            self._cluster = LocalCluster(  # type: ignore[no-untyped-call]
                n_workers=count, threads_per_worker=1, processes=True, dashboard_address=None
            )
        self._client = Client(address or self._cluster)  # type: ignore[no-untyped-call]
        # Retries are ours to count.
        self._pool = self._client.get_executor(pure=False, retries=0)

    def submit(self, function: Callable[..., Any], *arguments: Any) -> "Future[Any]":
        future: Future[Any] = self._pool.submit(function, *arguments)
        return future

    def close(self) -> None:
        self._client.close()
        if self._cluster is not None:
            self._cluster.close()  # type: ignore[no-untyped-call]


class RayWorkers:
    """A Ray cluster: the one at `address`, or processes on this machine."""

    def __init__(self, count: int, address: str | None = None) -> None:
        import ray

        self.count = count
        self._ray = ray
        if address is None:
            ray.init(num_cpus=count, include_dashboard=False, log_to_driver=False)
        else:
            ray.init(address=address, log_to_driver=False)
        self._call = ray.remote(max_retries=0, num_cpus=1)(_call)

    def submit(self, function: Callable[..., Any], *arguments: Any) -> "Future[Any]":
        future: Future[Any] = self._call.remote(function, *arguments).future()
        return future

    def close(self) -> None:
        self._ray.shutdown()


def _call(function: Callable[..., Any], *arguments: Any) -> Any:
    return function(*arguments)


BACKENDS = ("loky", "ray", "dask")


def run_all(
    workers: Workers,
    function: Callable[..., Any],
    calls: Sequence[tuple[Any, ...]],
    note: Callable[[], object] = lambda: None,
) -> list[Any]:
    """The function's results, in the order of the calls; begun again when a worker dies.

    Raises what the last of `ATTEMPTS` raised.
    """
    futures = [workers.submit(function, *call) for call in calls]
    results = []
    for call, first in zip(calls, futures, strict=True):
        future = first
        for _ in range(ATTEMPTS - 1):
            if future.exception() is None:
                break
            future = workers.submit(function, *call)
        results.append(future.result())
        note()
    return results


def check_backend(backend: str, address: str | None = None) -> None:
    """NaoGaitError for an unknown backend, or an address where it means nothing."""
    if backend not in BACKENDS:
        raise NaoGaitError("backend", backend, ", ".join(BACKENDS))
    if backend == "loky" and address is not None:
        raise NaoGaitError("address", address, "only with --backend ray or dask")


def make_workers(backend: str, count: int, address: str | None = None) -> Workers:
    """Started workers; `address` of a running cluster, for Ray and Dask."""
    check_backend(backend, address)
    if backend == "loky":
        return LokyWorkers(count)
    if backend == "dask":
        return DaskWorkers(count, address)
    return RayWorkers(count, address)
