"""The suite `rcss`: walks on RoboCup's simulation server, judged by the server's truth."""

import math
import statistics
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from gait_lab.bench.options import Option, Options
from gait_lab.bench.rows import Row, rows_of
from gait_lab.bench.suite import suite
from gait_lab.rcss.field import BALL
from gait_lab.rcss.server import VERSION, Server
from nao_soccer.behavior.kicks import kicks_of
from rcss_bridge.joints import ROBOTS
from robot_core.errors import NaoGaitError
from robot_core.types import VelocityCommand
from sim_bridge.trials.tasks import AXES, TASKS, RandomCommands, Task, find_task

if TYPE_CHECKING:
    from gait_lab.rcss.trial import ServerKick, ServerWalk

PLANT = f"rcsssmj {VERSION}"
SETTLED = 2.0
"""[s] that a robot stands after it has landed, before it walks."""
LATER = 0.06
"""[s] by which each start waits longer than the one before: the server has no noise."""
TEAM, NUMBER = "nao_lipm_gait", 2
ROBOT_OF = {each.robot: each for each in ROBOTS.values()}
"""The server's robots by their shipped names."""
LIES_AT = 0.2
"""[m] of the torso of a robot that is laid down."""
GETS_UP_WITHIN = 8.0
"""[s] for a get-up."""
PLACEMENT = 0.03
"""[m] by which a ball before a kick lies beside its place, at most, in x and in y."""
WANDERS = 4.0
"""[s] of random commands before a drop."""


@suite(
    "rcss", "On RoboCup's simulation server", "walks on RoboCup's server, by its truth", gait=False,
    options={
        "tasks": ("forward=60", "back=45", "side=30", "turn=110"),
        "window": ...,
        "starts": Option(3, "starts of each task", "N", minimum=0, maximum=1000),
        "drops": Option(0, "drops without warning, on the way", "N", minimum=0, maximum=1000),
        "getups": Option(0, "get-ups from either side", "N", minimum=0, maximum=1000),
        "kicks": Option(0, "kicks of each kind that the robot plays with there", "N", minimum=0,
                        maximum=1000),
        "minutes": Option(0.0, "minutes of random commands", "M", minimum=0.0, maximum=600.0),
        "late": Option(0.0, "share of the answers that come a cycle late", "SHARE", minimum=0.0,
                       maximum=0.9),
        "urdf": "booster_k1",
    },
    quick=(),  # not in `all`: it installs the server
    check=lambda options: _check(options),
)  # fmt: skip
def rcss(options: Options) -> Iterator[Row | str]:
    """One robot alone on the field: every task from every start, drops, get-ups, random commands.

    The largest random commands are the speeds of the tasks.
    """
    from gait_lab.rcss.agent import Agent
    from gait_lab.rcss.trial import START, LateClient, gets_up, kick, lands, walk, wander

    robot = ROBOT_OF[options.urdf]
    random = np.random.default_rng(options.seed)

    def commands() -> Callable[[float], VelocityCommand]:
        return _scaled(RandomCommands([int(random.integers(1 << 32))]), options.tasks)

    def place(height: float, pitch: float) -> None:
        pose = (*START[:2], height, 0.0, pitch, random.uniform(-math.pi, math.pi))
        server.place(TEAM, NUMBER, pose)

    def lay(x: float, y: float) -> None:
        server.order(f"(ball (pos {x:.3f} {y:.3f} {BALL}) (vel 0 0 0))")

    with (
        Server() as server,
        LateClient(
            "127.0.0.1", server.port, robot.name, TEAM, NUMBER, late=options.late
        ) as client,
    ):
        client.connect_within(10.0)
        if options.starts:
            for name in options.tasks:
                task = find_task(name).lasting(options.window)
                walks = [
                    walk(client, Agent(robot, TEAM), task, SETTLED + LATER * start)
                    for start in range(options.starts)
                ]
                yield from _walk_rows(name, task, walks)
        agent = Agent(robot, TEAM)
        if options.drops:
            landed = 0
            for _ in range(options.drops):
                landed += lands(client, agent, lambda: place(robot.drop_height, 0.0))
                wander(client, agent, commands(), WANDERS)
            yield from server_rows(
                "drop", ("tried", "drops", options.drops), ("landed", "drops", landed)
            )
        for side, pitch in (("front", math.pi / 2.0), ("back", -math.pi / 2.0)):
            if options.getups:
                times = [
                    gets_up(client, agent, lambda: place(LIES_AT, pitch))  # noqa: B023
                    for _ in range(options.getups)
                ]
                yield from server_rows(
                    f"getup_{side}",
                    ("tried", "get-ups", len(times)),
                    ("within", "get-ups", sum(each <= GETS_UP_WITHIN for each in times)),
                    ("up", "get-ups", sum(not math.isnan(each) for each in times)),
                    ("median", "s", float(np.median(times))),
                )
        kicks = kicks_of(f"{options.urdf}_rcss").kicks if options.kicks else ()
        for each in kicks:
            agent = Agent(robot, TEAM)
            spots = agent.robot.size * np.array(each.spot) + random.uniform(
                -PLACEMENT, PLACEMENT, (options.kicks, 2)
            )
            found = [
                kick(client, agent, each.motion, (x, y), lambda: place(robot.drop_height, 0.0), lay)
                for x, y in spots.tolist()
            ]
            yield from _kick_rows(each.motion, found)
        if options.minutes:
            agent = Agent(robot, TEAM)
            place(robot.drop_height, 0.0)
            fell = wander(client, agent, commands(), 60.0 * options.minutes)
            yield from server_rows(
                "random", ("minutes", "min", options.minutes), ("falls", "falls", fell)
            )
    yield (
        f"{robot.name} on the field of rcsssmj {VERSION}"
        + (f", {100.0 * options.late:g} % of the answers a cycle late" if options.late else "")
        + f". Each walk begins with a new gait and a drop; each start waits {LATER:g} s "
        f"longer than the one before. Speeds over {options.window:g} s by the server's truth; "
        "worst: the slowest start; a task counts only if no start fell. drop: between random "
        f"commands, without warning. getup: within {GETS_UP_WITHIN:g} s of lying. kick: a ball up "
        f"to {100.0 * PLACEMENT:g} cm in x and y beside its place."
    )


