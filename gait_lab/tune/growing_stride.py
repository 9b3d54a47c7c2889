"""The second paper's experiment: the stride grows every two steps; how far does the robot get?

Stride is what both feet together cover. The gait takes a velocity, so the pilot asks for the stride
over the time that the last two steps took.
"""

import math
from collections.abc import Mapping

import numpy as np

from gait_lab.analysis.metrics import Metrics, measure
from gait_lab.analysis.trace import Trace
from gait_lab.tune.measures import Measures, excess_of
from gait_lab.tune.walker import Setting, walk
from nao_lipm_gait.geometry import yaw_of_quaternion
from nao_lipm_gait.types import STANDSTILL, GaitState, GaitStatus, VelocityCommand

MEASURES = {
    "distance": "m",
    "speed": "m/s",
    "steps": "",
    "drift": "rad/s",
    "flight": "",
    "slip": "m/s",
}
STAND_TIME = 1.0
"""[s] before the first step."""
DOUBLE_STEP_GUESS = 0.5
"""[s] taken for a double step until one was seen."""
TOP_STEPS = 12
"""The speed is that of the last so many steps, where no hold follows."""
STEP_TIME_MAX = 1.0
"""[s] per step after which a walk that does not step is given up."""
TAIL = 1.0
"""[s] past the end: the window is cut by the trace."""


class StridePilot:
    """Raises the stride every two steps."""

    def __init__(self, steps: int, first: float, last: float, hold: float) -> None:
        self.steps, self.first, self.last, self.hold = steps, first, last, hold
        self.step_times: list[float] = []
        """[s] of each support change."""
        self.done_at: float | None = None

    def __call__(self, time: float, status: GaitStatus | None) -> VelocityCommand | None:
        if status is None or time < STAND_TIME:
            return STANDSTILL
        if status.state is GaitState.FALLEN:
            # The gait lies down by itself; what follows is not walking.
            return STANDSTILL
        walking = status.state is not GaitState.STAND
        if walking and status.step_count > len(self.step_times):
            self.step_times.append(time)
        if self.done_at is None and len(self.step_times) >= self.steps:
            self.done_at = time
        if self.done_at is not None and time >= self.done_at + self.hold:
            return None
        return VelocityCommand(self.stride / self._double_step, 0.0, 0.0)

    @property
    def stride(self) -> float:
        """[m] that the next two steps shall cover together."""
        stage = min(len(self.step_times), self.steps) // 2
        return self.first + (self.last - self.first) * stage / max(1, self.steps // 2)

    @property
    def _double_step(self) -> float:
        times = self.step_times
        # The first two shift the weight and start from rest.
        return times[-1] - times[-3] if len(times) >= 4 else DOUBLE_STEP_GUESS


def run(setting: Setting, options: Mapping[str, float]) -> Measures:
    """Distance [m] along the start heading until the last step or the fall, and the top speed.

    The speed is the mean in the torso's own heading over the hold, or over the last steps; 0 for a
    robot that falls.
    """
    trace, pilot, fell = record(setting, options)
    end = float(trace.time[-1]) + TAIL
    metrics = measure(trace, STAND_TIME, end)
    top_from = pilot.done_at if pilot.done_at is not None and pilot.hold > 0.0 else None
    if top_from is None:
        times = pilot.step_times
        top_from = times[-TOP_STEPS] if len(times) >= TOP_STEPS else STAND_TIME
    top: Metrics = measure(trace, top_from, end)
    values = {
        "distance": max(0.0, distance(trace, pilot.done_at)),
        "speed": 0.0 if fell else _number(top.speed_x),
        "steps": float(min(len(pilot.step_times), pilot.steps)),
        "drift": _number(metrics.turn_rate),
        "flight": _number(top.flight_share),
        "slip": _number(top.slip_speed),
    }
    return Measures(setting.robot_seed, values, fell, max(excess_of(metrics), excess_of(top)))


def record(
    setting: Setting, options: Mapping[str, float]
) -> tuple[Trace, StridePilot, bool]:
    """The walk itself: its trace, its pilot, and whether the robot fell or never got through."""
    pilot = StridePilot(
        int(options["steps"]), options["first"], options["last"], options["hold"]
    )
    limit = STAND_TIME + STEP_TIME_MAX * pilot.steps + pilot.hold
    trace, fell = walk(setting, pilot, time_limit=limit)
    return trace, pilot, fell or pilot.done_at is None


def distance(trace: Trace, end: float | None) -> float:
    """[m] from the start to `end` [s] along the heading at the start."""
    row = len(trace) - 1 if end is None else int(np.searchsorted(trace.time, end - 1e-9))
    row = min(row, len(trace) - 1)
    heading = yaw_of_quaternion(*trace.torso_quaternion[0].tolist())
    moved = trace.torso_position[row] - trace.torso_position[0]
    return float(math.cos(heading) * moved[0] + math.sin(heading) * moved[1])


def _number(value: float) -> float:
    return value if math.isfinite(value) else 0.0
