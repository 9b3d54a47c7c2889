"""`nao_gait demo`: watch the robot walk a tour over ROS 2."""

import argparse
from pathlib import Path

from gait_lab.terminal import say
from robot_core.resources import names


def run(arguments: argparse.Namespace) -> int:
    """Run the command; return the exit status."""
    from gait_lab.demo import demo

    options = demo.DemoOptions(
        out=arguments.out,
        gui=arguments.gui,
        real_time=arguments.real_time or arguments.gui,
        tour=arguments.tour,
        engine=arguments.engine,
        plant=arguments.plant,
        robot_seed=arguments.robot_seed,
        preset=arguments.preset,
        urdf=arguments.urdf,
    )
    return demo.run(options, say)


def add(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    window = parser.add_mutually_exclusive_group()
    window.add_argument("--headless", action="store_false", dest="gui", default=False,
                        help="no window (default)")  # fmt: skip
    window.add_argument("--gui", action="store_true", help="a window with the robot, in real time")
    pace = parser.add_mutually_exclusive_group()
    pace.add_argument("--fast", action="store_false", dest="real_time", default=False,
                      help="in lockstep, as fast as the machine can (default)")  # fmt: skip
    pace.add_argument("--real-time", action="store_true", help="in real time, not in lockstep")
    parser.add_argument("--out", type=Path, default=Path("out/demo"), metavar="DIR",
                        help="bag, table and pictures (out/demo)")  # fmt: skip
    parser.add_argument("--tour", default="full", metavar="NAME", help="full (default) or short")
    parser.add_argument("--robot-seed", type=int, default=0, metavar="S",
                        help="the individual (0); -1 is the nominal robot")  # fmt: skip
    parser.add_argument("--robot", "--urdf", default="nao_h21_v33", metavar="NAME", dest="urdf",
                        help=f"shipped robot ({', '.join(names('urdf'))}) or a URDF file "
                        "(nao_h21_v33)")  # fmt: skip
    parser.add_argument("--plant", default="reference", metavar="P",
                        help=f"shipped name ({', '.join(names('plants'))}) or YAML file "
                        "(reference)")  # fmt: skip
    parser.add_argument("--engine", default="pybullet", metavar="E",
                        help="physics engine: pybullet (default) or mujoco")  # fmt: skip
    parser.add_argument("--preset", default="default", metavar="NAME",
                        help=f"shipped name ({', '.join(names('gait'))}) or YAML file; default is "
                        "the robot's own")  # fmt: skip
    parser.set_defaults(run=run)
