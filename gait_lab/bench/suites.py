"""The suites of `nao_gait bench`: which there are, what they run on, and running them."""

import json
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from gait_lab.bench.ablation import ablation, load_changes
from gait_lab.bench.command import command_line
from gait_lab.bench.compute import compute
from gait_lab.bench.delay import TASKS as DELAY_TASKS
from gait_lab.bench.delay import delay
from gait_lab.bench.document import Section, write
from gait_lab.bench.endurance import endurance
from gait_lab.bench.error import TASKS as ERROR_TASKS
from gait_lab.bench.error import error
from gait_lab.bench.faults import classes_of, faults
from gait_lab.bench.fuzz import fuzz
from gait_lab.bench.getup import getup
from gait_lab.bench.kick import kicks
from gait_lab.bench.loss import TASKS as LOSS_TASKS
from gait_lab.bench.loss import loss
from gait_lab.bench.options import BenchOptions
from gait_lab.bench.peers import TASKS as PEERS_TASKS
from gait_lab.bench.peers import peers, require_possible, walks_here
from gait_lab.bench.plants import sweep
from gait_lab.bench.posture import TASKS as POSTURE_TASKS
from gait_lab.bench.posture import posture
from gait_lab.bench.push import TASKS as PUSH_TASKS
from gait_lab.bench.push import directions_of, push
from gait_lab.bench.realtime import realtime
from gait_lab.bench.report import Report
from gait_lab.bench.robust import TASKS as ROBUST_TASKS
from gait_lab.bench.robust import robust
from gait_lab.bench.rough import TASKS as ROUGH_TASKS
from gait_lab.bench.rough import rough
from gait_lab.bench.soak import soak_suite
from gait_lab.bench.speed import speed
from gait_lab.bench.start import start
from gait_lab.tasks import find_task
from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.parameters import BY_NAME, GaitParameters
from nao_lipm_gait.presets import preset_for
from nao_lipm_gait.robot_description import load_robot
from sim_bridge.plant import load_plant, with_options


@dataclass(frozen=True, slots=True)
class Suite:
    """A benchmark, the options that it runs on unless told otherwise, and its quick form."""

    measure: Callable[[BenchOptions], Report]
    usual: Mapping[str, Any]
    quick: tuple[Mapping[str, Any], ...]
    """Its runs in `all`: what each has else than usual, besides `QUICK_ENGINE`."""
    reads: frozenset[str]
    """The options that matter to it, besides those of `EVERY_SUITE`."""


QUICK_ENGINE = "mujoco"
"""The faster one."""
EVERY_SUITE = frozenset(
    {"robots", "seed", "engine", "plant", "plant_options", "urdf", "open_loop", "jobs", "show"}
)
_WALKS = frozenset({"tasks", "window"})
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
        frozenset({"tasks", "phases", "impulses", "directions"}),
    ),
    "start": Suite(start, {"robots": 20}, ({"robots": 3},), frozenset()),
    "endurance": Suite(
        endurance, {"robots": 20}, ({"robots": 4, "metres": 5.0},), frozenset({"metres"})
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
        getup, {"robots": 20}, ({"robots": 3, "attempts": 2},), frozenset({"attempts"})
    ),
    "posture": Suite(
        posture,
        {"robots": 20, "urdf": "bruno", "tasks": POSTURE_TASKS, "window": 300.0},
        ({"robots": 2, "window": 5.0},),
        _WALKS | {"experiments"},
    ),
    "rough": Suite(
        rough,
        {"robots": 20, "tasks": ROUGH_TASKS},
        ({"robots": 2, "open_loop": "off"},),
        frozenset({"tasks", "experiments"}),
    ),
    "kick": Suite(
        kicks,
        {"robots": 20, "attempts": 1},
        ({"robots": 3, "attempts": 1},),
        frozenset({"attempts"}),
    ),
    "compute": Suite(compute, {"robots": 1}, ({"window": 10.0},), frozenset({"window"})),
    "plant": Suite(
        sweep,
        {"robots": 2, "window": 5.0, "engine": "mujoco"},
        ({"robots": 1, "window": 3.0, "tasks": ("forward",), "open_loop": "off"},),
        _WALKS | {"ingredients"},
    ),
    "ablation": Suite(
        ablation,
        {"robots": 5, "window": 8.0, "open_loop": "off"},
        ({"robots": 2, "window": 4.0, "phases": 2},),
        _WALKS | {"phases", "changes"},
    ),
    "peers": Suite(
        peers,
        {"robots": 8, "window": 8.0, "phases": 4, "tasks": PEERS_TASKS},
        ({"robots": 2, "window": 4.0, "phases": 2},),
        _WALKS | {"phases", "placo_python"},
    ),
    "faults": Suite(
        faults, {"engine": "mujoco"}, ({"runs": 56},), frozenset({"runs", "faults"})
    ),
    "loss": Suite(
        loss,
        {"robots": 20, "window": 60.0, "engine": "mujoco", "tasks": LOSS_TASKS},
        ({"robots": 2, "window": 10.0},),
        _WALKS | {"loss"},
    ),
    "fuzz": Suite(fuzz, {}, ({"ticks": 20_000},), frozenset({"ticks"})),
    "soak": Suite(
        soak_suite, {"engine": "mujoco"}, ({"minutes": 1.0},), frozenset({"minutes"})
    ),
    "realtime": Suite(realtime, {"engine": "mujoco"}, ({"window": 5.0},), frozenset({"window"})),
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
        with_peers = walks_here(asked.get("urdf", BenchOptions().urdf))
        quick = [
            (suite, {"engine": QUICK_ENGINE, **changes, **asked})
            for suite, entry in SUITES.items()
            for changes in entry.quick
            if suite != "peers" or with_peers
        ]
        return tuple(Run(suite, options_for(suite, given), given) for suite, given in quick)
    if name not in SUITES:
        raise NaoGaitError("suite", name, f"one of {', '.join(SUITES)}, all")
    return (Run(name, options_for(name, asked), asked),)


