"""The node `lola_server`: LoLA's socket for any client, ground truth and pushes over ROS."""

import math
import time
from collections import deque
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PointStamped, WrenchStamped
from nav_msgs.msg import Odometry
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Trigger

from lola_bridge.codec import LolaCommand, encode_sensors
from robot_core.log import Level, Report
from robot_core.robot import load_robot
from robot_core.ros.messages import diagnostic_array
from robot_core.ros.parameters import (
    declare,
    load_parameter_file,
    node_parameter,
    warn_of_unknown_overrides,
)
from robot_core.ros.process import StopRequest
from robot_core.ros.topics import Inputs, publisher, watch_senders
from sim_bridge.lola.body import LolaBody
from sim_bridge.lola.server import LolaSocket
from sim_bridge.plant import load_plant
from sim_bridge.ros import parameters
from sim_bridge.ros.messages import TruthWriter, push_of
from sim_bridge.ros.stepping import Pacer
from sim_bridge.world import World

PERIOD = 0.012
"""[s] of a cycle of LoLA."""
DELAY = 3 * PERIOD
"""[s] from sampling to the frame. The plant's 40 ms would become 48 ms, which walks worse."""
PUSH_DURATION = 0.1
"""[s] for which a push acts."""
SERVICE = 0.01
"""[s] after which callbacks are served, while a client is waited for."""
MEMORY = 100_000
"""Cycles whose times are kept."""
SOCKET = node_parameter("socket", "/tmp/robocup", "path of the socket that is made")
URDF = node_parameter("urdf", "nao_v6", "robot model: a shipped name or a URDF file")
REAL_TIME_FACTOR = node_parameter(
    "real_time_factor", 1.0,
    "simulated seconds per wall second; 0 = each cycle waits for its command", "", 0.0, 100.0,
)  # fmt: skip
NODE_PARAMETERS = (
    SOCKET, URDF, parameters.ENGINE, parameters.PLANT, parameters.ROBOT_SEED,
    parameters.SENSOR_DELAY, REAL_TIME_FACTOR, parameters.START_STATE, parameters.PUBLISH_CLOCK,
    parameters.GUI,
)  # fmt: skip
PRESS_TIME = 1_200_000_000
"""[ns] of a press of the chest button: long enough for `lola_bridge` to go on."""


class CycleTimes:
    """Answers of the client and the machine's own lateness, cycle by cycle.

    Attributes:
        cycles: Cycles in which a frame was sent.
    """

    def __init__(self) -> None:
        self.cycles = self.missed = 0
        self._answers: deque[float] = deque(maxlen=MEMORY)
        self._wakes: deque[float] = deque(maxlen=MEMORY)

    def woken(self, late: float) -> None:
        """The machine has woken this process up so late [s]."""
        self._wakes.append(late)

    def add(self, answer: float | None) -> None:
        """A cycle: [s] until its command; None without one."""
        self.cycles += 1
        if answer is None:
            self.missed += 1
        else:
            self._answers.append(answer)

    def report(self) -> dict[str, str]:
        """The numbers as text."""
        values = {"cycles": str(self.cycles), "missed": str(self.missed)}
        for name, times in (("answer", self._answers), ("woken late", self._wakes)):
            known = list(times) or [math.nan]
            for share in (0.5, 0.99, 1.0):
                label = f"p{100 * share:.0f}" if share < 1.0 else "max"
                value = np.quantile(known, share, method="inverted_cdf")
                values[f"{name} {label} [ms]"] = f"{1e3 * value:.2f}"
        return values


