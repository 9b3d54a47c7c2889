"""The suite `faults`: every class of faults on many robots, and how each run ended.

The classes and what must happen belong to a scope: see `gait_lab.faults.scopes`.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from gait_lab.bench.options import BenchOptions, keep_option, option
from gait_lab.bench.result import Cell as TableCell
from gait_lab.bench.result import Column, Measurement, SuiteResult, Table
from gait_lab.bench.suite import Suite
from gait_lab.faults.campaign import FELL, VIOLATED, FaultResult, FaultRun
from gait_lab.faults.scopes import SCOPES, Scope
from nao_lipm_gait.presets import DEFAULT, preset_for
from robot_core.errors import NaoGaitError
from robot_core.robot import load_robot
from sim_bridge.trials.parallel import parallel_map
from sim_bridge.trials.result_cache import ResultCache

_EVIDENCE = 20
"""Violations that are listed one by one."""


@dataclass(frozen=True)
class Options(BenchOptions):
    """What the suite `faults` runs on."""

    engine: str = "mujoco"
    scope: str = option("gait", "what fails", "SCOPE", choices=tuple(SCOPES))
    runs: int = option(
        0, "runs with a fault each; 0 = the usual number of the scope", "N", minimum=0,
        maximum=10_000_000,
    )  # fmt: skip
    faults: tuple[str, ...] = option(
        (), "only this class, e.g. imu_outage", "NAME", flags=("--fault",)
    )
    keep: str = keep_option()


def classes_of(scope: Scope, names: Sequence[str]) -> tuple[str, ...]:
    """The classes of these names, all if none is named; raises NaoGaitError."""
    for name in names:
        if name not in scope.all_classes:
            raise NaoGaitError("fault", name, f"one of {', '.join(scope.all_classes)}")
    return tuple(dict.fromkeys(names)) or tuple(scope.classes)


def check(options: Options) -> None:
    """Raise NaoGaitError for what a scope cannot do."""
    classes_of(SCOPES[options.scope], options.faults)
    if options.scope != "gait" and options.parameters != preset_for(
        load_robot(options.urdf), DEFAULT
    ):
        allowed = f"those of the robot's own preset in the scope {options.scope}"
        raise NaoGaitError("preset or set", "other parameters", allowed)
    if options.scope == "robot" and options.plant_options:
        name, value = options.plant_options[0]
        raise NaoGaitError("plant-set", f"{name}={value}", "nothing in the scope robot")


def runs_of(options: Options) -> list[FaultRun]:
    """The runs, the classes in turn, each run of a class with a seed of its own."""
    scope = SCOPES[options.scope]
    names, first = classes_of(scope, options.faults), max(options.seed, 0)
    return [
        fault_run(options, names[index % len(names)], first + index // len(names))
        for index in range(options.runs or scope.usual)
    ]


def fault_run(options: BenchOptions, fault: str, seed: int) -> FaultRun:
    """One run on the robot, plant and engine of the options."""
    return FaultRun(
        fault, seed, engine=options.engine, plant=options.plant,
        plant_options=options.plant_options, urdf=options.urdf, parameters=options.parameters,
    )  # fmt: skip


def faults(options: Options) -> SuiteResult:
    """The campaign: outcomes per class, why robots fell, and the evidence of every violation."""
    scope = SCOPES[options.scope]
    verdicts = parallel_map(
        scope.run, runs_of(options), jobs=options.jobs, show=options.show, label="faults",
        note=lambda verdict: f"{verdict.run.fault}: {verdict.outcome}",
        kept=ResultCache(options.keep, FaultResult.restored) if options.keep else None,
    )  # fmt: skip
    by_class: dict[str, list[FaultResult]] = {}
    for verdict in verdicts:
        by_class.setdefault(verdict.run.fault, []).append(verdict)
    groups = {**by_class, "all": verdicts}
    columns = (
        Column("fault"), Column("runs"),
        *(Column(outcome.replace("_", " ")) for outcome in scope.outcomes),
        Column(scope.counted[0]), Column("what happens"),
    )  # fmt: skip
    return SuiteResult(
        tuple(row for name, found in groups.items() for row in _rows(scope, name, found)),
        f"{len(verdicts)} {scope.title}; plant {options.plant_title}, {options.engine}, "
        f"{options.urdf}",
        (Table(columns, [_line(scope, name, found) for name, found in groups.items()]),),
        tuple(_notes(scope, by_class, verdicts)),
        same_robots=False,
    )


def _rows(scope: Scope, name: str, verdicts: Sequence[FaultResult]) -> list[Measurement]:
    count = Counter(verdict.outcome for verdict in verdicts)
    return [Measurement(f"{name}_{outcome}", "runs", count[outcome]) for outcome in scope.outcomes]


def _line(scope: Scope, name: str, verdicts: Sequence[FaultResult]) -> tuple[TableCell, ...]:
    count = Counter(verdict.outcome for verdict in verdicts)
    counted = sum(map(scope.counted[1], verdicts))
    classes = scope.all_classes
    summary = classes[name].summary if name in classes else ""
    outcomes = (count[outcome] for outcome in scope.outcomes)
    return (name.replace("_", " "), len(verdicts), *outcomes, counted, summary)


def _notes(
    scope: Scope, by_class: Mapping[str, Sequence[FaultResult]], verdicts: Sequence[FaultResult]
) -> list[str]:
    classes = scope.all_classes
    notes = [*scope.notes]
    notes += [
        f"Falls, {name.replace('_', ' ')}: {classes[name].why}"
        for name, found in by_class.items()
        if classes[name].why and any(verdict.outcome == FELL for verdict in found)
    ]
    broken = [verdict for verdict in verdicts if verdict.outcome == VIOLATED]
    return notes + [
        f"VIOLATED {verdict.run.fault}, seed {verdict.run.seed}: {'; '.join(verdict.violations)}"
        for verdict in broken[:_EVIDENCE]
    ]


SUITE = Suite(
    name="faults",
    title="Faults in the middle of a walk",
    summary="every class of faults of sensors, messages and processes, in a walk or in a match",
    measure=faults,
    options=Options,
    quick=({"runs": 56},),
    check=check,
)
