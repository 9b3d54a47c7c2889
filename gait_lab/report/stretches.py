"""Stretches of one velocity command, each measured as the benchmark measures a task."""

import math
from dataclasses import dataclass

import numpy as np

from gait_lab.analysis.metrics import Metrics, Trace, measure
from gait_lab.report.walk import Walk
from nao_lipm_gait.types import VelocityCommand

SETTLE = 2.5
"""[s] after a change of the command before a stretch is measured."""
SHORTEST = 1.0
"""[s] that have to be left to measure."""
TIMEOUT = 500_000_000
"""[ns] after which a command means stop."""
LATE = 1_500_000_000
"""[ns]"""


@dataclass(frozen=True, slots=True)
class Stretch:
    """A time of one command; start and end on the report's axis [s], without the settling."""

    command: VelocityCommand | None
    """None for a bag without commands."""
    start: float
    end: float
    metrics: Metrics

    @property
    def name(self) -> str:
        """In words."""
        command = self.command
        if command is None:
            return "whole bag"
        if command.is_zero:
            return "stand"
        parts = []
        if abs(command.x) >= 0.005:
            parts.append("forward" if command.x > 0 else "back")
        if abs(command.y) >= 0.005:
            parts.append("left" if command.y > 0 else "right")
        if abs(command.yaw) >= 0.02:
            parts.append("turn left" if command.yaw > 0 else "turn right")
        return " + ".join(parts) or "on the spot"

    @property
    def reached(self) -> float | None:
        """Achieved share of the asked speed along the main axis; None where none was asked."""
        command = self.command
        if command is None or command.is_zero:
            return None
        axis = (command.x, command.y, 0.2 * command.yaw)
        main = int(np.argmax(np.abs(axis)))
        asked = (command.x, command.y, command.yaw)[main]
        got = (self.metrics.speed_x, self.metrics.speed_y, self.metrics.turn_rate)[main]
        small = (0.005, 0.005, 0.02)[main]
        return got / asked if abs(asked) >= small else None


def find_stretches(walk: Walk, trace: Trace) -> tuple[Stretch, ...]:
    """Every command that was held long enough to measure it; the whole bag if none was recorded."""
    shift = float(walk.seconds(int(trace.stamp[0])))
    last = float(walk.seconds(int(trace.stamp[-1])))
    if not len(walk.command):
        return (Stretch(None, shift, last, measure(trace, 0.0, math.inf)),)
    stretches = []
    for begin, end, command in _held(walk, last):
        start = begin + min(SETTLE, 0.5 * (end - begin))
        if end - start < SHORTEST:
            continue
        start, end = max(start, shift), min(end, last)
        if end > start:
            metrics = measure(trace, start - shift, end - shift)
            stretches.append(Stretch(command, start, end, metrics))
    return tuple(stretches)


def _held(walk: Walk, last: float) -> list[tuple[float, float, VelocityCommand]]:
    """(begin, end [s], command) of each time in which the command stayed the same."""
    events: list[tuple[int, tuple[float, ...]]] = []
    stamps, values = walk.command.stamp, walk.command.value
    zero = (0.0, 0.0, 0.0)
    for index, stamp in enumerate(stamps.tolist()):
        gap = stamp - int(stamps[index - 1]) if index else 0
        # A busy recorder makes short gaps within one command that the robot never saw.
        same = bool(np.array_equal(values[index], values[index - 1]))
        if gap > (LATE if same else TIMEOUT):
            events.append((int(stamps[index - 1]) + TIMEOUT, zero))
        events.append((stamp, tuple(np.round(values[index], 6).tolist())))
    events.append((int(stamps[-1]) + TIMEOUT, zero))
    held: list[tuple[float, float, VelocityCommand]] = []
    for (stamp, value), after in zip(events, [*events[1:], None], strict=True):
        begin = float(walk.seconds(stamp))
        end = last if after is None else float(walk.seconds(after[0]))
        if held and held[-1][2] == VelocityCommand(*value):
            held[-1] = (held[-1][0], end, held[-1][2])
        else:
            held.append((begin, end, VelocityCommand(*value)))
    return held
