"""The suite `getup`: a robot on the floor gets up, stands and walks."""

import statistics
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gait_lab.bench.options import BenchOptions, option
from gait_lab.bench.result import Cell as TableCell
from gait_lab.bench.result import Column, Measurement, SuiteResult, Table
from gait_lab.bench.suite import Suite
from sim_bridge.trials.get_up import SIDES, STAND, WALK, GetUpResult, GetUpSpec, get_up
from sim_bridge.trials.parallel import parallel_map
from sim_bridge.trials.trial import loaded_robot


@dataclass(frozen=True)
class Options(BenchOptions):
    """What the suite `getup` runs on."""

    robots: int = 20
    attempts: int = option(
        5, "attempts of each robot from each side", "N", minimum=1, maximum=1000
    )
    sides: tuple[str, ...] = option(
        tuple(SIDES), "side on which the robots lie; repeatable", "SIDE", flags=("--side",),
        choices=tuple(SIDES),
    )  # fmt: skip


def getup(options: Options) -> SuiteResult:
    """`options.attempts` attempts from each side with every robot."""
    specs = [
        GetUpSpec(side=side, robot_seed=seed, noise_seed=attempt, **options.trial)
        for side in options.sides for seed in options.seeds for attempt in range(options.attempts)
    ]  # fmt: skip
    results: list[GetUpResult] = parallel_map(
        get_up, specs, jobs=options.jobs, label="get-ups", show=options.show, note=_note
    )
    groups = {"all": results}
    groups |= {
        side: [each for each in results if each.spec.side == side] for side in options.sides
    }
    rows = [row for name, group in groups.items() for row in _rows(name, group)]
    by_robot: list[tuple[TableCell, ...]] = []
    for seed in options.seeds:
        shares, up, count = [], 0, 0
        for side in options.sides:
            found = [each.at_once for each in groups[side] if each.spec.robot_seed == seed]
            shares.append(f"{sum(found)}/{len(found)}")
            up, count = up + sum(found), count + len(found)
        by_robot.append((seed, *shares))
        rows.append(Measurement(f"robot_{seed}_first_try", "%", 100.0 * up / count))
    columns = (
        Column("side"), Column("attempts"), Column("up with the", "first try"),
        Column("up in", "the end"), Column("stood", f"{STAND:g} s"),
        Column("then", f"walked {WALK:g} s"), Column("median", "s", 2), Column("longest", "s", 2),
        Column("torque", "use", 2), Column("speed", "use", 2), Column("ticks at", "a limit"),
    )  # fmt: skip
    notes = (
        "first try: the gait's first get-up ends in a stand, the robot stands and walks; from a "
        "side it may roll over once before. Times: from lying at rest to the stand of the gait, of "
        "which it takes 0.4 s to find out on which side it lies.",
        "torque use: largest torque over the motor's at standstill "
        f"({_most_used(options, results)}); the plant's motors cannot give more. speed use: "
        "largest speed over the URDF's limit; targets stay below 0.95, beyond 1 a joint is turned "
        "by its load.",
    )
    lines = [_line(name, groups[name]) for name in (*options.sides, "all")]
    by_side = Table([Column("robot"), *map(Column, options.sides)], by_robot)
    tables = (Table(columns, lines), by_side)
    title = f"Getting up; {options.title}, {options.attempts} attempts from each side"
    return SuiteResult(tuple(rows), title, tables, notes)


def _note(result: GetUpResult) -> str:
    spec = result.spec
    fate = f"up after {result.time:.1f} s" if result.time is not None else "down"
    return f"{spec.side} robot {spec.robot_seed}: {fate}"


def _times(results: Sequence[GetUpResult]) -> list[float]:
    return [result.time for result in results if result.time is not None]


def _share(flags: Sequence[bool]) -> float:
    """Share of true values [%]."""
    return 100.0 * sum(flags) / len(flags)


def _rows(name: str, results: Sequence[GetUpResult]) -> list[Measurement]:
    times = _times(results)
    return [
        Measurement(f"{name}_attempts", "attempts", len(results)),
        Measurement(f"{name}_first_try", "%", _share([each.at_once for each in results])),
        Measurement(f"{name}_up", "%", _share([each.walked for each in results])),
        Measurement(f"{name}_median", "s", statistics.median(times) if times else None),
        Measurement(f"{name}_worst", "s", max(times, default=None)),
        Measurement(f"{name}_torque_use", "", _largest(results, "torque_use")),
        Measurement(f"{name}_speed_use", "", _largest(results, "speed_use")),
        Measurement(f"{name}_saturated", "%", 100.0 * _saturated(results)),
    ]


def _line(name: str, results: Sequence[GetUpResult]) -> tuple[TableCell, ...]:
    times = _times(results)
    return (
        name, len(results), f"{_share([each.at_once for each in results]):.1f} %",
        f"{_share([each.walked for each in results]):.1f} %",
        sum(each.stood for each in results), sum(each.walked for each in results),
        statistics.median(times) if times else None, max(times, default=None),
        _largest(results, "torque_use"), _largest(results, "speed_use"),
        f"{100.0 * _saturated(results):.0f} %",
    )  # fmt: skip


def _largest(results: Sequence[GetUpResult], attribute: str) -> float:
    return float(max(getattr(result, attribute).max() for result in results))


def _saturated(results: Sequence[GetUpResult]) -> float:
    return statistics.fmean(result.saturated for result in results)


def _most_used(options: Options, results: Sequence[GetUpResult]) -> str:
    """The joints with the largest use of torque."""
    names = loaded_robot(options.urdf).joint_names
    use = np.max([result.torque_use for result in results], axis=0)
    most = sorted(range(len(names)), key=lambda joint: -float(use[joint]))[:4]
    return ", ".join(f"{names[joint]} {use[joint]:.2f}" for joint in most)


SUITE = Suite(
    name="getup",
    title="Getting up",
    summary="a robot on the floor gets up, stands and walks",
    measure=getup,
    options=Options,
    takes=("robots",),
    quick=({"robots": 3, "attempts": 2},),
)
