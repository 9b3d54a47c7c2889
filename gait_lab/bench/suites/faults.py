"""The suite `faults`: every class of faults on many robots, and what became of them."""

from collections import Counter
from collections.abc import Sequence

from gait_lab.bench.options import BenchOptions
from gait_lab.bench.report import Report, Row, table
from gait_lab.faults.campaign import FELL, OUTCOMES, VIOLATED, FaultResult, FaultRun, run_fault
from gait_lab.faults.catalogue import ALL_FAULTS, FAULTS
from gait_lab.trials.parallel import parallel_map
from nao_lipm_gait.errors import NaoGaitError

SUITE = "faults"
_EVIDENCE = 20
"""Violations that are told one by one."""


def classes_of(names: Sequence[str]) -> tuple[str, ...]:
    """The classes to run: those that are named, or all."""
    for name in names:
        if name not in ALL_FAULTS:
            raise NaoGaitError("fault", name, f"one of {', '.join(ALL_FAULTS)}")
    return tuple(dict.fromkeys(names)) or tuple(FAULTS)


def runs_of(options: BenchOptions) -> list[FaultRun]:
    """So many runs, one class after the other, each with a seed of its own."""
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


def faults(options: BenchOptions) -> Report:
    """The campaign: a table of outcomes, why robots fell, and the evidence of every violation."""
    verdicts = parallel_map(
        run_fault, runs_of(options), jobs=options.jobs, show=options.show, label="faults",
        note=lambda verdict: f"{verdict.run.fault}: {verdict.outcome}",
    )  # fmt: skip
    by_class: dict[str, list[FaultResult]] = {}
    for verdict in verdicts:
        by_class.setdefault(verdict.run.fault, []).append(verdict)
    rows = [row for name, found in by_class.items() for row in _rows(name, found)]
    rows += _rows("all", verdicts)
    return Report(tuple(rows), _text(by_class, verdicts, options), one_set_of_robots=False)


def _rows(name: str, verdicts: Sequence[FaultResult]) -> list[Row]:
    count = Counter(verdict.outcome for verdict in verdicts)
    return [Row(SUITE, f"{name}_{outcome}", "runs", count[outcome]) for outcome in OUTCOMES]


def _line(name: str, verdicts: Sequence[FaultResult], what: str) -> tuple[str, ...]:
    count = Counter(verdict.outcome for verdict in verdicts)
    silent = sum(v.outcome == FELL and not v.down_known for v in verdicts)
    return (
        name.replace("_", " "), str(len(verdicts)), *(str(count[each]) for each in OUTCOMES),
        str(silent), what,
    )  # fmt: skip


def _text(
    by_class: dict[str, list[FaultResult]], verdicts: Sequence[FaultResult], options: BenchOptions
) -> str:
    lines: list[tuple[str, ...]] = [
        ("fault", "runs", *OUTCOMES, "fell unknown", "what happens to the robot"),
        ("",) * 8,
    ]
    lines += [_line(name, found, ALL_FAULTS[name].summary) for name, found in by_class.items()]
    lines.append(_line("all", verdicts, ""))
    title = (
        f"{len(verdicts)} runs with a fault in the middle of a walk; plant "
        f"{options.plant_title}, {options.engine}, {options.urdf}"
    )
    notes = [
        "walks: upright and walking at the end. stopped: upright, and a report said why. fell: the",
        "robot fell. fell unknown: of these, the gait does not say at the end that it is down.",
        "violated: a command that is not finite, beyond the limits of a joint or too fast; an",
        "exception; a hang; a stop without a word; after a fall, a stiff command of a gait that",
        "knows of no fall.",
    ]
    notes += [f"Falls, {name.replace('_', ' ')}: {ALL_FAULTS[name].why}"
              for name, found in by_class.items()
              if ALL_FAULTS[name].why and any(v.outcome == FELL for v in found)]  # fmt: skip
    broken = [verdict for verdict in verdicts if verdict.outcome == VIOLATED]
    notes += [
        f"VIOLATED {verdict.run.fault}, seed {verdict.run.seed}: {'; '.join(verdict.violations)}"
        for verdict in broken[:_EVIDENCE]
    ]
    return "\n".join((title, "", table(lines), "", *notes))
