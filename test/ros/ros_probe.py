"""The nodes as processes, and a probe that talks to them. Waits on predicates, never on sleeps."""

import atexit
import json
import os
import re
import select
import signal
import socket
import struct
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import rclpy
from geometry_msgs.msg import Twist
from rclpy.context import Context
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rosgraph_msgs.msg import Clock

from nao_soccer.team.udp import LOCAL
from robot_core.ros.lockstep import LockstepPartner
from robot_core.ros.process import DomainClaim, events_executor

ROOT = Path(__file__).resolve().parents[2]
MODULES = {
    "gait": "nao_lipm_gait.ros.main",
    "sim_bridge": "sim_bridge.ros.main",
    "vision": "nao_soccer.ros.vision_main",
    "player": "nao_soccer.ros.player_main",
    "referee": "nao_soccer.ros.referee_main",
    "robot": "gait_lab.soccer.robot_main",
    "lola_bridge": "lola_bridge.ros.main",
    "lola_server": "sim_bridge.lola.main",
}
TIMEOUT = 600.0
"""[s] for any single thing to happen, on a busy machine; it only ends a hang."""
LOST = 10.0
"""[s] after which a message that is not answered is sent again: best effort may lose it."""

os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"  # read when the probe joins its domain


def _held_port() -> socket.socket:
    """A socket on a port that was free, on which only those that share it can listen from now on.

    It is of the loopback broadcast: what is sent to one process does not end here.
    """
    holder = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    holder.bind((LOCAL, 0))
    holder.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    return holder


