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
        backend=arguments.backend,
        address=arguments.address,
        resume=arguments.resume,
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
    from gait_lab.tune.study import shipped_studies

    parser.add_argument("study", metavar="STUDY",
                        help=f"shipped name ({', '.join(shipped_studies())}) or YAML file; it "
                        "names robot, plant and parameters")  # fmt: skip
    parser.add_argument("--method", metavar="M",
                        help="surrogate (Gaussian process), pso, cma (the study's)")  # fmt: skip
    parser.add_argument("--trials", type=int, metavar="N", help="trials (the study's own)")
    parser.add_argument("--workers", type=int, metavar="N", help="processes (all cores)")
    parser.add_argument("--backend", default="loky", metavar="B",
                        help="loky: this machine (default); dask or ray, which are extras of "
                        "these names: a cluster")  # fmt: skip
    parser.add_argument("--address", metavar="A", help="address of a running Ray or Dask cluster "
                        "(one is started here)")  # fmt: skip
    parser.add_argument("--resume", action="store_true",
                        help="continue the study in --out")  # fmt: skip
    parser.add_argument("--out", type=Path, metavar="DIR",
                        help="trials, preset, figures, report (out/tune/STUDY)")  # fmt: skip
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="seed of the method (0)")
    parser.add_argument("--engine", metavar="E", help="physics engine of the search (the study's)")
    parser.add_argument("--no-confirm", action="store_false", dest="confirm",
                        help="do not confirm the winner on unseen robots")  # fmt: skip
    parser.add_argument("--confirm-on", action="append", default=[], metavar="ENGINE/PLANT",
                        help="where to confirm it instead of the study's places; may be "
                        "repeated")  # fmt: skip
    parser.set_defaults(run=run)
