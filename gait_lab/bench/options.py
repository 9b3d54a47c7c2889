"""The options of the suites. One declaration gives the default, the flag, the help and the check.

`BenchOptions` holds what several suites share. A suite with options of its own adds them, or other
defaults, in a subclass:

    @dataclass(frozen=True)
    class Options(BenchOptions):
        robots: int = 20
        metres: float = option(50.0, "distance that each robot walks", "M", above=0.0)
"""

import argparse
import dataclasses
import math
import shlex
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from nao_lipm_gait.parameters import BY_NAME, GaitParameters
from robot_core.errors import NaoGaitError
from robot_core.resources import names
from sim_bridge.plant import PlantOption, option_text, parse_options
from sim_bridge.trials.tasks import SPEED_TASKS

_KEY = "option"
"""Key of the `Option` in the metadata of a dataclass field."""


@dataclass(frozen=True, slots=True)
class Option:
    """How an option is written on the command line, and which values it takes.

    Attributes:
        help: Its meaning, without a full stop.
        metavar: Placeholder of the value; empty for a switch.
        flags: Names on the command line, the usual one first.
        parse: Converts the text of the command line.
        repeated: The option may be repeated; its value is a tuple.
        minimum: Smallest allowed value.
        above: The value has to be larger than this.
        maximum: Largest allowed value.
        choices: All allowed values; empty if they are not listed.
    """

    help: str
    metavar: str
    flags: tuple[str, ...]
    parse: Callable[[str], Any]
    repeated: bool
    minimum: float
    above: float
    maximum: float
    choices: tuple[str, ...]

    @property
    def name(self) -> str:
        """The flag without dashes, as it stands in errors."""
        return self.flags[0].lstrip("-")

    def read(self, text: str) -> Any:
        """The value of a text; raises NaoGaitError if it is none."""
        try:
            return self.parse(text)
        except NaoGaitError:
            raise
        except ValueError as error:
            kind = {int: "a whole number", float: "a number"}.get(self.parse, self.allowed)  # type: ignore[call-overload]
            raise NaoGaitError(self.name, text, kind) from error

    def check(self, value: Any) -> None:
        """Raise NaoGaitError if the value, or an item of it, is not allowed."""
        for each in value if self.repeated else (value,):
            if self.choices:
                good = each in self.choices
            elif isinstance(each, bool) or not isinstance(each, int | float):
                good = True
            else:
                good = self.minimum <= each <= self.maximum and each > self.above
            if not good:
                raise NaoGaitError(self.name, each, self.allowed)

    @property
    def allowed(self) -> str:
        """The allowed values in words."""
        if self.choices:
            return f"{', '.join(self.choices[:-1])} or {self.choices[-1]}"
        low = f"over {self.above:g}" if math.isfinite(self.above) else f"{self.minimum:g}"
        if math.isfinite(self.maximum):
            return f"{low} to {self.maximum:g}"
        return low if low.startswith("over") else f"at least {low}"


def option(
    default: Any,
    help_text: str,
    metavar: str = "",
    *,
    flags: tuple[str, ...] = (),
    parse: Callable[[str], Any] | None = None,
    minimum: float = -math.inf,
    above: float = -math.inf,
    maximum: float = math.inf,
    choices: tuple[str, ...] = (),
) -> Any:
    """A field of `BenchOptions` or of a subclass; see `Option`.

    Args:
        default: A tuple makes the option repeated.
        help_text: Its meaning, without a full stop.
        metavar: Placeholder of the value; empty for a switch.
        flags: Empty for `--` and the name of the field.
        parse: None for the type of the default, or str for a repeated option.
        minimum: Smallest allowed value.
        above: The value has to be larger than this.
        maximum: Largest allowed value.
        choices: All allowed values.

    Returns:
        A dataclass field.
    """
    repeated = isinstance(default, tuple)
    if parse is None:
        parse = str if repeated else type(default)
    made = Option(
        help_text, metavar, flags, parse, repeated, minimum, above, maximum, choices
    )  # fmt: skip
    return dataclasses.field(default=default, metadata={_KEY: made})


def keep_option() -> Any:
    """A field for the file of finished runs (`sim_bridge.trials.result_cache`)."""
    text = "file of finished runs: those in it are not run again, others are added"
    return option("", text, "FILE")


