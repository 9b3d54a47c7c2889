"""The benchmarks as a page: every table with the command that reproduces it, and the figures.

What stands here between the tables explains them and claims nothing; results are in the tables.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from gait_lab.bench.figures import push_figure, speed_figure
from gait_lab.bench.options import BenchOptions
from gait_lab.bench.report import Report
from gait_lab.compiled import is_compiled
from nao_lipm_gait.errors import NaoGaitError

TITLES = {
    "speed": "Speed",
    "error": "Error of the centre of mass",
    "push": "Pushes",
    "start": "Starts and stops",
    "endurance": "Endurance",
    "delay": "Late sensors",
    "robust": "Harder plants",
    "getup": "Getting up",
    "posture": "Posture control",
    "rough": "Rough ground",
    "kick": "Kicks",
    "compute": "Cost of control",
    "plant": "One ingredient of the plant at a time",
    "ablation": "One extension of the gait at a time",
    "peers": "Other walks on the same robots",
    "faults": "Faults in the middle of a walk",
    "loss": "Lost messages",
    "fuzz": "Messages that nobody would send",
    "soak": "On and on",
    "realtime": "Ticks on a busy machine",
}
INTRODUCTION = """\
# Benchmarks

Written by `{command}`, all of it from the rows that the suites measured. This is the quick form:
few robots, short windows. Leave out the options of a command to get the long form of its suite;
`nao_gait bench --help` lists them. On one machine a command gives the same numbers every time,
except for what the machine has its part in: the times of compute and realtime, the memory of soak.
{gait}
- A *robot* is an individual drawn from the plant: joint zero errors, sensor biases, masses,
  friction, motor strength ([plants.md](plants.md)). Worst and median are over the robots.
- *Closed* is the gait with its feedback, *open* the same gait and parameters on the same robots
  without (`feedback: false`). The two stand side by side; where the open loop is as good or
  better, the table shows it.
- A speed *counts* only if no robot falls, at most 5 % of the ticks are without a loaded foot, the
  loaded sole slips at most 3 cm/s, and the legs do not touch.
- A *fall* is a torso tilt over 45 deg or a torso below half of its standing height. Its
  *detection* is the state that the gait itself reports; the lead is 0 for a fall that it did not
  report before. A detection that relaxes the joints makes its own fall come true, so few false
  alarms are not yet a proof of good detection.
- *paper*: Graf and Röfer on a real NAO. *placo*: the open-loop walk of placo 0.10.2 on a plant
  much like `reference`, nine robots, heading held, stronger motors. *NAO*: the fastest forward
  walk that was measured on NAO hardware. None of these was measured here.
"""


_COMPILED = """\
The gait was compiled, which changes times, a little memory, and nothing else: `nao_gait compile`,
and then `PYTHONPATH=build/compiled` before a command.
"""


@dataclass(frozen=True, slots=True)
class Section:
    """One run of a suite."""

    suite: str
    command: str
    """As typed to get it again."""
    options: BenchOptions
    report: Report


def write(path: Path, sections: Sequence[Section], command: str) -> list[Path]:
    """The page, and its figures in `images/` beside it; all files that were written.

    Raises NaoGaitError if a file cannot be written.
    """
    images = path.parent / "images"
    try:
        images.mkdir(parents=True, exist_ok=True)
        figures = _figures(sections, images)
        path.write_text(_page(sections, figures, command), encoding="utf-8")
    except OSError as error:
        raise NaoGaitError("report", str(path), f"a file that can be written ({error})") from error
    return [path, *figures.values()]


def _figures(sections: Sequence[Section], images: Path) -> dict[str, Path]:
    """Suite -> figure, for those that have one."""
    found = {}
    for suite, draw in (("speed", speed_figure), ("push", push_figure)):
        values = {
            row.metric: row.value
            for section in sections if section.suite == suite for row in section.report.rows
        }  # fmt: skip
        drawn = draw(values, images / f"bench_{suite}.png")
        if drawn is not None:
            found[suite] = drawn
    return found


_CAPTIONS = {
    "speed": "Bars: median of the robots; the line ends at the worst one.",
    "push": "Largest impulse that is survived, by where the push points; ahead is up. A point in "
    "the middle: not even the smallest one that was tried.",
}


def _page(sections: Sequence[Section], figures: dict[str, Path], command: str) -> str:
    parts = [INTRODUCTION.format(command=command, gait=_COMPILED if is_compiled() else "")]
    before = None
    for section in sections:
        if section.suite != before:
            parts.append(f"## {TITLES.get(section.suite, section.suite)}\n")
            if section.suite in figures:
                file = figures[section.suite]
                caption = _CAPTIONS[section.suite]
                parts.append(f"![{caption}](images/{file.name})\n\n{caption}\n")
        before = section.suite
        parts.append(f"```\n$ {section.command}\n\n{section.report.text}\n```\n")
    return "\n".join(parts)
