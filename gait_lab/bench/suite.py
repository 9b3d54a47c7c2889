"""The suites: what each declares about itself, how they are found, planned and run.

A module of `gait_lab/bench/suites/` that holds a `SUITE` is a suite of `nao_gait bench`; nothing
else has to know of it.
"""

import importlib
import json
import pkgutil
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

from gait_lab.bench.options import BenchOptions, Option, command_line, declared, with_settings
from gait_lab.bench.result import SuiteResult
from nao_lipm_gait.presets import preset_for
from robot_core.errors import NaoGaitError
from robot_core.robot import load_robot
from sim_bridge.plant import load_plant, with_options
from sim_bridge.trials.compiled import is_compiled
from sim_bridge.trials.tasks import find_task

QUICK_ENGINE = "mujoco"
"""Engine of `all`: the faster one."""
EVERY_SUITE = ("seed", "engine", "plant", "plant_options", "urdf", "jobs")
"""Fields of `BenchOptions` that each suite takes."""


@dataclass(frozen=True, slots=True)
class Suite:
    """A benchmark.

    Attributes:
        name: Its name in `nao_gait bench NAME`.
        title: Heading of its results.
        summary: What it measures, for the help.
        measure: Runs it.
        options: Class of its options: its defaults, and the options that only it has.
        takes: Shared options that it accepts (`robots`, `tasks`, `window`, `open_loop`, `phases`,
            `control_period`), besides `EVERY_SUITE`; others are refused.
        quick: Its runs in `all`: field -> value of each where it differs from the default.
        check: Raises NaoGaitError, before any work, for what the suite cannot do.
        applies: Whether `all` runs it with these options.
        gait: Whether a preset and parameters of the gait may be given; without, each robot walks
            with its own preset.
    """

    name: str
    title: str
    summary: str
    measure: Callable[[Any], SuiteResult]
    options: type[BenchOptions] = BenchOptions
    takes: tuple[str, ...] = ()
    quick: tuple[Mapping[str, Any], ...] = ({},)
    check: Callable[[Any], object] = lambda options: None
    applies: Callable[[Any], bool] = lambda options: True
    gait: bool = True

    def __post_init__(self) -> None:
        fields = declared(self.options)
        for name in (*self.takes, *(name for run in self.quick for name in run)):
            if name not in fields:
                raise NaoGaitError(f"suite {self.name}", name, f"one of {', '.join(fields)}")

    @property
    def taken(self) -> dict[str, Option]:
        """The options that may be given to it, by the name of their field."""
        shared = declared(BenchOptions).keys() - {*EVERY_SUITE, *self.takes}
        return {name: each for name, each in declared(self.options).items() if name not in shared}


@cache
def suites() -> Mapping[str, Suite]:
    """All suites by name: every module of the package `suites` that holds a `SUITE`.

    Raises:
        NaoGaitError: Two suites have the same name.
    """
    from gait_lab.bench import suites as package

    found = {}
    for module in pkgutil.iter_modules(package.__path__):
        suite = getattr(importlib.import_module(f"{package.__name__}.{module.name}"), "SUITE", None)
        if isinstance(suite, Suite):
            if suite.name in found:
                raise NaoGaitError(f"suite in {module.name}.py", suite.name, "a name not yet used")
            found[suite.name] = suite
    return found


@dataclass(frozen=True, slots=True)
class Run:
    """One run of a suite.

    Attributes:
        suite: The suite.
        options: What it runs on.
        command: The command line that does the same.
    """

    suite: Suite
    options: BenchOptions
    command: str


def plan(
    name: str, asked: Mapping[str, Any], preset: str = "default", settings: Sequence[str] = ()
) -> list[Run]:
    """The runs behind the name of a suite, or behind `all`, with their input checked.

    In `all`, a preset and settings are those of the suites that can use them.

    Args:
        name: Name of a suite, or `all` for the quick form of each.
        asked: Field of the options -> value, where it is not the default.
        preset: Preset of the gait: a shipped name or a file; `default` is the robot's own.
        settings: `name=value` of the gait's parameters.

    Returns:
        The runs in their order.

    Raises:
        NaoGaitError: The suite, an option or a value of it does not exist or is not allowed.
    """
    if name == "all":
        usual: Mapping[str, Any] = {"engine": QUICK_ENGINE}
        pairs = [(suite, {**usual, **quick, **asked}) for suite in suites().values()
                 for quick in suite.quick]  # fmt: skip
        pairs = [
            (suite, {key: value for key, value in given.items() if key in {*suite.taken, "show"}})
            for suite, given in pairs
        ]
        pairs = [(suite, given) for suite, given in pairs
                 if suite.applies(suite.options(**given))]  # fmt: skip
        return [
            _planned(suite, given, *((preset, settings) if suite.gait else ("default", ())))
            for suite, given in pairs
        ]
    return [_planned(find_suite(name), dict(asked), preset, settings)]


def find_suite(name: str) -> Suite:
    """The suite of a name; raises NaoGaitError if there is none."""
    if name not in suites():
        raise NaoGaitError("suite", name, f"one of {', '.join(suites())}, all")
    return suites()[name]


def _planned(
    suite: Suite, given: Mapping[str, Any], preset: str, settings: Sequence[str]
) -> Run:
    for name, value in given.items():
        if name not in {*suite.taken, "show"}:
            flags = ", ".join(sorted(each.flags[0] for each in suite.taken.values()))
            raise NaoGaitError(name, value, f"an option of the suite {suite.name}: {flags}")
    if not suite.gait and (settings or preset != "default"):
        option, value = ("set", settings[0]) if settings else ("preset", preset)
        allowed = f"nothing: robots of the suite {suite.name} walk with their own preset"
        raise NaoGaitError(option, value, allowed)
    options = suite.options(**given)
    with_options(load_plant(options.plant), options.plant_options)
    for task in options.tasks:
        find_task(task)
    parameters = with_settings(preset_for(load_robot(options.urdf), preset), settings)
    options = replace(options, parameters=parameters)
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
    """Run a suite (or all), print its tables and write its JSON.

    Args:
        name: Name of a suite, or `all` for the quick form of each.
        asked: Field of the options -> value, where it is not the default.
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
        result = each.suite.measure(each.options)
        rows += result.as_rows(each.suite.name, each.options)
        out(f"{result.text}\n{each.suite.name}: took {time.monotonic() - began:.0f} s\n")
    if json_file is not None:
        json_file.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
        out(f"wrote {json_file}")


def require_writable(path: Path, name: str) -> None:
    """Raise NaoGaitError if the file cannot be written; `name` is the option that names it."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("a", encoding="utf-8"):
            pass
    except OSError as error:
        raise NaoGaitError(name, str(path), f"a file that can be written ({error})") from error
