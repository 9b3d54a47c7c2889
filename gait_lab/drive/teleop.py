"""Drive the robot from the keyboard: keys become `cmd_vel`, the gait's state comes back."""

import math
import os
import re
import select
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TextIO

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.ros.process import StopRequest, stay_local, stop_on_signal
from nao_lipm_gait.types import STANDSTILL, VelocityCommand

if TYPE_CHECKING:
    from rclpy.node import Node

FULL_SPEED = {"forward": 0.25, "back": 0.20, "side": 0.09, "turn": math.radians(45.0)}
"""Speed at level 9 [m/s, rad/s]."""
LEVELS = 9
PERIOD = 0.1
"""Seconds of wall time between two commands."""

HELP = """\
   q   w   e      w / s  forward, back        1-9    speed, 9 is full
   a   s   d      a / d  left, right          space  stop
                  q / e  turn left, right     r      put the robot back on its feet
   The opposite key first stops a motion.     h      this help
   Motions add up: w then q walks a curve.    x      stop and quit"""


@dataclass(frozen=True, slots=True)
class Driver:
    """What the keys have asked for so far; `press` gives the next one."""

    x: int = 0
    """1 forward, -1 back, 0 neither; likewise left and counter-clockwise."""
    y: int = 0
    yaw: int = 0
    level: int = 5
    """Speed, 1 to 9."""

    def press(self, key: str) -> "Driver":
        """The state after a key; unknown keys change nothing."""
        key = key.lower()
        if key == " ":
            return replace(self, x=0, y=0, yaw=0)
        if key.isascii() and key.isdigit() and 1 <= int(key) <= LEVELS:
            return replace(self, level=int(key))
        axis, sign = _KEYS.get(key, ("", 0))
        if not axis:
            return self
        now = getattr(self, axis)
        # The opposite key brakes first: nobody wants to reverse at full speed by one key.
        return replace(self, **{axis: 0 if now == -sign else sign})

    @property
    def command(self) -> VelocityCommand:
        """[m/s, m/s, rad/s]."""
        if not (self.x or self.y or self.yaw):
            return STANDSTILL
        share = self.level / LEVELS
        return VelocityCommand(
            x=share * self.x * FULL_SPEED["forward" if self.x > 0 else "back"],
            y=share * self.y * FULL_SPEED["side"],
            yaw=share * self.yaw * FULL_SPEED["turn"],
        )


_KEYS = {
    "w": ("x", 1), "s": ("x", -1), "a": ("y", 1), "d": ("y", -1), "q": ("yaw", 1), "e": ("yaw", -1),
}  # fmt: skip


@contextmanager
def raw_terminal(stream: TextIO) -> Iterator[int]:
    """Keys come at once and unseen; the terminal is always put back. Yields the descriptor.

    Ctrl-C still interrupts. Raises NaoGaitError if the stream is no terminal.
    """
    if not stream.isatty():
        raise NaoGaitError("standard input", "no terminal", "a terminal, to read the keys from")
    import termios
    import tty

    descriptor = stream.fileno()
    before = termios.tcgetattr(descriptor)
    try:
        tty.setcbreak(descriptor)
        yield descriptor
    finally:
        termios.tcsetattr(descriptor, termios.TCSADRAIN, before)


_ESCAPES = re.compile(r"\x1b(\[[0-9;]*[A-Za-z~]?|O[A-Za-z]?)?")
"""Arrow and function keys arrive as ESC [ ... or ESC O ...: their letters are no commands."""


def read_keys(descriptor: int, timeout: float) -> str:
    """The keys pressed within `timeout` s, without escape sequences; "" if none, "x" at the end."""
    ready, _, _ = select.select([descriptor], [], [], timeout)
    if not ready:
        return ""
    data = os.read(descriptor, 64)
    if not data:
        return "x"  # the terminal is gone
    text = data.decode("utf-8", "ignore")
    return _ESCAPES.sub("", text)


def status_line(driver: Driver, state: str) -> str:
    """One line: what is asked and what the gait does."""
    command = driver.command
    asked = (
        f"x {command.x * 100:+5.1f} cm/s  y {command.y * 100:+5.1f} cm/s  "
        f"turn {math.degrees(command.yaw):+6.1f} deg/s"
    )
    return f"{asked}   speed {driver.level}/{LEVELS}   gait: {state}"


class _Link:
    """The ROS side: cmd_vel out, the gait's state in, a reset on demand."""

    def __init__(self, node: "Node", *, stamped: bool) -> None:
        from geometry_msgs.msg import Twist, TwistStamped
        from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
        from std_msgs.msg import String
        from std_srvs.srv import Trigger

        self._node = node
        self._stamped = stamped
        self._message = TwistStamped if stamped else Twist
        self._publisher = node.create_publisher(self._message, "cmd_vel", 10)
        latched = QoSProfile(
            depth=1,
            durability=DurabilityPolicy.TRANSIENT_LOCAL,
            reliability=ReliabilityPolicy.RELIABLE,
        )
        node.create_subscription(String, "gait/support", self._on_state, latched)
        self._request = Trigger.Request
        self._reset = node.create_client(Trigger, "sim_bridge/reset")
        self.state = "not heard of yet"

    def _on_state(self, message: Any) -> None:
        self.state = message.data

    def send(self, command: VelocityCommand) -> None:
        message = self._message()
        twist = message
        if self._stamped:
            message.header.stamp = self._node.get_clock().now().to_msg()
            message.header.frame_id = "base_footprint"
            twist = message.twist
        twist.linear.x, twist.linear.y, twist.angular.z = command.x, command.y, command.yaw
        self._publisher.publish(message)

    def reset(self) -> None:
        if self._reset.service_is_ready():
            self._reset.call_async(self._request())


def run(*, namespace: str = "", stamped: bool = False, use_sim_time: bool = False) -> None:
    """Drive until x or Ctrl-C; the robot is told to stop on the way out."""
    with raw_terminal(sys.stdin) as descriptor:
        import rclpy
        from rclpy.parameter import Parameter
        from rclpy.signals import SignalHandlerOptions

        from gait_lab.drive.ros_names import checked_namespace

        # Ctrl-C must not close the context before the stop command is out.
        stay_local()
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
        try:
            node = rclpy.create_node(
                "nao_gait_teleop",
                namespace=checked_namespace(namespace),
                parameter_overrides=[Parameter("use_sim_time", value=use_sim_time)],
            )
            link = _Link(node, stamped=stamped)
            with stop_on_signal() as stop:
                try:
                    _drive(node, link, descriptor, stop)
                finally:
                    for _ in range(3):
                        link.send(STANDSTILL)
                        time.sleep(0.02)  # DDS sends in the background; the process ends next
        finally:
            rclpy.try_shutdown()


def _drive(node: "Node", link: _Link, descriptor: int, stop: StopRequest) -> None:
    import rclpy

    sys.stdout.write(HELP + "\n")
    driver = Driver()
    due = time.monotonic()
    while not stop:
        for key in read_keys(descriptor, max(0.0, due - time.monotonic())):
            if key in "xX\x04":
                sys.stdout.write("\n")
                return
            if key in "hH":
                sys.stdout.write("\r\033[K" + HELP + "\n")
            elif key in "rR":
                driver = driver.press(" ")
                link.reset()
            driver = driver.press(key)
        if time.monotonic() >= due:
            due += PERIOD
            link.send(driver.command)
            for _ in range(20):
                rclpy.spin_once(node, timeout_sec=0.0)
            sys.stdout.write("\r\033[K" + status_line(driver, link.state))
            sys.stdout.flush()
