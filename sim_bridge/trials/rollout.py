"""A walk of a timed task: one robot walks it, and `Metrics` say how well.

A result depends on its `RolloutSpec` alone. The classes behind the two ROS nodes are called in the
same order as over ROS, so what is measured here is what walks there.
"""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import islice
from typing import Any

from nao_lipm_gait.calibration import NOT_CALIBRATED
from nao_lipm_gait.gait import Gait
from robot_core.errors import NaoGaitError
from robot_core.robot import RobotDescription
from sim_bridge.trials.calibration import calibrate
from sim_bridge.trials.metrics import Metrics, measure
from sim_bridge.trials.motions import MotionOutcome, MotionWatch, ball_for
from sim_bridge.trials.parallel import parallel_map
from sim_bridge.trials.result_cache import ResultCache
from sim_bridge.trials.tasks import Task
from sim_bridge.trials.trace import Recorder, Trace
from sim_bridge.trials.trial import (
    CONTROL_PERIOD,
    Push,
    SeesTruth,
    TimedCommands,
    TrialSpec,
    Walker,
    loaded_robot,
    make_gait,
    make_world,
    run,
)
from sim_bridge.world import World


@dataclass(frozen=True, slots=True)
class RolloutSpec(TrialSpec):
    """Everything that a rollout depends on.

    Attributes:
        task: The commands over time and the measured window.
        keep_trace: Return the trace with the result.
        push: A push on the way.
        calibrated: The robot has been calibrated by its own sensors (`calibrate`).
        walker: Makes what walks in the gait's place, for a robot, a task and a control period [s].
    """

    task: Task
    keep_trace: bool = False
    push: Push | None = None
    calibrated: bool = False
    walker: Callable[[RobotDescription, Task, float], Walker] | None = None


@dataclass(frozen=True, slots=True)
class RolloutResult:
    """What came of a rollout.

    Attributes:
        spec: The specification.
        metrics: Of the task's window.
        trace: If the specification keeps it.
        motions: What became of the motions of the task that were due.
        calibration_failed: The robot should have been calibrated and walked without.
    """

    spec: RolloutSpec
    metrics: Metrics
    trace: Trace | None = None
    motions: tuple[MotionOutcome, ...] = ()
    calibration_failed: bool = False

    @classmethod
    def restored(
        cls, spec: RolloutSpec, metrics: Mapping[str, Any], **more: Any
    ) -> "RolloutResult":
        """As a `ResultCache` has kept it; not with a trace or motions."""
        return cls(spec, Metrics(**metrics), **more)

    @property
    def faults(self) -> tuple[str, ...]:
        """Why the result does not count; empty if it does."""
        failed = ("not calibrated",) if self.calibration_failed else ()
        return *failed, *self.metrics.faults


def make_pair(spec: RolloutSpec) -> tuple[World, Gait]:
    """The world of a rollout, which the caller closes, and the robot's gait."""
    if spec.calibrated:
        spec = replace(spec, calibration=calibrate(spec) or NOT_CALIBRATED)
    return make_world(spec, ball=ball_for(spec.task.motions)), make_gait(spec)


def walker_of(spec: RolloutSpec, gait: Gait) -> Walker:
    """The gait, or what walks in its place."""
    if spec.walker is None:
        return gait
    return spec.walker(loaded_robot(spec.urdf), spec.task, spec.control_period)


def task_ticks(task: Task, period: float = CONTROL_PERIOD) -> int:
    """Ticks of a task that nothing ends early, the one at rest included; `period` [s] of a tick."""
    return math.ceil(task.end / period - 1e-6) + 1


def rollout(spec: RolloutSpec) -> RolloutResult:
    """Run one task on one robot, until its end or a fall.

    Raises:
        NaoGaitError: Another walk than the gait is to play motions.
    """
    task = spec.task
    if spec.walker is not None and task.motions:
        raise NaoGaitError(
            "walker", task.name, "a task without motions: only the gait can play motions"
        )
    world, gait = make_pair(spec)
    recorder = Recorder()
    with world:
        watch = MotionWatch(world, gait, task.motions)
        walker = walker_of(spec, gait)
        pushes = () if spec.push is None else (spec.push,)
        sees = walker if isinstance(walker, SeesTruth) else None
        # A motion is requested, and the truth seen, between two ticks.
        ahead = not task.motions and sees is None
        policy = TimedCommands(task.command_at, pushes, ahead=ahead)
        for tick in islice(
            run(world, walker, policy), task_ticks(task, spec.control_period)
        ):
            recorder.add(tick.truth, tick.command, tick.status)
            if sees is not None:
                sees.see(tick.truth)
            if task.motions:
                watch.tick()
    trace = recorder.trace()
    metrics = measure(trace, task.start, task.end, loaded_robot(spec.urdf).sole_outline)
    return RolloutResult(
        spec, metrics, trace if spec.keep_trace else None, watch.outcomes,
        calibration_failed=spec.calibrated and calibrate(spec) is None,
    )  # fmt: skip


def run_all(
    specs: Iterable[RolloutSpec],
    *,
    jobs: int | None = None,
    show: bool = True,
    label: str = "rollouts",
    resume: str = "",
) -> list[RolloutResult]:
    """All rollouts with their progress; see `parallel_map`. `resume`: file of finished ones."""
    kept = ResultCache(resume, RolloutResult.restored) if resume else None
    return parallel_map(rollout, specs, jobs=jobs, label=label, show=show, note=_note, kept=kept)


def _note(result: RolloutResult) -> str:
    spec, metrics = result.spec, result.metrics
    end = f"fell at {metrics.fall_time:.1f} s" if metrics.fell else "upright"
    return f"{spec.task.name} robot {spec.robot_seed}: {end}"
