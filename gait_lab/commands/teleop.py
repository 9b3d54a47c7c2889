"""`nao_gait teleop`: drive the robot from the keyboard."""

import argparse

from gait_lab.terminal import EXIT_OK


def run(arguments: argparse.Namespace) -> int:
    """Run the command; return the exit status."""
    from gait_lab.drive import teleop

    teleop.run(
        namespace=arguments.namespace,
        stamped=arguments.stamped,
        use_sim_time=arguments.use_sim_time,
    )
    return EXIT_OK


def add(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    parser.add_argument("--namespace", default="", metavar="NS", help="namespace of the robot")
    parser.add_argument("--stamped", action="store_true", help="send TwistStamped")
    parser.add_argument("--use-sim-time", action="store_true", help="stamp with /clock")
    parser.set_defaults(run=run)
