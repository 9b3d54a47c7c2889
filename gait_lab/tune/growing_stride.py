"""The second paper's experiment: the stride grows every two steps; how far does the robot walk?

The stride is what both feet cover together. The gait takes a velocity, so the policy commands the
stride over the duration of the last two steps.
"""

import math
from collections.abc import Mapping

import numpy as np

from robot_core.geometry import yaw_of_quaternion
from robot_core.types import STANDSTILL, GaitState, VelocityCommand
from sim_bridge.trials.metrics import Trace
from sim_bridge.trials.rollout import Recorder
from sim_bridge.trials.trial import Action, Policy, Tick, TrialSpec, make_gait, make_world, run

STAND_TIME = 1.0
"""Time before the first step [s]."""
FIRST_DOUBLE_STEP = 0.5
"""Duration [s] assumed for a double step until one was measured."""
STEP_TIME_MAX = 1.0
"""Time per step [s] after which the walk is ended."""


class GrowingStride(Policy):
    """Raises the stride every two steps, then holds it.

    Args:
        steps: Number of steps.
        first: First stride [m].
        last: Last stride [m].
        hold: Time at the last stride after the last step [s].

    Attributes:
        steps: Number of steps.
        hold: Time at the last stride [s].
        step_times: Time of each support change [s].
        done_at: Time of the last step [s]; None before it.
    """

    def __init__(self, steps: int, first: float, last: float, hold: float) -> None:
        self.steps, self.hold = steps, hold
        self._first, self._last = first, last
        self.step_times: list[float] = []
        self.done_at: float | None = None

    def command(self, time: float, tick: Tick | None) -> Action:
        """Return the velocity for the present stride; None after the hold."""
        status = None if tick is None else tick.status
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
        stride = self.stride_after(len(self.step_times))
        return VelocityCommand(stride / self._double_step, 0.0, 0.0)

    def stride_after(self, steps: int) -> float:
        """Return the stride [m] that is commanded after a number of steps."""
        stage = min(steps, self.steps) // 2
        return self._first + (self._last - self._first) * stage / max(1, self.steps // 2)

    @property
    def _double_step(self) -> float:
        times = self.step_times
        # The first two shift the weight and start from rest.
        return times[-1] - times[-3] if len(times) >= 4 else FIRST_DOUBLE_STEP


def walk_growing_stride(
    spec: TrialSpec, options: Mapping[str, float]
) -> tuple[Trace, GrowingStride, bool]:
    """Walk the experiment.

    Args:
        spec: The robot and its gait.
        options: `steps`, `first` [m], `last` [m] and `hold` [s].

    Returns:
        The trace, the policy, and whether the robot fell or did not take all steps.
    """
    first, last, hold = (options[name] for name in ("first", "last", "hold"))
    policy = GrowingStride(int(options["steps"]), first, last, hold)
    limit = STAND_TIME + STEP_TIME_MAX * policy.steps + policy.hold
    recorder = Recorder()
    fell = False
    with make_world(spec) as world:
        for tick in run(world, make_gait(spec), policy):
            recorder.add(tick.truth, tick.command, tick.status)
            fell = tick.fallen
            if world.time * 1e-9 >= limit:
                break
    return recorder.trace(), policy, fell or policy.done_at is None


def distance(trace: Trace, end: float | None) -> float:
    """Return the distance [m] along the initial heading from the start to `end` [s]."""
    row = len(trace) - 1 if end is None else int(np.searchsorted(trace.time, end - 1e-9))
    row = min(row, len(trace) - 1)
    heading = yaw_of_quaternion(*trace.torso_quaternion[0].tolist())
    moved = trace.torso_position[row] - trace.torso_position[0]
    return float(math.cos(heading) * moved[0] + math.sin(heading) * moved[1])
