"""Faults of the processes of one robot: a node is killed or hangs, and perhaps comes back."""

import json
import math
import subprocess
import sys
from collections.abc import Mapping
from enum import Enum, auto
from typing import TYPE_CHECKING, Any

import numpy as np

from gait_lab.faults.campaign import VIOLATED, FaultResult, FaultRun
from gait_lab.faults.harness import Fault

if TYPE_CHECKING:
    from gait_lab.faults.node_harness import NodeHarness


class Rig(Enum):
    """The nodes that run."""

    MATCH = auto()
    """Bridge with cameras, gait, vision, player, perhaps a referee."""
    LOLA = auto()
    """LoLA's server, its bridge, gait."""


class NodeFault(Fault):
    """One node is killed and starts again after a while, or never.

    Attributes:
        victim: The node that is struck; empty = none.
        referee: A referee runs, and the player waits for it.
        begins: Earliest and latest beginning [s].
        gone: Shortest and longest time [s] until the node is back.
        stays_gone: Share of the runs in which it does not come back.
        hangs: The node is stopped and goes on; it is not killed.
    """

    end = 26.0
    rig = Rig.MATCH
    victim = ""
    referee = False
    begins = (8.0, 12.0)
    gone = (1.0, 5.0)
    stays_gone = 0.5
    hangs = False

    def __init__(self, random: np.random.Generator) -> None:
        super().__init__(random)
        self.begin = float(random.uniform(*self.begins))
        never = random.uniform() < self.stays_gone
        duration = float(random.uniform(*self.gone))
        self.duration = math.inf if never else duration  # until it is back
        self._stage = 0

    def before_frame(self, nodes: "NodeHarness") -> None:
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


def _of(victim: str, *says: str, **more: Any) -> type[NodeFault]:
    """The faults of a node; `more`: other attributes of `NodeFault`."""
    return type("NodeFault", (NodeFault,), {"victim": victim, "says": says, **more})


_LOLA = {"rig": Rig.LOLA, "stays_gone": 0.0}
NODE_FAULTS: Mapping[str, type[NodeFault]] = {
    "none": NodeFault,
    "gait_killed": _of("gait", "fallen", gone=(0.0, 0.5), stays_gone=0.0),
    "vision_killed": _of("vision", "no usable image"),
    "player_killed": _of("player", "no cmd_vel", "own pose not valid"),
    "player_hangs": _of("player", "no cmd_vel", stays_gone=0.0, hangs=True),
    # In play, which begins later; another one begins a new match.
    "referee_killed": _of(
        "referee", "referee not heard", referee=True, end=44.0, begins=(24.0, 28.0)
    ),
    "lola_silent": _of("lola_server", "no joint_states", **_LOLA, hangs=True),
    "lola_bridge_killed": _of("lola_bridge", "no joint_states", **_LOLA),
    "lola_gait_killed": _of("gait", "no joint_command", rig=Rig.LOLA),
}
"""By their names in the results of `--scope robot`."""


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
        return FaultResult(run, VIOLATED, (problem,), ())
    outcome, violations, explained = json.loads(done.stdout)
    return FaultResult(run, outcome, tuple(violations), tuple(explained))
