"""Matches with a fault on the ways to one player, and how each ended."""

import numpy as np

from gait_lab.faults.campaign import STOPPED, VIOLATED, WENT_ON, FaultResult, FaultRun
from gait_lab.faults.catalogue import SOCCER_FAULTS
from gait_lab.faults.soccer_harness import SoccerHarness
from gait_lab.soccer.match import MatchSpec
from sim_bridge.plant import load_plant, with_options

HALF = 2.0
"""[min] Longer than a run."""


def run_soccer_fault(run: FaultRun) -> FaultResult:
    """Play, inject the fault, and play on to the end of the run."""
    kind = list(SOCCER_FAULTS).index(run.fault)
    fault = SOCCER_FAULTS[run.fault](np.random.default_rng((kind, run.seed)))
    spec = MatchSpec(
        seed=run.seed, robots=fault.robots, minutes=HALF, engine=run.engine, urdf=run.urdf,
        plant=with_options(load_plant(run.plant), run.plant_options), frames=False,
    )  # fmt: skip
    harness = SoccerHarness(spec, fault)
    try:
        harness.run()
    except Exception as error:
        harness.violate("exception", f"{type(error).__name__}: {error}")
    finally:
        harness.close()
    ended = STOPPED if harness.stopped else WENT_ON
    return FaultResult(
        run=run,
        outcome=VIOLATED if harness.violations else ended,
        violations=tuple(f"{kind}: {text}" for kind, text in harness.violations.items()),
        explained=tuple(harness.explained),
        fell_at=harness.fell_at,
        down_known=True,
    )
