"""The second paper's experiment: the stride grows every two steps; how far does the robot walk?

The stride is what both feet cover together. The gait takes a velocity, so the policy commands the
stride over the duration of the last two steps.
"""

import math

import attrs
import numpy as np

from robot_core.geometry import yaw_of_quaternion
from robot_core.schema import Settings, number
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


@attrs.frozen
class GrowingStrideOptions(Settings):
    """How many steps, from which stride to which, and how long the last one is held."""

    steps: int = number(52, 4, 400, whole=True)
    first: float = number(0.05, 0.0, 0.4, "m")
    last: float = number(0.24, 0.0, 0.4, "m")
    hold: float = number(0.0, 0.0, 120.0, "s")


class GrowingStride(Policy):
    """Raises the stride every two steps, then holds it.

    Attributes:
        step_times: Time of each support change [s].
        done_at: Time of the last step [s]; None before it.
    """

    def __init__(self, options: GrowingStrideOptions) -> None:
        self._options = options
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
        if self.done_at is None and len(self.step_times) >= self._options.steps:
            self.done_at = time
        if self.done_at is not None and time >= self.done_at + self._options.hold:
            return None
        stride = self.stride_after(len(self.step_times))
        return VelocityCommand(stride / self._double_step, 0.0, 0.0)

    def stride_after(self, steps: int) -> float:
        """Return the stride [m] that is commanded after a number of steps."""
        first, last, count = self._options.first, self._options.last, self._options.steps
        return first + (last - first) * (min(steps, count) // 2) / (count // 2)

    @property
    def _double_step(self) -> float:
        times = self.step_times
        # The first two shift the weight and start from rest.
        return times[-1] - times[-3] if len(times) >= 4 else FIRST_DOUBLE_STEP


def walk_growing_stride(
    spec: TrialSpec, options: GrowingStrideOptions
) -> tuple[Trace, GrowingStride, bool]:
    """Walk the experiment; the bool says whether the robot fell or did not take all steps."""
    policy = GrowingStride(options)
    limit = STAND_TIME + STEP_TIME_MAX * options.steps + options.hold
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
