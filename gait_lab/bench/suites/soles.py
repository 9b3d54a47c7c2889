"""The suite `soles`: how far the soles are from parallel, before and after levelling."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

from gait_lab.bench.options import BenchOptions, option
from gait_lab.bench.result import Column, Measurement, SuiteResult, Table
from gait_lab.bench.suite import Suite
from gait_lab.bench.suites.peers import is_nao
from robot_core.types import VelocityCommand
from sim_bridge.trials.calibration import Levelled, SoleTilt, levelling
from sim_bridge.trials.parallel import parallel_map
from sim_bridge.trials.tasks import STAND_TIME, find_task
from sim_bridge.trials.trial import Push, TrialSpec

PUSH_TIMES = (2.0, 4.0, 6.0)
"""[s] of walking at which the robot is pushed, in turn from the left, from behind, the front."""
PUSH_DIRECTIONS = (-0.5 * math.pi, 0.0, math.pi)


@dataclass(frozen=True)
class Options(BenchOptions):
    """What the suite `soles` runs on."""

    robots: int = 40
    engine: str = "mujoco"
    tasks: tuple[str, ...] = ("spot", "forward=20")
    window: float = 10.0
    push: float = option(
        0.0, "push the robot three times with this impulse [N s]", "J", minimum=0.0, maximum=5.0
    )


class _Job(NamedTuple):
    spec: TrialSpec
    command: VelocityCommand
    seconds: float
    push: float


class _Soles(NamedTuple):
    """Of one robot: the first and the last state of its walk."""

    before: Levelled
    after: Levelled


def soles(options: Options) -> SuiteResult:
    """Walk the robots and compare their soles with the truth."""
    tasks = [find_task(name) for name in options.tasks]
    jobs = [
        _Job(
            TrialSpec(robot_seed=seed, noise_seed=max(seed, 0), **options.trial),
            task.command, options.window, options.push,
        )
        for task, seed in product(tasks, options.seeds)
    ]  # fmt: skip
    walked = parallel_map(_walk, jobs, jobs=options.jobs, show=options.show)
    rows: list[Measurement] = []
    cells: list[tuple[str | float, ...]] = []
    for index, name in enumerate(options.tasks):
        start = index * options.robots
        robots = walked[start : start + options.robots]
        # The names of the contract belong to the first task.
        prefix = "sole" if index == 0 else f"{name.replace('=', '_')}_sole"
        upright = [robot for robot in robots if not robot.after.fallen]
        line: list[str | float] = [name.replace("_", " "), f"{len(upright)}/{len(robots)}"]
        for axis in SoleTilt._fields:
            for moment, states in (
                ("before", [robot.before for robot in upright]),
                ("after", [robot.after for robot in upright]),
            ):
                tilts = [math.degrees(getattr(state.left, axis)) for state in states]
                rms, worst = _rms(tilts), max(map(abs, tilts), default=math.nan)
                rows.append(Measurement(f"{prefix}_{axis}_rms_{moment}", "deg", _known(rms)))
                rows.append(Measurement(f"{prefix}_{axis}_worst_{moment}", "deg", _known(worst)))
                line += [rms, worst]
        rows.append(Measurement(f"{prefix}_upright", "robots", float(len(upright))))
        cells.append(tuple(line))
    columns = (
        Column("task"), Column("upright"),
        Column("pitch before", "rms deg", 2), Column("", "worst", 2),
        Column("after", "rms deg", 2), Column("", "worst", 2),
        Column("roll before", "rms deg", 2), Column("", "worst", 2),
        Column("after", "rms deg", 2), Column("", "worst", 2),
    )  # fmt: skip
    notes = (
        f"Tilt of the left sole relative to the right one against the truth, {options.window:g} s "
        "after a walk begins from a stand, of the robots that stayed upright. The robot measures "
        "it by gyro, accelerometer and encoders.",
    )
    return SuiteResult(
        tuple(rows), f"Sole levelling, {options.title}", (Table(columns, cells),), notes
    )


def _walk(job: _Job) -> _Soles:
    pushes = [
        Push(STAND_TIME + time, job.push, direction)
        for time, direction in zip(PUSH_TIMES, PUSH_DIRECTIONS, strict=True)
        if job.push > 0.0 and time < job.seconds
    ]
    states = levelling(job.spec, job.command, job.seconds, tuple(pushes))
    before = after = next(states)
    for after in states:
        if after.fallen:
            break
    return _Soles(before, after)


def _rms(values: Sequence[float]) -> float:
    return math.sqrt(sum(value * value for value in values) / len(values)) if values else math.nan


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None


SUITE = Suite(
    "soles", "Sole levelling", "the soles against each other before and after levelling", soles,
    Options, takes=("robots", "tasks", "window"), quick=({"robots": 4},), applies=is_nao,
)  # fmt: skip
