"""`nao_gait view`: watch and drive the robot in the browser."""

import argparse

from gait_lab.terminal import EXIT_OK, say


def run(arguments: argparse.Namespace) -> int:
    """Run the command; return the exit status."""
    from gait_lab.view import viewer

    viewer.run(
        port=arguments.port,
        namespace=arguments.namespace,
        stamped=arguments.stamped,
        duration=arguments.duration,
        say=say,
    )
    return EXIT_OK


def add(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    parser.add_argument("--port", type=int, default=8080, metavar="P",
                        help="port of the page on 127.0.0.1 (8080, or next free one)")  # fmt: skip
    parser.add_argument("--namespace", default="", metavar="NS", help="namespace of the robot")
    parser.add_argument("--stamped", action="store_true", help="send TwistStamped")
    parser.add_argument("--duration", type=float, metavar="S", help="end after S s of wall time")
    parser.set_defaults(run=run)
