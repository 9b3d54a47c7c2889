"""The robot's end of LoLA's socket: one client, frames out, commands in."""

import contextlib
import os
import select
import socket
import stat
from typing import Any

from lola_bridge.codec import COMMAND_BYTES, LolaCommand, command_stream, read_command
from robot_core.errors import NaoGaitError

CHUNK = 65536


class LolaSocket:
    """Listens at a path and serves one client at a time; others wait until it has gone.

    Attributes:
        unanswered: Frames that the client has not answered yet; 0 without a client.
    """

    def __init__(self, path: str) -> None:
        """Listen.

        Args:
            path: A file that is no socket, or at which another server listens, is refused.

        Raises:
            NaoGaitError: The path cannot be used.
        """
        self._path = path
        self._listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            _remove_left_over(path)
            self._listener.bind(path)
        except OSError as error:
            self._listener.close()
            reason = error.strerror or str(error)
            raise NaoGaitError("socket", path, f"a path for a new socket ({reason})") from error
        self._listener.listen(4)
        self._listener.setblocking(False)
        self._client: socket.socket | None = None
        self._parser: Any = None
        self._errors: list[str] = []
        self.unanswered = 0

    @property
    def connected(self) -> bool:
        """Whether there is a client."""
        return self._client is not None

    def send(self, frame: bytes) -> bool:
        """Send a frame; False if there is no client, or it does not read."""
        if self._client is None:
            return False
        try:
            sent = self._client.send(frame)
        except BlockingIOError:
            self._errors.append("the client does not read: frame dropped")
            return False
        except OSError as error:
            self._drop(error.strerror or str(error))
            return False
        if sent < len(frame):
            self._drop("the client does not read")
            return False
        self.unanswered += 1
        return True

    def wait(self, seconds: float) -> list[LolaCommand]:
        """Wait for bytes or a new client, and return the commands that are complete.

        Args:
            seconds: Longest time to wait.
        """
        sockets = [self._listener if self._client is None else self._client]
        readable, _, _ = select.select(sockets, [], [], max(0.0, seconds))
        if not readable:
            return []
        if self._client is None:
            self._accept()
            return []
        try:
            data = self._client.recv(CHUNK)
        except BlockingIOError:
            return []
        except OSError as error:
            self._drop(error.strerror or str(error))
            return []
        if not data:
            self._drop("the client has gone")
            return []
        return self._read(data)

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            self._client, _ = self._listener.accept()
            self._client.setblocking(False)
            self._parser = command_stream()

    def _read(self, data: bytes) -> list[LolaCommand]:
        commands = []
        try:
            # A client that was held up answers many frames at once: more than the parser holds.
            for start in range(0, len(data), COMMAND_BYTES):
                self._parser.feed(data[start : start + COMMAND_BYTES])
                for found in self._parser:
                    self.unanswered = max(0, self.unanswered - 1)
                    try:
                        commands.append(read_command(found))
                    except NaoGaitError as error:
                        self._errors.append(f"{error}; command ignored")
        except Exception as error:  # what MessagePack raises for garbage is not one class
            self._drop(f"no MessagePack ({type(error).__name__}: {str(error)[:60]})")
        return commands

    def _drop(self, reason: str) -> None:
        if self._client is not None:
            self._client.close()
            self._client, self.unanswered = None, 0
            self._errors.append(f"connection closed: {reason}")

    def take_errors(self) -> list[str]:
        """What was wrong since the last call."""
        errors, self._errors = self._errors, []
        return errors

    def close(self) -> None:
        """Close everything and remove the path."""
        if self._client is not None:
            self._client.close()
        self._listener.close()
        with contextlib.suppress(OSError):
            os.unlink(self._path)


def _remove_left_over(path: str) -> None:
    """Remove the socket of a server that was killed."""
    try:
        mode = os.stat(path).st_mode
    except FileNotFoundError:
        return
    if not stat.S_ISSOCK(mode):
        raise NaoGaitError("socket", path, "a path without a file")
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        try:
            probe.connect(path)
        except ConnectionRefusedError:
            os.unlink(path)
            return
    raise NaoGaitError("socket", path, "a path at which no other server listens")
