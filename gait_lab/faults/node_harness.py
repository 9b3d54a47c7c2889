"""The nodes of one robot as processes, with a fault of one of them; runs in a process of its own.

Command line: python -m gait_lab.faults.node_harness FAULT SEED ENGINE PLANT URDF
Outcome, violations and explanations, as in `FaultResult`, go to the standard output as JSON.
"""

import json
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Twist
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from rosgraph_msgs.msg import Clock
from std_msgs.msg import String

from gait_lab.demo.node_processes import NodeProcesses, may_run_in_real_time, real_time_priority
from gait_lab.faults.campaign import STOPPED, VIOLATED, WENT_ON
from gait_lab.faults.node_faults import NODE_FAULTS, NodeFault, Rig
from gait_lab.soccer.player_nodes import player_parameters, referee_ports
from robot_core.ros.patience import STALL
from robot_core.ros.process import DomainClaim
from robot_core.ros.topics import LATCHED, publisher, subscription
from robot_core.types import BUSY, GaitState, state_of
from sim_bridge.scene import load_scene

FACTORS = {Rig.MATCH: 0.25, Rig.LOLA: 1.0}
"""Simulated seconds per second. Images are rendered on the same cores, which may be busy; LoLA's
deadlines are of the wall clock, so that rig runs with a real-time priority where it may."""
PATIENCE = 1.0
"""[s] without a new time on `/clock`, after which time goes on by the wall clock."""
LOOK = 8.0
"""[s] before the end, in which a robot that went on walks, kicks, gets up or obeys the referee."""
WALK_SPEED = 0.1
"""[m/s] forward, commanded by this process where there is no player."""
COMMAND_PERIOD = 0.1
"""[s] of wall time between two commands."""
Outcome = tuple[str, list[str], list[str]]
"""How a run ended, what must not happen, and what was said since the fault began."""


