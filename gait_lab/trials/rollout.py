"""A walk of a timed task: one robot walks it, and `Metrics` say how well.

A result depends on its `RolloutSpec` alone. The classes behind the two ROS nodes are called in the
same order as over ROS, so what is measured here is what walks there.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import islice

import numpy as np

from gait_lab.analysis.metrics import (
    ALARM_STATES,
    DOUBLE,
    SUPPORT_CODES,
    Metrics,
    Trace,
    measure,
)
from gait_lab.trials.motions import MotionOutcome, MotionWatch, ball_for
from gait_lab.trials.parallel import parallel_map
from gait_lab.trials.tasks import Task
from gait_lab.trials.trial import (
    CONTROL_PERIOD,
    Push,
    TimedCommands,
    TrialSpec,
    Walker,
    loaded_robot,
    make_gait,
    make_world,
    run,
)
from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.gait import Gait
from nao_lipm_gait.robot import RobotDescription
from nao_lipm_gait.types import GaitStatus, VelocityCommand
from sim_bridge.robot import GroundTruth
from sim_bridge.world import World

UNKNOWN = (math.nan, math.nan, math.nan)


@dataclass(frozen=True, slots=True)
class RolloutSpec(TrialSpec):
    """Everything that a rollout depends on.

    Attributes:
        task: The commands over time and the measured window.
        keep_trace: Return the trace with the result.
        push: A push on the way.
        walker: Makes what walks in the gait's place, for a robot, a task and a control period [s].
    """

    task: Task
    keep_trace: bool = False
    push: Push | None = None
    walker: Callable[[RobotDescription, Task, float], Walker] | None = None


@dataclass(frozen=True, slots=True)
class RolloutResult:
    """What came of a rollout.

    Attributes:
        spec: What was asked for.
        metrics: Of the task's window.
        trace: If the specification keeps it.
        motions: What became of the motions of the task that were due.
    """

    spec: RolloutSpec
    metrics: Metrics
    trace: Trace | None = None
    motions: tuple[MotionOutcome, ...] = ()


_COLUMNS = {
    "stamp": 1, "torso_position": 3, "torso_quaternion": 4, "torso_velocity": 3, "com": 3,
    "sole_position": 6, "sole_yaw": 2, "sole_force": 2, "sole_slip": 2, "legs_touch": 1,
    "saturated": 1, "command": 3, "alarm": 1, "odometry": 3, "status_stamp": 1, "support": 1,
    "support_sole_in_q": 3, "com_expected_in_q": 3, "com_measured_in_q": 3, "com_estimated_in_q": 3,
}  # fmt: skip
"""Numbers per tick of each column of a `Trace`, in the order in which they are recorded."""
_UNSEEN = (False, *UNKNOWN, -1, DOUBLE, *UNKNOWN, *UNKNOWN, *UNKNOWN, *UNKNOWN)
"""The columns of the gait, from `alarm` on, as long as it has not seen a frame."""


class Recorder:
    """Collects one row of numbers per control tick.

    Plain tuples of numbers: objects that are kept by the thousand cost time, because Python's
    garbage collector looks through them again and again.
    """

    def __init__(self) -> None:
        self._rows: list[tuple[float, ...]] = []
        self._phase: tuple[str, int] | None = None
        self._sole_in_q = UNKNOWN

    def add(
        self, truth: GroundTruth, command: VelocityCommand, status: GaitStatus | None = None
    ) -> None:
        """Append a tick; `status` is None as long as the gait has not seen a frame."""
        left, right = truth.soles
        self._rows.append((
            truth.stamp,
            *truth.torso_position.tolist(),
            *truth.torso_quaternion.tolist(),
            *truth.torso_linear_velocity_in_torso.tolist(),
            *truth.com.tolist(),
            *left.position.tolist(), *right.position.tolist(),
            _yaw(left.rotation), _yaw(right.rotation),
            *truth.sole_force.tolist(),
            *truth.sole_slip.tolist(),
            truth.legs_touch,
            truth.torque_saturated,
            command.x, command.y, command.yaw,
            *(_UNSEEN if status is None else self._seen(status)),
        ))  # fmt: skip

    def _seen(self, status: GaitStatus) -> tuple[float, ...]:
        # Soles are given as commanded, ahead of the measurement by the delay: at the end of a phase
        # the support sole already swings there. So it is kept as it was when the phase began.
        phase = (status.support, status.step_count)
        if phase != self._phase:
            self._phase = phase
            self._sole_in_q = _support_sole_in_q(status)
        return (
            status.state.value in ALARM_STATES,
            *status.base_footprint_in_odom,
            status.stamp,
            SUPPORT_CODES[status.support],
            *self._sole_in_q,
            *status.com_expected_in_q,
            *status.com_measured_in_q,
            *status.com_estimated_in_q,
        )

    def trace(self) -> Trace:
        table = np.array(self._rows, dtype=float).reshape(-1, sum(_COLUMNS.values()))
        ends = np.cumsum(list(_COLUMNS.values()))
        columns = dict(zip(_COLUMNS, np.split(table, ends[:-1], axis=1), strict=True))
        for name, width in _COLUMNS.items():
            if width == 1:
                columns[name] = columns[name][:, 0]
        columns["sole_position"] = columns["sole_position"].reshape(-1, 2, 3)
        for name in ("stamp", "saturated", "status_stamp", "support"):
            columns[name] = columns[name].astype(np.int64)
        for name in ("legs_touch", "alarm"):
            columns[name] = columns[name].astype(bool)
        return Trace(**columns)


def _yaw(rotation: np.ndarray) -> float:
    return math.atan2(rotation[1, 0], rotation[0, 0])


def _support_sole_in_q(status: GaitStatus) -> tuple[float, float, float]:
    if status.support == "double":
        return UNKNOWN
    sole = status.left_sole_in_odom if status.support == "left" else status.right_sole_in_odom
    qx, qy, q_yaw = status.q_in_odom
    dx, dy = sole[0] - qx, sole[1] - qy
    cos, sin = math.cos(q_yaw), math.sin(q_yaw)
    return cos * dx + sin * dy, cos * dy - sin * dx, sole[5] - q_yaw


def make_pair(spec: RolloutSpec) -> tuple[World, Gait]:
    """The world of a rollout, which the caller closes, and the robot's gait."""
    return make_world(spec, ball=ball_for(spec.task.motions)), make_gait(spec)


