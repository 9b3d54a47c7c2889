"""Processes that run jobs; a job whose process dies is begun again in a new one."""

import multiprocessing
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import Any

from robot_core.errors import NaoGaitError, one_line

ATTEMPTS = 3
"""How often a job is begun at most."""


@dataclass(slots=True)
class _Job:
    key: Any
    call: tuple[Any, ...]
    attempts: int = 0


@dataclass(frozen=True, slots=True)
class Outcome:
    """The result of a job, or in one line why there is none."""

    key: Any
    result: Any = None
    error: str | None = None


class Workers(AbstractContextManager["Workers"]):
    """A number of processes, each with one job at a time; a context manager that ends them."""

    def __init__(self, count: int) -> None:
        self.count = count
        self._open: deque[_Job] = deque()
        self._busy: dict[Connection, _Job] = {}
        self._idle: list[Connection] = []
        self._processes: dict[Connection, Any] = {}

    def __exit__(self, *_: object) -> None:
        for process in self._processes.values():
            process.kill()
            process.join()

    def submit(self, key: Any, function: Callable[..., Any], *arguments: Any) -> None:
        """Run a picklable function as soon as a process is free."""
        self._open.append(_Job(key, (function, *arguments)))
        self._begin()

    def results(self) -> Iterator[Outcome]:
        """Yield the jobs as they end, until none is left; more may be submitted meanwhile."""
        while self._busy or self._open:
            for ready in wait(list(self._busy)):
                connection: Any = ready
                job = self._busy.pop(connection)
                try:
                    result, error = connection.recv()
                    self._idle.append(connection)
                except (EOFError, ConnectionError):  # the process is gone
                    self._processes.pop(connection).join()
                    if job.attempts < ATTEMPTS:
                        self._open.appendleft(job)
                        continue
                    result, error = None, f"its process died {ATTEMPTS} times"
                self._begin()
                yield Outcome(job.key, result, error)
            self._begin()

    def map(self, function: Callable[..., Any], calls: Sequence[tuple[Any, ...]]) -> Iterator[Any]:
        """Yield the results in the order of the calls; NaoGaitError if one has none.

        Whoever stops before the last one ends the jobs that are left.
        """
        for i, call in enumerate(calls):
            self.submit(i, function, *call)
        early: dict[int, Any] = {}
        following = 0
        try:
            for outcome in self.results():
                if outcome.error is not None:
                    raise NaoGaitError("walk", outcome.error, "one that ends; --resume tries again")
                early[outcome.key] = outcome.result
                while following in early:
                    yield early.pop(following)
                    following += 1
        finally:
            self._drop()

    def _drop(self) -> None:
        """End what runs or waits: its result must not reach the next caller."""
        self._open.clear()
        for connection in self._busy:
            connection.close()
            process = self._processes.pop(connection)
            process.kill()
            process.join()
        self._busy.clear()

    def _begin(self) -> None:
        while self._open and len(self._busy) < self.count:
            job = self._open.popleft()
            job.attempts += 1
            connection = self._idle.pop() if self._idle else self._start()
            self._busy[connection] = job
            with suppress(OSError):  # it died while idle: `results` sees the end of the connection
                connection.send(job.call)

    def _start(self) -> Connection:
        # Not forked: a child must not inherit the database and the threads of numerical libraries.
        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe()
        process = context.Process(target=_serve, args=(theirs,), daemon=True)
        process.start()
        theirs.close()
        self._processes[ours] = process
        return ours


def _serve(connection: Connection) -> None:
    """Run jobs until the other end is closed."""
    try:
        while True:
            function, *arguments = connection.recv()
            answer: tuple[Any, str | None]
            try:
                answer = function(*arguments), None
            except Exception as error:  # a corner of the ranges that fails costs its trial only
                answer = None, one_line(error)
            connection.send(answer)
    except (EOFError, ConnectionError, KeyboardInterrupt):
        return
