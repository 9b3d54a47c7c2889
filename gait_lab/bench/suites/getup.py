"""The suite `getup`: a robot on the floor gets up, stands and walks."""

import statistics
from collections.abc import Sequence

import numpy as np

from gait_lab.bench.options import BenchOptions
from gait_lab.bench.report import Report, Row, number, table
from gait_lab.trials.get_up import SIDES, STAND, WALK, GetUpResult, GetUpSpec, get_up
from gait_lab.trials.parallel import parallel_map
from gait_lab.trials.trial import loaded_robot

SUITE = "getup"


def getup(options: BenchOptions) -> Report:
    """`options.attempts` attempts from each side with every robot."""
    specs = [
        GetUpSpec(
            side=side, robot_seed=seed, noise_seed=attempt, parameters=options.parameters,
            plant=options.plant, plant_options=options.plant_options, urdf=options.urdf,
            engine=options.engine,
        )
        for side in SIDES for seed in options.seeds for attempt in range(options.attempts)
    ]  # fmt: skip
    results: list[GetUpResult] = parallel_map(
        get_up, specs, jobs=options.jobs, label="get-ups", show=options.show, note=_note
    )
    rows = [*_rows("all", results)]
    lines: list[tuple[str, ...]] = [
        ("side", "attempts", "up with the", "up in", "stood", "then", "median", "longest", "torque",
         "speed", "ticks at"),
        ("", "", "first try", "the end", f"{STAND:g} s", f"walked {WALK:g} s", "s", "s", "use",
         "use", "a limit"),
    ]  # fmt: skip
    for side in SIDES:
        of_side = [result for result in results if result.spec.side == side]
        rows += _rows(side, of_side)
        lines.append(_line(side, of_side))
    lines.append(_line("all", results))
    by_robot: list[tuple[str, ...]] = [("robot", *SIDES), ("",) * (1 + len(SIDES))]
    for seed in options.seeds:
        of_robot = [result for result in results if result.spec.robot_seed == seed]
        shares = [
            f"{sum(r.at_once for r in of_side)}/{len(of_side)}"
            for of_side in ([r for r in of_robot if r.spec.side == side] for side in SIDES)
        ]
        by_robot.append((str(seed), *shares))
        share = 100.0 * sum(r.at_once for r in of_robot) / len(of_robot)
        rows.append(Row(SUITE, f"robot_{seed}_first_try", "%", share))
    notes = (
        "first try: the gait's first get-up ends in a stand, the robot stands and walks. Times: "
        "from lying at rest to the stand of the gait; it needs 0.4 s of them to know how it lies.",
        f"torque use: largest torque over the motor's at standstill ({_worst(options, results)}); "
        "the plant's motors cannot give more. speed use: largest speed over the URDF's limit; "
        "what is asked for stays below 0.95, beyond 1 a joint is turned by its load.",
    )
    title = f"Getting up; {options.title}, {options.attempts} attempts from each side"
    text = "\n".join((title, "", table(lines), "", table(by_robot), "", *notes))
    return Report(tuple(rows), text)


def _note(result: GetUpResult) -> str:
    spec = result.spec
    fate = f"up after {result.time:.1f} s" if result.time is not None else "down"
    return f"{spec.side} robot {spec.robot_seed}: {fate}"


def _times(results: Sequence[GetUpResult]) -> list[float]:
    return [result.time for result in results if result.time is not None]


def _rows(name: str, results: Sequence[GetUpResult]) -> list[Row]:
    times, count = _times(results), len(results)
    return [
        Row(SUITE, f"{name}_attempts", "attempts", count),
        Row(SUITE, f"{name}_first_try", "%", 100.0 * sum(r.at_once for r in results) / count),
        Row(SUITE, f"{name}_up", "%", 100.0 * sum(r.walked for r in results) / count),
        Row(SUITE, f"{name}_median", "s", statistics.median(times) if times else None),
        Row(SUITE, f"{name}_worst", "s", max(times) if times else None),
        Row(SUITE, f"{name}_torque_use", "", _largest(results, "torque_use")),
        Row(SUITE, f"{name}_speed_use", "", _largest(results, "speed_use")),
        Row(SUITE, f"{name}_saturated", "%", 100.0 * _mean_saturated(results)),
    ]


def _line(name: str, results: Sequence[GetUpResult]) -> tuple[str, ...]:
    times, count = _times(results), len(results)
    return (
        name,
        str(count),
        f"{100.0 * sum(result.at_once for result in results) / count:.1f} %",
        f"{100.0 * sum(result.walked for result in results) / count:.1f} %",
        str(sum(result.stood for result in results)),
        str(sum(result.walked for result in results)),
        number(statistics.median(times) if times else None, 2),
        number(max(times) if times else None, 2),
        number(_largest(results, "torque_use"), 2),
        number(_largest(results, "speed_use"), 2),
        f"{100.0 * _mean_saturated(results):.0f} %",
    )


def _largest(results: Sequence[GetUpResult], what: str) -> float:
    return float(max(getattr(result, what).max() for result in results))


def _mean_saturated(results: Sequence[GetUpResult]) -> float:
    return statistics.fmean(result.saturated for result in results)


def _worst(options: BenchOptions, results: Sequence[GetUpResult]) -> str:
    """The joints that are used most."""
    names = loaded_robot(options.urdf).joint_names
    use = np.max([result.torque_use for result in results], axis=0)
    most = sorted(range(len(names)), key=lambda joint: -float(use[joint]))[:4]
    return ", ".join(f"{names[joint]} {use[joint]:.2f}" for joint in most)
