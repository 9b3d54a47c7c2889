"""Faults of the processes of one robot: a node is killed or hangs, and perhaps comes back."""

import json
import math
import subprocess
import sys
from collections.abc import Mapping
from enum import Enum, auto
from typing import NamedTuple, Protocol

import numpy as np

from gait_lab.faults.campaign import STOPPED, VIOLATED, WENT_ON, FaultResult, FaultRun
from gait_lab.faults.harness import Fault


class Rig(Enum):
    """The nodes that run."""

    MATCH = auto()
    """Bridge with cameras, gait, vision, player, perhaps a referee."""
    LOLA = auto()
    """LoLA's server, its bridge, gait."""


class Nodes(Protocol):
    """What a fault may do with the nodes."""

    def seconds(self) -> float:
        """Simulated time [s]."""
        ...

    def kill(self, name: str) -> None:
        """End a node at once."""
        ...

    def start(self, name: str) -> None:
        """Start a node again."""
        ...

    def pause(self, name: str, paused: bool) -> None:
        """Stop a node from running, or let it run on."""
        ...


class NodeFault(Fault):
    """One node is killed and starts again after a while, or never.

    Attributes:
        victim: The node that is struck; empty = none.
        referee: A referee runs, and the player waits for it.
        gone: Shortest and longest time [s] until the node is back.
        stays_gone: Share of the runs in which it does not come back.
        hangs: The node is stopped and goes on; it is not killed.
    """

    end = 26.0
    rig = Rig.MATCH
    victim = ""
    referee = False
    gone = (1.0, 5.0)
    stays_gone = 0.5
    hangs = False

    def __init__(self, random: np.random.Generator) -> None:
        super().__init__(random)
        self.begin = float(random.uniform(8.0, 12.0))
        never = random.uniform() < self.stays_gone
        duration = float(random.uniform(*self.gone))
        self.duration = math.inf if never else duration  # until it is back
        self._stage = 0

    def before_frame(self, nodes: Nodes) -> None:
        """Strike, and bring back, when it is time."""
        now = nodes.seconds()
        if self._stage == 0 and self.victim and now >= self.begin:
            self._stage = 1
            if self.hangs:
                nodes.pause(self.victim, True)
            else:
                nodes.kill(self.victim)
        elif self._stage == 1 and now >= self.begin + self.duration:
            self._stage = 2
            if self.hangs:
                nodes.pause(self.victim, False)
            else:
                nodes.start(self.victim)


class GaitKilled(NodeFault):
    """The gait is killed while the robot plays, and is started again at once."""

    says = ("fallen",)
    victim = "gait"
    gone = (0.0, 0.5)
    stays_gone = 0.0


class VisionKilled(NodeFault):
    """Vision is killed; in half of the runs it is started again after 1 to 5 s."""

    says = ("no usable image",)
    victim = "vision"


class PlayerKilled(NodeFault):
    """The player is killed; in half of the runs it is started again after 1 to 5 s."""

    says = ("no cmd_vel", "own pose not valid")
    victim = "player"


class PlayerHangs(NodeFault):
    """The player hangs for 1 to 5 s."""

    says = ("no cmd_vel",)
    victim = "player"
    stays_gone = 0.0
    hangs = True


class RefereeKilled(NodeFault):
    """The referee is killed in play; in half of the runs another begins a new match."""

    says = ("referee not heard",)
    victim = "referee"
    referee = True
    end = 44.0

    def __init__(self, random: np.random.Generator) -> None:
        super().__init__(random)
        self.begin += 16.0  # the ball is in play


class LolaFault(NodeFault):
    """A robot behind LoLA's socket that walks ahead."""

    rig = Rig.LOLA
    stays_gone = 0.0


class LolaSilent(LolaFault):
    """LoLA sends nothing for 1 to 5 s, then goes on."""

    says = ("no joint_states",)
    victim = "lola_server"
    hangs = True


class LolaBridgeKilled(LolaFault):
    """Lola_bridge is killed and started again after 1 to 5 s."""

    says = ("no joint_states",)
    victim = "lola_bridge"


class LolaGaitKilled(LolaFault):
    """The gait behind LoLA is killed; in half of the runs it is started again."""

    says = ("no joint_command",)
    victim = "gait"
    stays_gone = 0.5


NODE_FAULTS: Mapping[str, type[NodeFault]] = {
    "none": NodeFault,
    "gait_killed": GaitKilled,
    "vision_killed": VisionKilled,
    "player_killed": PlayerKilled,
    "player_hangs": PlayerHangs,
    "referee_killed": RefereeKilled,
    "lola_silent": LolaSilent,
    "lola_bridge_killed": LolaBridgeKilled,
    "lola_gait_killed": LolaGaitKilled,
}
"""By their names in the results of `--scope robot`."""


class NodeOutcome(NamedTuple):
    """How a run ended.

    Attributes:
        went_on: The robot walked, kicked or got up shortly before the end.
        violations: What must not happen, as `kind: evidence`.
        explained: Diagnostics above OK, and warnings and errors of logs, since the fault began.
    """

    went_on: bool
    violations: tuple[str, ...]
    explained: tuple[str, ...]


def run_node_fault(run: FaultRun) -> FaultResult:
    """Start the nodes, inject the fault, watch. The ROS wheels restart a process: it is another."""
    done = subprocess.run(
        [
            sys.executable, "-m", "gait_lab.faults.node_harness",
            run.fault, str(run.seed), run.engine, run.plant, run.urdf,
        ],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    if done.returncode:
        problem = f"harness: {(done.stderr.splitlines() or ['no output'])[-1]}"
        outcome = NodeOutcome(False, (problem,), ())
    else:
        outcome = NodeOutcome(*json.loads(done.stdout))
    ended = WENT_ON if outcome.went_on else STOPPED
    return FaultResult(
        run=run,
        outcome=VIOLATED if outcome.violations else ended,
        violations=tuple(outcome.violations),
        explained=tuple(outcome.explained),
    )