class LolaServerNode(Node):
    """A world with one robot behind LoLA's socket.

    Attributes:
        period: [ns] of a cycle.
        factor: Simulated seconds per wall second; 0 = each cycle waits for its command.
    """

    def __init__(self) -> None:
        super().__init__("lola_server", automatically_declare_parameters_from_overrides=True)
        plant = load_parameter_file(self, parameters.PLANT, load_plant)
        delay = declare(self, parameters.SENSOR_DELAY, DELAY)
        self.factor: float = declare(self, REAL_TIME_FACTOR)
        self._world = World.single(
            load_parameter_file(self, URDF, load_robot),
            plant,
            robot_seed=declare(self, parameters.ROBOT_SEED),
            engine=declare(self, parameters.ENGINE),
            sensor_delay=delay,
            control_period=PERIOD,
            start_state=declare(self, parameters.START_STATE),
            gui=declare(self, parameters.GUI),
        )
        self.period = self._world.control_period
        self.body = LolaBody(self._world.robot, PERIOD)
        self.times = CycleTimes()
        path = declare(self, SOCKET)
        self._make_topics()
        warn_of_unknown_overrides(self, (p.name for p in NODE_PARAMETERS))
        watch_senders(self)
        self.socket = LolaSocket(path)
        pace = f"real time factor {self.factor:g}" if self.factor else "waits for each command"
        robot = self._world.robot
        self.get_logger().info(
            f"{robot.description.name} robot {robot.spec.seed}, plant {plant.name}, {path}: {pace}"
        )

    def _make_topics(self) -> None:
        self._clock_topic = None
        if declare(self, parameters.PUBLISH_CLOCK):
            self._clock_topic = publisher(self, Clock, "/clock")
        self._truths = TruthWriter(self._world.robot.description)
        self._odometry = publisher(self, Odometry, "ground_truth/odom")
        self._com = publisher(self, PointStamped, "ground_truth/com")
        self._diagnostics = publisher(self, DiagnosticArray, "/diagnostics")
        self._inputs = Inputs(self)
        self._inputs.subscribe(WrenchStamped, "push", self._on_push)
        self.create_service(Trigger, "~/reset", self._on_reset)
        self.create_service(Trigger, "~/press_chest_button", self._on_press)
        self._press_until = 0

    def destroy_node(self) -> None:
        """Close the socket and free the engine."""
        self.socket.close()
        self._world.close()
        super().destroy_node()

    # -- a cycle -----------------------------------------------------------------------------------

    def begin(self) -> bool:
        """Step the world, publish the truth and send a frame; whether the client has got it."""
        self._world.step()
        now = self._world.time
        if self._clock_topic is not None:
            self._clock_topic.publish(self._truths.clock(now))
        truth = self._world.robot.truth()
        self._odometry.publish(self._truths.odometry(truth))
        self._com.publish(self._truths.com(truth))
        self.body.touch[0] = 1.0 if now < self._press_until else 0.0
        sensors = self.body.sensors()
        return sensors is not None and self.socket.send(encode_sensors(sensors))

    def end(self, command: LolaCommand | None) -> None:
        """Give the command of this cycle, if there is one, to the robot."""
        self.body.command(command)
        for error in self.socket.take_errors():
            self._inputs.warn("client", error, burst=5)

    def report(self) -> None:
        """Publish how the client is doing."""
        level = Level.OK if self.socket.connected else Level.WARN
        state = "client connected" if self.socket.connected else "no client"
        held = ", robot held" if self.body.held else ""
        report = Report("socket", level, state + held, self.times.report())
        name = self.get_fully_qualified_name().lstrip("/")
        hardware = self._world.robot.description.name
        array = diagnostic_array(name, hardware, self._world.time, (report,))
        self._diagnostics.publish(array)

    # -- inputs ------------------------------------------------------------------------------------

    def _on_push(self, message: WrenchStamped) -> None:
        self._world.robot.push(push_of(message), PUSH_DURATION)

    def _on_reset(self, _request: Any, response: Trigger.Response) -> Trigger.Response:
        self._world.reset()
        self.body.restart()
        response.success, response.message = True, "back at the start, held"
        return response

    def _on_press(self, _request: Any, response: Trigger.Response) -> Trigger.Response:
        self._press_until = self._world.time + PRESS_TIME
        response.success, response.message = True, "pressed"
        return response


def drive(node: Node, executor: SingleThreadedExecutor, stop: StopRequest) -> None:
    """Run cycles until a stop is requested."""
    if not isinstance(node, LolaServerNode):
        raise TypeError(type(node).__name__)
    pacer = Pacer(node.period, node.factor)
    report_at = 0.0
    while not stop:
        executor.spin_once(timeout_sec=0.0)
        if time.monotonic() >= report_at:
            report_at = time.monotonic() + 1.0
            node.report()
        if node.factor == 0.0 and not node.socket.connected:
            node.socket.wait(SERVICE)
            continue
        if not node.socket.connected:
            node.socket.wait(0.0)  # also on a machine that is too slow to wait for a step
        while pacer.wait() > 0.0 and not stop:
            if node.socket.connected:
                time.sleep(max(0.0, pacer.wait()))
                node.times.woken(-pacer.wait())
            else:
                node.socket.wait(pacer.wait())
        sent = node.begin()
        pacer.stepped()
        begin = time.monotonic()
        command = None
        if sent:
            command, in_time = _command(node, executor, stop, pacer)
            node.times.add(time.monotonic() - begin if in_time else None)
        node.end(command)
    values = ", ".join(f"{name} {value}" for name, value in node.times.report().items())
    node.get_logger().info(values)


def _command(
    node: LolaServerNode, executor: SingleThreadedExecutor, stop: StopRequest, pacer: Pacer
) -> tuple[LolaCommand | None, bool]:
    """Wait for the answer to the last frame: a period, and until the next frame is due.

    Returns:
        The newest command that has come, which may be a late answer to an earlier frame, or None;
        and whether the last frame is answered.
    """
    newest = None
    latest = time.monotonic() + PERIOD / (node.factor or 1.0)  # of a frame that went out late
    while not stop and node.socket.unanswered:
        left = SERVICE
        if node.factor > 0.0:
            left = max(pacer.wait(), latest - time.monotonic())
        if left <= 0.0:
            return newest, False
        for command in node.socket.wait(min(left, SERVICE)):
            newest = command
        if node.factor == 0.0:
            executor.spin_once(timeout_sec=0.0)
    return newest, not stop and node.socket.connected
