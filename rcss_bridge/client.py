"""The connection of one player to the server: one message each cycle, one answer to it."""

import contextlib
import socket
import time
from collections.abc import Callable
from contextlib import AbstractContextManager

from rcss_bridge.codec import Unframer, framed, init
from robot_core.errors import NaoGaitError

TIMEOUT = 180.0
"""[s] that a server may be silent: it compiles its world for each player that comes or goes."""
RETRY = 0.5
"""[s] between two attempts to connect."""
_CHUNK = 1 << 16


class ServerGoneError(NaoGaitError):
    """The connection is over: the server has ended, or has dropped or refused the player."""


class Client(AbstractContextManager["Client"]):
    """A player's connection; use it as a context manager.

    Args:
        host: Of the server.
        port: Its port for players.
        robot: The server's name of the robot: `K1`.
        team: Name of the team, without spaces and brackets.
        number: The player's, 1 to 99; the server takes 1 for the goalkeeper.
        timeout: [s] of silence after which the server counts as gone.

    Attributes:
        heard: The server has sent something since the last connection.

    Raises:
        NaoGaitError: Team or number are not allowed.
    """

    def __init__(
        self,
        host: str,
        port: int,
        robot: str,
        team: str,
        number: int,
        timeout: float = TIMEOUT,
    ) -> None:
        if not 1 <= number <= 99:
            raise NaoGaitError("number", number, "1 to 99")
        self._init = framed(init(robot, team, number))
        self._address, self._timeout = (host, port), timeout
        self._who = f"{robot} {number} of {team}"
        self._socket: socket.socket | None = None
        self._unframer = Unframer()
        self.heard = False

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def connected(self) -> bool:
        """Whether there is a connection."""
        return self._socket is not None

    def fileno(self) -> int:
        """For `select`; -1 without a connection."""
        return -1 if self._socket is None else self._socket.fileno()

    def connect(self) -> None:
        """Connect and say who the player is.

        Raises:
            ServerGoneError: Nobody listens.
        """
        self.close()
        self.heard = False
        try:
            connection = socket.create_connection(self._address, self._timeout)
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            connection.sendall(self._init)
        except (OSError, UnicodeError) as error:  # UnicodeError: a name that no host can have
            raise self._gone(getattr(error, "strerror", None) or str(error)) from error
        self._socket, self._unframer = connection, Unframer()

    def connect_within(
        self, patience: float, wait: Callable[[float], None] = time.sleep
    ) -> None:
        """Connect; try again each `RETRY` for `patience` [s].

        Raises:
            ServerGoneError: Nobody has listened.
        """
        for attempts_left in range(max(0, round(patience / RETRY)), -1, -1):
            try:
                return self.connect()
            except ServerGoneError:
                if not attempts_left:
                    raise
            wait(RETRY)

    def receive(self) -> bytes:
        """The message of the next cycle.

        Raises:
            ServerGoneError: The connection is over, or nothing has come for the timeout.
            NaoGaitError: What comes is not the protocol.
        """
        while True:
            message = self._unframer.next()
            if message is not None:
                self.heard = True
                return message
            self._unframer.add(self._read())

    def _read(self) -> bytes:
        if self._socket is None:
            raise self._gone("not connected")
        try:
            data = self._socket.recv(_CHUNK)
        except TimeoutError as error:
            raise self._gone(f"silent for {self._timeout:g} s") from error
        except OSError as error:
            raise self._gone(error.strerror or str(error)) from error
        if data:
            return data
        if self.heard:
            raise self._gone("it has closed the connection")
        raise self._gone(
            "it has refused the player",
            "a number that is free, one of two teams with a place left, a robot of the server",
        )

    def send(self, message: bytes) -> None:
        """Answer a message.

        Raises:
            ServerGoneError: The connection is over.
        """
        if self._socket is None:
            raise self._gone("not connected")
        try:
            self._socket.sendall(framed(message))
        except OSError as error:
            raise self._gone(error.strerror or str(error)) from error

    def close(self) -> None:
        """End the connection; the server takes the robot off the field."""
        if self._socket is not None:
            with contextlib.suppress(OSError):
                self._socket.close()
        self._socket = None

    def _gone(self, reason: str, allowed: str = "a server that answers") -> ServerGoneError:
        self.close()
        host, port = self._address
        return ServerGoneError(f"server {host}:{port} for {self._who}", reason, allowed)
