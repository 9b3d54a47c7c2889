"""Nodes as child processes that end with this process, however it ends."""

import contextlib
import ctypes
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from functools import partial
from pathlib import Path

from robot_core.errors import NaoGaitError

MODULES = {
    "sim_bridge": "sim_bridge.ros.main",
    "lola_server": "sim_bridge.lola.main",
    "lola_bridge": "lola_bridge.ros.main",
    "gait": "nao_lipm_gait.ros.main",
    "vision": "nao_soccer.ros.vision_main",
    "player": "nao_soccer.ros.player_main",
    "robot": "gait_lab.soccer.robot_main",
    "referee": "nao_soccer.ros.referee_main",
}
"""The modules of the nodes, by the names of their executables."""
END_TIME = 60.0
"""Time [s] that a node gets to end after SIGINT, before it is killed."""
PRIORITY = 50
"""Of SCHED_FIFO, as `chrt -f 50` sets it."""
_PR_SET_PDEATHSIG = 1


def empty_folder(out: Path, *names: str) -> None:
    """Make the folder of the results, without those of an earlier run: its bag and these files.

    What a user keeps beside them stays; logs are written anew.

    Raises:
        NaoGaitError: `bag` is no bag, or something cannot be removed.
    """
    bag = out / "bag"
    try:
        out.mkdir(parents=True, exist_ok=True)
        if bag.is_dir():
            if any(each.stem not in ("bag", "metadata") for each in bag.iterdir()):
                raise NaoGaitError("out", str(out), "a folder whose bag this command recorded")
            shutil.rmtree(bag)
        for name in names:
            (out / name).unlink(missing_ok=True)
    except OSError as error:
        raise NaoGaitError("out", str(out), f"a folder that can be written ({error})") from error


def end_with_parent(parent: int) -> None:
    """On Linux, have the kernel end this child when its parent is killed, or was just before."""
    signal.signal(signal.SIGTERM, signal.SIG_DFL)  # the parent's handler is no use here
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
        if os.getppid() != parent:
            os._exit(1)


@contextlib.contextmanager
def real_time_priority() -> Iterator[None]:
    """Run this process, and those that it starts meanwhile, with a real-time priority.

    Raises:
        PermissionError: This user may not.
    """
    before, usual = os.sched_getscheduler(0), os.sched_getparam(0)
    os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    try:
        yield
    finally:
        os.sched_setscheduler(0, before, usual)


def may_run_in_real_time() -> bool:
    """Whether this process may take a real-time priority."""
    try:
        with real_time_priority():
            return True
    except (PermissionError, AttributeError):  # not allowed; not on this system
        return False


class NodeProcesses(AbstractContextManager["NodeProcesses"]):
    """Nodes, with their output in log files."""

    def __init__(self, environment: Mapping[str, str], logs: Path) -> None:
        self._environment = dict(environment)
        self._logs = logs
        self._processes: dict[str, subprocess.Popen[bytes]] = {}
        self._started: list[str] = []

    def start(self, executable: str, parameters: Mapping[str, object], namespace: str = "") -> None:
        """Start a node.

        Args:
            executable: One of `MODULES`.
            parameters: ROS parameters; `NODE:NAME` of one node out of several.
            namespace: Namespace of the robot; "" for none.
        """
        arguments = ["-r", f"__ns:=/{namespace}"] if namespace else []
        name = f"{namespace}_{executable}" if namespace else executable
        for key, value in parameters.items():
            text = str(value).lower() if isinstance(value, bool) else str(value)
            arguments += ["-p", f"{key}:={text}"]
        self._started.append(name)
        with self.log(name).open("ab" if name in self._started[:-1] else "wb") as log:
            self._processes[name] = subprocess.Popen(
                [sys.executable, "-m", MODULES[executable], "--ros-args", *arguments],
                env=self._environment,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,
                preexec_fn=partial(end_with_parent, os.getpid()),
            )

    def log(self, name: str) -> Path:
        """Return the log file of a node."""
        return self._logs / f"{name}.log"

    def ended(self) -> str | None:
        """Return the name and status of a node that has ended; None while all run."""
        for name, process in self._processes.items():
            status = process.poll()
            if status is not None:
                return f"{name} ended with status {status}"
        return None

    def kill(self, name: str) -> None:
        """End a node at once; it does not count as ended by itself, and may be started again."""
        process = self._processes.pop(name)
        process.kill()
        process.wait()

    def pause(self, name: str, paused: bool) -> None:
        """Stop a node from running, or let it run on."""
        self._processes[name].send_signal(signal.SIGSTOP if paused else signal.SIGCONT)

    def stop(self) -> dict[str, int]:
        """End all nodes with SIGINT, then with SIGKILL; return their exit statuses."""
        for process in self._processes.values():
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
                process.send_signal(signal.SIGCONT)  # one that was paused
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

    def log_tails(self, lines: int = 5) -> Sequence[str]:
        """Return the last lines of every log."""
        tails = []
        for name in self._started:
            if self.log(name).is_file():
                text = self.log(name).read_text(errors="replace").splitlines()
                tails += [f"[{name}] {line}" for line in text[-lines:]]
        return tails

    def __exit__(self, *_: object) -> None:
        self.stop()
