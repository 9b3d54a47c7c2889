"""The suite `rcss_match`: our players on RoboCup's simulation server, judged by its referee."""

import math
import statistics
from collections.abc import Iterator

from gait_lab.bench.options import Option, Options
from gait_lab.bench.rows import Row
from gait_lab.bench.suite import suite
from gait_lab.bench.suites.rcss import ROBOT_OF, check_robot, server_rows
from rcss_bridge.body import CYCLE
from sim_bridge.trials.progress import Progress

LIMIT = 90.0
"""[s] within which a robot alone has to score."""


def _command(text: str) -> str:
    """A command that can start; raises NaoGaitError before there is a server."""
    from gait_lab.rcss.match import guest_words

    guest_words(text, 0, 1)
    return text


@suite(
    "rcss_match", "Soccer on RoboCup's simulation server",
    "goals, falls and real-time factor there", gait=False,
    options={
        "alone": Option(0, "starts of a robot alone at an empty goal", "N", minimum=0,
                        maximum=1000),
        "players": Option(2, "players of each team of a match; 0 = no match", "N", minimum=0,
                          maximum=11),
        "length": Option(300.0, "length of each half [s]", "S", minimum=10.0, maximum=300.0),
        "halves": Option(1, "halves; each two are a match, with errors of their own", "N",
                         minimum=1, maximum=100),
        "against": Option("", "command that starts a player of another team, with {port} and "
                          "{number}", "COMMAND", parse=_command),
        "exact": Option(False, "percepts without errors, misses and delay"),
        "urdf": "booster_k1",
    },
    quick=(),  # not in `all`: it installs the server
    check=check_robot,
)  # fmt: skip
def rcss_match(options: Options) -> Iterator[Row | str]:
    """A robot alone from some starts, then a match of our team against itself."""
    from gait_lab.rcss.match import TEAMS, Squad, alone, play, starts
    from gait_lab.rcss.server import Server

    robot = ROBOT_OF[options.urdf]
    if options.alone:
        with (
            Server("--rules", "fifa") as server,  # which has the longer half
            Squad(server.port, robot, TEAMS[0], [2], exact=options.exact) as squad,
        ):
            found = [
                alone(squad, server, start, LIMIT) for start in starts(options.alone, 27.5)
            ]
        times = [each for each, _ in found if not math.isnan(each)]
        yield from server_rows(
            "rcss",
            ("goals", "goals", float(len(times))),
            ("alone_falls", "falls", float(sum(falls for _, falls in found))),
        )
        if times:
            yield from server_rows("rcss", ("alone_median", "s", statistics.median(times)))
    if options.players:
        size = options.players
        played = []
        with Progress(total=options.halves, desc="halves", show=options.show) as bar:
            for index in range(options.halves):
                half = play(
                    robot, (size, size), options.length, exact=options.exact,
                    against=options.against, half=index % 2, seed=options.seed + index,
                )  # fmt: skip
                played.append(half)
                bar.set_postfix_str("{}:{}".format(*half.score), refresh=False)
                bar.update()
        seconds = sum(each.seconds for each in played)
        minutes = (size if options.against else 2 * size) * seconds / 60.0
        cpu = statistics.median(each for half in played for each in half.cpu)
        yield from server_rows(
            "rcss_match",
            ("seconds", "s", seconds),
            ("ended", "halves", float(sum(each.ended for each in played))),
            ("left", "goals", float(sum(each.score[0] for each in played))),
            ("right", "goals", float(sum(each.score[1] for each in played))),
            ("falls", "1/min", sum(each.falls for each in played) / minutes),
            ("get_ups", "1/min", sum(each.get_ups for each in played) / minutes),
            ("put_back", "1/min", sum(each.put_back for each in played) / minutes),
            ("one_striker", "%", 100.0 * statistics.fmean(each.one_striker for each in played)),
            ("unsure", "%", 100.0 * statistics.fmean(each.unsure for each in played)),
            ("real_time", "", seconds / sum(each.wall for each in played)),
            ("cycle_p50", "ms", 1e3 * cpu),
            ("server", "ms", 1e3 * CYCLE * sum(each.server for each in played) / seconds),
        )
    yield (
        f"{robot.name}, percepts {'exact' if options.exact else 'by the model'}. alone: ball 3 to "
        "8 m from the goal, robot 1 to 3 m from the ball, in any direction and not told where; "
        f"goal within {LIMIT:g} s. match: left is ours; falls, get-ups and put-backs for each "
        "of our robots and minute; a process for each team of ours and one for the server, which "
        "does not wait for real time. unsure: share of the upright robots' time without a valid "
        "pose. server: its processor time of a cycle, physics and messages."
    )
