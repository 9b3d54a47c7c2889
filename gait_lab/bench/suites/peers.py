"""The suite `peers`: the sweep of its file, and placo's walk where its environment is given."""

from collections.abc import Iterator, Mapping
from dataclasses import replace

from gait_lab.bench.options import Option, Options
from gait_lab.bench.rows import Row
from gait_lab.bench.suite import Suite
from gait_lab.bench.sweep import load_sweep, sweep_suite
from gait_lab.bench.walks import Variant
from gait_lab.peers.placo_walk import HOW_TO_GET_IT, Placo
from robot_core.errors import NaoGaitError
from robot_core.resources import share
from robot_core.robot import NAO, load_robot

SWEEP = load_sweep(share("config", "bench", "peers.yaml"))


def is_nao(options: Options) -> bool:
    """Whether the other walks are made for this robot."""
    return load_robot(options.urdf).name == NAO


def check(options: Options) -> None:
    """Raise NaoGaitError for a robot that is no NAO, or a Python without placo."""
    if not is_nao(options):
        raise NaoGaitError("robot", load_robot(options.urdf).name, f"{NAO} for this suite")
    if options.placo_python is not None:
        Placo(options.placo_python).check()
    SWEEP.check(options)


def peers(options: Options) -> Iterator[Row | str]:
    """All tasks and pushes with every walk."""
    more: Mapping[str, Variant] = {}
    if options.placo_python is None:
        yield (
            "placo's walk is left out: give a Python that has it by --placo-python. To make one: "
            f"{HOW_TO_GET_IT}, then --placo-python placo-env/bin/python."
        )
    else:
        more = {"placo": Variant(walker=Placo(options.placo_python))}
    yield from SWEEP.measure(options, more)


def _suite() -> Suite:
    of_file = sweep_suite("peers", SWEEP)
    placo = Option(None, "Python of an environment that has placo, to measure its walk too", "PATH",
                   ("--placo-python",), str)  # fmt: skip
    options = {**of_file.options, "placo_python": placo}
    return replace(of_file, measure=peers, options=options, check=check, applies=is_nao)


SUITE = _suite()
