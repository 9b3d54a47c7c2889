"""Worker processes for trials: on this machine (loky), or on a Dask or Ray cluster.

All three return a future per trial, so that a worker that dies costs one trial. With
`joblib.Parallel` on the same backends it would cost the whole call.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import Future
from importlib.util import find_spec
from typing import Any, Protocol

from robot_core.errors import NaoGaitError

ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
"""One simulation per process uses a whole core; more threads would compete for it."""
ATTEMPTS = 3
"""Number of attempts if a worker dies."""
IDLE_TIME = 600
"""Time [s] after which an idle local worker ends; longer than a pause between two trials."""


class Workers(Protocol):
    """Runs functions in other processes. A future that raises has lost its worker.

    Attributes:
        count: Number of processes.
    """

    count: int

    def submit(self, function: Callable[..., Any], *arguments: Any) -> "Future[Any]":
        """Run a function with arguments; return its future."""

    def close(self) -> None:
        """End the workers."""


class LokyWorkers:
    """Processes on this machine by joblib's loky, which replaces those that die."""

    def __init__(self, count: int) -> None:
        self.count = count

    def _executor(self) -> Any:
        try:
            from joblib.externals.loky import get_reusable_executor
        except ModuleNotFoundError:  # some distributions ship joblib without its copy
            from loky import get_reusable_executor

        # Returns a new executor if the last one broke.
        return get_reusable_executor(max_workers=self.count, timeout=IDLE_TIME, env=ONE_THREAD)

    def submit(self, function: Callable[..., Any], *arguments: Any) -> "Future[Any]":
        """Run a function with arguments; return its future."""
        try:
            future: Future[Any] = self._executor().submit(function, *arguments)
        except Exception as error:  # a worker died between the two calls: this trial is lost
            future = Future()
            future.set_exception(error)
        return future

    def close(self) -> None:
        """End the workers."""
        self._executor().shutdown(wait=True, kill_workers=True)


class DaskWorkers:
    """A Dask cluster: the scheduler at `address`, or processes on this machine.

    Args:
        count: Number of processes.
        address: Address of a running scheduler.
    """

    def __init__(self, count: int, address: str | None = None) -> None:
        from distributed import Client, LocalCluster

        self.count = count
        self._cluster = None
        if address is None:
            self._cluster = LocalCluster(  # type: ignore[no-untyped-call]
                n_workers=count, threads_per_worker=1, processes=True, dashboard_address=None
            )
        self._client = Client(address or self._cluster)  # type: ignore[no-untyped-call]
        # The search counts the attempts.
        self._pool = self._client.get_executor(pure=False, retries=0)

    def submit(self, function: Callable[..., Any], *arguments: Any) -> "Future[Any]":
        """Run a function with arguments; return its future."""
        future: Future[Any] = self._pool.submit(function, *arguments)
        return future

    def close(self) -> None:
        """Disconnect, and end a cluster that was started here."""
        self._client.close()
        if self._cluster is not None:
            self._cluster.close()  # type: ignore[no-untyped-call]


class RayWorkers:
    """A Ray cluster: the one at `address`, or processes on this machine.

    Args:
        count: Number of processes.
        address: Address of a running cluster.
    """

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
        """Run a function with arguments; return its future."""
        future: Future[Any] = self._call.remote(function, *arguments).future()
        return future

    def close(self) -> None:
        """Disconnect, and end a cluster that was started here."""
        self._ray.shutdown()


def _call(function: Callable[..., Any], *arguments: Any) -> Any:
    return function(*arguments)


BACKENDS = ("loky", "ray", "dask")
_PACKAGES = {"ray": "ray", "dask": "distributed"}


def run_all(
    workers: Workers,
    function: Callable[..., Any],
    calls: Sequence[tuple[Any, ...]],
    note: Callable[[], object] = lambda: None,
) -> list[Any]:
    """Run a function for each call, and repeat a call whose worker dies.

    Args:
        workers: The processes.
        function: The function.
        calls: Arguments of each call.
        note: Called after each result.

    Returns:
        The results in the order of the calls.

    Raises:
        Exception: What the last attempt raised.
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
    """Raise NaoGaitError for an unknown backend, one without its package, or a useless address."""
    if backend not in BACKENDS:
        raise NaoGaitError("backend", backend, ", ".join(BACKENDS))
    package = _PACKAGES.get(backend)
    if package is not None and find_spec(package) is None:
        allowed = f"loky; or install {package}, in the checkout: pip install '.[{backend}]'"
        raise NaoGaitError("backend", backend, allowed)
    if backend == "loky" and address is not None:
        raise NaoGaitError("address", address, "only with --backend ray or dask")


def make_workers(backend: str, count: int, address: str | None = None) -> Workers:
    """Start workers; `address`: of a running Ray or Dask cluster, None to start one here."""
    check_backend(backend, address)
    if backend == "loky":
        return LokyWorkers(count)
    if backend == "dask":
        return DaskWorkers(count, address)
    return RayWorkers(count, address)
