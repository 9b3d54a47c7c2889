"""The suites of `nao_gait bench`: which there are, what they run on, and running them."""

import json
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from gait_lab.bench.compute import compute
from gait_lab.bench.delay import TASKS as DELAY_TASKS
from gait_lab.bench.delay import delay
from gait_lab.bench.endurance import endurance
from gait_lab.bench.error import TASKS as ERROR_TASKS
from gait_lab.bench.error import error
from gait_lab.bench.options import BenchOptions
from gait_lab.bench.plants import sweep
from gait_lab.bench.push import TASKS as PUSH_TASKS
from gait_lab.bench.push import push
from gait_lab.bench.report import Report
from gait_lab.bench.robust import TASKS as ROBUST_TASKS
from gait_lab.bench.robust import robust
from gait_lab.bench.speed import speed
from gait_lab.bench.start import start
from gait_lab.tasks import find_task
from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.parameters import BY_NAME, GaitParameters, load_preset
from nao_lipm_gait.robot_description import load_robot
from sim_bridge.plant import load_plant, with_options


@dataclass(frozen=True, slots=True)
class Suite:
    """A benchmark and the options that it runs on unless told otherwise."""

    measure: Callable[[BenchOptions], Report]
    usual: Mapping[str, Any] = field(default_factory=dict)
    quick: Mapping[str, Any] | None = None
    """What is different in `all`; None = not in `all`."""


SUITES = {
    "speed": Suite(speed),
    "error": Suite(error, {"tasks": ERROR_TASKS}),
    "push": Suite(push, {"robots": 5, "tasks": PUSH_TASKS}),
    "start": Suite(start, {"robots": 20}),
    "endurance": Suite(endurance, {"robots": 20}),
    "delay": Suite(delay, {"robots": 4, "window": 10.0, "tasks": DELAY_TASKS}),
    "robust": Suite(robust, {"robots": 20, "tasks": ROBUST_TASKS}),
    "compute": Suite(compute),
    "plant": Suite(sweep, {"robots": 2, "window": 5.0, "engine": "mujoco"}),
}


def named(name: str) -> tuple[str, ...]:
    """The suites behind a name; `all` is every one but the long ones."""
    if name == "all":
        return tuple(key for key, suite in SUITES.items() if suite.quick is not None)
    if name not in SUITES:
        raise NaoGaitError("suite", name, f"one of {', '.join(SUITES)}, all")
    return (name,)


def options_for(name: str, asked: Mapping[str, Any], *, quick: bool = False) -> BenchOptions:
    """What a suite runs on: what was asked for, else what it usually runs on."""
    suite = SUITES[name]
    return BenchOptions(**{**suite.usual, **((suite.quick or {}) if quick else {}), **asked})


def overridden(parameters: GaitParameters, settings: Iterable[str]) -> GaitParameters:
    """Parameters with `name=value` settings applied, as typed on a command line."""
    changes: dict[str, float | bool] = {}
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
    out: Callable[[str], None] = print,
) -> None:
    """Run a suite (or all), print its tables and write its JSON.

    `asked`: the options of `BenchOptions` that shall not be the suite's usual ones.
    """
    names = named(suite)
    asked = {**asked, "parameters": overridden(load_preset(preset), settings)}
    all_options = {name: options_for(name, asked, quick=suite == "all") for name in names}
    # What is wrong with the input shall be said before the work, not after it.
    for options in all_options.values():
        load_robot(options.urdf)
        with_options(load_plant(options.plant), options.plant_options)
        for task in options.tasks:
            find_task(task)
    if json_file is not None:
        _check_writable(json_file)
    rows: list[dict[str, Any]] = []
    for name, options in all_options.items():
        began = time.monotonic()
        report = SUITES[name].measure(options)
        rows += report.as_json(options)
        out(f"{report.text}\n{name}: took {time.monotonic() - began:.0f} s\n")
    if json_file is not None:
        json_file.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
        out(f"wrote {json_file}")


def _check_writable(path: Path) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("a", encoding="utf-8"):
            pass
    except OSError as error:
        raise NaoGaitError("json", str(path), f"a file that can be written ({error})") from error
