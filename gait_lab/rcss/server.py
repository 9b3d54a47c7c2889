"""The server on this machine, in a Python environment of its own: it pins another MuJoCo."""

import math
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
from functools import partial
from pathlib import Path

from gait_lab.demo.node_processes import end_with_parent
from gait_lab.rcss.field import FIELD
from rcss_bridge.codec import framed
from robot_core.errors import NaoGaitError
from robot_core.geometry import quaternion_from_rpy
from robot_core.types import Pose6

VERSION = "0.2.1"
"""Of rcsssmj."""
STARTS_WITHIN = 120.0
"""[s] for which the server may take to listen."""
ENDS_WITHIN = 5.0
"""[s] after which a server that was asked to end is killed."""


def environment() -> Path:
    """Folder of the server's environment, which may not exist yet."""
    cache = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(cache) / "nao_lipm_gait" / f"rcsssmj-{VERSION}"


def is_installed() -> bool:
    """Whether the server can start."""
    return (environment() / "ready").exists()


def install() -> Path:
    """Install the server if it is not; the Python of its environment.

    Raises:
        NaoGaitError: It cannot be installed, for example without a network.
    """
    folder = environment()
    python = folder / "bin" / "python"
    if not is_installed():
        sys.stderr.write(f"installing rcsssmj {VERSION} into {folder}\n")
        for command in (
            [sys.executable, "-m", "venv", "--clear", str(folder)],
            [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check",
             f"rcsssmj=={VERSION}"],
        ):  # fmt: skip
            done = subprocess.run(command, capture_output=True, text=True)
            if done.returncode:
                lines = (done.stderr or done.stdout).strip().splitlines() or ["no reason given"]
                allowed = f"an environment in {folder} with rcsssmj=={VERSION} from PyPI"
                raise NaoGaitError("server", lines[-1], allowed)
        (folder / "ready").touch()
    return python


class Server:
    """A server without pace, which waits for every player in each cycle; use it with `with`.

    Raises:
        NaoGaitError: It cannot be installed, or does not start.
    """

    def __init__(self, *arguments: str) -> None:
        python = install()
        self._folder = tempfile.TemporaryDirectory(prefix="rcsssmj-")
        self._log = Path(self._folder.name, "server.log")
        self.port, self._monitor = _free_port(), _free_port()
        with self._log.open("wb") as log:
            self._process = subprocess.Popen(
                [str(python), launcher_file(), "--aport", str(self.port), "--mport",
                 str(self._monitor), "--no-render", "--no-realtime", "--sync", "--field", FIELD,
                 *arguments],
                cwd=self._folder.name, stdout=log, stderr=subprocess.STDOUT,
                preexec_fn=partial(end_with_parent, os.getpid()),
            )  # fmt: skip

    def __enter__(self) -> "Server":
        until = time.monotonic() + STARTS_WITHIN
        while time.monotonic() < until and self._process.poll() is None:
            with socket.socket() as probe:
                if probe.connect_ex(("127.0.0.1", self.port)) == 0:
                    return self
            time.sleep(0.2)
        reason = self.last_words
        self.__exit__()
        raise NaoGaitError("server", reason, f"one that listens within {STARTS_WITHIN:g} s")

    def __exit__(self, *_: object) -> None:
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGINT)
            try:
                self._process.wait(ENDS_WITHIN)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        self._folder.cleanup()

    def order(self, *commands: str) -> None:
        """Give orders as a monitor may: `(kickOff Left)`, `(ball (pos 0 0 0.11))`."""
        with socket.create_connection(("127.0.0.1", self._monitor), 10.0) as connection:
            for command in commands:
                connection.sendall(framed(command.encode()))

    def place(self, team: str, number: int, pose: Pose6) -> None:
        """Put a player's torso somewhere, its joints at zero.

        Args:
            team: Its team.
            number: Its number.
            pose: x, y, z [m], roll, pitch, yaw [rad] on the field.
        """
        x, y, z, w = quaternion_from_rpy(*pose[3:])
        numbers = " ".join(f"{each:.4f}" for each in (*pose[:3], w, x, y, z))
        self.order(f"(agent (unum {number}) (team {team}) (move3d {numbers}))")

    @property
    def joined(self) -> int:
        """How many players it has taken."""
        return self._log.read_text(errors="replace").count("joined the game")

    @property
    def cpu(self) -> float:
        """Processor time [s] that it has used; NaN where there is no /proc."""
        try:
            words = Path(f"/proc/{self._process.pid}/stat").read_text().rpartition(")")[2].split()
        except OSError:
            return math.nan
        return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")

    @property
    def last_words(self) -> str:
        """The last line of its log."""
        lines = self._log.read_text(errors="replace").strip().splitlines()
        return lines[-1] if lines else "it said nothing"


def launcher_file() -> str:
    """The script that starts the server."""
    return str(Path(__file__).with_name("launcher.py"))


def _free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return int(listener.getsockname()[1])
