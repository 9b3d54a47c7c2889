"""`nao_gait teach`: teach the robot a motion."""

import argparse
from pathlib import Path

from gait_lab.terminal import EXIT_OK, say
from robot_core.errors import NaoGaitError
from robot_core.resources import names


def run(arguments: argparse.Namespace) -> int:
    """Run the command; return the exit status."""
    from gait_lab.drive import teach

    if arguments.action == "list":
        say(teach.listing(arguments.urdf))
    elif arguments.file is None:
        raise NaoGaitError("file", "none", f"a motion file to {arguments.action}")
    elif arguments.action == "check":
        for motion in teach.check(arguments.file, arguments.urdf):
            say(f"{motion.name}: {len(motion.keyframes)} keyframes, {motion.time:.2f} s")
    elif arguments.action == "play":
        teach.play(
            arguments.file, urdf=arguments.urdf, namespace=arguments.namespace, say=say
        )
    else:
        teach.record(
            arguments.file, urdf=arguments.urdf, meaning=arguments.meaning,
            starts=arguments.starts, ends=arguments.ends, stiff=arguments.stiff,
            head=arguments.head, namespace=arguments.namespace, say=say,
        )  # fmt: skip
    return EXIT_OK


def add(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    parser.add_argument("action", choices=("record", "play", "check", "list"),
                        help="record poses of the running robot, play a file on it, check a file, "
                        "list the shipped motions")  # fmt: skip
    parser.add_argument("file", type=Path, nargs="?", metavar="FILE", help="motion file (.yaml)")
    parser.add_argument("--urdf", default="nao_h21_v33", metavar="NAME",
                        help=f"shipped robot ({', '.join(names('urdf'))}) or a URDF file "
                        "(nao_h21_v33)")  # fmt: skip
    parser.add_argument("--meaning", default="", metavar="TEXT", help="record: what it is for")
    parser.add_argument("--starts", default="standing", metavar="P", help="record: posture before")
    parser.add_argument("--ends", default="standing", metavar="P", help="record: posture after")
    parser.add_argument("--stiff", action="store_true",
                        help="record: keep the joints stiff")  # fmt: skip
    parser.add_argument("--head", action="store_true", help="record: include the head")
    parser.add_argument("--namespace", default="", metavar="NS", help="namespace of the robot")
    parser.set_defaults(run=run)
