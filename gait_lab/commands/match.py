"""`nao_gait match`: two teams play on a simulated pitch."""

import argparse
from pathlib import Path

from gait_lab.terminal import say
from robot_core.resources import names


def run(arguments: argparse.Namespace) -> int:
    """Run the command; return the exit status."""
    from gait_lab.soccer import match_command
    from gait_lab.soccer.match_options import MatchOptions

    return match_command.run(
        MatchOptions(
            scene=arguments.scene,
            robots=arguments.robots,
            minutes=arguments.minutes,
            real_time=arguments.real_time,
            vision=arguments.vision,
            seed=arguments.seed,
            engine=arguments.engine,
            out=arguments.out,
            json=arguments.json,
        ),
        say,
    )


def add(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    parser.add_argument("--scene", default="pitch_small", metavar="S",
                        help=f"shipped scene ({', '.join(names('scenes'))}) or YAML file "
                        "(pitch_small)")  # fmt: skip
    parser.add_argument("--robots", type=int, default=None, metavar="N",
                        help="robots in each team (as in the scene)")  # fmt: skip
    parser.add_argument("--minutes", type=float, default=2.0, metavar="M",
                        help="simulated minutes of a half (2); with rendered images 2 take about "
                        "20 real minutes on two cores")  # fmt: skip
    pace = parser.add_mutually_exclusive_group()
    pace.add_argument("--fast", action="store_false", dest="real_time", default=False,
                      help="in lockstep, as fast as the machine can (default)")  # fmt: skip
    pace.add_argument("--real-time", action="store_true", help="in real time, not in lockstep")
    parser.add_argument("--vision", choices=("camera", "model"), default="camera",
                        help="rendered images over ROS 2 (default), or percepts with the errors "
                             "that were measured on images, in one process")  # fmt: skip
    parser.add_argument("--seed", type=int, default=0, metavar="S",
                        help="of the robots and all noise (0)")  # fmt: skip
    parser.add_argument("--engine", default="mujoco", metavar="E",
                        help="physics engine: mujoco (default) or pybullet")  # fmt: skip
    parser.add_argument("--out", type=Path, default=Path("out/match"), metavar="DIR",
                        help="replay, logs and bag (out/match)")  # fmt: skip
    parser.add_argument("--json", type=Path, default=None, metavar="FILE",
                        help="the result as JSON")  # fmt: skip
    parser.set_defaults(run=run)