@cache
def _server() -> "subprocess.Popen[str]":
    """The process that starts nodes; it ends with this one, which it serves alone."""
    server = subprocess.Popen(
        [sys.executable, str(Path(__file__).with_name("node_server.py"))],
        cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    atexit.register(server.communicate)
    return server


def _ask(**request: object) -> Any:
    server = _server()
    assert server.stdin is not None
    assert server.stdout is not None
    print(json.dumps(request), file=server.stdin, flush=True)
    return json.loads(server.stdout.readline())


class Process:
    """One node as a process; its log goes to a file."""

    def __init__(self, name: str, log: Path, domain: DomainClaim, arguments: Sequence[str]) -> None:
        self.name = name
        self._log = log
        log.touch()
        self.pid: int = _ask(
            module=MODULES[name], arguments=arguments, environment=domain.environment(),
            log=str(log),
        )  # fmt: skip
        self._handle = os.pidfd_open(self.pid)  # can be read once the process has ended
        self._end = select.poll()
        self._end.register(self._handle, select.POLLIN)
        self._status: int | None = None

    @property
    def log(self) -> str:
        """What the process has printed so far."""
        return self._log.read_text(errors="replace")

    @property
    def status(self) -> int | None:
        """Exit status; None while the process runs."""
        if self._status is None and self._end.poll(0):
            self._status = _ask(ended=self.pid)
            os.close(self._handle)
        return self._status

    def signal(self, number: int) -> None:
        """Send a signal to the process."""
        if self.status is None:
            os.kill(self.pid, number)

    def wait(self, timeout: float = TIMEOUT) -> int:
        """Exit status."""
        if self._status is None:
            self._end.poll(1e3 * timeout)
        if self.status is None:
            raise TimeoutError(f"{self.name} has not ended\n{self.log[-3000:]}")
        return self.status

    def end(self) -> None:
        """Politely first: a killed process leaves its shared memory behind."""
        if self.status is None:
            self.signal(signal.SIGINT)
            self.signal(signal.SIGCONT)  # one that was stopped
            try:
                self.wait(60.0)
            except TimeoutError:
                self.signal(signal.SIGKILL)
                self.wait()

    def says(self, pattern: str) -> bool:
        """Whether its output matches a regular expression."""
        return re.search(pattern, self.log) is not None


class Messages(list[Any]):
    """What came on a topic. Who asks before anything came waits for it: discovery may be late."""

    def __init__(self, probe: "Probe", topic: str) -> None:
        super().__init__()
        self._probe, self._topic = probe, topic

    def __getitem__(self, index: Any) -> Any:
        if not self and not isinstance(index, slice):
            self._probe.wait(self.__len__, f"a first message of {self._topic}")
        return super().__getitem__(index)


class Probe:
    """A node of the test's own, and the processes beside it, in a domain of their own."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.domain = DomainClaim()
        self._context = Context()
        rclpy.init(context=self._context, domain_id=self.domain.domain)
        self.node = Node("probe", context=self._context)
        self._executor = events_executor(self._context)
        self._executor.add_node(self.node)
        self.processes: list[Process] = []
        self._ports: list[socket.socket] = []
        self._received = 0

    def start(self, name: str, *arguments: str, **parameters: object) -> Process:
        """Start one of `MODULES` with ROS parameters."""
        given = [f"{key}:={_yaml(value)}" for key, value in parameters.items()]
        ros = [word for item in given for word in ("-p", item)]
        log = self._folder / f"{name}_{len(self.processes)}.log"
        everything = [*arguments, *(["--ros-args", *ros] if ros else [])]
        process = Process(name, log, self.domain, everything)
        self.processes.append(process)
        return process

    def subscribe(
        self,
        kind: type,
        topic: str,
        qos: QoSProfile | int = 100,
        callback: Callable[[Any], None] | None = None,
    ) -> Messages:
        """All messages of a topic, as they come, also the latched ones that a busy test missed."""
        if isinstance(qos, QoSProfile) and qos.durability == DurabilityPolicy.TRANSIENT_LOCAL:
            qos = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        messages = Messages(self, topic)

        def receive(message: Any) -> None:
            messages.append(message)
            self._received += 1
            if callback is not None:
                callback(message)

        self.node.create_subscription(kind, topic, receive, qos)
        return messages

    @cached_property
    def udp_ports(self) -> dict[str, int]:
        """Of a game, held until the end of the test."""
        self._ports = [_held_port() for _ in range(3)]
        names = ("control_port", "return_port", "team_port")
        return {n: p.getsockname()[1] for n, p in zip(names, self._ports, strict=True)}

    def publisher(self, kind: type, topic: str) -> Any:
        """A publisher with a subscriber."""
        publisher = self.node.create_publisher(kind, topic, 10)
        self.wait(lambda: publisher.get_subscription_count() > 0, f"a subscriber of {topic}")
        return publisher

    def call(self, kind: type, service: str, request: Any) -> Any:
        """Call a service and return its response."""
        client = self.node.create_client(kind, service)
        self.wait(client.service_is_ready, f"service {service}")
        futures: list[Any] = []
        # A node that does not know this client yet loses its answer.
        self.wait(
            lambda: any(each.done() for each in futures), f"answer of {service}",
            every=lambda: futures.append(client.call_async(request)), pause=LOST,
        )  # fmt: skip
        self.node.destroy_client(client)
        return next(each.result() for each in futures if each.done())

    def wait(
        self,
        predicate: Callable[[], object],
        what: str,
        timeout: float = TIMEOUT,
        every: Callable[[], None] | None = None,
        pause: float = 0.25,
    ) -> None:
        """Serve callbacks until the predicate holds; call `every` now and after each pause [s]."""
        end = time.monotonic() + timeout
        again = 0.0
        while not predicate():
            if every is not None and time.monotonic() > again:
                again = time.monotonic() + pause
                every()
            dead = [process for process in self.processes if process.status not in (None, 0)]
            if dead or time.monotonic() > end:
                logs = "\n".join(f"--- {p.name}: {p.log[-3000:]}" for p in self.processes)
                raise AssertionError(f"{'died' if dead else 'timeout'} waiting for {what}\n{logs}")
            self._executor.spin_once(timeout_sec=0.02)

    def settle(self) -> None:
        """Serve all messages that have arrived."""
        before = -1
        while before < self._received:
            before = self._received
            self._executor.spin_once(timeout_sec=0.0)

    def close(self) -> None:
        """End all processes and leave the ROS domain."""
        for process in self.processes:
            process.end()
        self._executor.shutdown()
        self.node.destroy_node()
        self._context.try_shutdown()
        for port in self._ports:
            port.close()
        self.domain.release()


class Driver:
    """Repeats a velocity command every 0.1 s of simulated time; in lockstep time waits for it.

    Attributes:
        forward: [m/s]; None for no command.
    """

    def __init__(self, probe: Probe) -> None:
        self.forward: float | None = None
        self._publisher = probe.node.create_publisher(Twist, "cmd_vel", 10)
        self._follow = LockstepPartner(probe.node).follower()
        self._next = 0
        probe.subscribe(Clock, "/clock", callback=self._on_clock)

    def _on_clock(self, message: Clock) -> None:
        now = nanoseconds(message.clock)
        if self.forward is not None and not 0 < self._next - now <= 100_000_000:
            self._next = now + 100_000_000
            twist = Twist()
            twist.linear.x = self.forward
            self._publisher.publish(twist)
        self._follow(now)


def _yaml(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def nanoseconds(time: Any) -> int:
    """[ns] of a builtin_interfaces/Time."""
    return int(time.sec * 1_000_000_000 + time.nanosec)


def stamp(message: Any) -> int:
    """The stamp of a message [ns]."""
    return nanoseconds(message.header.stamp)


def set_stamp(message: Any, nanoseconds: int) -> Any:
    """Set the stamp of a message [ns] and return the message."""
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(nanoseconds, 1_000_000_000)
    return message


def bits(values: Any) -> bytes:
    """Of a list of doubles, exactly."""
    return struct.pack(f"{len(values)}d", *values)
