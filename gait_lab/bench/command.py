"""`nao_gait bench`: measure the gait on many robots."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from gait_lab.terminal import EXIT_OK, say
from robot_core import resources

if TYPE_CHECKING:
    from gait_lab.bench.suite import Suite


def add(parser: argparse.ArgumentParser) -> None:
    """Declare the suites, each with its own options."""
    from gait_lab.bench.registry import suites

    names = parser.add_subparsers(dest="suite", metavar="SUITE", required=True)
    for suite in suites().values():
        text = f"{suite.title}: {suite.summary}"
        parser = names.add_parser(
            suite.name, help=suite.summary, description=text, epilog=suite.epilog
        )
        if suite.epilog:
            parser.formatter_class = argparse.RawDescriptionHelpFormatter
        _add_suite(parser, [suite])
    text = "every suite in its quick form"
    everything = names.add_parser(
        "all", help=text, description=f"{text}; an option goes to each suite that has it"
    )
    _add_suite(everything, list(suites().values()))


def _add_suite(parser: argparse.ArgumentParser, chosen: "list[Suite]") -> None:
    from gait_lab.bench.options import add_argument

    options = {name: each for suite in chosen for name, each in suite.options.items()}
    for name, each in options.items():
        add_argument(parser, name, each, shows_default=len(chosen) == 1)
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the rows as JSON")
    parser.set_defaults(run=run, options=options, preset="default", settings=[])
    if not any(suite.gait for suite in chosen):
        return
    gait = parser.add_argument_group("gait parameters")
    gait.add_argument("--preset", default="default", metavar="NAME",
                      help=f"shipped preset ({', '.join(resources.names('gait'))}) or a YAML file; "
                      "default is the robot's own")  # fmt: skip
    gait.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", dest="settings",
                      help="override one parameter; may be repeated")  # fmt: skip


def run(arguments: argparse.Namespace) -> int:
    """Run it; the exit status."""
    from gait_lab.bench import registry
    from gait_lab.bench.options import given

    registry.run(
        arguments.suite,
        given(arguments, arguments.options),
        preset=arguments.preset,
        settings=arguments.settings,
        json_file=arguments.json,
        out=say,
    )
    return EXIT_OK
