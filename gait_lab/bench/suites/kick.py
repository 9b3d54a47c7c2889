"""The suite `kick`: how far and where each kick sends the ball, and who still stands after it."""

import math
import statistics
from collections.abc import Sequence

from gait_lab.bench.options import BenchOptions
from gait_lab.bench.report import Report, Row, number, table
from gait_lab.trials.kick import AFTERWARDS, PLACEMENT, KickResult, KickSpec, kick
from gait_lab.trials.parallel import parallel_map
from gait_lab.trials.trial import loaded_robot
from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.motion.library import shipped_library

SUITE = "kick"


def kicks_of(urdf: str) -> tuple[str, ...]:
    """Names of the kicks of a robot."""
    motions = shipped_library(loaded_robot(urdf)).motions
    names = tuple(sorted(name for name, motion in motions.items() if motion.kick is not None))
    if not names:
        raise NaoGaitError("urdf", urdf, "a robot with kicks in config/motions/")
    return names


def kicks(options: BenchOptions) -> Report:
    """`options.attempts` of every kick with every robot."""
    names = kicks_of(options.urdf)
    specs = [
        KickSpec(
            motion=name, robot_seed=seed, noise_seed=attempt, parameters=options.parameters,
            plant=options.plant, plant_options=options.plant_options, urdf=options.urdf,
            engine=options.engine,
        )
        for name in names for seed in options.seeds for attempt in range(options.attempts)
    ]  # fmt: skip
    results: list[KickResult] = parallel_map(
        kick, specs, jobs=options.jobs, label="kicks", show=options.show, note=_note
    )
    rows: list[Row] = []
    lines: list[tuple[str, ...]] = [
        ("kick", "attempts", "stands", "distance", "spread", "direction", "meant", "spread",
         "ball", "takes"),
        ("", "", "afterwards", "m", "m", "deg", "deg", "deg", "m/s", "s"),
    ]  # fmt: skip
    library = shipped_library(loaded_robot(options.urdf))
    for name in names:
        meant = library.find(name).kick
        of_kick = [result for result in results if result.spec.motion == name]
        found = _Spread(of_kick, 0.0 if meant is None else meant.direction)
        rows += found.rows(name)
        lines.append(found.line(name))
    whole = sum(result.stood for result in results)
    rows.append(Row(SUITE, "all_stood", "%", 100.0 * whole / len(results)))
    notes = (
        f"all kicks: {whole} of {len(results)} robots stand {AFTERWARDS:g} s after the kick "
        f"({100.0 * whole / len(results):.1f} %).",
        f"mean and standard deviation over robots and attempts; the ball is laid within "
        f"{1000 * PLACEMENT:g} mm (standard deviation) of the kick's spot; it rolls until it lies. "
        "direction: counter-clockwise from the robot's heading.",
    )
    title = f"Kicks; {options.title}, {options.attempts} attempts each"
    return Report(tuple(rows), "\n".join((title, "", table(lines), "", *notes)))


def _note(result: KickResult) -> str:
    return f"{result.spec.motion} robot {result.spec.robot_seed}: {result.distance:.2f} m"


class _Spread:
    """Distance and direction of one kick over all its attempts."""

    def __init__(self, results: Sequence[KickResult], meant: float) -> None:
        self._results = results
        self._meant = meant
        distances = [result.distance for result in results]
        # Around the meant direction, so that a kick straight back has a mean.
        errors = [math.remainder(result.direction - meant, math.tau) for result in results]
        self._distance, self._distance_spread = _mean_and_spread(distances)
        error, self._direction_spread = _mean_and_spread(errors)
        self._direction = math.remainder(meant + error, math.tau)
        self._stood = sum(result.stood for result in results)
        self._speed = statistics.fmean(result.speed for result in results)
        self._seconds = statistics.fmean(result.seconds for result in results)

    def rows(self, name: str) -> list[Row]:
        count = len(self._results)
        return [
            Row(SUITE, f"{name}_stood", "%", 100.0 * self._stood / count),
            Row(SUITE, f"{name}_distance", "m", self._distance),
            Row(SUITE, f"{name}_distance_spread", "m", self._distance_spread),
            Row(SUITE, f"{name}_direction", "deg", math.degrees(self._direction)),
            Row(SUITE, f"{name}_direction_spread", "deg", math.degrees(self._direction_spread)),
        ]

    def line(self, name: str) -> tuple[str, ...]:
        return (
            name.removeprefix("kick_").replace("_", " "),
            str(len(self._results)),
            str(self._stood),
            number(self._distance, 2),
            number(self._distance_spread, 2),
            number(math.degrees(self._direction), 0),
            number(math.degrees(self._meant), 0),
            number(math.degrees(self._direction_spread), 1),
            number(self._speed, 2),
            number(self._seconds, 1),
        )


def _mean_and_spread(values: Sequence[float]) -> tuple[float, float]:
    return statistics.fmean(values), statistics.pstdev(values)
