"""Options of the suites. One declaration gives the default, the flag, the help and the check."""

import argparse
import math
import shlex
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from nao_lipm_gait.parameters import BY_NAME, GaitParameters
from robot_core.errors import NaoGaitError
from robot_core.resources import names
from robot_core.schema import Anything, Choice, Kind, Number, require_writable, value_of
from sim_bridge.engines.registry import ENGINES
from sim_bridge.plant import Plant, load_plant, option_text, parse_options, with_options
from sim_bridge.trials.parallel import MOST, parallel_map
from sim_bridge.trials.result_cache import ResultCache
from sim_bridge.trials.tasks import SPEED_TASKS


@dataclass(frozen=True, slots=True)
class Option:
    """How an option is written on the command line, and which values it takes.

    Attributes:
        default: Its default; a tuple makes it repeated.
        help: Its meaning, without a full stop.
        metavar: Placeholder of the value; empty for a switch.
        flags: Names on the command line; empty for `--` and the name of the option.
        parse: Converts a text; None for the type of the default, or str for a repeated option.
        minimum: Smallest allowed value.
        maximum: Largest allowed value.
        choices: All allowed values; empty if they are not listed.
        writes: `file` or `folder`: the suite ends with writing it, which is tried before.
    """

    default: Any
    help: str
    metavar: str = ""
    flags: tuple[str, ...] = ()
    parse: Callable[[str], Any] | None = None
    minimum: float = -math.inf
    maximum: float = math.inf
    choices: tuple[str, ...] = ()
    writes: str = ""

    @property
    def repeated(self) -> bool:
        """It may be given several times."""
        return isinstance(self.default, tuple)

    @property
    def _parser(self) -> Callable[[str], Any]:
        return self.parse or (str if self.repeated else type(self.default))

    @property
    def _kind(self) -> Kind:
        """Which values, or items, it takes."""
        if self.choices:
            return Choice(self.choices)
        if self._parser in (int, float):
            return Number(self.minimum, self.maximum, whole=self._parser is int)
        return Anything()

    def read(self, text: str) -> Any:
        """The value of a text; raises NaoGaitError if it is none."""
        if self.writes and not text.strip():
            raise NaoGaitError(self.flags[0].lstrip("-"), text, "a path")
        try:
            return self._parser(text)
        except NaoGaitError:
            raise
        except ValueError as error:
            raise NaoGaitError(self.flags[0].lstrip("-"), text, self._kind.allowed) from error

    def check(self, value: Any) -> None:
        """Raise NaoGaitError if the value, or an item of it, is not allowed."""
        for each in value if self.repeated else (value,):
            self._kind.check(self.flags[0].lstrip("-"), each)
        if self.writes and value:
            require_writable(Path(value), self.flags[0].lstrip("-"), folder=self.writes == "folder")


MOST_ROBOTS = 10_000
"""Robots, or what else is repeated, of a run."""
SHARED: Mapping[str, Option] = {
    "robots": Option(8, "number of robots", "N", minimum=1, maximum=MOST_ROBOTS),
    "seed": Option(
        0, "seed of the first robot, the others have the next ones; -1 is the nominal robot", "S",
        minimum=-1, maximum=2**31 - 1,
    ),
    "engine": Option("mujoco", "physics engine: mujoco or pybullet", "E", choices=ENGINES),
    "plant": Option("reference", f"shipped name ({', '.join(names('plants'))}) or YAML file", "P"),
    "plant_options": Option(
        (), "override one option of the plant, e.g. motor.play=0.035", "OPTION=VALUE",
        ("--plant-set",), parse=lambda text: parse_options([text])[0],
    ),
    "urdf": Option(
        "nao_h21_v33",
        f"shipped robot ({', '.join(names('urdf'))}) or the path of a URDF, MJCF or robot file",
        "NAME", ("--robot", "--urdf"),
    ),
    "tasks": Option(
        SPEED_TASKS, "walk this, e.g. forward=31 (cm/s), turn=50 (deg/s) or spot", "NAME[=SPEED]",
        ("--task",),
    ),
    "window": Option(20.0, "measured time [s]", "T", ("--seconds",), minimum=0.01, maximum=3600.0),
    "open_loop": Option(
        "beside", "open loop beside the closed one, off, or only", "MODE",
        choices=("beside", "off", "only"),
    ),
    "control_period": Option(
        0.01, "time between two ticks of the gait [s]; LoLA's is 0.012", "T", minimum=0.002,
        maximum=0.05,
    ),
    "phases": Option(8, "pushes per gait cycle of two steps", "N", minimum=1, maximum=100),
    "scene": Option("pitch_small", "field and goals: a shipped scene or a YAML file", "S"),
    "attempts": Option(1, "attempts of each robot", "N", minimum=1, maximum=1000),
    "resume": Option("", "file of finished runs: those in it are not run again, others are added",
                     "FILE"),
    "jobs": Option(None, "processes (all cores)", "N", ("--jobs", "--workers"), int, minimum=1,
                   maximum=MOST),
}  # fmt: skip
"""Options that several suites have."""
EVERY_SUITE = ("seed", "engine", "plant", "plant_options", "urdf", "jobs")
"""Of these, those that each suite takes."""


