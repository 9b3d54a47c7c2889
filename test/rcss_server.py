"""A small server in a thread that speaks rcsssmj's protocol, without physics."""

import contextlib
import socket
import threading
from collections.abc import Sequence

from rcss_bridge.codec import Unframer, framed
from rcss_bridge.joints import ServerRobot
from rcss_bridge.sexpr import Expression, parse, write


def cycle_message(
    robot: ServerRobot,
    time: float,
    *,
    angles: Sequence[float] | None = None,
    gyro: Sequence[object] = (0.0, 0.0, 0.0),
    force: Sequence[object] = (0.0, 0.0, 9.81),
    mode: str = "PlayOn",
    more: Sequence[object] = (),
) -> bytes:
    """A cycle's message; angles [deg] in the order of the effectors, gyro in deg/s."""
    names = [robot.sensor(joint) for joint in robot.effectors]
    values = [0.0] * len(names) if angles is None else angles
    expressions: list[object] = [
        ["time", ["now", time]],
        ["GS", ["t", 1.5], ["pm", mode], ["tl", "ours"], ["tr", "theirs"], ["sl", 2], ["sr", 1]],
        ["quat", ["n", "torso_quat"], ["q", 1.0, 0.0, 0.0, 0.0]],
        ["pos", ["n", "torso_pos"], ["p", 77.5, -66.5, 55.5]],
        ["GYR", ["n", "torso_gyro"], ["rt", *gyro]],
        ["ACC", ["n", "torso_acc"], ["a", *force]],
    ]
    expressions += [
        ["HJ", ["n", f"q_{name}"], ["ax", value], ["vx", 0.0]]
        for name, value in zip(names, values, strict=True)
    ]
    return write([*expressions, *more])


class FakeServer:
    """Accepts players one after the other and lets each do some cycles; use `with`.

    Args:
        cycles: Messages for each player that connects, in order; None refuses it.

    Attributes:
        port: Where it listens.
        inits: The first message of each player.
        answers: For each player what it answered.
    """

    def __init__(self, *cycles: Sequence[bytes] | None) -> None:
        self._cycles = cycles
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        self.inits: list[Expression] = []
        self.answers: list[list[Expression]] = []
        self._thread = threading.Thread(target=self._serve, daemon=True)

    def __enter__(self) -> "FakeServer":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        with contextlib.suppress(OSError):  # its thread has closed it
            self._listener.shutdown(socket.SHUT_RDWR)  # which wakes a thread that accepts
        self._thread.join()

    def _serve(self) -> None:
        for cycles in self._cycles:
            try:
                player, _ = self._listener.accept()
            except OSError:
                return
            with player:
                unframer = Unframer()
                self.inits.append(parse(_message(player, unframer)))
                self.answers.append([])
                with contextlib.suppress(OSError):  # it has left, and its system says so
                    for message in cycles or ():
                        player.sendall(framed(message))
                        answer = _message(player, unframer)
                        if not answer:  # the player has left
                            break
                        self.answers[-1].append(parse(answer))
        self._listener.close()


def _message(player: socket.socket, unframer: Unframer) -> bytes:
    while True:
        message = unframer.next()
        if message is not None:
            return message
        data = player.recv(1 << 16)
        if not data:
            return b""
        unframer.add(data)
