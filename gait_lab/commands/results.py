"""`nao_gait results`: measure what docs/results.md reports."""

import argparse
from pathlib import Path

from gait_lab.terminal import EXIT_OK, say


def run(arguments: argparse.Namespace) -> int:
    """Run it; the exit status."""
    from gait_lab.bench import results

    folder = {} if arguments.docs is None else {"docs": arguments.docs}
    options = results.ResultsOptions(
        only=tuple(arguments.only), quick=arguments.quick, allow_dirty=arguments.allow_dirty,
        placo_python=arguments.placo_python, jobs=arguments.jobs, **folder,
    )  # fmt: skip
    if arguments.mark_stale:
        results.mark_stale(options, say)
    else:
        results.measure(options, say)
    return EXIT_OK


def add(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("--quick", action="store_true", help="few robots, short windows; "
                        "uncommitted changes are allowed")  # fmt: skip
    parser.add_argument("--only", action="append", default=[], metavar="SECTION",
                        help="only this section, e.g. speed; may be repeated")  # fmt: skip
    parser.add_argument("--allow-dirty", action="store_true",
                        help="measure although there are uncommitted changes")  # fmt: skip
    parser.add_argument("--mark-stale", action="store_true", help="measure nothing; mark the "
                        "results whose walk has changed")  # fmt: skip
    parser.add_argument("--placo-python", metavar="PATH", help="Python of an environment that has "
                        "placo; without it the section peers is left out")  # fmt: skip
    parser.add_argument("--docs", type=Path, metavar="DIR",
                        help="folder of results.md and results/ (docs)")  # fmt: skip
    parser.add_argument("--jobs", type=int, metavar="N", help="processes (all cores)")
    parser.set_defaults(run=run)
