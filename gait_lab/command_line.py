"""How a command of the tool is declared: its arguments as data, and the function that it calls."""

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

from gait_lab.terminal import EXIT_OK, EXIT_USAGE, say
from robot_core.errors import LONGEST_ALLOWED, NaoGaitError, clipped
from robot_core.resources import names
from robot_core.schema import Kind, read_word, require_writable


@dataclass(frozen=True, slots=True)
class Argument:
    """An argument as `argparse` takes it.

    `{urdf}` in the help stands for the shipped names of that kind; arguments of the same `group`
    exclude each other.

    Attributes:
        kind: What a word of it may be; None for any text.
        writes: `file` or `folder`: the command ends with writing it, which is tried before.
    """

    flags: tuple[str, ...]
    options: dict[str, Any]
    group: str = ""
    kind: Kind | None = None
    writes: str = ""

    def add_to(self, target: Any) -> argparse.Action:
        """Declare it in a parser, or in a group of it."""
        options = {**self.options, "help": self.options["help"].format_map(_Shipped())}
        if self.kind is not None:
            options["type"] = partial(_read, self.kind)
        elif self.writes or options.get("type") is Path:
            options["type"] = _path
        return target.add_argument(*self.flags, **options)  # type: ignore[no-any-return]


def argument(
    *flags: str, group: str = "", kind: Kind | None = None, writes: str = "", **options: Any
) -> Argument:
    """An argument; `options` are those of `add_argument`."""
    return Argument(flags, options, group, kind, writes)


def _path(word: str) -> Path:
    if not word.strip():  # an empty variable of a shell; Path("") would be the working directory
        raise argparse.ArgumentTypeError(f"got {word!r}; allowed: a path")
    return Path(word)


def _read(kind: Kind, word: str) -> Any:
    try:
        return read_word(kind, "", word)
    except NaoGaitError as error:  # argparse names the argument
        raise argparse.ArgumentTypeError(str(error).removeprefix(": ")) from None


@dataclass(frozen=True, slots=True)
class Command:
    """A command of the tool, or a group of them.

    Attributes:
        help: One line.
        run: `module:function`, imported when it is called with the arguments by name and `say`; it
            returns the exit status, or None for success.
        arguments: Its arguments.
        parts: Subcommands by name, instead of `run`.
        declare: Declares arguments that have to be computed, and sets `run` to a function of them.
    """

    help: str
    run: str = ""
    arguments: tuple[Argument, ...] = ()
    parts: "dict[str, Command]" = field(default_factory=dict)
    declare: Callable[[argparse.ArgumentParser], None] | None = None

    def add_to(self, parser: argparse.ArgumentParser) -> None:
        """Declare everything in a parser."""
        if self.declare is not None:
            self.declare(parser)
            return
        if self.parts:
            add_commands(parser, self.parts, "action")
            return
        groups: dict[str, Any] = {"": parser}
        written = []
        for each in self.arguments:
            target = groups.setdefault(each.group, None) or parser.add_mutually_exclusive_group()
            groups[each.group] = target
            action = each.add_to(target)
            if each.writes:
                written.append((action.dest, each.flags[-1], each.writes == "folder"))
        parser.set_defaults(run=partial(self._call, written))

    def _call(self, written: Sequence[tuple[str, str, bool]], parsed: argparse.Namespace) -> int:
        given = {k: v for k, v in vars(parsed).items() if k not in ("command", "action", "run")}
        for name, flag, folder in written:
            if given[name] is not None:
                require_writable(given[name], flag, folder=folder)
        module, _, name = self.run.partition(":")
        status = getattr(import_module(module), name)(**given, say=say)
        return EXIT_OK if status is None else int(status)


class _Shipped(dict[str, str]):
    def __missing__(self, kind: str) -> str:
        return ", ".join(names(kind))


class Parser(argparse.ArgumentParser):
    """Answers bad arguments with one line instead of the whole usage.

    Args:
        declare: Adds the arguments when the parser is used for the first time, so that only the
            chosen command imports what its arguments depend on.
    """

    def __init__(
        self,
        *args: Any,
        declare: Callable[[argparse.ArgumentParser], None] | None = None,
        **options: Any,
    ) -> None:
        super().__init__(*args, **options)
        self._declare = declare

    def parse_known_args(self, args=None, namespace=None):  # type: ignore[no-untyped-def,override]
        """See the base class."""
        if self._declare is not None:
            declare, self._declare = self._declare, None
            declare(self)
        known, unknown = super().parse_known_args(args, namespace)
        if unknown and self._subparsers is None:
            flags = (flag for action in self._actions for flag in action.option_strings[:1])
            self.error(f"{unknown[0]}: no such argument; allowed: {', '.join(flags)}")
        return known, unknown

    def error(self, message: str) -> None:  # type: ignore[override]
        """See the base class."""
        text = clipped(message, LONGEST_ALLOWED)
        self.exit(EXIT_USAGE, f"{self.prog}: {text} (see {self.prog} --help)\n")


def add_commands(
    parser: argparse.ArgumentParser, commands: dict[str, Command], kept_as: str = "command"
) -> None:
    """Declare commands; the name of the chosen one is kept under `kept_as`."""
    group = parser.add_subparsers(dest=kept_as, metavar=kept_as.upper(), required=True)
    for name, each in commands.items():
        group.add_parser(name, help=each.help, description=each.help, declare=each.add_to)
