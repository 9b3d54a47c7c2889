"""The suite `rcss`: walks on RoboCup's simulation server, judged by the server's truth."""

import math
import statistics
from collections.abc import Iterator

from gait_lab.bench.options import Option, Options
from gait_lab.bench.rows import Row, rows_of
from gait_lab.bench.suite import suite
from gait_lab.rcss.server import VERSION, Server
from rcss_bridge.joints import ROBOTS
from robot_core.errors import NaoGaitError
from sim_bridge.trials.tasks import AXES, find_task

PLANT = f"rcsssmj {VERSION}"
SETTLED = 2.0
"""[s] that a robot stands after it has landed, before it walks."""
LATER = 0.06
"""[s] by which each start waits longer than the one before: the server has no noise."""
TEAM = "nao_lipm_gait"
ROBOT_OF = {each.robot: each for each in ROBOTS.values()}
"""The server's robots by their shipped names."""


@suite(
    "rcss", "On RoboCup's simulation server", "walks on RoboCup's server, by its truth", gait=False,
    options={
        "tasks": ("forward=50", "back=40", "side=30", "turn=90"),
        "window": ...,
        "starts": Option(3, "starts of each task", "N", minimum=1, maximum=1000),
        "urdf": "booster_k1",
    },
    quick=(),  # not in `all`: it installs the server
    check=lambda options: _check(options),
)  # fmt: skip
def rcss(options: Options) -> Iterator[Row | str]:
    """Every task from every start, one robot alone on the field."""
    from gait_lab.rcss.agent import Agent
    from gait_lab.rcss.trial import walk
    from rcss_bridge.client import Client

    robot = ROBOT_OF[options.urdf]
    falls = drops = 0
    with Server() as server, Client("127.0.0.1", server.port, robot.name, TEAM, 2) as client:
        client.connect_within(10.0)
        for name in options.tasks:
            task = find_task(name).lasting(options.window)
            walks = [
                walk(client, Agent(robot, TEAM), task, SETTLED + LATER * start)
                for start in range(options.starts)
            ]
            falls += sum(each.fell for each in walks)
            drops += len(walks)
            if task.axis is None:
                continue
            unit, factor = AXES[task.axis]
            speeds = [each.speed(task) for each in walks if not each.fell]
            whole = len(speeds) == len(walks)
            label = name.partition("=")[0]
            yield Row("rcss", label, unit, min(speeds) if whole else math.nan, plant=PLANT)
            for row in rows_of(
                label,
                ("asked", unit, factor * abs(task.asked)),
                ("median", unit, statistics.median(speeds) if whole else math.nan),
                ("upright", "starts", float(len(speeds))),
            ):
                yield row._replace(plant=PLANT)
    yield Row("rcss", "falls", "falls", float(falls), plant=PLANT)
    yield Row("rcss", "drops", "drops", float(drops), plant=PLANT)
    yield (
        f"{robot.name} on the field of rcsssmj {VERSION}. Each walk begins with a new gait and a "
        f"drop from 1 m; each start waits {LATER:g} s longer than the one before. Speeds over "
        f"{options.window:g} s by the server's truth; rcss: the slowest start. A task counts "
        "only if no start fell."
    )


def check_robot(options: Options) -> None:
    """Raise NaoGaitError for a robot that the server does not have."""
    if options.urdf not in ROBOT_OF:
        raise NaoGaitError("robot", options.urdf, ", ".join(ROBOT_OF))


def _check(options: Options) -> None:
    check_robot(options)
    kinds = [find_task(name).name.partition("=")[0] for name in options.tasks]
    if len(set(kinds)) < len(kinds):
        raise NaoGaitError("task", ", ".join(options.tasks), "each direction once")
