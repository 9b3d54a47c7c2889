"""The suites: how they are found, planned and run.

Each `Suite` in a module of `gait_lab/bench/suites/` and each sweep in `config/bench/*.yaml` is a
suite of `nao_gait bench`; nothing else has to know of it.
"""

import importlib
import json
import pkgutil
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from gait_lab.bench import suites as package
from gait_lab.bench.options import Options, command_line, with_settings
from gait_lab.bench.suite import Suite
from gait_lab.bench.sweep import shipped_sweeps
from nao_lipm_gait.presets import preset_for
from robot_core.errors import NaoGaitError
from robot_core.robot import load_robot
from robot_core.schema import require_writable, write_text
from sim_bridge.scene import load_scene
from sim_bridge.trials.compiled import is_compiled
from sim_bridge.trials.tasks import find_task


@cache
def suites() -> Mapping[str, Suite]:
    """All suites by name; raises NaoGaitError if two have the same one."""
    found: dict[str, Suite] = {}
    every = list(shipped_sweeps(find_suite))
    for module in pkgutil.iter_modules(package.__path__):
        content = vars(importlib.import_module(f"{package.__name__}.{module.name}"))
        every += [each for each in content.values() if isinstance(each, Suite)]
    for each in every:
        if found.setdefault(each.name, each) is not each:
            raise NaoGaitError("suite", each.name, "a name not yet used")
    return dict(sorted(found.items()))


def find_suite(name: str) -> Suite:
    """The suite of a name; raises NaoGaitError if there is none."""
    if name not in suites():
        raise NaoGaitError("suite", name, (*suites(), "all"))
    return suites()[name]


@dataclass(frozen=True, slots=True)
class Run:
    """One run of a suite, and the command line that does the same."""

    suite: Suite
    options: Options
    command: str


def plan(
    name: str, asked: Mapping[str, Any], preset: str = "default", settings: Sequence[str] = ()
) -> list[Run]:
    """The runs behind the name of a suite, or behind `all`, with their input checked.

    In `all`, options, preset and settings are those of the suites that can use them.

    Args:
        name: Name of a suite, or `all` for the quick form of each.
        asked: Option -> value, where it is not the default.
        preset: Preset of the gait: a shipped name or a file; `default` is the robot's own.
        settings: `name=value` of the gait's parameters.

    Raises:
        NaoGaitError: The suite, an option or a value of it does not exist or is not allowed.
    """
    if name != "all":
        return [_planned(find_suite(name), dict(asked), preset, settings)]
    runs = []
    for each in suites().values():
        for quick in each.quick:
            asked_of = {key: value for key, value in {**quick, **asked}.items()
                        if key in {*each.options, "show"}}  # fmt: skip
            if each.applies(Options.of(each.options, asked_of)):
                gait = (preset, settings) if each.gait else ("default", ())
                runs.append(_planned(each, asked_of, *gait))
    return runs


def _planned(
    suite: Suite, given: Mapping[str, Any], preset: str, settings: Sequence[str]
) -> Run:
    for name, value in given.items():
        if name not in {*suite.options, "show"}:
            flags = ", ".join(sorted(each.flags[0] for each in suite.options.values()))
            raise NaoGaitError(name, value, f"an option of the suite {suite.name}: {flags}")
    if not suite.gait and (settings or preset != "default"):
        option, value = ("set", settings[0]) if settings else ("preset", preset)
        allowed = f"nothing: robots of the suite {suite.name} walk with their own preset"
        raise NaoGaitError(option, value, allowed)
    options = Options.of(suite.options, given)
    _ = options.made_plant  # raises NaoGaitError for a bad one
    for task in options.tasks:
        find_task(task)
    load_scene(options.scene)
    parameters = with_settings(preset_for(load_robot(options.urdf), preset), settings)
    options = options.but(parameters=parameters)
    suite.check(options)
    return Run(suite, options, command_line(suite.name, suite.options, given, preset, settings))


def run(
    name: str,
    asked: Mapping[str, Any],
    *,
    preset: str = "default",
    settings: Sequence[str] = (),
    json_file: Path | None = None,
    out: Callable[[str], None] = print,
) -> None:
    """Run a suite (or all), print its tables and write its JSON; arguments as of `plan`.

    Args:
        name: Name of a suite, or `all`.
        asked: Option -> value.
        preset: Preset of the gait.
        settings: `name=value` of the gait's parameters.
        json_file: Where the rows are written.
        out: Prints a text.

    Raises:
        NaoGaitError: Something is wrong with the input; found before any work.
    """
    planned = plan(name, asked, preset, settings)
    if json_file is not None:
        require_writable(json_file, "json")
    if is_compiled():
        out("with the compiled gait\n")
    rows: list[dict[str, Any]] = []
    for each in planned:
        began = time.monotonic()
        if len(planned) > 1:
            out(f"$ {each.command}\n")
        result = each.suite.run(each.options)
        rows += result.as_dicts()
        out(f"{result.text}\n{each.suite.name}: took {time.monotonic() - began:.0f} s\n")
    if json_file is not None:
        write_text(json_file, json.dumps(rows, indent=1) + "\n", "json")
        out(f"wrote {json_file}")