@dataclass(frozen=True)
class BenchOptions:
    """What a suite runs on. The text of each option is its meaning.

    Attributes:
        parameters: Parameters of the gait, from `--preset` and `--set`.
        show: Show a progress bar, on a terminal.
        calibrated: The robots have been calibrated by their own sensors.
    """

    robots: int = option(8, "number of robots", "N", minimum=1)
    seed: int = option(
        0, "seed of the first robot, the others have the next ones; -1 is the nominal robot", "S",
        minimum=-1,
    )  # fmt: skip
    engine: str = option("pybullet", "physics engine: pybullet or mujoco", "E")
    plant: str = option(
        "reference", f"shipped name ({', '.join(names('plants'))}) or YAML file", "P"
    )
    plant_options: tuple[PlantOption, ...] = option(
        (), "override one option of the plant, e.g. motor.play=0.035", "OPTION=VALUE",
        flags=("--plant-set",), parse=lambda text: parse_options([text])[0],
    )  # fmt: skip
    urdf: str = option(
        "nao_h21_v33",
        f"shipped robot ({', '.join(names('urdf'))}) or a URDF file with its joint names",
        "NAME", flags=("--robot", "--urdf"),
    )  # fmt: skip
    tasks: tuple[str, ...] = option(
        SPEED_TASKS, "walk this, e.g. forward=31 (cm/s), turn=50 (deg/s) or spot", "NAME[=SPEED]",
        flags=("--task",),
    )  # fmt: skip
    window: float = option(
        20.0, "measured time [s]", "T", flags=("--seconds",), minimum=0.01, maximum=3600.0
    )
    open_loop: str = option(
        "beside", "open loop beside the closed one, off, or only", "MODE",
        choices=("beside", "off", "only"),
    )  # fmt: skip
    control_period: float = option(
        0.01, "time between two ticks of the gait [s]; LoLA's is 0.012", "T", minimum=0.002,
        maximum=0.05,
    )  # fmt: skip
    phases: int = option(8, "pushes per gait cycle of two steps", "N", minimum=1, maximum=100)
    jobs: int | None = option(
        None, "processes (all cores)", "N", flags=("--jobs", "--workers"), parse=int, minimum=1
    )
    parameters: GaitParameters = GaitParameters()
    show: bool = True
    calibrated: bool = False

    def __post_init__(self) -> None:
        for name, each in declared(type(self)).items():
            if (value := getattr(self, name)) is not None:
                each.check(value)

    @property
    def plant_title(self) -> str:
        """The plant with its replaced options."""
        return " ".join((self.plant, *(option_text(option) for option in self.plant_options)))

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
        names = ("parameters", "plant", "plant_options", "urdf", "engine")
        return {name: getattr(self, name) for name in names}

    def loop_parameters(self, closed: bool) -> GaitParameters:
        """The gait's parameters in closed or open loop."""
        return self.parameters.replace(feedback=self.parameters.feedback and closed)

    @property
    def robots_title(self) -> str:
        """The robots by their seeds."""
        last = self.seed + self.robots - 1
        return f"robots {self.seed}-{last}" if self.robots > 1 else f"robot {last}"

    @property
    def title(self) -> str:
        """Robots, plant, engine and model, for the head of a table."""
        return f"{self.robots_title}, plant {self.plant_title}, {self.engine}, {self.urdf}"


def declared(kind: type[BenchOptions]) -> Mapping[str, Option]:
    """The options of a class by the name of their field.

    A subclass may replace only a default (`robots: int = 3`); the rest is then as its base declares
    it. A field declared again with `option(...)` replaces all of it.
    """
    found = {}
    for field in dataclasses.fields(kind):
        for base in kind.__mro__:
            known = getattr(base, "__dataclass_fields__", {}).get(field.name)
            if known is not None and _KEY in known.metadata:
                each: Option = known.metadata[_KEY]
                flags = each.flags or ("--" + field.name.replace("_", "-"),)
                found[field.name] = dataclasses.replace(each, flags=flags)
                break
    return found


def default_of(kind: type[BenchOptions], name: str) -> Any:
    """The default of a field."""
    return kind.__dataclass_fields__[name].default


def add_argument(parser: argparse.ArgumentParser, name: str, each: Option, default: Any) -> None:
    """Declare one option on a command line; its text is read by `given`.

    Args:
        parser: Parser of the command.
        name: Name of the field.
        each: The option.
        default: Default shown in the help; None if it has none or several.
    """
    text = each.help
    if isinstance(default, bool) or not each.metavar:
        parser.add_argument(*each.flags, dest=name, action="store_const", const=not default,
                            help=text)  # fmt: skip
        return
    if each.repeated:
        text += "; may be repeated"
    if default not in (None, ()):
        shown = ", ".join(default) if isinstance(default, tuple) else f"{default}"
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
        if text is None:
            continue
        if isinstance(text, list):
            found[name] = tuple(map(each.read, text))
        else:
            found[name] = text if isinstance(text, bool) else each.read(text)
    return found


def command_line(
    suite: str,
    kind: type[BenchOptions],
    values: Mapping[str, Any],
    preset: str = "default",
    settings: Sequence[str] = (),
) -> str:
    """The command that runs a suite with these options.

    Args:
        suite: Its name.
        kind: The class of its options.
        values: Field -> value. Defaults and the number of processes are left out, but for the
            engine, whose default depends on the suite.
        preset: Preset of the gait.
        settings: `name=value` of the gait's parameters.

    Returns:
        `nao_gait bench ...`, quoted for a shell.
    """
    words = ["nao_gait", "bench", suite]
    for name, each in declared(kind).items():
        if name == "jobs" or name not in values:
            continue
        if name != "engine" and values[name] == default_of(kind, name):
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
