"""UDP sockets for team messages and the GameController; by default on this machine alone.

All players of one machine listen on one port, so what is sent must reach all of them: it is
broadcast, by default on the loopback network only.
"""

import contextlib
import socket
from collections.abc import Iterator

from robot_core.errors import NaoGaitError

LOCAL = "127.255.255.255"
"""Broadcast address of the loopback network: nothing leaves this machine, nothing comes in."""
LARGEST = 2048
"""[bytes] Longer packets are cut, and then refused by their length."""
BURST = 100
"""Number of packets that are read at once; the rest waits."""


class UdpLink:
    """A socket that listens on a port and broadcasts to one; it never blocks.

    `address` is that of a broadcast, or 0.0.0.0 for every network. `target_port` None = `port`.

    Raises:
        NaoGaitError: The port cannot be opened.
    """

    def __init__(
        self,
        port: int,
        address: str = LOCAL,
        target_port: int | None = None,
    ) -> None:
        self._target = (address, port if target_port is None else target_port)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
            self._socket.setblocking(False)
            self._socket.bind((address, port))
        except (OSError, OverflowError) as error:
            self._socket.close()
            raise NaoGaitError(
                "UDP address", f"{address}:{port}", f"a free one ({error})"
            ) from error

    def send(self, data: bytes) -> None:
        """Send; a network that is down loses the packet."""
        with contextlib.suppress(OSError):
            self._socket.sendto(data, self._target)

    def send_to(self, data: bytes, host: str) -> None:
        """Send to one address, on the same port; as `send`."""
        with contextlib.suppress(OSError):
            self._socket.sendto(data, (host, self._target[1]))

    def received(self) -> Iterator[tuple[bytes, str]]:
        """The packets that have come, and the address of each sender."""
        for _ in range(BURST):
            try:
                data, sender = self._socket.recvfrom(LARGEST)
            except OSError:
                return
            yield data, sender[0]

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()
