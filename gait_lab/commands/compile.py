"""`nao_gait compile`: compiles the gait to machine code."""

import argparse
from pathlib import Path

from gait_lab.terminal import EXIT_OK, say


def run(arguments: argparse.Namespace) -> int:
    """Run the command; returns the exit status."""
    from gait_lab.compiled.build import compile_gait

    compile_gait(arguments.folder, say)
    return EXIT_OK


def add(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    parser.add_argument("folder", type=Path, nargs="?", default=Path("build/compiled"),
                        metavar="FOLDER", help="target folder (build/compiled)")  # fmt: skip
    parser.set_defaults(run=run)
