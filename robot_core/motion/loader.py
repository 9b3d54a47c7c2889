"""Loads motion files beside the thread that asks for them."""

from pathlib import Path
from queue import SimpleQueue
from threading import Thread

from robot_core.errors import NaoGaitError, one_line
from robot_core.motion.keyframes import Motion
from robot_core.motion.motion_file import load_motions
from robot_core.robot import RobotDescription


class _Load:
    """One file that is loaded, or was wanted before another request."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.wanted = True
        self.result: Motion | NaoGaitError | None = None


class MotionLoader:
    """Loads the motion file that was requested last, on a thread of its own.

    A control loop asks with `request` and looks with `take` in every tick; neither waits.
    """

    def __init__(self, robot: RobotDescription) -> None:
        self._robot = robot
        self._queue: SimpleQueue[_Load] = SimpleQueue()
        self._thread: Thread | None = None
        self._load: _Load | None = None

    @property
    def busy(self) -> bool:
        """A requested file has not been taken yet."""
        return self._load is not None

    def request(self, name: str) -> None:
        """Load a file in place of one that has not been taken yet."""
        self.cancel()
        self._load = _Load(name)
        self._queue.put(self._load)
        if self._thread is None:  # a daemon: a file that hangs must not delay the end
            self._thread = Thread(target=self._work, name="motion files", daemon=True)
            self._thread.start()

    def cancel(self) -> str | None:
        """Forget the requested file; returns its name, None without one."""
        load, self._load = self._load, None
        if load is None:
            return None
        load.wanted = False
        return load.name

    def take(self) -> tuple[str, Motion | NaoGaitError] | None:
        """The requested file and its first motion, or why it was refused; None until then."""
        load = self._load
        if load is None or load.result is None:
            return None
        self._load = None
        return load.name, load.result

    def _work(self) -> None:
        while True:
            load = self._queue.get()
            if load.wanted:
                load.result = self._loaded(load.name)

    def _loaded(self, name: str) -> Motion | NaoGaitError:
        try:
            return load_motions(Path(name), self._robot)[0]
        except NaoGaitError as error:
            return error
        except Exception as error:
            return NaoGaitError(f"motion file {name}", one_line(error), "a motion file")
