"""Drive the robot from the keyboard: keys become `cmd_vel`; the state of the gait is shown.

Or without keys, with one velocity.
"""

import math
import os
import re
import select
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TextIO

from gait_lab.ros_session import VelocityPublisher, ros_node
from nao_lipm_gait.runtime.inputs import TwistInput, read_velocity
from robot_core.errors import NaoGaitError
from robot_core.ros.process import StopRequest, domain_id, stop_on_signal
from robot_core.types import STANDSTILL, VelocityCommand

if TYPE_CHECKING:
    from rclpy.node import Node

FULL_SPEED = {"forward": 0.40, "back": 0.33, "side": 0.20, "turn": math.radians(100.0)}
"""Commanded speed at level 9 [m/s, rad/s]."""
LEVELS = 9
PERIOD = 0.1
"""Wall time between two commands [s]."""
PATIENCE = 3.0
"""Wall time [s] without a subscriber after which that is said; discovery takes a second or two."""

HELP = """\
   q   w   e      w / s  forward, back        1-9    speed, 9 is full
   a   s   d      a / d  left, right          space  stop
                  q / e  turn left, right     r      put the robot back on its feet
   The opposite key first stops a motion.     h      this help
   Motions add up: w then q walks a curve.    x      stop and quit"""


@dataclass(frozen=True, slots=True)
class Driver:
    """The command that the keys have set; `press` returns the next state.

    Attributes:
        x: 1 forward, -1 back, 0 neither.
        y: 1 left, -1 right, 0 neither.
        yaw: 1 counter-clockwise, -1 clockwise, 0 neither.
        level: Speed, 1 to 9.
    """

    x: int = 0
    y: int = 0
    yaw: int = 0
    level: int = 5

    def press(self, key: str) -> "Driver":
        """Return the state after a key; unknown keys change nothing."""
        key = key.lower()
        if key == " ":
            return replace(self, x=0, y=0, yaw=0)
        if key.isascii() and key.isdigit() and 1 <= int(key) <= LEVELS:
            return replace(self, level=int(key))
        axis, sign = _KEYS.get(key, ("", 0))
        if not axis:
            return self
        now = getattr(self, axis)
        # The opposite key stops first, so that one key does not reverse at full speed.
        return replace(self, **{axis: 0 if now == -sign else sign})

    @property
    def command(self) -> VelocityCommand:
        """The commanded velocity [m/s, m/s, rad/s]."""
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
    """Read keys without Return and without echo; restore the terminal at the end.

    Ctrl-C still interrupts.

    Yields:
        Its file descriptor.

    Raises:
        NaoGaitError: If the stream is not a terminal.
    """
    if not stream.isatty():
        raise NaoGaitError("standard input", "no terminal", "a terminal with keys, or --velocity")
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
"""Arrow and function keys send ESC [ ... or ESC O ...; their letters are not commands."""


def read_keys(descriptor: int, timeout: float) -> str:
    """Return the keys of the next `timeout` s, without escape sequences; "x" if the input ended."""
    ready, _, _ = select.select([descriptor], [], [], timeout)
    if not ready:
        return ""
    data = os.read(descriptor, 64)
    if not data:
        return "x"  # the terminal was closed
    text = data.decode("utf-8", "ignore")
    return _ESCAPES.sub("", text)


def status_line(command: VelocityCommand, state: str, level: int | None = None) -> str:
    """Return one line with the command, the speed level of the keys and the state of the gait."""
    velocity = (
        f"x {command.x * 100:+5.1f} cm/s  y {command.y * 100:+5.1f} cm/s  "
        f"turn {math.degrees(command.yaw):+6.1f} deg/s"
    )
    speed = "" if level is None else f"   speed {level}/{LEVELS}"
    return f"{velocity}{speed}   gait: {state}"


class Screen:
    """Shows the status in one line that is written again, in a file one line for each change.

    Args:
        stream: Where to.
        topic: What the commands are sent on, for the line that nobody listens.
    """

    def __init__(self, stream: TextIO, topic: str) -> None:
        self._stream = stream
        self._topic = topic
        self._heard = time.monotonic()
        self._told = False
        self._shown = ""

    def show(self, line: str, subscribers: int) -> None:
        """Show a status; once for each time that nobody listens, say so before it."""
        now = time.monotonic()
        if subscribers:
            self._heard, self._told = now, False
        elif now - self._heard >= PATIENCE and not self._told:
            self._told = True
            text = f"nobody listens to {self._topic}, ROS_DOMAIN_ID {domain_id()}: does a gait run?"
            self._write(text + "\n")
        if self._stream.isatty():
            self._write(line)
        elif line != self._shown:
            self._write(line + "\n")
        self._shown = line
        self._stream.flush()

    def _write(self, text: str) -> None:
        self._stream.write(("\r\033[K" if self._stream.isatty() else "") + text)


class _RobotClient:
    """Commands the robot, resets it, and receives the state of the gait."""

    def __init__(self, node: "Node", *, stamped: bool) -> None:
        from std_msgs.msg import String
        from std_srvs.srv import Trigger

        from robot_core.ros.topics import LATCHED

        self._node = node
        self.velocity = VelocityPublisher(node, stamped=stamped)
        kind = self.velocity.message_type.__name__
        self._screen = Screen(sys.stdout, f"{node.resolve_topic_name('cmd_vel')} ({kind})")
        self.state = "not received yet"
        node.create_subscription(String, "gait/support", self._on_state, LATCHED)
        self._request = Trigger.Request
        self._reset = node.create_client(Trigger, "sim_bridge/reset")

    def send(self, command: VelocityCommand, level: int | None = None) -> None:
        """Send a command, and show it and the state of the gait."""
        import rclpy

        self.velocity.publish(command)
        for _ in range(20):
            rclpy.spin_once(self._node, timeout_sec=0.0)
        self._screen.show(status_line(command, self.state, level), self.velocity.subscribers)

    def reset(self) -> None:
        if self._reset.service_is_ready():
            self._reset.call_async(self._request())

    def _on_state(self, message: Any) -> None:
        self.state = message.data


def run(
    velocity: tuple[float, float, float] | None,
    namespace: str,
    stamped: bool,
    use_sim_time: bool,
    say: Callable[[str], None],
) -> None:
    """Drive by keys, or with a velocity, until x or Ctrl-C; then the robot is commanded to stop."""
    if velocity is not None:
        x, y, turn = velocity
        read_velocity(TwistInput((x, y, 0.0), (0.0, 0.0, turn)))  # the gait would only log a line
    with (
        nullcontext(-1) if velocity is not None else raw_terminal(sys.stdin) as descriptor,
        ros_node("nao_gait_teleop", namespace, use_sim_time) as node,
        stop_on_signal() as stop,
    ):
        robot = _RobotClient(node, stamped=stamped)
        try:
            if velocity is not None:
                hold(VelocityCommand(*velocity), robot.send, stop)
            else:
                say(HELP)
                _drive(robot, descriptor, stop)
        finally:
            robot.velocity.stop()


def hold(
    command: VelocityCommand, send: Callable[[VelocityCommand], None], stop: StopRequest
) -> None:
    """Send a command again and again, because the gait forgets an old one."""
    while not stop:
        send(command)
        time.sleep(PERIOD)


def _drive(robot: _RobotClient, descriptor: int, stop: StopRequest) -> None:
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
                robot.reset()
            driver = driver.press(key)
        if time.monotonic() >= due:
            due += PERIOD
            robot.send(driver.command, driver.level)
