"""The suite `faults`: every class of faults on many robots, and how each run ended."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from gait_lab.bench.options import BenchOptions, option
from gait_lab.bench.result import Cell as TableCell
from gait_lab.bench.result import Column, Measurement, SuiteResult, Table
from gait_lab.bench.suite import Suite
from gait_lab.faults.campaign import FELL, OUTCOMES, VIOLATED, FaultResult, FaultRun, run_fault
from gait_lab.faults.catalogue import ALL_FAULTS, FAULTS
from gait_lab.trials.parallel import parallel_map
from nao_lipm_gait.errors import NaoGaitError

_EVIDENCE = 20
"""Violations that are listed one by one."""


@dataclass(frozen=True)
class Options(BenchOptions):
    """What the suite `faults` runs on."""

    engine: str = "mujoco"
    runs: int = option(2000, "walks with a fault each", "N", minimum=1, maximum=10_000_000)
    faults: tuple[str, ...] = option(
        (), "only this class, e.g. imu_outage", "NAME", flags=("--fault",)
    )


def classes_of(names: Sequence[str]) -> tuple[str, ...]:
    """The classes of these names, all if none is named; raises NaoGaitError."""
    for name in names:
        if name not in ALL_FAULTS:
            raise NaoGaitError("fault", name, f"one of {', '.join(ALL_FAULTS)}")
    return tuple(dict.fromkeys(names)) or tuple(FAULTS)


def runs_of(options: Options) -> list[FaultRun]:
    """`options.runs` runs, the classes in turn, each run of a class with a seed of its own."""
    names, first = classes_of(options.faults), max(options.seed, 0)
    return [
        fault_run(options, names[index % len(names)], first + index // len(names))
        for index in range(options.runs)
    ]


def fault_run(options: BenchOptions, fault: str, seed: int) -> FaultRun:
    """One run on the robot, plant and engine of the options."""
    return FaultRun(
        fault, seed, engine=options.engine, plant=options.plant,
        plant_options=options.plant_options, urdf=options.urdf, parameters=options.parameters,
    )  # fmt: skip


def faults(options: Options) -> SuiteResult:
    """The campaign: outcomes per class, why robots fell, and the evidence of every violation."""
    verdicts = parallel_map(
        run_fault, runs_of(options), jobs=options.jobs, show=options.show, label="faults",
        note=lambda verdict: f"{verdict.run.fault}: {verdict.outcome}",
    )  # fmt: skip
    by_class: dict[str, list[FaultResult]] = {}
    for verdict in verdicts:
        by_class.setdefault(verdict.run.fault, []).append(verdict)
    groups = {**by_class, "all": verdicts}
    columns = (
        Column("fault"), Column("runs"), *map(Column, OUTCOMES), Column("fell, unknown"),
        Column("what happens to the robot"),
    )  # fmt: skip
    return SuiteResult(
        tuple(row for name, found in groups.items() for row in _rows(name, found)),
        f"{len(verdicts)} runs with a fault in the middle of a walk; plant "
        f"{options.plant_title}, {options.engine}, {options.urdf}",
        (Table(columns, [_line(name, found) for name, found in groups.items()]),),
        tuple(_notes(by_class, verdicts)),
        same_robots=False,
    )


def _rows(name: str, verdicts: Sequence[FaultResult]) -> list[Measurement]:
    count = Counter(verdict.outcome for verdict in verdicts)
    return [Measurement(f"{name}_{outcome}", "runs", count[outcome]) for outcome in OUTCOMES]


def _line(name: str, verdicts: Sequence[FaultResult]) -> tuple[TableCell, ...]:
    count = Counter(verdict.outcome for verdict in verdicts)
    unknown = sum(v.outcome == FELL and not v.down_known for v in verdicts)
    summary = ALL_FAULTS[name].summary if name in ALL_FAULTS else ""
    outcomes = (count[outcome] for outcome in OUTCOMES)
    return (name.replace("_", " "), len(verdicts), *outcomes, unknown, summary)


def _notes(
    by_class: Mapping[str, Sequence[FaultResult]], verdicts: Sequence[FaultResult]
) -> list[str]:
    notes = [
        "walks: upright and walking at the end. stopped: upright, and a report says why. fell: the "
        "robot fell; fell, unknown: of these, the gait does not report at the end that it is down.",
        "violated: a command that is not finite, beyond the limits of a joint or too fast; an "
        "exception; a hang; a stop without a report; stiff commands after a fall that the gait "
        "did not detect.",
    ]
    notes += [
        f"Falls, {name.replace('_', ' ')}: {ALL_FAULTS[name].why}"
        for name, found in by_class.items()
        if ALL_FAULTS[name].why and any(verdict.outcome == FELL for verdict in found)
    ]  # fmt: skip
    broken = [verdict for verdict in verdicts if verdict.outcome == VIOLATED]
    return notes + [
        f"VIOLATED {verdict.run.fault}, seed {verdict.run.seed}: {'; '.join(verdict.violations)}"
        for verdict in broken[:_EVIDENCE]
    ]


SUITE = Suite(
    name="faults",
    title="Faults in the middle of a walk",
    summary="every class of sensor, message, process and robot faults during a walk",
    measure=faults,
    options=Options,
    quick=({"runs": 56},),
    check=lambda options: classes_of(options.faults),
)
