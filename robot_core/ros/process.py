"""Lifecycle of a ROS process: its domain, its signals, and the start and end of a node.

rclpy is imported only inside the functions that need it: the import takes about a second, in which
a signal must already end the process quietly. Both nodes and the tools use this module.
"""

import argparse
import gc
import itertools
import os
import signal
import socket
import sys
import threading
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from types import FrameType
from typing import TYPE_CHECKING, NoReturn

from robot_core.errors import NaoGaitError, one_line
from robot_core.ros.executable import no_collections

if TYPE_CHECKING:
    from rclpy.context import Context
    from rclpy.executors import Executor
    from rclpy.node import Node

FAILED, REFUSED = 1, 2
"""Exit status after an exception that nothing has caught, and for a parameter, file or argument
that cannot be used."""
RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
GREATEST_DOMAIN = 232
"""From there on DDS has no ports."""
FIRST_DOMAIN, LAST_DOMAIN = 1, 101
"""On Linux the ports of higher domains overlap with those of outgoing connections."""
PORT_BASE, PORT_GAIN = 7400, 250
"""UDP ports of DDS: those of a domain begin at PORT_BASE + PORT_GAIN * domain."""


# -- signals ---------------------------------------------------------------------------------------


class StopRequest:
    """Becomes true on SIGINT or SIGTERM.

    Until `defer` is called there is nothing to clean up, and a signal ends the process at once.
    """

    def __init__(self) -> None:
        self._requested = False
        self._deferred = False

    def __bool__(self) -> bool:
        return self._requested

    def install(self) -> None:
        """Handle both signals from here on."""
        signal.signal(signal.SIGINT, self._on_signal)
        signal.signal(signal.SIGTERM, self._on_signal)

    def defer(self) -> None:
        """Let a signal only set the flag from here on; the loop of the node checks it."""
        self._deferred = True

    def request(self) -> None:
        """Ask for a stop, as a signal does."""
        self._requested = True

    def _on_signal(self, _signum: int, _frame: FrameType | None) -> None:
        self._requested = True
        if not self._deferred:
            os._exit(0)  # an exception would surface as an ImportError somewhere in the imports


@contextmanager
def stop_on_signal() -> Iterator[StopRequest]:
    """Let a signal only set a flag inside the context; restore the handlers after it.

    A KeyboardInterrupt inside rclpy can surface as any error (`take_message` turns it into a
    RuntimeError). rclpy must be initialised with SignalHandlerOptions.NO beside this.
    """
    stop = StopRequest()
    stop.defer()
    if threading.current_thread() is not threading.main_thread():
        yield stop  # only the main thread may set handlers
        return
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    stop.install()
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


# -- domain ----------------------------------------------------------------------------------------


def domain_id() -> int:
    """ROS_DOMAIN_ID of this environment; NaoGaitError if it is none."""
    text = os.environ.get("ROS_DOMAIN_ID") or "0"
    known = text.isascii() and text.isdecimal() and len(text) <= len(str(GREATEST_DOMAIN))
    if not known or int(text) > GREATEST_DOMAIN:
        raise NaoGaitError("ROS_DOMAIN_ID", text, f"an integer from 0 to {GREATEST_DOMAIN}")
    return int(text)


def stay_local() -> None:
    """Limit discovery to this machine, unless the user has set its range; call before rclpy.init.

    Any process that reaches the topics can command the robot, so the network is opened only on
    purpose. NaoGaitError if the user has set a domain that DDS cannot use, which would end it.
    """
    domain_id()
    os.environ.setdefault(RANGE, "LOCALHOST")


def start_rclpy() -> None:
    """Initialise rclpy for a tool on this machine; signals stay with the tool.

    Raises:
        NaoGaitError: It cannot start, for example because its log folder cannot be written.
    """
    import rclpy
    from rclpy.impl.implementation_singleton import rclpy_implementation
    from rclpy.signals import SignalHandlerOptions

    stay_local()
    try:
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    except rclpy_implementation.RCLError as error:
        reason = " ".join(str(error).split())
        allowed = "a ROS that starts; ROS_LOG_DIR names a folder for its logs"
        raise NaoGaitError("ROS", reason, allowed) from error


