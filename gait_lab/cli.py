"""`nao_gait`: the tools around the gait. Each subcommand imports only what it needs."""

import argparse
import sys
from collections.abc import Callable, Sequence
from typing import Any

from gait_lab.commands import (
    bench,
    calibrate,
    compile,
    demo,
    fingerprint,
    match,
    record,
    report,
    results,
    teach,
    teleop,
    tune,
    view,
    vision,
)
from gait_lab.terminal import EXIT_FAILED, EXIT_INTERRUPTED, EXIT_USAGE
from robot_core.errors import NaoGaitError
from sim_bridge.trials.compiled import check_fresh

_COMMANDS = (
    ("demo", "watch the robot walk a tour over ROS 2; table, bag and figures", demo.add),
    ("match", "two teams play soccer; result, bag and a replay page", match.add),
    ("bench", "measure the gait on many robots, in process, without ROS", bench.add),
    ("compile", "the gait as machine code, for long rollouts; the same walk", compile.add),
    ("fingerprint", "hashes of reference rollouts: same hash, same walk", fingerprint.add),
    ("results", "measure what docs/results.md reports, on one commit", results.add),
    ("tune", "search parameters of the gait by a study; a preset comes out", tune.add),
    ("record", "record topics to a bag (rosbag2; MCAP or sqlite3)", record.add),
    ("report", "a page in one file about a recorded walk, or about two", report.add),
    ("view", "watch and drive the running robot in the browser", view.add),
    ("teach", "teach the robot a motion by hand, or play one", teach.add),
    ("teleop", "drive the robot from the keyboard", teleop.add),
    ("calibrate", "the running robot measures its soles and its IMU; a file comes out",
     calibrate.add),
    ("vision", "colour tables of the robots' vision, made from images", vision.add),
)  # fmt: skip
_EXTRAS = {"cv2": "vision", "mujoco": "mujoco"}
"""Module -> extra that brings it, where that is not the one of the command."""


class _Parser(argparse.ArgumentParser):
    """Answers bad arguments with one line instead of the whole usage.

    Args:
        declare: Adds the arguments when the parser is used for the first time, so that only the
            chosen subcommand imports what its arguments depend on.
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
        self.exit(EXIT_USAGE, f"{self.prog}: {message} (see {self.prog} --help)\n")


def build_parser() -> argparse.ArgumentParser:
    """The parser of `nao_gait` with all its subcommands."""
    parser = _Parser(prog="nao_gait", description="Watch, drive, measure and record a NAO's gait.")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for name, help_text, add in _COMMANDS:
        commands.add_parser(name, help=help_text, description=help_text, declare=add)
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a subcommand; the exit status (0 only for success)."""
    words = sys.argv[1:] if arguments is None else list(arguments)
    command = words[0] if words else ""
    try:
        # In here, because the options of a suite may need what is not installed.
        parsed = build_parser().parse_args(words)
        if parsed.command != "compile":
            check_fresh()
        return int(parsed.run(parsed))
    except NaoGaitError as error:
        sys.stderr.write(f"nao_gait {command}: {error}\n")
        return EXIT_USAGE
    except KeyboardInterrupt:
        sys.stderr.write(f"nao_gait {command}: interrupted\n")
        return EXIT_INTERRUPTED
    except ModuleNotFoundError as error:
        by_command = command if command in ("view", "tune") else "lab"
        extra = _EXTRAS.get(str(error.name), by_command)
        sys.stderr.write(
            f"nao_gait {command}: needs {error.name}, which is not installed; "
            f"in the checkout: pip install '.[{extra}]'; beside an installed ROS: docs/ros.md\n"
        )
        return EXIT_FAILED


if __name__ == "__main__":
    sys.exit(main())
