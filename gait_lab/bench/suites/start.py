"""The suite `start`: from standing to full speed at once and back to standing, in any direction."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from gait_lab.bench.falls import by_loop, rows_by_loop, text_by_loop
from gait_lab.bench.options import BenchOptions
from gait_lab.bench.report import Report, Row, loop_name, table
from gait_lab.bench.score import Score, walk_all
from gait_lab.trials.tasks import STAND_TIME, TASKS, Task
from nao_lipm_gait.types import STANDSTILL, VelocityCommand

SUITE = "start"
JUMP = 0.01
"""The command is there this long after it was not [s]."""
STOP_TIME = STAND_TIME + 4.0
"""When the command ends [s]."""
END = STOP_TIME + 4.0
REST = 1.0
"""The robot stands still over the last so many seconds, or it has not stopped [s]."""
STILL = 0.02
"""[m/s] mean speed that is still standing."""


def cases() -> dict[str, VelocityCommand]:
    """Name -> command: the full speed of the tasks, alone and mixed."""
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


@dataclass(frozen=True, slots=True)
class Tally:
    """What became of the starts of one case."""

    score: Score

    @property
    def starts(self) -> int:
        return len(self.score.results)

    @property
    def start_falls(self) -> int:
        return sum(time < STOP_TIME for time in self._fall_times)

    @property
    def stop_falls(self) -> int:
        return sum(time >= STOP_TIME for time in self._fall_times)

    @property
    def stopped(self) -> int:
        """Robots that stand still at the end."""
        return sum(
            not result.metrics.fell
            and math.hypot(result.metrics.speed_x, result.metrics.speed_y) < STILL
            and result.metrics.support_changes == 0
            for result in self.score.results
        )

    @property
    def _fall_times(self) -> list[float]:
        times = [result.metrics.fall_time for result in self.score.results]
        return [time for time in times if time is not None]


def start(options: BenchOptions) -> Report:
    """Every case on every robot: a start and a stop each."""
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
    (scores,) = walk_all(options, tasks=tasks, label="starts")
    tallies = [Tally(score) for score in scores]
    rows = [row for tally in tallies for row in _rows(tally.score.name, [tally])]
    lines: list[tuple[str, ...]] = [
        ("command", "loop", "starts", "falls", "falls after", "stands"),
        ("", "", "", "", "the stop", "still"),
    ]
    lines += [_line(tally.score.task.name.replace("_", " "), [tally]) for tally in tallies]
    for closed in options.loops:
        of_loop = [tally for tally in tallies if tally.score.closed_loop == closed]
        rows += _rows("all" if closed else "all_open_loop", of_loop)
        lines.append(_line("all", of_loop))
    found = by_loop(scores)
    rows += rows_by_loop(SUITE, found)
    title = f"From standing to full speed at once, {STOP_TIME - STAND_TIME:g} s, and a stop at once"
    notes = (
        f"stands still: {END - STOP_TIME:g} s after the end of the command, for {REST:g} s, below "
        f"{100 * STILL:g} cm/s and without a step.",
    )
    text = "\n".join((f"{title}; {options.title}", "", table(lines), "", *notes))
    return Report(tuple(rows), f"{text}\n{text_by_loop(found)}")


def _rows(name: str, tallies: Sequence[Tally]) -> list[Row]:
    return [
        Row(SUITE, f"{name}_starts", "starts", sum(tally.starts for tally in tallies)),
        Row(SUITE, f"{name}_start_falls", "falls", sum(tally.start_falls for tally in tallies)),
        Row(SUITE, f"{name}_stop_falls", "falls", sum(tally.stop_falls for tally in tallies)),
        Row(SUITE, f"{name}_stopped", "robots", sum(tally.stopped for tally in tallies)),
    ]


def _line(name: str, tallies: Sequence[Tally]) -> tuple[str, ...]:
    return (
        name,
        loop_name(tallies[0].score.closed_loop),
        str(sum(tally.starts for tally in tallies)),
        str(sum(tally.start_falls for tally in tallies)),
        str(sum(tally.stop_falls for tally in tallies)),
        str(sum(tally.stopped for tally in tallies)),
    )
