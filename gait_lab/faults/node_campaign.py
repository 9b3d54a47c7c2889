"""Runs of the nodes of one robot with a fault of one of them, each in a process of its own."""

import json
import subprocess
import sys
from typing import NamedTuple

from gait_lab.faults.campaign import STOPPED, VIOLATED, WENT_ON, FaultResult, FaultRun


class NodeOutcome(NamedTuple):
    """How a run ended.

    Attributes:
        went_on: The robot walked, kicked or got up shortly before the end.
        violations: What must not happen, as `kind: evidence`.
        explained: Diagnostics above OK, and warnings and errors of logs, since the fault began.
        fell: The robot fell since then.
        end: Simulated time at the end [s].
    """

    went_on: bool
    violations: tuple[str, ...]
    explained: tuple[str, ...]
    fell: bool
    end: float


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
        outcome = NodeOutcome(False, (problem,), (), False, 0.0)
    else:
        outcome = NodeOutcome(*json.loads(done.stdout))
    ended = WENT_ON if outcome.went_on else STOPPED
    return FaultResult(
        run=run,
        outcome=VIOLATED if outcome.violations else ended,
        violations=tuple(outcome.violations),
        explained=tuple(outcome.explained),
        fell_at=outcome.end if outcome.fell else None,
        down_known=True,
    )
