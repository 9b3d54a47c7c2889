"""The suite `start`: from standing to full speed at once and back, in any direction."""

import math
from collections.abc import Iterator, Sequence

from gait_lab.bench.options import Options
from gait_lab.bench.rows import Row, rows_of
from gait_lab.bench.suite import suite
from gait_lab.bench.walks import Score, loop_detection, walk_all
from robot_core.types import STANDSTILL, VelocityCommand
from sim_bridge.trials.tasks import STAND_TIME, TASKS, Task

JUMP = 0.01
"""[s] in which a command changes."""
STOP_TIME = STAND_TIME + 4.0
"""[s since the start] when the command ends."""
END = STOP_TIME + 4.0
REST = 1.0
"""[s] at the end in which a robot that has stopped does not move."""
STILL = 0.02
"""[m/s] mean speed up to which a robot stands still."""


def cases() -> dict[str, VelocityCommand]:
    """Name -> command: the full speeds of the tasks, alone and mixed."""
    x, back = TASKS["forward"].asked, TASKS["back"].asked
    y, yaw = TASKS["side"].asked, TASKS["turn"].asked
    return {
        "forward": VelocityCommand(x, 0.0, 0.0),
        "back": VelocityCommand(back, 0.0, 0.0),
        "left": VelocityCommand(0.0, y, 0.0),
        "right": VelocityCommand(0.0, -y, 0.0),
        "turn_left": VelocityCommand(0.0, 0.0, yaw),
        "turn_right": VelocityCommand(0.0, 0.0, -yaw),
        "forward_left": VelocityCommand(x / math.sqrt(2.0), y / math.sqrt(2.0), 0.0),
        "back_right": VelocityCommand(back / math.sqrt(2.0), -y / math.sqrt(2.0), 0.0),
        "curve_right": VelocityCommand(x / math.sqrt(2.0), 0.0, -yaw / math.sqrt(2.0)),
        "everything": VelocityCommand(x, y, yaw),
    }


def tally(name: str, scores: Sequence[Score]) -> list[Row]:
    """Starts, falls before and after the end of the command, and robots that stand still then."""
    robots = [each for score in scores for each in score.metrics]
    times = [each.fall_time for each in robots if each.fall_time is not None]
    stopped = [
        not each.fell and math.hypot(each.speed_x, each.speed_y) < STILL
        and each.support_changes == 0 for each in robots
    ]  # fmt: skip
    return rows_of(
        name,
        ("starts", "starts", len(robots)),
        ("start_falls", "falls", sum(time < STOP_TIME for time in times)),
        ("stop_falls", "falls", sum(time >= STOP_TIME for time in times)),
        ("stopped", "robots", sum(stopped)),
    )


@suite(
    "start", "Starts and stops", "from standing to full speed at once, and a stop at once",
    options={"robots": 20, "open_loop": ...}, quick=({"robots": 3},),
)  # fmt: skip
def start(options: Options) -> Iterator[Row | str]:
    """A start and a stop of every robot in every case."""
    tasks = [
        Task(
            name,
            ((STAND_TIME, STANDSTILL), (STAND_TIME + JUMP, command), (STOP_TIME, command),
             (STOP_TIME + JUMP, STANDSTILL)),
            END - REST,
            END,
        )
        for name, command in cases().items()
    ]  # fmt: skip
    (scores,) = walk_all(options, tasks)
    for score in scores:
        yield from tally(score.name, [score])
    for closed in options.loops:
        every = [score for score in scores if score.closed_loop == closed]
        yield from tally("all" if closed else "all_open_loop", every)
    yield from loop_detection(scores)
    yield (
        f"At full speed for {STOP_TIME - STAND_TIME:g} s. Stopped: {END - STOP_TIME:g} s after the "
        f"end of the command, for {REST:g} s, below {100 * STILL:g} cm/s and without a step."
    )
