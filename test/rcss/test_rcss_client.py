"""A player's connection, against a small server that speaks the protocol."""

import socket

import pytest

from rcss_bridge import codec
from rcss_bridge.client import RETRY, Client, ServerGoneError
from rcss_bridge.joints import ROBOTS
from rcss_server import FakeServer, cycle_message
from robot_core.errors import NaoGaitError

K1 = ROBOTS["K1"]
CYCLES = [cycle_message(K1, 0.02 * count) for count in range(5)]


def play(client: Client, cycles: int) -> list[float]:
    times = []
    for _ in range(cycles):
        times.append(codec.percepts(client.receive()).time)
        client.send(codec.actions({}))
    return times


def closed_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return int(listener.getsockname()[1])


def test_each_message_gets_one_answer():
    with FakeServer(CYCLES) as server, Client("127.0.0.1", server.port, "K1", "ours", 3) as client:
        client.connect()
        assert play(client, 5) == pytest.approx([0.0, 0.02, 0.04, 0.06, 0.08])
    assert server.inits == [[["init", "K1", "ours", "3"]]]
    assert server.answers == [[[["syn"]]] * 5]


def test_a_player_that_is_dropped_comes_back():
    server = FakeServer(CYCLES[:2], CYCLES)
    with server, Client("127.0.0.1", server.port, "K1", "ours", 3) as client:
        client.connect()
        play(client, 2)
        with pytest.raises(ServerGoneError, match="closed the connection"):
            client.receive()
        assert not client.connected
        client.connect()
        assert len(play(client, 5)) == 5


def test_a_refused_player_is_told_why_it_may_be():
    with FakeServer(None) as server, Client("127.0.0.1", server.port, "K9", "ours", 3) as client:
        client.connect()
        with pytest.raises(ServerGoneError, match=r"refused.*number that is free"):
            client.receive()


def test_a_silent_server_is_given_up():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
        with Client("127.0.0.1", port, "K1", "ours", 3, timeout=0.05) as client:
            client.connect()
            with pytest.raises(ServerGoneError, match="silent"):
                client.receive()


def test_without_a_server_it_is_tried_as_long_as_asked():
    waits: list[float] = []
    client = Client("127.0.0.1", closed_port(), "K1", "ours", 3)
    with pytest.raises(ServerGoneError, match=r"127\.0\.0\.1"):
        client.connect_within(3 * RETRY, waits.append)
    assert waits == [RETRY] * 3


def test_what_is_no_server_is_noticed():
    listener = socket.create_server(("127.0.0.1", 0))
    client = Client("127.0.0.1", listener.getsockname()[1], "K1", "ours", 3)
    with listener, client:
        client.connect()
        other, _ = listener.accept()
        with other:
            other.sendall(b"HTTP/1.1 400 Bad Request")
            with pytest.raises(NaoGaitError, match="at most"):
                client.receive()


@pytest.mark.parametrize("number", [0, 100, -1])
def test_numbers_that_the_server_would_change_are_refused(number: int):
    with pytest.raises(NaoGaitError, match="1 to 99"):
        Client("127.0.0.1", 1, "K1", "ours", number)


def test_without_a_connection_nothing_is_sent():
    with pytest.raises(ServerGoneError, match="not connected"):
        Client("127.0.0.1", 1, "K1", "ours", 1).send(b"(syn)")
