"""The life of a process: signals set a flag, and runs on one machine use different domains."""

import os
import signal
import socket
import threading
from collections.abc import Iterator
from contextlib import suppress

import pytest

from robot_core.errors import NaoGaitError
from robot_core.ros.process import (
    LAST_DOMAIN,
    PORT_BASE,
    PORT_GAIN,
    REFUSED,
    DomainClaim,
    StopRequest,
    domain_id,
    run,
    spin,
    stay_local,
    stop_on_signal,
)


@pytest.fixture(autouse=True)
def interruptible() -> Iterator[None]:
    """A background job of a shell starts with SIGINT ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_stops_the_loop_without_an_exception(number: signal.Signals) -> None:
    before = signal.getsignal(number)
    with stop_on_signal() as stop:
        assert not stop
        os.kill(os.getpid(), number)
        assert stop
    assert signal.getsignal(number) is before


def test_ctrl_c_interrupts_again_afterwards() -> None:
    with pytest.raises(ZeroDivisionError), stop_on_signal():
        raise ZeroDivisionError
    with pytest.raises(KeyboardInterrupt):
        os.kill(os.getpid(), signal.SIGINT)


def test_beside_the_main_thread_signals_are_left_alone() -> None:
    before = signal.getsignal(signal.SIGINT)
    seen: list[StopRequest] = []

    def loop() -> None:
        with stop_on_signal() as stop:
            seen.append(stop)

    thread = threading.Thread(target=loop)
    thread.start()
    thread.join()
    assert len(seen) == 1
    assert not seen[0]
    assert signal.getsignal(signal.SIGINT) is before


@pytest.mark.parametrize(
    "words",
    [["robot:=nao_v6"], ["--robot", "nao_v6"], ["-p", "robot:=nao_v6"],
     ["--ros-args", "-p", "robot=nao_v6"]],
)  # fmt: skip
def test_arguments_that_are_no_ros_arguments_are_refused_in_one_line(
    words: list[str], capfd: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("rclpy")
    assert run("gait", "The walk.", [], spin, ["gait", *words], StopRequest()) == REFUSED
    said = capfd.readouterr().err
    assert said.startswith("gait: ")
    assert said.count("\n") == 1
    assert "allowed: --ros-args -p NAME:=VALUE" in said


def test_a_node_that_is_refused_half_built_is_destroyed(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    node = pytest.importorskip("rclpy.node")
    made = []

    class Refused(node.Node):  # type: ignore[name-defined,misc]
        def __init__(self) -> None:
            super().__init__("refused")
            made.append(self)
            raise NaoGaitError("scene", "nothing", "a scene")

        def destroy_node(self) -> None:
            pytest.fail("not all is there that this expects")

    with DomainClaim() as claim:
        monkeypatch.setenv("ROS_DOMAIN_ID", str(claim.domain))
        assert run("refused", "", [Refused], spin, ["refused"], StopRequest()) == REFUSED
    assert capfd.readouterr().err == "refused: scene: got 'nothing'; allowed: a scene\n"
    assert not list(made[0].publishers)


@pytest.mark.parametrize("text", ["233", "-1", "1.5", "abc", "0x1", "\u0663", "9" * 5000, " 1"])
def test_a_domain_that_dds_cannot_use_is_refused(
    text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", text)
    with pytest.raises(NaoGaitError, match="an integer from 0 to 232"):
        stay_local()


@pytest.mark.parametrize(("text", "domain"), [("", 0), ("7", 7), ("232", 232)])
def test_the_domain_of_the_environment(
    text: str, domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", text)
    assert domain_id() == domain


def test_two_runs_never_get_the_same_domain() -> None:
    with DomainClaim() as first, DomainClaim() as second:
        assert first.domain != second.domain
        environment = second.environment()
        assert environment["ROS_DOMAIN_ID"] == str(second.domain)
        assert environment["ROS_AUTOMATIC_DISCOVERY_RANGE"] == "LOCALHOST"

    with DomainClaim() as again:
        assert again.domain != second.domain, "its late messages may still arrive"


def test_a_domain_in_which_somebody_listens_is_not_taken() -> None:
    with DomainClaim() as first, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as participant:
        follows = first.domain % LAST_DOMAIN + 1
        with suppress(OSError):  # somebody listens there already
            participant.bind(("127.0.0.1", PORT_BASE + PORT_GAIN * follows + 11))
        with DomainClaim() as second:
            assert second.domain not in (first.domain, follows)
