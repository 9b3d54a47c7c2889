"""`nao_gait record`: record topics to a bag."""

import argparse
from pathlib import Path

from gait_lab.terminal import EXIT_FAILED, EXIT_OK, say


def run(arguments: argparse.Namespace) -> int:
    """Record; the exit status."""
    from gait_lab.record.recorder import record

    messages = record(
        arguments.bag or arguments.out,
        topics=tuple(arguments.topics),
        duration=arguments.duration,
        storage=arguments.storage,
        images=arguments.images,
        say=say,
    )
    return EXIT_OK if messages else EXIT_FAILED


def add(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("--topics", nargs="+", default=[], metavar="TOPIC",
                        help="only these topics (default: all that appear)")  # fmt: skip
    parser.add_argument("bag", type=Path, nargs="?", metavar="BAG",
                        help="a new folder for the bag; the same as --out")  # fmt: skip
    parser.add_argument("-o", "--out", type=Path, default=Path("out/bag"), metavar="DIR",
                        help="a new folder for the bag (out/bag)")  # fmt: skip
    parser.add_argument("--images", action="store_true",
                        help="images, too: they are rendered only for a listener")  # fmt: skip
    parser.add_argument("--duration", type=float, metavar="S", help="seconds of wall time")
    parser.add_argument("--storage", default="mcap", metavar="S", help="mcap (default) or sqlite3")
    parser.set_defaults(run=run)