def declared(given: Mapping[str, Any]) -> dict[str, Option]:
    """The options of a suite: those of every suite, and its own.

    Args:
        given: Name -> an `Option`, or the suite's default of a shared one (`...` for the usual).
    """
    found = {name: SHARED[name] for name in EVERY_SUITE}
    for name, each in given.items():
        if not isinstance(each, Option):
            each = SHARED[name] if each is ... else replace(SHARED[name], default=each)
        found[name] = each
    return {name: replace(each, flags=each.flags or (f"--{name.replace('_', '-')}",))
            for name, each in found.items()}  # fmt: skip


@dataclass(frozen=True)
class Options:
    """What a suite runs on: the values of its options are attributes.

    Attributes:
        values: Option -> value; shared options that the suite does not take have their default.
        parameters: Parameters of the gait, from `--preset` and `--set`.
    """

    values: Mapping[str, Any]
    parameters: GaitParameters = GaitParameters()
    show: bool = True
    calibrated: bool = False

    @classmethod
    def of(cls, options: Mapping[str, Option], given: Mapping[str, Any]) -> "Options":
        """Defaults and given values; raises NaoGaitError for one that is not allowed."""
        values = {name: each.default for name, each in {**SHARED, **options}.items()}
        if "robots" not in options:
            values["robots"] = 1
        for name, each in options.items():
            if (value := given.get(name)) is not None:
                each.check(value)
        show = given.get("show", True)
        return cls({**values, **{k: v for k, v in given.items() if k != "show"}}, show=show)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_") or name == "values" or name not in self.values:
            raise AttributeError(name)
        return self.values[name]

    def but(self, **changes: Any) -> "Options":
        """The same with other values."""
        fields = {name: changes.pop(name) for name in ("parameters", "show", "calibrated")
                  if name in changes}  # fmt: skip
        return replace(self, values={**self.values, **changes}, **fields)

    @property
    def plant_title(self) -> str:
        """The plant with its replaced options."""
        return " ".join((self.plant, *(option_text(option) for option in self.plant_options)))

    @property
    def made_plant(self) -> Plant:
        """The plant with its replaced options."""
        return with_options(load_plant(self.plant), self.plant_options)

    @property
    def seeds(self) -> range:
        """Seeds of the robots."""
        return range(self.seed, self.seed + self.robots)

    @property
    def loops(self) -> tuple[bool, ...]:
        """Closed (true) and open (false) loop, as far as requested."""
        return {"beside": (True, False), "off": (True,), "only": (False,)}[self.open_loop]

    @property
    def trial(self) -> dict[str, Any]:
        """Arguments of a `TrialSpec`: robot, plant, engine and parameters."""
        taken = ("plant", "plant_options", "urdf", "engine")
        return {"parameters": self.parameters, **{name: self.values[name] for name in taken}}

    @property
    def play(self) -> dict[str, Any]:
        """Arguments of a specification in soccer: robot, plant and engine."""
        return {"urdf": self.urdf, "engine": self.engine, "plant": self.made_plant}

    def loop_parameters(self, closed: bool) -> GaitParameters:
        """The gait's parameters in closed or open loop."""
        return self.parameters.replace(feedback=self.parameters.feedback and closed)

    def map(
        self, function: Callable[[Any], Any], items: Iterable[Any], label: str = "rollouts",
        restore: Callable[..., Any] | None = None, **more: Any,
    ) -> list[Any]:  # fmt: skip
        """`parallel_map` with these processes; `restore`: for the file of finished runs."""
        kept = ResultCache(self.resume, restore) if restore is not None and self.resume else None
        return parallel_map(
            function, items, jobs=self.jobs, show=self.show, label=label, kept=kept, **more
        )

    def by_robots(self, results: Sequence[Any]) -> list[Sequence[Any]]:
        """Results in groups of as many as there are robots."""
        return [results[i : i + self.robots] for i in range(0, len(results), self.robots)]

    @property
    def title(self) -> str:
        """Robots, plant, engine and model, for the head of a table."""
        last = self.seed + self.robots - 1
        robots = f"robots {self.seed}-{last}" if self.robots > 1 else f"robot {last}"
        return f"{robots}, plant {self.plant_title}, {self.engine}, {self.urdf}"


