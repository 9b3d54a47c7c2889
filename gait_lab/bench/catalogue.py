"""Which suites `nao_gait bench` has, what they run on, and their quick form."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from gait_lab.bench.changes import load_changes
from gait_lab.bench.command import flag_of
from gait_lab.bench.options import BenchOptions
from gait_lab.bench.push_cells import directions_of
from gait_lab.bench.report import Report
from gait_lab.bench.suites.ablation import ablation
from gait_lab.bench.suites.compute import compute
from gait_lab.bench.suites.delay import TASKS as DELAY_TASKS
from gait_lab.bench.suites.delay import delay
from gait_lab.bench.suites.endurance import endurance
from gait_lab.bench.suites.error import TASKS as ERROR_TASKS
from gait_lab.bench.suites.error import error
from gait_lab.bench.suites.faults import classes_of, faults
from gait_lab.bench.suites.fuzz import fuzz
from gait_lab.bench.suites.getup import getup
from gait_lab.bench.suites.kick import kicks, kicks_of
from gait_lab.bench.suites.loss import TASKS as LOSS_TASKS
from gait_lab.bench.suites.loss import check as check_loss
from gait_lab.bench.suites.loss import loss
from gait_lab.bench.suites.peers import TASKS as PEERS_TASKS
from gait_lab.bench.suites.peers import peers, require_possible, walks_here
from gait_lab.bench.suites.plants import check as check_sweep
from gait_lab.bench.suites.plants import sweep
from gait_lab.bench.suites.posture import TASKS as POSTURE_TASKS
from gait_lab.bench.suites.posture import experiments_of, posture
from gait_lab.bench.suites.push import TASKS as PUSH_TASKS
from gait_lab.bench.suites.push import push
from gait_lab.bench.suites.realtime import realtime
from gait_lab.bench.suites.robust import TASKS as ROBUST_TASKS
from gait_lab.bench.suites.robust import robust
from gait_lab.bench.suites.rough import TASKS as ROUGH_TASKS
from gait_lab.bench.suites.rough import rough, walkers_of
from gait_lab.bench.suites.soak import soak_suite
from gait_lab.bench.suites.speed import speed
from gait_lab.bench.suites.start import start
from nao_lipm_gait.errors import NaoGaitError


@dataclass(frozen=True, slots=True)
class Suite:
    """A benchmark, the options that it runs on unless told otherwise, and its quick form."""

    measure: Callable[[BenchOptions], Report]
    usual: Mapping[str, Any]
    quick: tuple[Mapping[str, Any], ...]
    """Its runs in `all`: what each has else than usual, besides `QUICK_ENGINE`."""
    reads: frozenset[str]
    """The options that matter to it, besides those of `EVERY_SUITE`; others are refused."""
    check: Callable[[BenchOptions], object] = lambda options: None
    """Raises NaoGaitError, before the work, for what the suite cannot do."""


QUICK_ENGINE = "mujoco"
"""The faster one."""
EVERY_SUITE = frozenset({"seed", "engine", "plant", "plant_options", "urdf", "jobs", "show"})
_ROBOTS = frozenset({"robots"})
_LOOPS = _ROBOTS | {"open_loop"}
_WALKS = _LOOPS | {"tasks", "window"}
SUITES = {
    "speed": Suite(speed, {}, ({"robots": 3, "window": 5.0},), _WALKS | {"half_speed"}),
    "error": Suite(error, {"tasks": ERROR_TASKS}, ({"robots": 3, "window": 5.0},), _WALKS),
    "push": Suite(
        push,
        {"robots": 5, "tasks": PUSH_TASKS},
        (
            {"robots": 2, "phases": 4, "tasks": ("spot",)},
            {"robots": 2, "phases": 4, "tasks": ("forward=20",), "impulses": (1.25,)},
        ),
        _LOOPS | {"tasks", "phases", "impulses", "directions"},
        lambda options: directions_of(options.directions),
    ),
    "start": Suite(start, {"robots": 20}, ({"robots": 3},), _LOOPS),
    "endurance": Suite(
        endurance, {"robots": 20}, ({"robots": 4, "metres": 5.0},), _LOOPS | {"metres"}
    ),
    "delay": Suite(
        delay,
        {"robots": 4, "window": 10.0, "tasks": DELAY_TASKS},
        ({"robots": 2, "window": 4.0, "tasks": ("forward=20",)},),
        _WALKS,
    ),
    "robust": Suite(
        robust, {"robots": 20, "tasks": ROBUST_TASKS}, ({"robots": 3, "window": 5.0},), _WALKS
    ),
    "getup": Suite(
        getup, {"robots": 20}, ({"robots": 3, "attempts": 2},), _ROBOTS | {"attempts"}
    ),
    "posture": Suite(
        posture,
        {"robots": 20, "urdf": "bruno", "tasks": POSTURE_TASKS, "window": 300.0},
        ({"robots": 2, "window": 5.0},),
        _ROBOTS | {"tasks", "window", "experiments"},
        experiments_of,
    ),
    "rough": Suite(
        rough,
        {"robots": 20, "tasks": ROUGH_TASKS},
        ({"robots": 2, "open_loop": "off"},),
        _LOOPS | {"tasks", "experiments"},
        walkers_of,
    ),
    "kick": Suite(
        kicks,
        {"robots": 20, "attempts": 1},
        ({"robots": 3, "attempts": 1},),
        _ROBOTS | {"attempts"},
        lambda options: kicks_of(options.urdf),
    ),
    "compute": Suite(compute, {"robots": 1}, ({"window": 10.0},), frozenset({"window"})),
    "plant": Suite(
        sweep,
        {"robots": 2, "window": 5.0, "engine": "mujoco"},
        ({"robots": 1, "window": 3.0, "tasks": ("forward",), "open_loop": "off"},),
        _WALKS | {"ingredients"},
        check_sweep,
    ),
    "ablation": Suite(
        ablation,
        {"robots": 5, "window": 8.0, "open_loop": "off"},
        ({"robots": 2, "window": 4.0, "phases": 2},),
        _WALKS | {"phases", "changes"},
        lambda options: load_changes(options.changes),
    ),
    "peers": Suite(
        peers,
        {"robots": 8, "window": 8.0, "phases": 4, "tasks": PEERS_TASKS},
        ({"robots": 2, "window": 4.0, "phases": 2},),
        _ROBOTS | {"tasks", "window", "phases", "placo_python"},
        require_possible,
    ),
    "faults": Suite(
        faults,
        {"engine": "mujoco"},
        ({"runs": 56},),
        frozenset({"runs", "faults"}),
        lambda options: classes_of(options.faults),
    ),
    "loss": Suite(
        loss,
        {"robots": 20, "window": 60.0, "engine": "mujoco", "tasks": LOSS_TASKS},
        ({"robots": 2, "window": 10.0},),
        _ROBOTS | {"tasks", "window", "loss"},
        check_loss,
    ),
    "fuzz": Suite(fuzz, {}, ({"ticks": 20_000},), frozenset({"ticks"})),
    "soak": Suite(
        soak_suite, {"engine": "mujoco", "robots": 1}, ({"minutes": 1.0},), frozenset({"minutes"})
    ),
    "realtime": Suite(
        realtime, {"engine": "mujoco", "robots": 1}, ({"window": 5.0},), frozenset({"window"})
    ),
}


@dataclass(frozen=True, slots=True)
class Run:
    """One run of a suite."""

    suite: str
    options: BenchOptions
    given: Mapping[str, Any]
    """What is not as usual."""


def runs(name: str, asked: Mapping[str, Any]) -> tuple[Run, ...]:
    """The runs behind a name: a suite, or `all` of them in their quick form."""
    if name == "all":
        engine, urdf = asked.get("engine", QUICK_ENGINE), asked.get("urdf", BenchOptions().urdf)
        left_out = {"plant"} if engine != "mujoco" else set()
        left_out |= set() if walks_here(urdf) else {"peers"}
        quick = [
            (suite, {"engine": engine, **changes, **asked})
            for suite, entry in SUITES.items()
            for changes in entry.quick
            if suite not in left_out
        ]
        return tuple(Run(suite, options_for(suite, given), given) for suite, given in quick)
    if name not in SUITES:
        raise NaoGaitError("suite", name, f"one of {', '.join(SUITES)}, all")
    taken = EVERY_SUITE | SUITES[name].reads
    for option, value in asked.items():
        if option not in taken:
            allowed = ", ".join(sorted(map(flag_of, SUITES[name].reads)))
            raise NaoGaitError(
                flag_of(option), value, f"no such option for the suite {name}; it has {allowed}"
            )
    return (Run(name, options_for(name, asked), asked),)


def options_for(name: str, given: Mapping[str, Any]) -> BenchOptions:
    """What a suite runs on: what is given, else what it usually runs on."""
    return BenchOptions(**{**SUITES[name].usual, **given})