class NodeHarness:
    """Starts the nodes, injects the fault, and watches what the robot does and says."""

    def __init__(
        self, fault: NodeFault, nodes: NodeProcesses, node: Node, folder: Path, domain: int,
        seed: int, engine: str, plant: str, urdf: str,
    ) -> None:  # fmt: skip
        self.fault = fault
        self._nodes = nodes
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(node)
        self._now = 0.0
        self._moved = time.monotonic()
        self._state: GaitState | None = None
        self._busy_at = self._obeys_at = -LOOK
        self._warned: dict[str, None] = {}
        self._log_sizes: dict[Path, int] = {}
        self._folder = folder
        common = {"engine": engine, "plant": plant, "real_time_factor": FACTORS[fault.rig]}
        self._starts: dict[str, Callable[[], None]] = {}
        below = "" if fault.rig is Rig.LOLA else "red1/"
        if fault.rig is Rig.LOLA:
            self._prepare_lola(common, seed)
        else:
            self._prepare_match(common, seed, urdf, domain)
        subscription(node, Clock, "/clock", self._on_clock, qos_profile_sensor_data)
        subscription(node, String, f"{below}gait/support", self._on_support, LATCHED)
        subscription(node, DiagnosticArray, "/diagnostics", self._on_diagnostics)
        subscription(node, DiagnosticArray, f"{below}behavior", self._on_behavior)
        self._velocity = publisher(node, Twist, "cmd_vel") if fault.rig is Rig.LOLA else None
        self._commanded = 0.0

    def _prepare_lola(self, common: Mapping[str, object], seed: int) -> None:
        socket = str(self._folder / "robocup")
        self._starts = {
            "lola_server": lambda: self._nodes.start(
                "lola_server",
                {"socket": socket, "publish_clock": True, "robot_seed": seed, **common},
            ),
            "lola_bridge": lambda: self._nodes.start("lola_bridge", {"socket": socket}),
            "gait": lambda: self._nodes.start(
                "gait", {"urdf": "nao_v6", "control_period": 0.012, "bias_wait": 0.0}
            ),
        }

    def _prepare_match(
        self, common: Mapping[str, object], seed: int, urdf: str, domain: int
    ) -> None:
        whole = load_scene("pitch_small")
        robot = whole.robots[0].replace(name="red1", urdf=urdf, seed=seed)
        file = self._folder / "scene.yaml"
        scene = whole.replace(robots=(robot,))
        file.write_text(scene.to_yaml(), encoding="utf-8")
        player = player_parameters(robot, scene, file, domain)
        player["referee"] = self.fault.referee
        start = self._nodes.start
        self._starts = {
            "sim_bridge": lambda: start("sim_bridge", {"scene": file, "cameras": True, **common}),
            "gait": lambda: start("gait", {"urdf": urdf, "bias_wait": 0.0}, "red1"),
            "vision": lambda: start("vision", {"urdf": urdf, "scene": file}, "red1"),
            "player": lambda: start("player", player, "red1"),
        }
        if self.fault.referee:
            self._starts["referee"] = lambda: start(
                "referee", {"scene": file, **referee_ports(domain)}
            )

    # -- what a fault may do -----------------------------------------------------------------------

    def seconds(self) -> float:
        """Simulated time [s]; it goes on by the wall clock while the simulator hangs."""
        waited = max(0.0, time.monotonic() - self._moved - PATIENCE)
        return self._now + FACTORS[self.fault.rig] * waited

    def kill(self, name: str) -> None:
        """End a node at once."""
        self._nodes.kill(self._process(name))

    def start(self, name: str) -> None:
        """Start a node again."""
        self._starts[name]()

    def pause(self, name: str, paused: bool) -> None:
        """Stop a node from running, or let it run on."""
        self._nodes.pause(self._process(name), paused)

    def _process(self, name: str) -> str:
        below = name in ("gait", "vision", "player") and self.fault.rig is Rig.MATCH
        return f"red1_{name}" if below else name

    # -- the run -----------------------------------------------------------------------------------

    def run(self) -> Outcome:
        """Start all nodes, inject the fault, watch to the end."""
        for start in self._starts.values():
            start()
        self._moved = time.monotonic()
        began = False
        while self._now < self.fault.end:
            self._executor.spin_once(timeout_sec=0.02)
            self._command()
            if not began and self._now >= self.fault.begin:
                began = True
                self._begin()
            self.fault.before_frame(self)
            ended = self._nodes.ended()
            if ended is not None:
                return self._outcome(f"process: {ended}")
            if time.monotonic() - self._moved > STALL:
                return self._outcome(f"stall: time stands still at {self._now:.1f} s")
        return self._outcome(None)

    def _begin(self) -> None:
        self._warned.clear()
        for log in self._folder.glob("*.log"):
            self._log_sizes[log] = log.stat().st_size

    def _command(self) -> None:
        if self._velocity is None or time.monotonic() - self._commanded < COMMAND_PERIOD:
            return
        self._commanded = time.monotonic()
        twist = Twist()
        twist.linear.x = WALK_SPEED
        self._velocity.publish(twist)

    def _outcome(self, problem: str | None) -> Outcome:
        explained = list(self._warned)
        violations = [] if problem is None else [problem]
        for log in sorted(self._folder.glob("*.log")):
            text = log.read_text(errors="replace")
            if "Traceback" in text or " ends after " in text:
                violations.append(f"exception: {log.stem}: {text.splitlines()[-1]}")
            new = log.read_bytes()[self._log_sizes.get(log, 0) :].decode(errors="replace")
            explained += [
                f"{log.stem}: {line.rsplit(']: ', 1)[-1][:160]}"
                for line in new.splitlines() if line.startswith(("[WARN]", "[ERROR]"))
            ]  # fmt: skip
        went_on = max(self._busy_at, self._obeys_at) > self._now - LOOK
        if not went_on and not any(map(self.fault.explained_by, explained)):
            said = "; ".join(dict.fromkeys(explained)) or "nothing"
            violations.append(f"silent stop: {self._state} at the end, warnings: {said}")
        ended = WENT_ON if went_on else STOPPED
        return VIOLATED if violations else ended, violations, list(dict.fromkeys(explained))

    # -- topics ------------------------------------------------------------------------------------

    def _on_clock(self, message: Clock) -> None:
        self._now = message.clock.sec + message.clock.nanosec * 1e-9
        self._moved = time.monotonic()

    def _on_support(self, message: String) -> None:
        self._state = state_of(message.data)
        if self._state in BUSY:
            self._busy_at = self._now

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            # A joint at its limit does not explain a stop.
            if ord(status.level) > 0 and not status.message.endswith("out of reach"):
                self._warned[f"{status.name}: {status.message.partition(' for ')[0][:160]}"] = None

    def _on_behavior(self, message: DiagnosticArray) -> None:
        (status,) = message.status
        if ord(status.level) > 0:
            self._warned[f"behavior: {status.message.partition(' for ')[0]}"] = None
        elif any("stand still" in pair.value for pair in status.values):
            self._obeys_at = self._now  # the referee wants it to stand


def main() -> None:
    """Run the fault of the command line."""
    name, seed, engine, plant, urdf = sys.argv[1:]
    kind = list(NODE_FAULTS).index(name)
    fault = NODE_FAULTS[name](np.random.default_rng((kind, int(seed))))
    urgent = fault.rig is Rig.LOLA and may_run_in_real_time()
    with (
        real_time_priority() if urgent else nullcontext(),
        tempfile.TemporaryDirectory() as folder,
        DomainClaim() as domain,
    ):
        rclpy.init(domain_id=domain.domain)
        node = rclpy.create_node("faults")
        with NodeProcesses(domain.environment(), Path(folder)) as nodes:
            harness = NodeHarness(
                fault, nodes, node, Path(folder), domain.domain, int(seed), engine, plant, urdf
            )
            outcome = harness.run()
        rclpy.try_shutdown()
    json.dump(outcome, sys.stdout)


if __name__ == "__main__":
    main()
