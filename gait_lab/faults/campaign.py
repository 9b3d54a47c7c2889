"""Fault campaign: runs of one fault on one robot each, and their outcomes."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from gait_lab.faults import network_faults as network
from gait_lab.faults import process_faults as process
from gait_lab.faults import robot_faults as robot
from gait_lab.faults import sensor_faults as sensors
from gait_lab.faults import stamp_faults as stamps
from gait_lab.faults.harness import PERIOD, Fault, Harness
from gait_lab.faults.healthy import Healthy
from robot_core.types import GaitState, VelocityCommand
from sim_bridge.trials.trial import TrialSpec, make_world
from sim_bridge.world import World

WALKS, STOPPED, FELL, VIOLATED = "walks", "stopped", "fell", "violated"
OUTCOMES = (WALKS, STOPPED, FELL, VIOLATED)
WENT_ON = "went_on"
"""Outcome of a fault in a match: the player plays, perhaps after a fall."""

FAULTS: Mapping[str, type[Fault]] = {
    "none": Fault,
    "silence": sensors.Silence,
    "frozen": sensors.Frozen,
    "joint_dropout": sensors.JointDropout,
    "nan": sensors.NotANumber,
    "spikes": sensors.Spikes,
    "bias_jump": sensors.BiasJump,
    "imu_outage": sensors.ImuOutage,
    "repeated": stamps.Repeated,
    "reordered": stamps.Reordered,
    "stamp_outliers": stamps.Outliers,
    "stamp_jitter": stamps.Jitter,
    "stamp_jump": stamps.Jump,
    "loss": network.Loss,
    "bursts": network.Bursts,
    "latency": network.Latency,
    "late_controller": network.LateController,
    "starved": network.StarvedProcessor,
    "gait_restart": process.GaitRestart,
    "bridge_reset": process.BridgeReset,
    "bridge_restart": process.BridgeRestart,
    "two_drivers": process.TwoDrivers,
    "two_gaits": process.TwoGaits,
    "parameters": process.Parameters,
    "no_commands": process.NoCommands,
    "bad_commands": process.BadCommands,
    "weak_motor": robot.WeakMotor,
    "limp_motor": robot.LimpMotor,
    "slippery": robot.SlipperyPatch,
    "picked_up": robot.PickedUp,
    "wandering_age": network.WanderingAge,
}
"""A new class goes to the end: the place of a class is part of the seeds of its runs."""
COMPARISON_FAULTS: Mapping[str, type[Fault]] = {
    "imu_gone": sensors.ImuGone,
    "imu_ignored": sensors.ImuIgnored,
    "healthy": Healthy,
}
"""Not part of the campaign: stopping without an IMU or walking on; a robot without a fault."""
ALL_FAULTS: Mapping[str, type[Fault]] = {**FAULTS, **COMPARISON_FAULTS}


@dataclass(frozen=True, slots=True)
class FaultRun(TrialSpec):
    """Everything that a run depends on; robot, noise, command and fault follow from the seed."""

    fault: str
    seed: int
    engine: str = field(default="mujoco", kw_only=True)

    def world(self, robot_seed: int, noise_seed: int = 0) -> World:
        """The world of one robot and one noise; the caller closes it."""
        return make_world(replace(self, robot_seed=robot_seed, noise_seed=noise_seed))


@dataclass(frozen=True, slots=True)
class FaultResult:
    """Result of a run.

    Attributes:
        violations: Violated invariants as `kind: evidence`.
        explained: Diagnostics above OK.
    """

    run: FaultRun
    outcome: str
    violations: tuple[str, ...]
    explained: tuple[str, ...]


def run_fault(run: FaultRun) -> FaultResult:
    """Stand, walk, inject the fault, and continue to the end of the run."""
    # Both faults of the comparison get the same robots and commands.
    kind = list(ALL_FAULTS).index(run.fault.replace("ignored", "gone"))
    random = np.random.default_rng((kind, run.seed))
    fault = ALL_FAULTS[run.fault](random)
    command = VelocityCommand(
        float(random.uniform(0.05, 0.25)),
        float(random.uniform(-0.05, 0.05)),
        float(random.uniform(-0.3, 0.3)),
    )
    with run.world(fault.individual(run.seed), run.seed) as world:
        harness = Harness(world, run.parameters, fault, command)
        try:
            harness.run(round(fault.end / PERIOD))
        except Exception as error:
            harness.invariants.violate("exception", f"{type(error).__name__}: {error}")
        return _result(run, harness)


def _result(run: FaultRun, harness: Harness) -> FaultResult:
    invariants = harness.invariants
    states = {gait.controller.state for gait in harness.gaits}
    if invariants.violations:
        outcome = VIOLATED
    elif harness.fallen or invariants.fell_at is not None:
        outcome = FELL
    elif GaitState.WALK in states:
        outcome = WALKS
    else:
        outcome = STOPPED
    return FaultResult(
        run=run,
        outcome=outcome,
        violations=invariants.listed(),
        explained=tuple(invariants.explained),
    )
