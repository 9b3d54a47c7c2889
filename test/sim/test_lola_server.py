"""The simulated robot's end of LoLA's socket."""

import socket
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from lola_bridge.codec import (
    JOINTS,
    LolaCommand,
    decode_sensors,
    encode_command,
    encode_sensors,
)
from lola_frames import STAND, sensors
from robot_core.errors import NaoGaitError
from robot_core.robot import load_robot
from sim_bridge.force_sensors import sole_loads
from sim_bridge.lola.body import HOLD_CYCLES, LolaBody
from sim_bridge.lola.server import LolaSocket
from sim_bridge.plant import Plant
from sim_bridge.world import World

ROBOT = load_robot("nao_v6")
GRAVITY = 9.81
KNEE = JOINTS.index("LKneePitch")
COMMAND = encode_command(LolaCommand(STAND, [1.0] * 25))


@pytest.fixture
def server(tmp_path: Path) -> Iterator[LolaSocket]:
    server = LolaSocket(str(tmp_path / "lola"))
    yield server
    server.close()


@pytest.fixture
def client(server: LolaSocket, tmp_path: Path) -> Iterator[socket.socket]:
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as client:
        client.connect(str(tmp_path / "lola"))
        client.setblocking(False)
        server.wait(1.0)
        yield client


def test_a_frame_is_answered_by_a_command_in_pieces(
    server: LolaSocket, client: socket.socket
) -> None:
    frame = encode_sensors(sensors())
    assert server.send(frame)
    assert client.recv(2000) == frame
    client.send(COMMAND[:100])
    assert server.wait(1.0) == []
    assert server.unanswered == 1
    client.send(COMMAND[100:])
    (found,) = server.wait(1.0)
    assert found.position == pytest.approx(STAND, abs=1e-6)
    assert server.unanswered == 0


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"\x81\xa4Tail\x91\xca\0\0\0\0", "LoLA command key: got 'Tail'"),
        (encode_command(LolaCommand(STAND, None)).replace(b"\xdc\0\x19", b"\xdc\0\x18"), "LoLA"),
        (b"\xc1\xc1\xc1", "no MessagePack"),
    ],
)
def test_a_bad_command_is_said(
    server: LolaSocket, client: socket.socket, data: bytes, reason: str
) -> None:
    client.send(data + COMMAND)
    server.wait(1.0)
    assert any(reason in error for error in server.take_errors())


def test_a_client_that_goes_makes_room_for_the_next(
    server: LolaSocket, client: socket.socket, tmp_path: Path
) -> None:
    client.close()
    server.wait(1.0)
    assert not server.connected
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as second:
        second.connect(str(tmp_path / "lola"))
        server.wait(1.0)
        assert server.send(encode_sensors(sensors()))


def test_paths_that_cannot_be_used_are_refused(server: LolaSocket, tmp_path: Path) -> None:
    with pytest.raises(NaoGaitError, match="no other server"):
        LolaSocket(str(tmp_path / "lola"))
    (tmp_path / "file").write_text("")
    with pytest.raises(NaoGaitError, match="a path without a file"):
        LolaSocket(str(tmp_path / "file"))
    with pytest.raises(NaoGaitError, match="socket"):
        LolaSocket(str(tmp_path / "no" / "folder"))


def test_the_socket_of_a_killed_server_is_replaced(tmp_path: Path) -> None:
    path = str(tmp_path / "left")
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as killed:
        killed.bind(path)
    LolaSocket(path).close()


@pytest.fixture
def world(mujoco_only: None, reference: Plant) -> Iterator[World]:
    with World.single(
        ROBOT, reference, -1, engine="mujoco", control_period=0.012
    ) as world:
        yield world


def test_a_robot_at_rest_reads_as_a_real_one_does(world: World) -> None:
    body = LolaBody(world.robot, 0.012)
    assert body.sensors() is None, "no reading has passed the delay"
    for _ in range(100):
        world.step()
        found = body.sensors()
    assert found is not None
    found = decode_sensors(encode_sensors(found))
    assert found.accelerometer[2] == pytest.approx(-GRAVITY, abs=0.6)
    assert sum(found.fsr) == pytest.approx(5.359, abs=0.15)
    assert found.position == pytest.approx(STAND, abs=0.03)
    assert found.angles == pytest.approx((0.0, 0.0), abs=0.03)


def test_gyroscope_has_three_axes(world: World) -> None:
    body = LolaBody(world.robot, 0.012)
    for _ in range(20):
        world.step()
        found = body.sensors()
    assert found is not None
    assert 0.0 < abs(found.gyroscope[2]) < 0.1, "noise of a yaw gyro, which an H21 does not have"


def test_the_robot_is_held_until_its_legs_carry_it(world: World) -> None:
    body = LolaBody(world.robot, 0.012)
    for share in (0.0, 0.3):
        body.command(LolaCommand(STAND, [share] * 25))
        assert body.held
    for _ in range(50):
        world.step()
    assert world.robot.truth().torso_position[2] > 0.28
    body.command(LolaCommand(STAND, [0.8] * 25))
    assert not body.held


def test_without_commands_it_holds_the_last_one_and_then_has_no_stiffness(world: World) -> None:
    body = LolaBody(world.robot, 0.012)
    body.command(LolaCommand(STAND, [1.0] * 25))
    for _ in range(HOLD_CYCLES):
        body.command(None)
        world.step()
    assert body.sensors().stiffness[KNEE] == 1.0
    body.command(None)
    assert world.robot.last_command.stiffness == 0.0
    assert body.sensors().stiffness[KNEE] == 0.0


def test_four_sensors_give_the_wrench_of_the_sole() -> None:
    places = np.array(ROBOT.force_sensors[0])
    rng = np.random.default_rng(0)
    for _ in range(50):
        shares = rng.dirichlet((1.0, 1.0, 1.0, 1.0))
        force, center = rng.uniform(5.0, 60.0), shares @ places
        wrench = np.array((0, 0, force, center[1] * force, -center[0] * force, 0))
        loads = np.array(sole_loads(wrench, ROBOT.force_sensors[0]))
        assert (loads >= 0.0).all()
        assert loads.sum() == pytest.approx(force)
        assert loads @ places / force == pytest.approx(center, abs=1e-3)


def test_a_sole_in_the_air_or_on_its_edge_has_no_negative_load() -> None:
    places = ROBOT.force_sensors[1]
    assert sole_loads(np.zeros(6), places) == [0.0] * 4
    loads = sole_loads(np.array((0.0, 0.0, 20.0, 0.0, -20.0 * 0.2, 0.0)), places)
    assert min(loads) >= 0.0
    assert sum(loads) == pytest.approx(20.0)
    assert loads[2] == loads[3] == 0.0