def _domains_in_use() -> set[int]:
    """Domains whose UDP ports are bound on this machine, as far as Linux tells."""
    ports: list[int] = []
    for table in ("/proc/net/udp", "/proc/net/udp6"):
        with suppress(OSError), open(table, encoding="ascii") as file:
            ports += (int(line.split()[1].rpartition(":")[2], 16) for line in list(file)[1:])
    return {(port - PORT_BASE) // PORT_GAIN for port in ports}


class DomainClaim(AbstractContextManager["DomainClaim"]):
    """Reserves a ROS_DOMAIN_ID until `release` or the end of the process.

    The claim is a name in Linux's abstract socket namespace. The kernel frees it with the process,
    however that ends. A domain in which a participant listens on this machine is not taken: it was
    set by hand, or is that of a node which has outlived its run.

    Attributes:
        domain: The ID.
    """

    _last: int | None = None

    def __init__(self) -> None:
        # Never the same ID twice in a row: late messages of a killed run may still be there.
        # Processes that were started together do not follow each other either.
        count = LAST_DOMAIN - FIRST_DOMAIN + 1
        last = DomainClaim._last
        start = 13 * os.getpid() if last is None else last - FIRST_DOMAIN + 1
        used = _domains_in_use()
        for offset in range(count):
            domain = FIRST_DOMAIN + (start + offset) % count
            if domain in used:
                continue
            holder = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
            try:
                holder.bind(f"\0nao_lipm_gait_domain_{domain}")
            except OSError:
                holder.close()
                continue
            DomainClaim._last = self.domain = domain
            self._holder = holder
            return
        raise OSError(f"all ROS domains from {FIRST_DOMAIN} to {LAST_DOMAIN} are in use")

    def environment(self) -> dict[str, str]:
        """The environment for processes of this run: this domain, this machine only."""
        return {**os.environ, "ROS_DOMAIN_ID": str(self.domain), RANGE: "LOCALHOST"}

    def release(self) -> None:
        """Give the ID back."""
        self._holder.close()

    def __exit__(self, *_: object) -> None:
        self.release()


# -- node ------------------------------------------------------------------------------------------


def run(
    name: str,
    description: str,
    builds: Sequence[Callable[[], "Node"]],
    loop: Callable[["Node", "Executor", StopRequest], None],
    args: Sequence[str] | None,
    stop: StopRequest,
) -> int:
    """Build a node or several, run their loop until a stop is requested, clean up.

    Args:
        name: Name of the executable, for its messages.
        description: Description for `--help`.
        builds: Each makes a node. Several share the executor of `events_executor`.
        loop: Serves the nodes until the stop; it is given the first one.
        args: Command line; None = that of the process.
        stop: Already installed.

    Returns:
        Exit status: 0 after a stop; with one line on stderr, REFUSED if the node cannot start, and
        FAILED after an exception in its loop. In each case the nodes are destroyed, which stops
        their robot.
    """
    import rclpy
    from rclpy.exceptions import ParameterException
    from rclpy.executors import SingleThreadedExecutor
    from rclpy.impl.implementation_singleton import rclpy_implementation
    from rclpy.signals import SignalHandlerOptions
    from rclpy.utilities import remove_ros_args

    argument_errors = (
        NaoGaitError,
        ParameterException,
        rclpy_implementation.RCLInvalidROSArgsError,
        rclpy_implementation.UnknownROSArgsError,
        rclpy_implementation.RCLError,
    )
    arguments = list(sys.argv if args is None else args)
    parser = _Parser(prog=name, description=description)
    parser.add_argument(
        "--ros-args", help="ROS arguments follow: -p parameter:=value, -r from:=to, ..."
    )
    try:
        # rcl would take robot:=nao_v6, as for ros2 launch, for a remapping of a name.
        for word in itertools.takewhile("--ros-args".__ne__, arguments[1:]):
            if ":=" in word:
                raise NaoGaitError("arguments", word, _PARAMETERS)
        plain = remove_ros_args(arguments)[1:]
        if plain:
            parser.parse_args(plain)
        stop.defer()
        stay_local()
        # The default handlers shut the context down under a running callback; ours set a flag.
        rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
    except argument_errors as error:
        return _refuse(name, error)
    nodes: list[Node] = []
    executor = SingleThreadedExecutor() if len(builds) == 1 else events_executor()
    try:
        try:
            with no_collections():
                for build in builds:
                    nodes.append(build())
                    executor.add_node(nodes[-1])
                # Exempt what start-up made from later collections.
                gc.collect()
                gc.freeze()
        except argument_errors as error:
            _destroy_unfinished(error)
            return _refuse(name, error)
        loop(nodes[0], executor, stop)
        return 0
    except Exception as error:
        return _fail(name, nodes[0] if nodes else None, error)
    finally:
        executor.shutdown(timeout_sec=1.0)
        for node in nodes:
            node.destroy_node()
        rclpy.try_shutdown()


def _destroy_unfinished(error: Exception) -> None:
    """Destroy a node whose constructor raised; else that is left to the end of the interpreter.

    There the threads of DDS may still run, and whether the process then ends is a matter of luck.
    """
    from rclpy.node import Node

    for frame, _ in traceback.walk_tb(error.__traceback__):
        node = frame.f_locals.get("self")
        if isinstance(node, Node):
            with suppress(Exception):  # not even the base class may be complete
                Node.destroy_node(node)  # that of its own class expects all that it makes
            return


def events_executor(context: "Context | None" = None) -> "Executor":
    """The executor that is told of messages and does not look for them, where rclpy has it.

    It cannot serve subscriptions that take the message info (rclpy 7.1), and knows no groups.
    """
    from rclpy.executors import SingleThreadedExecutor

    try:
        from rclpy.experimental import EventsExecutor
    except ImportError:
        return SingleThreadedExecutor(context=context)
    return EventsExecutor(context=context)


def spin(_node: "Node", executor: "Executor", stop: StopRequest) -> None:
    """Serve callbacks until a stop is requested."""
    while not stop:
        executor.spin_once(timeout_sec=0.1)


def _fail(name: str, node: "Node | None", error: Exception) -> int:
    """One line about an exception; where it came from in full is a debug message of the log."""
    if node is not None:
        node.get_logger().debug("".join(traceback.format_exception(error)))
    print(f"{name}: ends after {one_line(error)}", file=sys.stderr, flush=True)
    return FAILED


_PARAMETERS = "--ros-args -p NAME:=VALUE, without spaces around :="


class _Parser(argparse.ArgumentParser):
    """Refuses in one line, and says how a node gets its parameters."""

    def error(self, message: str) -> NoReturn:
        raise NaoGaitError("arguments", message, _PARAMETERS)


def _refuse(name: str, error: Exception) -> int:
    message = " ".join(str(error).split())
    if message.startswith("Failed to parse ROS arguments"):
        message = f"{message.partition(' Error:')[0]} allowed: {_PARAMETERS}"
    print(f"{name}: {message}", file=sys.stderr)  # the logger may not exist yet
    return REFUSED
