"""The suite `bump`: a robot walks into a post or another robot, and should stay on its feet."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

from gait_lab.bench.options import Option, Options
from gait_lab.bench.rows import Row, rows_of
from gait_lab.bench.suite import suite
from gait_lab.bench.walks import median, percent
from nao_lipm_gait.gait import Gait
from robot_core.field import Pole
from robot_core.types import DOWN, STANDSTILL, Pose2, VelocityCommand
from sim_bridge.plant import load_plant, with_options
from sim_bridge.scene import Scene, SceneRobot
from sim_bridge.trials.trial import (
    CONTROL_PERIOD,
    Policy,
    TimedCommands,
    TrialSpec,
    loaded_robot,
    make_scene_world,
    run_several,
)
from sim_bridge.world import World

INTO = "post", "standing", "walking", "lying"
"""A post of a goal; a robot that stands, comes to meet the one that bumps, or lies across its
way."""
DIRECTIONS = {"ahead": 0.0, "left": 0.5 * math.pi, "right": -0.5 * math.pi, "back": math.pi}
"""Bearing [rad] of the other thing, in which the robot walks."""
REST, AFTER = 1.0, 2.0
"""[s] of standing before the walk, and after it."""
GAP = 0.6
"""[m] between the middles at the start, for robots of a NAO's size."""
MEET = 0.2
"""[m] between the middles when the first parts touch, about; likewise."""
OTHER = 1000
"""Number of the other robot after that of the one that bumps."""
POST = 0.1
"""[m] Diameter of the post."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BumpSpec(TrialSpec):
    """One bump.

    Attributes:
        into: One of `INTO`.
        direction: One of `DIRECTIONS`.
        speed: [m/s] that is commanded.
        hold: [s] for which the command goes on after the contact; the robot stands then.
    """

    into: str
    direction: str
    speed: float
    hold: float


@dataclass(frozen=True, slots=True)
class BumpResult:
    """What came of it: when it fell [s] after it should have arrived; None = it did not."""

    spec: BumpSpec
    fell: float | None


def bump_once(spec: BumpSpec) -> BumpResult:
    """Run one bump."""
    bearing = DIRECTIONS[spec.direction]
    ux, uy = math.cos(bearing), math.sin(bearing)
    robot = loaded_robot(spec.urdf)
    gap, meet = robot.size * GAP, robot.size * MEET
    arrival = REST + (gap - meet) / (spec.speed * (2.0 if spec.into == "walking" else 1.0))
    end = arrival + spec.hold

    def walk_at(forward: float, left: float) -> Policy:
        command = VelocityCommand(spec.speed * forward, spec.speed * left)
        return TimedCommands(
            lambda time: command if REST <= time < end else STANDSTILL, ahead=False
        )

    policies = [walk_at(ux, uy)]
    if spec.into != "post":
        policies.append(walk_at(1.0, 0.0) if spec.into == "walking" else Policy())
    with _world(spec, (gap * ux, gap * uy), bearing) as world:
        gaits = [Gait(robot, spec.parameters) for _ in policies]
        if spec.into == "lying":
            gaits[1].request_relax()
        for count, ticks in enumerate(run_several(world, gaits, policies)):
            time, status = count * CONTROL_PERIOD, ticks[0].status
            if ticks[0].fallen or (status is not None and status.state in DOWN):
                return BumpResult(spec, time - arrival)
            if time >= end + AFTER:
                break
    return BumpResult(spec, None)


def _world(spec: BumpSpec, place: tuple[float, float], bearing: float) -> World:
    """The robot, and the other thing at a place."""
    robots = [_robot(spec, "red", (0.0, 0.0, 0.0), 0, "stand")]
    poles: tuple[Pole, ...] = ()
    if spec.into == "post":
        poles = (Pole(x=place[0], y=place[1], diameter=POST),)
    else:
        lies = spec.into == "lying"
        heading = math.remainder(bearing + (0.5 if lies else 1.0) * math.pi, math.tau)
        state = "lying_front" if lies else "stand"
        robots.append(_robot(spec, "blue", (*place, heading), OTHER, state))
    return make_scene_world(
        Scene(name="bump", robots=tuple(robots), poles=poles),
        plant=with_options(load_plant(spec.plant), spec.plant_options),
        engine=spec.engine,
        noise_seed=spec.noise_seed,
    )


def _robot(spec: BumpSpec, team: str, pose: Pose2, after: int, state: str) -> SceneRobot:
    return SceneRobot(
        name=team, team=team, number=1, urdf=spec.urdf, pose=pose, seed=spec.robot_seed + after,
        start_state=state,
    )  # fmt: skip


@suite(
    "bump", "Bumps", "walking into a post, a standing, a walking or a lying robot: who stays up",
    options={
        "robots": 8,
        "into": Option(("post", "standing"), "what stands in the way", "NAME", ("--into",),
                       choices=INTO),
        "directions": Option(("ahead",), "where it stands, and the robot walks", "NAME",
                             ("--direction",), choices=tuple(DIRECTIONS)),
        "speeds": Option((0.2, 0.4), "commanded speed [m/s]", "V", ("--speed",), float,
                         minimum=0.05, maximum=2.0),
        "window": Option(3.0, "the command goes on for this time [s] after the contact", "T",
                         ("--seconds",), minimum=0.0, maximum=60.0),
    },
    quick=({"robots": 2},),
)  # fmt: skip
def bump(options: Options) -> Iterator[Row | str]:
    """Each robot walks into each thing, in each direction and at each speed."""
    specs = [
        BumpSpec(**options.trial, robot_seed=seed, noise_seed=2 * max(seed, 0), into=into,
                 direction=direction, speed=speed, hold=options.window)
        for speed in options.speeds for into in options.into for direction in options.directions
        for seed in options.seeds
    ]  # fmt: skip
    results: list[BumpResult] = options.map(bump_once, specs, label="bumps")
    for speed in options.speeds:
        name = f"{speed:.1f}".replace(".", "") if round(speed, 1) == speed else f"{speed:g}"
        mine = [each for each in results if each.spec.speed == speed]
        yield Row("bump", f"survived_{name}", "%", percent(each.fell is None for each in mine))
        for into in options.into:
            for direction in options.directions:
                where = replace(mine[0].spec, into=into, direction=direction)
                these = [each for each in mine
                         if replace(each.spec, robot_seed=0, noise_seed=0)
                         == replace(where, robot_seed=0, noise_seed=0)]  # fmt: skip
                falls = [each.fell for each in these if each.fell is not None]
                yield from rows_of(
                    f"bump_{into}_{direction}_{name}",
                    ("survived", "%", percent(each.fell is None for each in these)),
                    ("fall_median", "s", median(falls)),
                )
    yield (
        f"The command goes on for {options.window:g} s after the robot should have arrived; "
        f"then it stands for {AFTER:g} s. survived: it did not fall. fall median: of those that "
        "fell, after the contact."
    )
