"""`nao_gait tune`: search parameters of the gait."""

import argparse
from pathlib import Path

from gait_lab.terminal import EXIT_OK, say


def run(arguments: argparse.Namespace) -> int:
    """Run the command; return the exit status."""
    from gait_lab.tune import run as tune

    options = tune.TuneOptions(
        study=arguments.study,
        method=arguments.method,
        trials=arguments.trials,
        workers=arguments.workers,
        resume=arguments.resume,
        join=arguments.join,
        storage=arguments.storage,
        out=arguments.out,
        seed=arguments.seed,
        engine=arguments.engine,
        confirm=arguments.confirm,
        places=tuple(arguments.confirm_on),
    )
    tune.run(options, say)
    return EXIT_OK


def add(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    from gait_lab.tune.study import METHODS
    from robot_core.resources import names

    parser.add_argument("study", metavar="STUDY",
                        help=f"shipped name ({', '.join(names('studies'))}) or YAML file; it "
                        "names robot, plant and parameters")  # fmt: skip
    parser.add_argument("--method", metavar="M", help=f"{', '.join(METHODS)} (the study's)")
    parser.add_argument("--trials", type=int, metavar="N", help="trials (the study's own)")
    parser.add_argument("--workers", type=int, metavar="N", help="processes (all cores)")
    parser.add_argument("--resume", action="store_true",
                        help="continue the study in --out")  # fmt: skip
    parser.add_argument("--join", action="store_true",
                        help="help the tuner that leads this study, from here or another machine: "
                        "search only")  # fmt: skip
    parser.add_argument("--storage", metavar="URL", help="database of the trials that several "
                        "machines share (a file in --out)")  # fmt: skip
    parser.add_argument("--out", type=Path, metavar="DIR",
                        help="trials, preset, report (out/tune/STUDY)")  # fmt: skip
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="seed of the method (0)")
    parser.add_argument("--engine", metavar="E", help="physics engine of the search (the study's)")
    parser.add_argument("--no-confirm", action="store_false", dest="confirm",
                        help="do not confirm the winner on unseen robots")  # fmt: skip
    parser.add_argument("--confirm-on", action="append", default=[], metavar="ENGINE/PLANT",
                        help="where to confirm it instead of the study's places; may be "
                        "repeated")  # fmt: skip
    parser.set_defaults(run=run)
