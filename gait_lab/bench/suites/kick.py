"""The suite `kick`: how far and where each kick sends the ball, and whether the robot stays up."""

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass

from gait_lab.bench.options import BenchOptions, option
from gait_lab.bench.result import Cell as TableCell
from gait_lab.bench.result import Column, Measurement, SuiteResult, Table
from gait_lab.bench.suite import Suite
from sim_bridge.trials.kick import (
    AFTERWARDS,
    PLACEMENT,
    KickResult,
    KickSpec,
    kick,
    kick_directions,
)
from sim_bridge.trials.parallel import parallel_map


@dataclass(frozen=True)
class Options(BenchOptions):
    """What the suite `kick` runs on."""

    robots: int = 20
    attempts: int = option(1, "attempts of each robot", "N", minimum=1, maximum=1000)


def kicks(options: Options) -> SuiteResult:
    """`options.attempts` of every kick with every robot."""
    directions = kick_directions(options.urdf)
    specs = [
        KickSpec(motion=name, robot_seed=seed, noise_seed=attempt, **options.trial)
        for name in directions for seed in options.seeds for attempt in range(options.attempts)
    ]  # fmt: skip
    results: list[KickResult] = parallel_map(
        kick, specs, jobs=options.jobs, label="kicks", show=options.show, note=_note
    )
    spreads = [
        _Spread(name, [each for each in results if each.spec.motion == name], direction)
        for name, direction in directions.items()
    ]
    stood = sum(each.stood for each in results)
    share = 100.0 * stood / len(results)
    columns = (
        Column("kick"), Column("attempts"), Column("stands", "afterwards"),
        Column("distance", "m", 2), Column("spread", "m", 2), Column("direction", "deg", 0),
        Column("intended", "deg", 0), Column("spread", "deg"), Column("ball", "m/s", 2),
        Column("takes", "s"),
    )  # fmt: skip
    notes = (
        f"All kicks: {stood} of {len(results)} robots stand {AFTERWARDS:g} s after the kick "
        f"({share:.1f} %).",
        "Mean and standard deviation over robots and attempts; the ball is placed within "
        f"{1000 * PLACEMENT:g} mm (standard deviation) of the kick's spot and rolls until it lies "
        "still. direction: counter-clockwise from the robot's heading.",
    )
    return SuiteResult(
        (*(row for each in spreads for row in each.rows), Measurement("all_stood", "%", share)),
        f"Kicks; {options.title}, attempts: {options.attempts} each",
        (Table(columns, [each.line for each in spreads]),), notes,
    )  # fmt: skip


def _note(result: KickResult) -> str:
    return f"{result.spec.motion} robot {result.spec.robot_seed}: {result.distance:.2f} m"


class _Spread:
    """Distance and direction of one kick over all its attempts.

    Args:
        name: Name of the kick.
        results: Its attempts.
        intended: Direction of the ball [rad].
    """

    def __init__(self, name: str, results: Sequence[KickResult], intended: float) -> None:
        self._name = name
        self._results = results
        self._intended = intended
        distances = [result.distance for result in results]
        # Around the intended direction, so that a kick straight back has a mean.
        errors = [math.remainder(result.direction - intended, math.tau) for result in results]
        self._distance = statistics.fmean(distances)
        self._distance_spread = statistics.pstdev(distances)
        error = statistics.fmean(errors)
        self._direction_spread = math.degrees(statistics.pstdev(errors))
        self._direction = math.degrees(math.remainder(intended + error, math.tau))
        self._stood = sum(result.stood for result in results)

    @property
    def rows(self) -> list[Measurement]:
        """The measurements."""
        share, name = 100.0 * self._stood / len(self._results), self._name
        return [
            Measurement(f"{name}_stood", "%", share),
            Measurement(f"{name}_distance", "m", self._distance),
            Measurement(f"{name}_distance_spread", "m", self._distance_spread),
            Measurement(f"{name}_direction", "deg", self._direction),
            Measurement(f"{name}_direction_spread", "deg", self._direction_spread),
        ]

    @property
    def line(self) -> tuple[TableCell, ...]:
        """The row of the table."""
        return (
            self._name.removeprefix("kick_").replace("_", " "), len(self._results), self._stood,
            self._distance, self._distance_spread, self._direction,
            math.degrees(self._intended) + 0.0,
            self._direction_spread, statistics.fmean(each.speed for each in self._results),
            statistics.fmean(each.seconds for each in self._results),
        )  # fmt: skip


SUITE = Suite(
    name="kick",
    title="Kicks",
    summary="how far and where each kick sends the ball, and whether the robot stays up",
    measure=kicks,
    options=Options,
    takes=("robots",),
    quick=({"robots": 3, "attempts": 1},),
    check=lambda options: kick_directions(options.urdf),
)
