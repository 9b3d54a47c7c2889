"""The suite `kick`: how far and where each kick sends the ball, and whether the robot stays up."""

import math
import statistics
from collections.abc import Iterator

from gait_lab.bench.options import Options
from gait_lab.bench.rows import Row, rows_of
from gait_lab.bench.suite import suite
from sim_bridge.trials.kick import (
    AFTERWARDS,
    PLACEMENT,
    KickResult,
    KickSpec,
    kick,
    kick_directions,
)
from sim_bridge.trials.parallel import parallel_map


@suite(
    "kick", "Kicks", "how far and where each kick sends the ball, and whether the robot stays up",
    options={"robots": 20, "attempts": ...}, quick=({"robots": 3},),
    check=lambda options: kick_directions(options.urdf),
)  # fmt: skip
def kicks(options: Options) -> Iterator[Row | str]:
    """`options.attempts` of every kick with every robot."""
    directions = kick_directions(options.urdf)
    specs = [
        KickSpec(motion=name, robot_seed=seed, noise_seed=attempt, **options.trial)
        for name in directions for seed in options.seeds for attempt in range(options.attempts)
    ]  # fmt: skip
    results: list[KickResult] = parallel_map(
        kick, specs, jobs=options.jobs, label="kicks", show=options.show,
        note=lambda each: f"{each.spec.motion} robot {each.spec.robot_seed}: {each.distance:.2f} m",
    )  # fmt: skip
    for name, intended in directions.items():
        mine = [each for each in results if each.spec.motion == name]
        distances = [each.distance for each in mine]
        # Around the intended direction, so that a kick straight back has a mean.
        errors = [math.remainder(each.direction - intended, math.tau) for each in mine]
        mean = math.remainder(intended + statistics.fmean(errors), math.tau)
        yield from rows_of(
            name,
            ("stood", "%", 100.0 * sum(each.stood for each in mine) / len(mine)),
            ("distance", "m", statistics.fmean(distances)),
            ("distance_spread", "m", statistics.pstdev(distances)),
            ("direction", "deg", math.degrees(mean)),
            ("direction_spread", "deg", math.degrees(statistics.pstdev(errors))),
        )
    yield Row("all", "stood", "%", 100.0 * sum(each.stood for each in results) / len(results))
    yield (
        f"Stood: {AFTERWARDS:g} s after the kick. Mean and standard deviation over robots and "
        f"attempts; the ball is placed within {1000 * PLACEMENT:g} mm (standard deviation) of the "
        "kick's spot and rolls until it lies still. direction: counter-clockwise from the heading."
    )
