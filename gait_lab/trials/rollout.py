"""One walk in one process: the simulation and the gait in lockstep, without ROS, deterministic.

The same classes as behind the two nodes are called in the same order, so what is measured here is
what walks over ROS. A result depends on its `RolloutSpec` alone.
"""

import math
import os
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import count, islice
from typing import Any

import numpy as np

from gait_lab.analysis.metrics import (
    ALARM_STATES,
    DOUBLE,
    SUPPORT_CODES,
    Metrics,
    Trace,
    has_fallen,
    measure,
    yaw_of,
)
from gait_lab.compiled import check_fresh
from gait_lab.trials.answers import Answers, Walker
from gait_lab.trials.asked_motions import MotionOutcome, MotionWatch, ball_for
from gait_lab.trials.tasks import Task
from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.gait import Gait
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.robot import RobotDescription, load_robot
from nao_lipm_gait.types import GaitStatus, JointTargets, VelocityCommand
from sim_bridge.plant import PlantOption, load_plant, with_options
from sim_bridge.simulation import GroundTruth, Simulation

CONTROL_PERIOD = 0.01
"""[s] between two ticks of the gait."""
UNKNOWN = (math.nan, math.nan, math.nan)
PUSH_DURATION = 0.1
"""[s] for which the force of a push acts."""


@dataclass(frozen=True, slots=True)
class Push:
    """A push at the torso."""

    time: float
    """[s] since the start."""
    impulse: float
    """[N s]; the force is this over `PUSH_DURATION`."""
    direction: float
    """[rad] of the force, counter-clockwise from the robot's heading at that moment."""

    def force(self, heading: float) -> np.ndarray:
        """(3,) [N] in the world, for a robot that looks along `heading` [rad]."""
        size, angle = self.impulse / PUSH_DURATION, heading + self.direction
        return np.array((size * math.cos(angle), size * math.sin(angle), 0.0))


@dataclass(frozen=True, slots=True)
class RolloutSpec:
    """Everything that a rollout depends on; small and picklable."""

    task: Task
    robot_seed: int = 0
    """The individual; -1 is the nominal robot."""
    noise_seed: int = 0
    parameters: GaitParameters = field(default_factory=GaitParameters)
    plant: str = "reference"
    urdf: str = "nao_h21_v33"
    engine: str = "pybullet"
    keep_trace: bool = False
    plant_options: tuple[PlantOption, ...] = ()
    """Options of the plant that are replaced: (("motor.play", 0.035), ...)."""
    push: Push | None = None
    urdf_effort: bool = False
    """Motors whose stall torque is the effort limit of the URDF, instead of their own."""
    walker: Callable[[RobotDescription, Task, float], Walker] | None = None
    """Makes what walks in the gait's place, for a robot, a task and a control period [s]."""


@dataclass(frozen=True, slots=True)
class RolloutResult:
    spec: RolloutSpec
    metrics: Metrics
    trace: Trace | None = None
    motions: tuple[MotionOutcome, ...] = ()
    """What became of the motions of the task, as far as they were due."""


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


@lru_cache(maxsize=4)
def loaded_robot(urdf: str) -> RobotDescription:
    return load_robot(urdf)


def with_urdf_effort(robot: RobotDescription) -> RobotDescription:
    motors = {
        name: replace(motor, stall_torque=robot.limits[name].effort)
        for name, motor in robot.motors.items()
    }
    return replace(robot, motors=motors)


def make_pair(spec: RolloutSpec) -> tuple[Simulation, Gait]:
    """The robot of a rollout and its gait; the simulation is the caller's to close."""
    check_fresh()
    robot = loaded_robot(spec.urdf)
    simulation = Simulation(
        with_urdf_effort(robot) if spec.urdf_effort else robot,
        with_options(load_plant(spec.plant), spec.plant_options),
        robot_seed=spec.robot_seed,
        noise_seed=spec.noise_seed,
        engine=spec.engine,
        control_period=CONTROL_PERIOD,
        ball=ball_for(spec.task.motions),
    )
    return simulation, Gait(robot, spec.parameters)


