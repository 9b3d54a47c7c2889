"""`nao_gait report`: a page about one recorded walk, or about two."""

import argparse
from pathlib import Path

from gait_lab.terminal import EXIT_FAILED, EXIT_OK, say


def run(arguments: argparse.Namespace) -> int:
    """Write the page; the exit status."""
    from gait_lab.report import command

    if arguments.after is None:
        whole = command.write_report(arguments.bag, arguments.out, say, arguments.robot)
    else:
        whole = command.write_comparison(
            arguments.bag, arguments.after, arguments.out, say, arguments.robot
        )
    return EXIT_OK if whole else EXIT_FAILED


def add(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("bag", type=Path, metavar="BAG",
                        help="a rosbag2 folder, or an .mcap or .db3 file")  # fmt: skip
    parser.add_argument("after", type=Path, nargs="?", metavar="BAG2",
                        help="a second bag to compare the first with")  # fmt: skip
    parser.add_argument("--robot", default="", metavar="NAME",
                        help="one robot of a bag with several")  # fmt: skip
    parser.add_argument("-o", "--out", "--output", dest="out", type=Path, metavar="FILE",
                        default=Path("report.html"),
                        help="the page, complete in one file (report.html)")  # fmt: skip
    parser.set_defaults(run=run)
