"""Keys become commands; the terminal comes back whatever happens."""

import io
import math
import os
from collections.abc import Iterator
from typing import TextIO

import pytest

from gait_lab.drive import teleop
from gait_lab.drive.teleop import Driver, raw_terminal, read_keys, status_line
from gait_lab.ros_session import checked_namespace, checked_topics
from robot_core.errors import NaoGaitError
from robot_core.ros.process import StopRequest
from robot_core.types import STANDSTILL, VelocityCommand

termios = pytest.importorskip("termios")
pytest.importorskip("rclpy")


def after(keys: str) -> VelocityCommand:
    driver = Driver()
    for key in keys:
        driver = driver.press(key)
    return driver.command


@pytest.mark.parametrize(
    ("keys", "asked"),
    [
        ("9w", VelocityCommand(x=0.40)),
        ("9s", VelocityCommand(x=-0.33)),
        ("9a", VelocityCommand(y=0.20)),
        ("9d", VelocityCommand(y=-0.20)),
        ("9q", VelocityCommand(yaw=math.radians(100))),
        ("9e", VelocityCommand(yaw=-math.radians(100))),
        ("9W", VelocityCommand(x=0.40)),
        ("9wwww", VelocityCommand(x=0.40)),
        ("9wq", VelocityCommand(x=0.40, yaw=math.radians(100))),
        ("9wqd", VelocityCommand(0.40, -0.20, math.radians(100))),
        ("3w", VelocityCommand(x=0.40 / 3)),
        ("w3", VelocityCommand(x=0.40 / 3)),
        ("w0", VelocityCommand(x=0.40 * 5 / 9)),
        ("wz?\u00e9\u0663", VelocityCommand(x=0.40 * 5 / 9)),
        ("wqa ", STANDSTILL),
        ("ws", STANDSTILL),
        ("9wss", VelocityCommand(x=-0.33)),
        ("", STANDSTILL),
    ],
)
def test_keys(keys: str, asked: VelocityCommand) -> None:
    got = after(keys)
    assert (got.x, got.y, got.yaw) == pytest.approx((asked.x, asked.y, asked.yaw))


def test_the_status_line_shows_the_commanded_speed_and_the_state() -> None:
    line = status_line(Driver(x=1, yaw=-1, level=9).command, "walk left", 9)
    assert "+40.0 cm/s" in line
    assert "-100.0 deg/s" in line
    assert line.endswith("speed 9/9   gait: walk left")
    assert "speed" not in status_line(STANDSTILL, "stand")


def test_the_screen_says_once_that_nobody_listens(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [10.0]
    monkeypatch.setattr(teleop.time, "monotonic", lambda: now[0])
    monkeypatch.setenv("ROS_DOMAIN_ID", "7")
    stream = io.StringIO()
    screen = teleop.Screen(stream, "/cmd_vel (Twist)")
    for now[0], subscribers in ((12.9, 0), (13.0, 0), (20.0, 0), (21.0, 1), (23.9, 0), (24.0, 0)):
        screen.show("status", subscribers)
    alone = "nobody listens to /cmd_vel (Twist), ROS_DOMAIN_ID 7: does a gait run?"
    assert stream.getvalue().splitlines() == ["status", alone, alone]


@pytest.fixture
def terminal() -> Iterator[tuple[int, TextIO]]:
    keyboard, screen = os.openpty()
    with os.fdopen(keyboard, "wb", buffering=0), os.fdopen(screen, "r") as stream:
        yield keyboard, stream


def test_keys_arrive_without_return_and_without_echo(terminal: tuple[int, TextIO]) -> None:
    keyboard, stream = terminal
    with raw_terminal(stream) as descriptor:
        os.write(keyboard, b"wq")
        assert read_keys(descriptor, 60.0) == "wq"
        assert read_keys(descriptor, 0.0) == ""


def test_the_letters_of_arrow_keys_are_ignored(terminal: tuple[int, TextIO]) -> None:
    keyboard, stream = terminal
    with raw_terminal(stream) as descriptor:
        os.write(keyboard, b"\x1b[D")  # arrow left holds a D
        assert read_keys(descriptor, 60.0) == ""
        os.write(keyboard, b"w\x1b[1;5C \x1bOPq\x1b")  # the stop key between two of them
        assert read_keys(descriptor, 60.0) == "w q"


@pytest.mark.parametrize("name", ["1bad", "a b", "robot//left"])
def test_invalid_ros_names_are_refused(name: str) -> None:
    with pytest.raises(NaoGaitError, match="namespace: got '" + name):
        checked_namespace(name)
    with pytest.raises(NaoGaitError, match="topics: got '" + name):
        checked_topics(("cmd_vel", name))
    assert checked_namespace("/robot/left")
    assert checked_namespace("") == ""
    assert checked_topics(("~/support", "/odom", "imu/data"))


def test_the_terminal_is_restored_after_an_error(terminal: tuple[int, TextIO]) -> None:
    _, stream = terminal
    before = termios.tcgetattr(stream.fileno())

    def interrupted() -> None:
        with raw_terminal(stream) as descriptor:
            assert termios.tcgetattr(descriptor) != before
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert termios.tcgetattr(stream.fileno()) == before


def test_an_input_that_is_not_a_terminal_is_refused(tmp_path: object) -> None:
    with (
        open(os.devnull) as stream,
        pytest.raises(NaoGaitError, match="standard input: got 'no terminal'"),
        raw_terminal(stream),
    ):
        pass


def test_a_velocity_is_sent_again_until_it_shall_stop(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(teleop, "PERIOD", 0.0)
    sent: list[VelocityCommand] = []
    stop = StopRequest()

    def publish(command: VelocityCommand) -> None:
        sent.append(command)
        if len(sent) == 3:
            stop.request()

    teleop.hold(VelocityCommand(0.2, -0.1, 0.5), publish, stop)
    assert sent == [VelocityCommand(0.2, -0.1, 0.5)] * 3


@pytest.mark.parametrize("key", "wsadqe")
def test_every_key_of_the_help_moves_the_robot(key: str) -> None:
    assert key in teleop.HELP
    assert Driver().press(key).command != STANDSTILL
