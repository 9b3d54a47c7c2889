"""`nao_gait fingerprint`: the hashes of the reference rollouts."""

import argparse

from gait_lab.commands.terminal import EXIT_FAILED, EXIT_OK, say


def run(arguments: argparse.Namespace) -> int:
    """Print them, or compare them with an earlier output; the exit status."""
    import json
    import sys

    from gait_lab.bench.fingerprint import ENGINES, fingerprints

    engines = tuple(arguments.engine or ENGINES)
    found = {each.key: each for each in fingerprints(engines, arguments.jobs)}
    if arguments.compare is None:
        json.dump(
            {key: each.as_list() for key, each in sorted(found.items())}, sys.stdout, indent=0
        )
        say("")
        return EXIT_OK
    before = json.load(arguments.compare)
    wanted = {key for key in before if key.split("/")[0] in engines}
    changed = [
        key for key in sorted(wanted | set(found))
        if key not in found or key not in before or before[key][0] != found[key].digest
    ]  # fmt: skip
    for key in changed:
        say(f"changed: {key}")
    say(f"{len(found)} reference rollouts, {len(changed)} changed")
    return EXIT_FAILED if changed else EXIT_OK


def add(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("--engine", action="append", choices=("mujoco", "pybullet"),
                        help="only this engine; may be given twice")  # fmt: skip
    parser.add_argument("--compare", type=argparse.FileType(), metavar="FILE",
                        help="compare with an earlier output of this command")  # fmt: skip
    parser.add_argument("--jobs", type=int, metavar="N", help="processes (all cores)")
    parser.set_defaults(run=run)