def task_ticks(task: Task) -> int:
    """Ticks of a task that nothing ends early, the one at rest included."""
    return math.ceil(task.end / CONTROL_PERIOD - 1e-6) + 1


def rollout(spec: RolloutSpec) -> RolloutResult:
    """Run one task on one robot, until its end or a fall."""
    task = spec.task
    if spec.walker is not None and task.motions:
        raise NaoGaitError("walker", task.name, "a task without motions, which only the gait has")
    world, gait = make_pair(spec)
    walker: Walker = gait
    recorder = Recorder()
    with world:
        watch = MotionWatch(world, gait, task.motions)
        if spec.walker is not None:
            walker = spec.walker(loaded_robot(spec.urdf), task, CONTROL_PERIOD)
        pushes = () if spec.push is None else (spec.push,)
        # A motion is requested between two ticks.
        policy = TimedCommands(task.command_at, pushes, ahead=not task.motions)
        for tick in islice(run(world, walker, policy), task_ticks(task)):
            recorder.add(tick.truth, tick.command, tick.status)
            if task.motions:
                watch.tick()
    trace = recorder.trace()
    metrics = measure(trace, task.start, task.end, loaded_robot(spec.urdf).sole_outline)
    return RolloutResult(spec, metrics, trace if spec.keep_trace else None, watch.outcomes)


def run_all(
    specs: Iterable[RolloutSpec],
    *,
    jobs: int | None = None,
    show: bool = True,
    label: str = "rollouts",
) -> list[RolloutResult]:
    """All rollouts, over all cores.

    Args:
        specs: The rollouts.
        jobs: Number of processes; None for all cores.
        show: Show a progress bar on a terminal.
        label: Of the progress bar.

    Returns:
        The results in the order of the specs.
    """
    return parallel_map(rollout, specs, jobs=jobs, label=label, show=show, note=_note)


def _note(result: RolloutResult) -> str:
    spec, metrics = result.spec, result.metrics
    end = f"fell at {metrics.fall_time:.1f} s" if metrics.fell else "upright"
    return f"{spec.task.name} robot {spec.robot_seed}: {end}"
