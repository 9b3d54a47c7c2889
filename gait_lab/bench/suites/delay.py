"""The suite `delay`: sensors that are late, with a gait that knows it and one that does not."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from gait_lab.bench.falls import by_loop, rows_by_loop, text_by_loop
from gait_lab.bench.options import BenchOptions
from gait_lab.bench.report import Report, Row, loop_name, number, table
from gait_lab.bench.score import RULES, Score, Variant, labelled_tasks, walk_all
from nao_lipm_gait.parameters import BY_NAME

SUITE = "delay"
TASKS = ("forward=20", "forward", "back", "side", "turn")
DELAYS = (0, 20, 40, 60, 80)
"""[ms]"""
MOTOR_LAG = 0.02
"""What the feedback delay of a matched gait has beyond the sensors' delay: lag and interpolation of
the motors [s]."""


@dataclass(frozen=True, slots=True)
class Late:
    """One delay of the sensors and what the gait takes it for."""

    delay: int
    """[ms]"""
    matched: bool
    feedback_delay: float
    """[s]"""

    @property
    def name(self) -> str:
        return f"delay_{self.delay}_{'matched' if self.matched else 'own'}"

    @property
    def variant(self) -> Variant:
        plant = (("sensors.delay", self.delay / 1000.0),)
        return Variant(plant, {"feedback_delay": self.feedback_delay})


def delay(options: BenchOptions) -> Report:
    """Every delay, with the matched feedback delay and with the gait's own."""
    tasks = labelled_tasks(options)
    longest = BY_NAME["feedback_delay"].maximum
    lates = [
        Late(delay, matched, min(delay / 1000.0 + MOTOR_LAG, longest) if matched
             else options.parameters.feedback_delay)
        for matched in (True, False) for delay in DELAYS
    ]  # fmt: skip
    found = walk_all(options, [late.variant for late in lates], tasks)
    rows = [
        replace(row, plant=late.variant.plant_title(options))
        for late, scores in zip(lates, found, strict=True) for score in scores
        for row in _rows(late, score)
    ]  # fmt: skip
    everything = [score for scores in found for score in scores]
    detection = by_loop(everything)
    rows += rows_by_loop(SUITE, detection)
    text = _text(lates, found, options)
    return Report(tuple(rows), f"{text}\n{text_by_loop(detection)}")


def _rows(late: Late, score: Score) -> list[Row]:
    name = f"{late.name}_{score.name}"
    upright = Row(SUITE, f"{name}_upright", "robots", score.upright)
    return [upright, *score.speed_rows(SUITE, name, not score.faults)]


def _text(
    lates: Sequence[Late], found: Sequence[Sequence[Score]], options: BenchOptions
) -> str:
    names = list(dict.fromkeys((score.task.name, score.unit) for score in found[0]))
    header = ["delay", "gait", "loop"]
    units = ["ms", "ms", ""]
    for name, unit in names:
        header += [name.replace("_", " "), ""]
        units += ["upright", unit]
    lines = [header, units]
    for late, scores in zip(lates, found, strict=True):
        for closed in options.loops:
            line = [f"{late.delay}", f"{1000 * late.feedback_delay:.0f}", loop_name(closed)]
            for score in scores:
                if score.closed_loop == closed:
                    mark = " x" if score.faults else ""
                    line += [score.upright_text, number(score.median) + mark]
            lines.append(line)
    title = f"Late sensors, {options.window:g} s at speed, {options.title}"
    notes = (
        "delay: of the sensors; gait: the delay that it bridges. First the matched ones (sensors +",
        f"{1000 * MOTOR_LAG:.0f} ms for the motors), then the gait's own. "
        "Median speed of the robots that stayed upright.",
        RULES,
    )
    return "\n".join((title, "", table(lines), "", *notes))
