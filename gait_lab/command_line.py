"""How a command of the tool is declared: its arguments as data, and the function that it calls."""

import argparse
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any

from gait_lab.terminal import EXIT_OK, EXIT_USAGE, say
from robot_core.resources import names


@dataclass(frozen=True, slots=True)
class Argument:
    """An argument as `argparse` takes it.

    `{urdf}` in the help stands for the shipped names of that kind; arguments of the same `group`
    exclude each other.
    """

    flags: tuple[str, ...]
    options: dict[str, Any]
    group: str = ""


def argument(*flags: str, group: str = "", **options: Any) -> Argument:
    """An argument; `options` are those of `add_argument`."""
    return Argument(flags, options, group)


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
        for each in self.arguments:
            target = groups.setdefault(each.group, None) or parser.add_mutually_exclusive_group()
            groups[each.group] = target
            text = each.options["help"].format_map(_Shipped())
            target.add_argument(*each.flags, **{**each.options, "help": text})
        parser.set_defaults(run=self._call)

    def _call(self, parsed: argparse.Namespace) -> int:
        given = {k: v for k, v in vars(parsed).items() if k not in ("command", "action", "run")}
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
        self.exit(EXIT_USAGE, f"{self.prog}: {message} (see {self.prog} --help)\n")


def add_commands(
    parser: argparse.ArgumentParser, commands: dict[str, Command], kept_as: str = "command"
) -> None:
    """Declare commands; the name of the chosen one is kept under `kept_as`."""
    group = parser.add_subparsers(dest=kept_as, metavar=kept_as.upper(), required=True)
    for name, each in commands.items():
        group.add_parser(name, help=each.help, description=each.help, declare=each.add_to)
