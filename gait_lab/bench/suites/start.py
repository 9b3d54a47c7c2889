"""The suite `start`: from standing to full speed at once and back, in any direction."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from gait_lab.bench.options import BenchOptions
from gait_lab.bench.result import Cell as TableCell
from gait_lab.bench.result import Column, Measurement, SuiteResult, Table, loop_name
from gait_lab.bench.score import LoopDetection, Score, walk_all
from gait_lab.bench.suite import Suite
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


@dataclass(frozen=True)
class Options(BenchOptions):
    """What the suite `start` runs on."""

    robots: int = 20


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


@dataclass(frozen=True, slots=True)
class Tally:
    """The starts and stops of some scores.

    Attributes:
        scores: One per case, all in the same loop.
    """

    scores: Sequence[Score]

    @property
    def starts(self) -> int:
        """Number of starts."""
        return sum(len(score.results) for score in self.scores)

    @property
    def start_falls(self) -> int:
        """Falls before the command ends."""
        return sum(time < STOP_TIME for time in self._fall_times)

    @property
    def stop_falls(self) -> int:
        """Falls after the command ends."""
        return sum(time >= STOP_TIME for time in self._fall_times)

    @property
    def stopped(self) -> int:
        """Robots that stand still at the end."""
        return sum(
            not result.metrics.fell
            and math.hypot(result.metrics.speed_x, result.metrics.speed_y) < STILL
            and result.metrics.support_changes == 0
            for score in self.scores
            for result in score.results
        )

    @property
    def _fall_times(self) -> list[float]:
        times = [result.metrics.fall_time for score in self.scores for result in score.results]
        return [time for time in times if time is not None]

    def rows(self, name: str) -> list[Measurement]:
        """Its measurements."""
        return [
            Measurement(f"{name}_starts", "starts", self.starts),
            Measurement(f"{name}_start_falls", "falls", self.start_falls),
            Measurement(f"{name}_stop_falls", "falls", self.stop_falls),
            Measurement(f"{name}_stopped", "robots", self.stopped),
        ]

    def line(self, name: str) -> tuple[TableCell, ...]:
        """Its row of the table."""
        loop = loop_name(self.scores[0].closed_loop)
        return name, loop, self.starts, self.start_falls, self.stop_falls, self.stopped


def start(options: Options) -> SuiteResult:
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
    (scores,) = walk_all(options, tasks=tasks, label="starts")
    rows = [row for score in scores for row in Tally([score]).rows(score.name)]
    lines = [Tally([score]).line(score.task.name.replace("_", " ")) for score in scores]
    for closed in options.loops:
        tally = Tally([score for score in scores if score.closed_loop == closed])
        rows += tally.rows("all" if closed else "all_open_loop")
        lines.append(tally.line("all"))
    columns = (
        Column("command"), Column("loop"), Column("starts"), Column("falls"),
        Column("falls after", "the stop"), Column("stands", "still"),
    )  # fmt: skip
    detection = LoopDetection(scores)
    return SuiteResult(
        (*rows, *detection.rows),
        f"From standing to full speed at once, {STOP_TIME - STAND_TIME:g} s, and a stop at once; "
        f"{options.title}",
        (Table(columns, lines),),
        (
            f"stands still: {END - STOP_TIME:g} s after the end of the command, for {REST:g} s, "
            f"below {100 * STILL:g} cm/s and without a step.",
            *detection.notes,
        ),
    )


SUITE = Suite(
    name="start",
    title="Starts and stops",
    summary="from standing to full speed at once, and a stop at once",
    measure=start,
    options=Options,
    takes=("robots", "open_loop"),
    quick=({"robots": 3},),
)
