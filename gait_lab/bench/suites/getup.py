"""The suite `getup`: a robot on the floor gets up, stands and walks."""

import statistics
from collections.abc import Iterator, Sequence

from gait_lab.bench.options import Option, Options
from gait_lab.bench.rows import Row, rows_of
from gait_lab.bench.suite import suite
from gait_lab.bench.walks import median, percent
from sim_bridge.trials.get_up import SIDES, STAND, WALK, GetUpResult, GetUpSpec, get_up

NAMES = tuple(SIDES)


@suite(
    "getup", "Getting up", "a robot on the floor gets up, stands and walks",
    options={
        "robots": 20, "attempts": 5,
        "sides": Option(NAMES, "side on which the robots lie", "SIDE", ("--side",), choices=NAMES),
    },
    quick=({"robots": 3, "attempts": 2},),
)  # fmt: skip
def getup(options: Options) -> Iterator[Row | str]:
    """`options.attempts` attempts from each side with every robot."""
    specs = [
        GetUpSpec(side=side, robot_seed=seed, noise_seed=attempt, **options.trial)
        for side in options.sides for seed in options.seeds for attempt in range(options.attempts)
    ]  # fmt: skip
    results: list[GetUpResult] = options.map(
        get_up, specs, label="get-ups",
        note=lambda each: f"{each.spec.side} robot {each.spec.robot_seed}: "
        + ("down" if each.time is None else f"up after {each.time:.1f} s"),
    )  # fmt: skip
    yield from _rows("all", results)
    for side in options.sides:
        yield from _rows(side, [each for each in results if each.spec.side == side])
    for seed in options.seeds:
        mine = [each.at_once for each in results if each.spec.robot_seed == seed]
        yield Row(f"robot_{seed}", "first_try", "%", percent(mine))
    yield (
        f"first try: the gait's first get-up ends in a stand, the robot stands {STAND:g} s and "
        f"walks {WALK:g} s; from a side it may roll over once before. Times: from lying at rest to "
        "the stand of the gait. torque use: largest torque over the motor's at standstill; speed "
        "use: largest speed over the URDF's limit, beyond 1 a joint is turned by its load."
    )


def _rows(name: str, results: Sequence[GetUpResult]) -> list[Row]:
    times = [each.time for each in results if each.time is not None]
    return rows_of(
        name,
        ("attempts", "attempts", len(results)),
        ("first_try", "%", percent(each.at_once for each in results)),
        ("up", "%", percent(each.walked for each in results)),
        ("median", "s", median(times)),
        ("worst", "s", max(times, default=None)),
        ("torque_use", "", float(max(each.torque_use.max() for each in results))),
        ("speed_use", "", float(max(each.speed_use.max() for each in results))),
        ("saturated", "%", 100.0 * statistics.fmean(each.saturated for each in results)),
    )
