"""When physics takes its next step: in real time, as fast as possible, or in lockstep."""

import time
from collections.abc import Callable

from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from robot_core.log import Level
from robot_core.ros.process import StopRequest
from robot_core.ros.topics import write_log
from sim_bridge.ros.monitors import WINDOW, SpeedMonitor
from sim_bridge.ros.node import BridgeNode

BACKLOG = 0.2
"""[s] of wall time by which steps may be late and still catch up; steps do not make up for more."""
RESEND = 0.25
"""[s] of wall time after which lockstep sends an unanswered reading again, because subscribers may
be best effort and lose one."""
FORGET = 1.0
"""[s] of wall time after which lockstep forgets a node that holds time and has ended."""
RELEASE = 5.0
"""[s] of wall time without an answer after which lockstep accepts another gait. Simulated time
stands still meanwhile, so a rule in simulated time cannot decide this. Longer than a busy machine
holds up a gait: one that walks must not lose control to another."""
REPORT = 3.0
"""[s] of wall time without an answer after which lockstep logs a warning; each next one comes after
ten times as long."""
ADVICE = "a gait that waits for the processor may fall: lockstep:=true waits for it"
_SECOND = 1_000_000_000


class Pacer:
    """Holds simulated time to the wall clock.

    A step is due at the start time plus its number of periods, so rounding errors do not add up.

    Attributes:
        lost: [ns] wall time given up so far because steps were too late to catch up.
    """

    def __init__(
        self, period: int, factor: float, clock: Callable[[], int] = time.monotonic_ns
    ) -> None:
        """Start now.

        Args:
            period: Simulated time of one step [ns].
            factor: Simulated seconds per wall second; 0 = as fast as possible.
            clock: Monotonic time [ns].
        """
        self._wall_period = period / factor if factor else 0.0
        self._clock = clock
        self._steps = 0
        self._start = clock()
        self.lost = 0

    def wait(self) -> float:
        """[s] of wall time until the next step is due; 0 or less when it is."""
        if not self._wall_period:
            return 0.0
        return (self._due() - self._clock()) * 1e-9

    def stepped(self) -> None:
        """Count a step; discard wall time in excess of the backlog limit."""
        self._steps += 1
        if not self._wall_period:
            return
        excess = self._clock() - self._due() - round(BACKLOG * _SECOND)
        if excess > 0:
            self._start += excess
            self.lost += excess

    def restart(self) -> None:
        """Start again now; the wall time until now does not count."""
        self._start = self._clock()
        self._steps = 0

    def _due(self) -> int:
        return self._start + round(self._steps * self._wall_period)


def drive(node: Node, executor: SingleThreadedExecutor, stop: StopRequest) -> None:
    """Step physics when it is due and serve callbacks in between, until a stop is requested."""
    if not isinstance(node, BridgeNode):
        raise TypeError(type(node).__name__)
    pacer = Pacer(node.control_period, node.factor)
    speed = SpeedMonitor(node.factor, time.monotonic_ns())
    check_at, advised = 0, False
    while not stop:
        if not serve_until_due(node, executor, stop, pacer):
            return
        node.advance()
        pacer.stepped()
        now = time.monotonic_ns()
        line = speed.update(now, pacer.lost)
        if line is not None:
            write_log(node, line)
            if line.level >= Level.WARN and not (node.lockstep or advised):
                advised = True
                node.get_logger().warning(ADVICE)
        if now >= check_at:
            check_at = now + round(WINDOW * _SECOND)
            node.check_publishers()


def serve_until_due(
    node: BridgeNode,
    executor: SingleThreadedExecutor,
    stop: StopRequest,
    pacer: Pacer,
    clock: Callable[[], float] = time.monotonic,
) -> bool:
    """Serve callbacks until the next step is due, at least once.

    A step is due when the pacer says so and, in lockstep, the last reading has been answered.

    Args:
        node: The bridge.
        executor: Serves its callbacks.
        stop: Becomes true when a stop is requested.
        pacer: Holds the steps to the wall clock.
        clock: Monotonic time [s].

    Returns:
        False if a stop was requested.
    """
    begin = clock()
    resend_at, report_at, waited = RESEND, REPORT, 0.0
    served = False
    while not stop:
        wait = pacer.wait()
        if not node.waits_for_answer and wait <= 0.0 and served:
            if report_at > REPORT:
                node.get_logger().info(f"lockstep: resumed after {waited:.0f} s")
            return True
        executor.spin_once(timeout_sec=0.05 if node.waits_for_answer else min(max(wait, 0.0), 0.1))
        served = True
        waited = clock() - begin
        if not node.waits_for_answer:
            continue
        if waited > resend_at:
            resend_at = waited + RESEND
            pacer.restart()
            node.resend()
        if waited > FORGET:
            node.forget_ended()
        if waited > RELEASE:
            node.release_control()
        if waited > report_at:
            report_at *= 10.0
            node.report_wait(waited)
    return False