def _walk_rows(name: str, task: Task, walks: Sequence["ServerWalk"]) -> Iterator[Row]:
    label = name.partition("=")[0]
    falls = sum(each.fell for each in walks)
    if task.axis is not None:
        unit, factor = AXES[task.axis]
        speeds = [math.nan if each.fell else each.speed(task) for each in walks]
        yield from server_rows(
            label,
            ("asked", unit, factor * abs(task.asked)),
            ("median", unit, statistics.median(speeds) if not falls else math.nan),
            ("worst", unit, min(speeds) if not falls else math.nan),
        )
    yield from server_rows(label, ("starts", "starts", len(walks)), ("falls", "falls", falls))


def _kick_rows(motion: str, found: Sequence["ServerKick"]) -> Iterator[Row]:
    """Of the kicks that left the robot on its feet; NaN if none did."""
    stood = [each for each in found if not each.fell]
    ways = [(each.distance, math.degrees(each.direction)) for each in stood]
    ways = ways or [(math.nan, math.nan)]
    reach, direction = np.mean(ways, axis=0).tolist()
    reach_spread, direction_spread = np.std(ways, axis=0).tolist()
    yield from server_rows(
        motion,
        ("tried", "kicks", len(found)),
        ("stood", "kicks", len(stood)),
        ("distance", "m", reach),
        ("distance_spread", "m", reach_spread),
        ("direction", "deg", direction),
        ("direction_spread", "deg", direction_spread),
    )


def server_rows(subject: str, *cells: tuple[str, str, float]) -> Iterator[Row]:
    """Rows of one subject, with the server as their plant."""
    for row in rows_of(subject, *cells):
        yield row._replace(plant=PLANT)


def _scaled(
    random: RandomCommands, tasks: Sequence[str]
) -> Callable[[float], VelocityCommand]:
    """Random commands whose full speeds are those of the tasks."""
    asked = {each.name: each.asked for each in map(find_task, tasks) if each.axis}
    share = {name: speed / TASKS[name].asked for name, speed in asked.items()}

    def at(time: float) -> VelocityCommand:
        x, y, yaw = random.at(time)
        ahead = share.get("forward" if x > 0.0 else "back", 1.0)
        return VelocityCommand(
            ahead * x, share.get("side", 1.0) * y, share.get("turn", 1.0) * yaw
        )

    return at


def check_robot(options: Options) -> None:
    """Raise NaoGaitError for a robot that the server does not have."""
    if options.urdf not in ROBOT_OF:
        raise NaoGaitError("robot", options.urdf, ", ".join(ROBOT_OF))


def _check(options: Options) -> None:
    check_robot(options)
    kinds = [find_task(name).name.partition("=")[0] for name in options.tasks]
    if len(set(kinds)) < len(kinds):
        raise NaoGaitError("task", ", ".join(options.tasks), "each direction once")
