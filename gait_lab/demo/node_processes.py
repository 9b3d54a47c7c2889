"""Both nodes as processes of this run, ended with it whatever happens."""

import contextlib
import ctypes
import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType

MODULES = {"sim_bridge": "sim_bridge.ros.main", "gait": "nao_lipm_gait.ros.main"}
END_TIME = 8.0
"""[s] that a node has to end by itself."""
_PR_SET_PDEATHSIG = 1


def _end_with_parent() -> None:
    """Linux: a killed parent takes its children along. Elsewhere only a clean end does."""
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)


class NodeProcesses:
    """The nodes `sim_bridge` and `gait`; their logs go to files."""

    def __init__(self, environment: Mapping[str, str], logs: Path) -> None:
        self._environment = dict(environment)
        self._logs = logs
        self._processes: dict[str, subprocess.Popen[bytes]] = {}

    def start(self, name: str, parameters: Mapping[str, object]) -> None:
        """Start a node with ROS parameters."""
        arguments: list[str] = []
        for key, value in parameters.items():
            text = str(value).lower() if isinstance(value, bool) else str(value)
            arguments += ["-p", f"{key}:={text}"]
        with self.log(name).open("wb") as log:
            self._processes[name] = subprocess.Popen(
                [sys.executable, "-m", MODULES[name], "--ros-args", *arguments],
                env=self._environment,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,
                preexec_fn=_end_with_parent,
            )

    def log(self, name: str) -> Path:
        return self._logs / f"{name}.log"

    def ended(self) -> str | None:
        """Name and status of a node that ended by itself, None while all run."""
        for name, process in self._processes.items():
            status = process.poll()
            if status is not None:
                return f"{name} ended with status {status}"
        return None

    def stop(self) -> dict[str, int]:
        """End all nodes as Ctrl-C would, then harder; their exit statuses."""
        for process in self._processes.values():
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
        deadline = time.monotonic() + END_TIME
        for process in self._processes.values():
            try:
                process.wait(max(0.1, deadline - time.monotonic()))
            except subprocess.TimeoutExpired:
                with contextlib.suppress(ProcessLookupError):
                    os.killpg(process.pid, signal.SIGKILL)
                process.wait()
        statuses = {name: int(process.returncode) for name, process in self._processes.items()}
        self._processes.clear()
        return statuses

    def last_words(self, lines: int = 5) -> Sequence[str]:
        """The last lines of every log."""
        words = []
        for name in MODULES:
            if self.log(name).is_file():
                text = self.log(name).read_text(errors="replace").splitlines()
                words += [f"[{name}] {line}" for line in text[-lines:]]
        return words

    def __enter__(self) -> "NodeProcesses":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.stop()
