"""The suite `delay`: late sensors, with a gait that knows the delay and with one that does not."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from gait_lab.bench.options import BenchOptions
from gait_lab.bench.result import Cell as TableCell
from gait_lab.bench.result import Column, Measurement, SuiteResult, Table, loop_name
from gait_lab.bench.score import (
    RULES,
    LoopDetection,
    Score,
    Variant,
    labelled_tasks,
    walk_all,
)
from gait_lab.bench.suite import Suite
from nao_lipm_gait.parameters import BY_NAME

DELAYS = (0, 20, 40, 60, 80)
"""[ms]"""
MOTOR_LAG = 0.02
"""[s] that a matched feedback delay is longer than the sensors' delay: lag and interpolation of the
motors."""


@dataclass(frozen=True)
class Options(BenchOptions):
    """What the suite `delay` runs on."""

    robots: int = 4
    window: float = 10.0
    tasks: tuple[str, ...] = ("forward=20", "forward", "back", "side", "turn")


@dataclass(frozen=True, slots=True)
class Delay:
    """A delay of the sensors, and the one that the gait predicts over.

    Attributes:
        sensors: [ms].
        matched: Whether the gait's delay follows that of the sensors.
        feedback_delay: Feedback delay of the gait [s].
    """

    sensors: int
    matched: bool
    feedback_delay: float

    @property
    def name(self) -> str:
        """As it begins the name of a metric."""
        return f"delay_{self.sensors}_{'matched' if self.matched else 'own'}"

    @property
    def variant(self) -> Variant:
        """The plant and the gait with it."""
        plant = (("sensors.delay", self.sensors / 1000.0),)
        return Variant(plant, {"feedback_delay": self.feedback_delay})


def delays_of(own: float) -> list[Delay]:
    """Every delay, with the matched feedback delay and with the gait's own [s]."""
    longest = BY_NAME["feedback_delay"].maximum
    return [
        Delay(delay, matched, min(delay / 1000.0 + MOTOR_LAG, longest) if matched else own)
        for matched in (True, False) for delay in DELAYS
    ]  # fmt: skip


def delay(options: Options) -> SuiteResult:
    """Walk with every delay."""
    delays = delays_of(options.parameters.feedback_delay)
    variants = [each.variant for each in delays]
    found = walk_all(options, variants, labelled_tasks(options))
    rows = [
        replace(row, plant=each.variant.plant_title(options))
        for each, scores in zip(delays, found, strict=True) for score in scores
        for row in _rows(each, score)
    ]  # fmt: skip
    detection = LoopDetection(score for scores in found for score in scores)
    notes = (
        "delay: of the sensors. gait: the delay that it predicts over; first the matched ones "
        f"(sensors + {1000 * MOTOR_LAG:.0f} ms for the motors), then the gait's own. Median speed "
        "of the robots that stayed upright.",
        RULES,
        *detection.notes,
    )
    title = f"Late sensors, {options.window:g} s at speed, {options.title}"
    return SuiteResult(
        (*rows, *detection.rows), title, (_table(delays, found, options),), notes
    )


def _rows(each: Delay, score: Score) -> list[Measurement]:
    name = f"{each.name}_{score.name}"
    return [Measurement(f"{name}_upright", "robots", score.upright), *score.speed_rows(name)]


def _table(
    delays: Sequence[Delay], found: Sequence[Sequence[Score]], options: Options
) -> Table:
    columns = [Column("delay", "ms"), Column("gait", "ms", 0), Column("loop")]
    for name, unit in dict.fromkeys((score.task.name, score.unit) for score in found[0]):
        columns += [Column(name.replace("_", " "), "upright"), Column("", unit), Column("")]
    rows = []
    for each, scores in zip(delays, found, strict=True):
        for closed in options.loops:
            row: list[TableCell] = [each.sensors, 1000.0 * each.feedback_delay, loop_name(closed)]
            for score in scores:
                if score.closed_loop == closed:
                    row += [score.upright_text, score.median, "x" if score.faults else ""]
            rows.append(row)
    return Table(columns, rows)


SUITE = Suite(
    name="delay",
    title="Late sensors",
    summary="delays of the sensors that the gait knows, and that it does not know",
    measure=delay,
    options=Options,
    takes=("robots", "tasks", "window", "open_loop"),
    quick=({"robots": 2, "window": 4.0, "tasks": ("forward=20",)},),
)
