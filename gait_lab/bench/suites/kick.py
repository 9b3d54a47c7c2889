"""The suite `kick`: how far and where each kick sends the ball, and whether the robot stays up."""

import math
from collections.abc import Iterator, Sequence

from gait_lab.bench.options import Option, Options
from gait_lab.bench.rows import Row, rows_of
from gait_lab.bench.suite import suite
from gait_lab.bench.walks import percent
from gait_lab.soccer.kick_table import means
from sim_bridge.trials.dribble import DribbleResult, DribbleSpec, dribble
from sim_bridge.trials.kick import (
    AFTERWARDS,
    PLACEMENT,
    KickResult,
    KickSpec,
    kick,
    kick_directions,
)
from sim_bridge.trials.trial import loaded_robot

WAYS = "standing", "walking"
SPEED = 0.1
"""[m/s] of a robot as large as a NAO that kicks in the walk, as slow as a player beside others;
other robots by Froude's law."""
IN_THE_WALK = {"walking_left": 1.0, "walking_right": -1.0}
"""Kicks in the walk, and the side of the foot."""


@suite(
    "kick", "Kicks", "how far and where each kick sends the ball, and whether the robot stays up",
    options={
        "robots": 20, "attempts": ...,
        "ways": Option(
            WAYS[:1], "kicks of a standing robot, or of one that walks", "WAY", ("--way",),
            choices=WAYS,
        ),
        "lift": Option(
            1.0, "share of their usual height by which a robot that walks lifts its feet", "SHARE",
            minimum=0.0, maximum=1.0,
        ),
    },
    quick=({"robots": 3},),
    check=lambda options: "standing" in options.ways and kick_directions(options.urdf),
)  # fmt: skip
def kicks(options: Options) -> Iterator[Row | str]:
    """`options.attempts` of every kick with every robot."""
    if "standing" in options.ways:
        yield from _standing(options)
    if "walking" in options.ways:
        yield from _walking(options)


def _standing(options: Options) -> Iterator[Row | str]:
    directions = kick_directions(options.urdf)
    specs = [
        KickSpec(motion=name, robot_seed=seed, noise_seed=attempt, **options.trial)
        for name in directions for seed in options.seeds for attempt in range(options.attempts)
    ]  # fmt: skip
    results: list[KickResult] = options.map(
        kick, specs, label="kicks",
        note=lambda each: f"{each.spec.motion} robot {each.spec.robot_seed}: {each.distance:.2f} m",
    )  # fmt: skip
    for name, intended in directions.items():
        yield from _rows(name, intended, [each for each in results if each.spec.motion == name])
    yield Row("all", "stood", "%", percent(each.stood for each in results))
    yield (
        f"Stood: {AFTERWARDS:g} s after the kick. Mean and standard deviation over robots and "
        f"attempts; the ball is placed within {1000 * PLACEMENT:g} mm (standard deviation) of the "
        "kick's spot and rolls until it lies still. direction: counter-clockwise from the heading."
    )


def _walking(options: Options) -> Iterator[Row | str]:
    robot = loaded_robot(options.urdf)
    middle = 0.5 * sum(f(y for _, y in robot.sole_outline) for f in (min, max))
    across = 0.5 * options.parameters.foot_spacing * robot.size + middle
    specs = [
        DribbleSpec(
            robot_seed=seed, noise_seed=attempt, across=sign * across,
            speed=SPEED * math.sqrt(robot.size), lift=options.lift, **options.trial,
        )
        for sign in IN_THE_WALK.values() for seed in options.seeds
        for attempt in range(options.attempts)
    ]  # fmt: skip
    results: list[DribbleResult] = options.map(
        dribble, specs, label="kicks in the walk",
        note=lambda each: f"robot {each.spec.robot_seed}: {each.distance:.2f} m",
    )  # fmt: skip
    count = len(specs) // len(IN_THE_WALK)
    for index, name in enumerate(IN_THE_WALK):
        yield from _rows(name, 0.0, results[index * count : (index + 1) * count])
    yield f"walking: the ball lies before a foot of a robot that walks {SPEED:g} m/s sqrt(size)."


def _rows(
    name: str, intended: float, results: Sequence[KickResult | DribbleResult]
) -> Iterator[Row]:
    found = means(results, intended)
    yield from rows_of(
        name,
        ("stood", "%", percent(each.stood for each in results)),
        ("distance", "m", found["distance"]),
        ("distance_spread", "m", found["distance_spread"]),
        ("direction", "deg", math.degrees(found["direction"])),
        ("direction_spread", "deg", math.degrees(found["direction_spread"])),
    )