def options_for(name: str, given: Mapping[str, Any]) -> BenchOptions:
    """What a suite runs on: what is given, else what it usually runs on."""
    return BenchOptions(**{**SUITES[name].usual, **given})


def overridden(parameters: GaitParameters, settings: Iterable[str]) -> GaitParameters:
    """Parameters with `name=value` settings applied, as typed on a command line."""
    changes: dict[str, float | bool | str] = {}
    for setting in settings:
        name, equals, text = setting.partition("=")
        parameter = BY_NAME.get(name)
        if parameter is None or not equals:
            raise NaoGaitError("set", setting, f"name=value, name one of {', '.join(BY_NAME)}")
        words = {"true": True, "false": False}
        if parameter.is_switch:
            if text.lower() not in words:
                raise NaoGaitError(name, text, parameter.allowed)
            changes[name] = words[text.lower()]
        elif parameter.choices:
            changes[name] = text
        else:
            try:
                changes[name] = float(text)
            except ValueError:
                raise NaoGaitError(name, text, parameter.allowed) from None
    return parameters.replace(**changes)


def run(
    suite: str,
    asked: Mapping[str, Any],
    *,
    preset: str = "default",
    settings: Sequence[str] = (),
    json_file: Path | None = None,
    page: Path | None = None,
    out: Callable[[str], None] = print,
) -> None:
    """Run a suite (or all), print its tables, write its JSON and a page of everything.

    `asked`: the options of `BenchOptions` that shall not be the suite's usual ones.
    """
    planned = runs(suite, asked)
    # What is wrong with the input shall be said before the work, not after it.
    parameters = {
        urdf: overridden(preset_for(load_robot(urdf), preset), settings)
        for urdf in dict.fromkeys(each.options.urdf for each in planned)
    }
    for each in planned:
        with_options(load_plant(each.options.plant), each.options.plant_options)
        for task in each.options.tasks:
            find_task(task)
        directions_of(each.options.directions)
        classes_of(each.options.faults)
        if each.suite == "ablation":
            load_changes(each.options.changes)
        if each.suite == "peers":
            require_possible(each.options)
    for file, name in ((json_file, "json"), (page, "report")):
        if file is not None:
            _check_writable(file, name)
    rows: list[dict[str, Any]] = []
    sections: list[Section] = []
    for each in planned:
        began = time.monotonic()
        options = replace(each.options, parameters=parameters[each.options.urdf])
        report = SUITES[each.suite].measure(options)
        rows += report.as_json(options)
        reads = EVERY_SUITE | SUITES[each.suite].reads
        given = {name: value for name, value in each.given.items() if name in reads}
        command = command_line(each.suite, given, preset, settings)
        sections.append(Section(each.suite, command, options, report))
        out(f"{report.text}\n{each.suite}: took {time.monotonic() - began:.0f} s\n")
    if json_file is not None:
        json_file.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
        out(f"wrote {json_file}")
    if page is not None:
        whole = command_line(suite, asked, preset, settings) + f" --report {page}"
        out(f"wrote {', '.join(map(str, write(page, sections, whole)))}")


def _check_writable(path: Path, name: str) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("a", encoding="utf-8"):
            pass
    except OSError as error:
        raise NaoGaitError(name, str(path), f"a file that can be written ({error})") from error
