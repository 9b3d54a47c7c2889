"""Drives the robot through the tour over ROS 2 and records every topic."""

import math
import sys
import time
from typing import TYPE_CHECKING, Any

from gait_lab.analysis.bag import BagWriter
from gait_lab.demo.node_processes import NodeProcesses
from gait_lab.demo.tour import TourPhase, duration, phase_at
from gait_lab.record.recorder import TopicRecorder
from gait_lab.ros_session import VelocityPublisher
from robot_core.ros.lockstep import LockstepPartner
from robot_core.ros.patience import STALL, START
from robot_core.ros.process import StopRequest
from robot_core.types import STANDSTILL, VelocityCommand

if TYPE_CHECKING:
    from rclpy.node import Node

COMMAND_PERIOD = 0.05
"""Simulated time [s] between two velocity commands, up to which lockstep runs on; less than fills
the queue of a publisher, so that the recorder loses nothing."""
STAND_UP_TIME = 4.0
"""Simulated time [s] before the tour for the gait to stand up and, with the tour's own stand, to
learn its gyro's bias."""
EXTRA_TIME = 0.2
"""Simulated time [s] that is recorded after the end of the tour."""
TOPICS = 12
"""Number of topics to be recorded before the tour begins."""
SEARCH_PERIOD = 0.05
"""[s] of wall time between two searches for new topics before the tour."""
SHOW_PERIOD = 0.25 if sys.stdout.isatty() else 10.0
"""Wall time [s] between two updates of the progress bar; rare in a log file."""


class TourError(Exception):
    """The tour was not completed."""


class TourDriver:
    """Publishes the velocity commands of a tour by simulated time, and records all topics.

    In lockstep each command has reached the gait before the sensors of its time.

    Attributes:
        tour_began: Simulated time [s] at which the tour began; None before.
    """

    def __init__(
        self,
        node: "Node",
        tour: tuple[TourPhase, ...],
        writer: BagWriter,
        stop: StopRequest,
        nodes: NodeProcesses,
        lockstep: LockstepPartner | None,
    ) -> None:
        from nav_msgs.msg import Odometry
        from rclpy.executors import SingleThreadedExecutor
        from rclpy.qos import qos_profile_sensor_data
        from rosgraph_msgs.msg import Clock
        from std_msgs.msg import String

        from robot_core.ros.topics import LATCHED

        self._tour = tour
        self._stop = stop
        self._nodes = nodes
        self._lockstep = lockstep
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(node)
        self._recorder = TopicRecorder(node, writer)
        self._velocity = VelocityPublisher(node)
        for kind, topic, callback, qos in (
            (Clock, "/clock", self._on_clock, qos_profile_sensor_data),
            (Odometry, "ground_truth/odom", self._on_truth, qos_profile_sensor_data),
            (String, "gait/support", self._on_support, LATCHED),
        ):
            node.create_subscription(kind, topic, callback, qos)
        self._now = 0.0
        self._last_clock = time.monotonic()
        self._next_command = 0
        self._stamp = 0
        self._support = ""
        self._speed = 0.0
        self._up = 1.0
        self.tour_began: float | None = None

    def run(self) -> None:
        """Wait for the robot to stand, and walk the whole tour.

        Raises:
            TourError: If the nodes do not start, end or stall, or if the robot falls.
            KeyboardInterrupt: If the user interrupts the demo.
        """
        self._wait_for_stand()
        assert self.tour_began is not None
        total = duration(self._tour)
        shown = 0.0
        with _progress_bar(total) as bar:
            while (elapsed := self._now - self.tour_began) < total:
                self._spin(STALL)
                if time.monotonic() >= shown + SHOW_PERIOD:
                    shown = time.monotonic()
                    phase = phase_at(self._tour, elapsed)
                    bar.n = min(total, round(elapsed, 1))
                    bar.set_description(phase.name if phase else "done", refresh=False)
                    bar.set_postfix_str(f"{100 * self._speed:3.0f} cm/s, {self._support}")
                if self._up < 0.5:
                    raise TourError(f"the robot fell {elapsed:.1f} s into the tour")
            bar.n = total
            bar.refresh()
        # On a busy machine the recorder lags behind the clock.
        while self._recorder.now < self.tour_began + total + EXTRA_TIME:
            self._spin(STALL)

    def close(self) -> None:
        """Close the recorder, and let time run on."""
        self._recorder.close()
        if self._lockstep is not None:
            self._lockstep.leave()

    def _wait_for_stand(self) -> None:
        deadline = time.monotonic() + START
        search = 0.0
        while self.tour_began is None:
            if time.monotonic() >= search:
                self._recorder.add_new_topics()
                search = time.monotonic() + SEARCH_PERIOD
            self._spin(max(1.0, deadline - time.monotonic()))
            if time.monotonic() > deadline:
                raise TourError(f"the nodes did not start within {START:.0f} s")

    def _spin(self, stall: float) -> None:
        self._executor.spin_once(timeout_sec=0.1)
        if self._stop:
            raise KeyboardInterrupt
        if (ended := self._nodes.ended()) is not None:
            raise TourError(ended)
        if time.monotonic() - self._last_clock > stall:
            raise TourError(f"no message on /clock for {stall:.0f} s")

    def _on_clock(self, message: Any) -> None:
        stamp = message.clock.sec * 1_000_000_000 + message.clock.nanosec
        self._now = 1e-9 * stamp
        self._last_clock = time.monotonic()
        if self.tour_began is None and self._now >= STAND_UP_TIME and self._support:
            self.tour_began = self._now
        repeated, self._stamp = stamp == self._stamp, stamp  # time is held
        if (stamp < self._next_command and not repeated) or not self._may_go_on():
            return
        self._velocity.publish(self._command())
        self._next_command = stamp + round(COMMAND_PERIOD * 1e9)
        if self._lockstep is not None and self._velocity.arrived():
            self._lockstep.release(self._next_command)

    def _may_go_on(self) -> bool:
        """Whether lockstep may go on: the tour has all its topics, and begins at a set time."""
        if self._lockstep is None or self.tour_began is not None:
            return True
        return (
            self._now < STAND_UP_TIME
            and len(self._recorder.topics) >= TOPICS
            and self._velocity.subscribers > 1  # gait and recorder
        )

    def _command(self) -> VelocityCommand:
        if self.tour_began is None:
            return STANDSTILL
        phase = phase_at(self._tour, self._now - self.tour_began)
        return phase.command if phase else STANDSTILL

    def _on_truth(self, message: Any) -> None:
        q = message.pose.pose.orientation
        self._up = 1.0 - 2.0 * (q.x * q.x + q.y * q.y)
        v = message.twist.twist.linear
        self._speed += 0.05 * (math.hypot(v.x, v.y) - self._speed)

    def _on_support(self, message: Any) -> None:
        self._support = message.data


def _progress_bar(total: float) -> Any:
    from tqdm import tqdm

    layout = "{desc:12s}|{bar:30}| {n:4.1f}/{total:.0f} s simulated, {elapsed}{postfix}"
    return tqdm(total=total, bar_format=layout, mininterval=SHOW_PERIOD, file=sys.stdout)
