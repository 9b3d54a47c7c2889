"""The suite `peers`: the sweep of its file, and placo's walk where its environment is given.

With learned walks, it measures these instead, beside the gait, on any robot.
"""

import statistics
import time
from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import islice
from pathlib import Path

import attrs

from gait_lab.bench.options import Option, Options
from gait_lab.bench.pushes import PushSeries, search_largest, walk_unpushed
from gait_lab.bench.rows import Row
from gait_lab.bench.suite import Suite
from gait_lab.bench.suites.compute import FIRST, ClockedWalker
from gait_lab.bench.suites.endurance import loop_rows, walk_journey
from gait_lab.bench.sweep import load_sweep, sweep_suite
from gait_lab.bench.walks import Variant
from gait_lab.peers.placo_walk import HOW_TO_GET_IT, Placo
from gait_lab.peers.policy_file import load_policy
from gait_lab.peers.policy_walk import PolicyWalk
from nao_lipm_gait.whole_body.body_model import BodyModel
from robot_core.errors import NaoGaitError
from robot_core.resources import share
from robot_core.robot import NAO, load_robot
from sim_bridge.trials.tasks import find_task
from sim_bridge.trials.trial import HeldCommand, loaded_robot, make_gait, make_world, run

SWEEP = load_sweep(share("config", "bench", "peers.yaml"))
CLASSICAL = "classical"
LEARNED = attrs.evolve(
    SWEEP, labelled=True, pushes={},
    metrics=(
        "upright", "counts", "farthest", "farthest_of_upright", "median_of_upright", "error_median",
        "off_worst", "yaw_off_worst", "flight_worst", "slip_worst",
    ),
    note="classical: the gait. The others are named by the files of their policies and have the "
    "motors' gains of these; true velocity: of the torso, which no robot measures, in place of "
    "that over the lower sole. All of them sense through the plant. Tick: CPU time on this "
    "machine. Pushes: on the spot, as in the suite push, but survived by who does not fall.",
)  # fmt: skip
"""The sweep of the walks beside learned ones."""
DIRECTIONS = ("forward", "left", "back")
"""Of the pushes beside learned walks; those are mirror-symmetric."""
SHARES = tuple(0.1 * step for step in range(1, 13))
"""Impulses [N s/kg] among which the largest survived one is searched."""
TIMED = 5.0
"""[s] of stepping whose ticks are timed."""


def is_nao(options: Options) -> bool:
    """Whether the other walks are made for this robot."""
    return load_robot(options.urdf).name == NAO


def check(options: Options) -> None:
    """Raise NaoGaitError for what cannot be run.

    A robot that is no NAO, a Python without placo, a policy that does not fit the robot.
    """
    if options.policy:
        for variant in policies(options).values():
            assert variant.walker is not None
            variant.walker(load_robot(options.urdf), find_task("spot"), options.control_period)
        LEARNED.check(options)
        return
    if not is_nao(options):
        allowed = f"{NAO} for this suite, or --policy"
        raise NaoGaitError("robot", load_robot(options.urdf).name, allowed)
    if options.placo_python is not None:
        Placo(options.placo_python).check()
    SWEEP.check(options)


def peers(options: Options) -> Iterator[Row | str]:
    """All tasks and pushes with every walk."""
    if options.policy:
        yield from learned(options)
        return
    more: Mapping[str, Variant] = {}
    if options.placo_python is None:
        yield (
            "placo's walk is left out: give a Python that has it by --placo-python. To make one: "
            f"{HOW_TO_GET_IT}, then --placo-python placo-env/bin/python."
        )
    else:
        more = {"placo": Variant(walker=Placo(options.placo_python))}
    sweep = SWEEP if options.pushes else attrs.evolve(SWEEP, pushes={})
    yield from sweep.measure(options, more)


def policies(options: Options) -> dict[str, Variant]:
    """The learned walks by the names of their files; NaoGaitError if one does not fit."""
    found: dict[str, Variant] = {}
    robot = load_robot(options.urdf)
    for path in options.policy:
        policy, _ = load_policy(path, robot)
        name, gains = Path(path).stem, policy.gains_of(robot)
        if name in {CLASSICAL, *found, *(each.removesuffix("_true_velocity") for each in found)}:
            raise NaoGaitError("policy", path, "files of different names")
        found[name] = Variant(gains=gains, walker=PolicyWalk(path))
        if policy.sees_velocity:
            true = PolicyWalk(path, true_velocity=True)
            found[f"{name}_true_velocity"] = Variant(gains=gains, walker=true)
    return found


def learned(options: Options) -> Iterator[Row | str]:
    """All tasks, the largest pushes, and the time of a tick, of the gait and of learned walks."""
    variants = {CLASSICAL: Variant(), **policies(options)}
    if options.pushes:
        yield from largest_pushes(options, variants)
    for name, variant in variants.items():
        yield Row(name, "tick_mean", "us", tick_time(options, variant))
        if options.metres > 0.0:
            yield from falls_per_km(name, options, variant)
    yield from LEARNED.measure(options.but(only=()), variants)


def largest_pushes(options: Options, variants: Mapping[str, Variant]) -> Iterator[Row]:
    """Push on the spot."""
    series = {
        name: PushSeries("spot", variant=each, only_falls=True) for name, each in variants.items()
    }
    mass = BodyModel(load_robot(options.urdf)).total_mass
    walk_unpushed(list(series.values()), options)
    search_largest(
        list(series.values()), DIRECTIONS, options, [share * mass for share in SHARES]
    )
    for name, each in series.items():
        for direction in DIRECTIONS:
            largest = each.largest(direction)
            value = None if largest is None else largest / mass
            yield Row(f"{name}_push_{direction}", "max", "N s/kg", value)


def falls_per_km(name: str, options: Options, variant: Variant) -> list[Row]:
    """Walk random commands, as the suite endurance does."""
    stand = find_task("stand")
    asked = [
        (variant.spec(options, True, stand, seed), options.metres) for seed in options.seeds
    ]
    journeys = options.map(walk_journey, asked, label=f"{name}, random commands")
    return loop_rows(f"{name}_random", journeys)


def tick_time(options: Options, variant: Variant) -> float:
    """Mean CPU time [us] of a tick, stepping on the spot."""
    task, period = find_task("spot"), options.control_period
    spec = replace(variant.spec(options, True, task, options.seed), control_period=period)
    robot = loaded_robot(spec.urdf)
    walker = make_gait(spec) if spec.walker is None else spec.walker(robot, task, period)
    clocked = ClockedWalker(walker, time.thread_time_ns)
    with make_world(spec) as world:
        for _ in islice(run(world, clocked, HeldCommand(task.command)), round(TIMED / period)):
            pass
    return statistics.fmean(clocked.spans[FIRST:] or clocked.spans) / 1000.0


def _suite() -> Suite:
    of_file = sweep_suite("peers", SWEEP)
    placo = Option(None, "Python of an environment that has placo, to measure its walk too", "PATH",
                   ("--placo-python",), str)  # fmt: skip
    policy = Option((), "YAML file of a learned walk, to measure it beside the gait instead",
                    "FILE", ("--policy",))  # fmt: skip
    pushes = Option(True, "not also pushes", "", ("--no-pushes",))
    metres = Option(0.0, "distance that each robot also walks beside learned walks, by random "
                    "commands", "M", ("--metres",), minimum=0.0, maximum=1e5)  # fmt: skip
    more = {"placo_python": placo, "policy": policy, "pushes": pushes, "metres": metres}
    options = {**of_file.options, **more}
    return replace(of_file, measure=peers, options=options, check=check, applies=is_nao)


SUITE = _suite()
