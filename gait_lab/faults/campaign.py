"""One run of one fault on one robot, and what became of it."""

from dataclasses import dataclass, field

import numpy as np

from gait_lab.faults.classes import ALL
from gait_lab.faults.fault_trial import World
from gait_lab.faults.harness import PERIOD
from gait_lab.trials.rollout import RolloutSpec, make_pair
from gait_lab.trials.tasks import TASKS
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.types import GaitState, VelocityCommand
from sim_bridge.plant import PlantOption

WALKS, STOPPED, FELL, VIOLATED = "walks", "stopped", "fell", "violated"
OUTCOMES = (WALKS, STOPPED, FELL, VIOLATED)
ROBOTS = 100
"""Individuals among which a run chooses."""


@dataclass(frozen=True, slots=True)
class FaultRun:
    """All that a run depends on."""

    fault: str
    seed: int
    engine: str = "mujoco"
    plant: str = "reference"
    plant_options: tuple[PlantOption, ...] = ()
    urdf: str = "nao_h21_v33"
    parameters: GaitParameters = field(default_factory=GaitParameters)


@dataclass(frozen=True, slots=True)
class Verdict:
    """What became of a run."""

    run: FaultRun
    outcome: str
    violations: tuple[str, ...]
    """`kind: evidence`"""
    explained: tuple[str, ...]
    """What the diagnostics said above OK."""
    fell_at: float | None
    """[s]"""
    began_at: float
    """[s] The fault."""
    down_known: bool
    """A gait said at the end that the robot is down."""


def run_fault(run: FaultRun) -> Verdict:
    """One run, from standing through the walk and the fault to the end of its time."""
    # A comparison meets the same robots and commands.
    kind = list(ALL).index(run.fault.replace("ignored", "gone"))
    random = np.random.default_rng((kind, run.seed))
    fault = ALL[run.fault](random)
    command = VelocityCommand(
        float(random.uniform(0.05, 0.25)),
        float(random.uniform(-0.05, 0.05)),
        float(random.uniform(-0.3, 0.3)),
    )
    spec = RolloutSpec(
        task=TASKS["stand"],
        robot_seed=int(random.integers(ROBOTS)),
        noise_seed=run.seed,
        parameters=run.parameters,
        plant=run.plant,
        plant_options=run.plant_options,
        urdf=run.urdf,
        engine=run.engine,
    )
    simulation, _ = make_pair(spec)
    with simulation:
        world = World(simulation, run.parameters, fault, command)
        try:
            world.run(round(fault.end / PERIOD))
        except Exception as error:
            world.judge.violate("exception", f"{type(error).__name__}: {error}")
        return _verdict(run, world)


def _verdict(run: FaultRun, world: World) -> Verdict:
    judge = world.judge
    states = {gait.entry.state for gait in world.gaits}
    if judge.violations:
        outcome = VIOLATED
    elif world.fallen or judge.fell_at is not None:
        outcome = FELL
    elif GaitState.WALK in states:
        outcome = WALKS
    else:
        outcome = STOPPED
    return Verdict(
        run=run,
        outcome=outcome,
        violations=tuple(f"{kind}: {text}" for kind, text in judge.violations.items()),
        explained=tuple(judge.explained),
        fell_at=judge.fell_at,
        began_at=world.fault.begin,
        down_known=bool(states & {GaitState.FALLEN, GaitState.RELAXED}),
    )