def add_argument(
    parser: argparse.ArgumentParser, name: str, each: Option, shows_default: bool = True
) -> None:
    """Declare one option on a command line; its text is read by `given`."""
    text = each.help
    if not each.metavar:
        parser.add_argument(*each.flags, dest=name, action="store_const", const=not each.default,
                            help=text)  # fmt: skip
        return
    if each.repeated:
        text += "; may be repeated"
    if shows_default and each.default not in (None, (), ""):
        shown = ", ".join(map(str, each.default)) if each.repeated else f"{each.default}"
        text += f" ({shown})"
    parser.add_argument(
        *each.flags, dest=name, metavar=each.metavar, action="append" if each.repeated else "store",
        help=text.replace("%", "%%"),
    )  # fmt: skip


def given(namespace: argparse.Namespace, options: Mapping[str, Option]) -> dict[str, Any]:
    """The values of the options that the command line names; raises NaoGaitError."""
    found: dict[str, Any] = {}
    for name, each in options.items():
        text = getattr(namespace, name, None)
        if isinstance(text, list):
            found[name] = tuple(map(each.read, text))
        elif text is not None:
            found[name] = text if isinstance(text, bool) else each.read(text)
    return found


def command_line(
    suite: str,
    options: Mapping[str, Option],
    values: Mapping[str, Any],
    preset: str = "default",
    settings: Sequence[str] = (),
) -> str:
    """The command that runs a suite with these options, quoted for a shell.

    Defaults and the number of processes are left out.
    """
    words = ["nao_gait", "bench", suite]
    for name, each in options.items():
        if name == "jobs" or name not in values or values[name] == each.default:
            continue
        value = values[name]
        if isinstance(value, bool):
            words.append(each.flags[0])
        else:
            for item in value if each.repeated else (value,):
                words += [each.flags[0], _text(item)]
    if preset != "default":
        words += ["--preset", preset]
    for setting in settings:
        words += ["--set", setting]
    return shlex.join(words)


def _text(value: Any) -> str:
    if isinstance(value, tuple):
        return option_text(value)
    return f"{value:.10g}" if isinstance(value, float) else str(value)


def with_settings(parameters: GaitParameters, settings: Iterable[str]) -> GaitParameters:
    """Parameters with `name=value` settings of a command line; raises NaoGaitError."""
    changes = {}
    for setting in settings:
        name, equals, text = setting.partition("=")
        if name not in BY_NAME or not equals:
            allowed = f"name=value, name one of {', '.join(BY_NAME)}"
            raise NaoGaitError("set", setting, allowed, BY_NAME)
        changes[name] = BY_NAME[name].check(value_of(text))
    return parameters.replace(**changes)
