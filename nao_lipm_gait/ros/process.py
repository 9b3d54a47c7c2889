"""Life of a node process: start, refusal, loop, end."""

import argparse
import gc
import sys
from collections.abc import Callable, Sequence

import rclpy
from rclpy.exceptions import ParameterException
from rclpy.executors import SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.ros.domain import stay_local
from nao_lipm_gait.ros.stop_request import StopRequest

REFUSED = 2
"""Exit status for a parameter, file or argument that cannot be used."""

_ARGUMENT_ERRORS = (
    NaoGaitError,
    ParameterException,
    rclpy_implementation.RCLInvalidROSArgsError,
    rclpy_implementation.UnknownROSArgsError,
    rclpy_implementation.RCLError,
)

Build = Callable[[], Node]
Loop = Callable[[Node, SingleThreadedExecutor, StopRequest], None]


def run(
    name: str,
    description: str,
    build: Build,
    loop: Loop,
    args: Sequence[str] | None,
    stop: StopRequest,
) -> int:
    """Build a node, run its loop until a stop is asked for, tidy up; the exit status.

    0 after a stop; 2, with one line on stderr, when the node cannot start as asked.
    """
    arguments = list(sys.argv if args is None else args)
    parser = argparse.ArgumentParser(prog=name, description=description)
    parser.add_argument(
        "--ros-args", help="ROS arguments follow: -p parameter:=value, -r from:=to, ..."
    )
    try:
        plain = remove_ros_args(arguments)[1:]
        if "-h" in plain or "--help" in plain or plain:
            parser.parse_args(plain)
        stop.defer()
        stay_local()
        # The default handlers shut the context down under a running callback; ours set a flag.
        rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
    except _ARGUMENT_ERRORS as error:
        return _refuse(name, error)
    node: Node | None = None
    executor = SingleThreadedExecutor()
    try:
        try:
            node = build()
        except _ARGUMENT_ERRORS as error:
            return _refuse(name, error)
        executor.add_node(node)
        # What start-up made stays: the collector need not walk it during the ticks.
        gc.collect()
        gc.freeze()
        loop(node, executor, stop)
        return 0
    finally:
        executor.shutdown(timeout_sec=1.0)
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()


def spin(_node: Node, executor: SingleThreadedExecutor, stop: StopRequest) -> None:
    """Serve callbacks until a stop is asked for."""
    while not stop:
        executor.spin_once(timeout_sec=0.1)


def _refuse(name: str, error: Exception) -> int:
    message = " ".join(str(error).split())
    print(f"{name}: {message}", file=sys.stderr)  # the logger may not exist yet
    return REFUSED