def rollout(spec: RolloutSpec) -> RolloutResult:
    """Run one task on one robot, until its end or a fall."""
    task = spec.task
    walker: Walker
    if spec.walker is not None and task.motions:
        raise NaoGaitError("walker", task.name, "a task without motions, which only the gait has")
    simulation, gait = make_pair(spec)
    walker = gait
    recorder = Recorder()
    try:
        watch = MotionWatch(simulation, gait, task.motions)
        if spec.walker is not None:
            walker = spec.walker(loaded_robot(spec.urdf), task, CONTROL_PERIOD)
        # A motion is asked for between two ticks, so that they have to come one by one.
        ahead = not task.motions
        ticks = walk(simulation, walker, task.command_at, push=spec.push, ahead=ahead)
        for tick in islice(ticks, math.ceil(task.end / CONTROL_PERIOD - 1e-6) + 1):
            recorder.add(tick.truth, tick.command, tick.status)
            if task.motions:
                watch.tick()
    finally:
        simulation.close()
    trace = recorder.trace()
    metrics = measure(trace, task.start, task.end, loaded_robot(spec.urdf).sole_outline)
    return RolloutResult(spec, metrics, trace if spec.keep_trace else None, watch.outcomes)


@dataclass(frozen=True, slots=True)
class Tick:
    """One control period of a walk."""

    truth: GroundTruth
    command: VelocityCommand
    status: GaitStatus | None
    """None as long as the gait has not seen a frame."""
    fallen: bool


def walk(
    simulation: Simulation,
    gait: Walker,
    command_at: Callable[[float], VelocityCommand],
    *,
    push: Push | None = None,
    ahead: bool = False,
) -> Iterator[Tick]:
    """The robot at rest, then one control period after the other, up to and with a fall.

    `command_at`: the command by time since the start [s]; `ahead`: it depends on the time alone,
    and nobody asks the gait for anything else, so that it may go ahead of the simulation.
    """
    answers = Answers(simulation, gait, command_at, ahead=ahead)
    targets: JointTargets | None = None
    push_tick = None if push is None else round(push.time / CONTROL_PERIOD)

    truth = simulation.truth()
    height = float(truth.torso_position[2])
    yield Tick(truth, command_at(0.0), None, False)
    for tick in count():
        if push is not None and tick == push_tick:
            force = push.force(float(yaw_of(truth.torso_quaternion)))
            simulation.push(force, PUSH_DURATION)
        simulation.step(targets)
        command, targets, status = answers.next()
        truth = simulation.truth()
        fallen = has_fallen(truth.torso_position, truth.torso_quaternion, height)
        yield Tick(truth, command, status, fallen)
        if fallen:
            return


def workers(asked: int | None = None) -> int:
    """Number of worker processes: what was asked for, or all cores this process may use."""
    if asked is not None:
        if asked < 1:
            raise NaoGaitError("jobs", asked, "a number of processes, at least 1")
        return asked
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def parallel_map(
    function: Callable[[Any], Any],
    items: Iterable[Any],
    *,
    jobs: int | None = None,
    label: str = "rollouts",
    show: bool = True,
    note: Callable[[Any], str] | None = None,
) -> list[Any]:
    """`function` of every item, over all cores, in the order of the items, with a progress bar.

    joblib runs it: on a cluster, another joblib backend takes the same call.
    """
    from joblib import Parallel, delayed
    from tqdm import tqdm

    items = list(items)
    processes = min(workers(jobs), max(1, len(items)))
    done: Iterable[Any]
    if processes == 1:
        done = map(function, items)
    else:
        # Not unordered: joblib knows that from 1.4 on, Ubuntu 24.04 ships 1.3.
        parallel = Parallel(n_jobs=processes, return_as="generator")
        done = parallel(delayed(function)(item) for item in items)
    results = []
    with tqdm(total=len(items), desc=label, disable=None if show else True, leave=False) as bar:
        for result in done:
            results.append(result)
            if note is not None:
                bar.set_postfix_str(note(result), refresh=False)
            bar.update()
    return results


def run_all(
    specs: Iterable[RolloutSpec],
    *,
    jobs: int | None = None,
    show: bool = True,
    label: str = "rollouts",
) -> list[RolloutResult]:
    """All rollouts, over all cores; results in the order of the specs."""
    return parallel_map(rollout, specs, jobs=jobs, label=label, show=show, note=_note)


def _note(result: RolloutResult) -> str:
    spec, metrics = result.spec, result.metrics
    fate = f"fell at {metrics.fall_time:.1f} s" if metrics.fell else "upright"
    return f"{spec.task.name} robot {spec.robot_seed}: {fate}"
