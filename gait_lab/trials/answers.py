"""The answers of a gait to the frames of a simulation: one by one, or some in a row.

What the sensor delay holds back has been sampled already: nothing that happens until it arrives
can change it, nor the answers to it. So the gait may go some ticks ahead, and the plant follows
with as many control periods. Each then works from caches that the other has not emptied, which
makes a rollout faster and changes no bit of it.
"""

from collections import deque
from collections.abc import Callable
from typing import NamedTuple, Protocol

from nao_lipm_gait.types import GaitStatus, JointTargets, SensorFrame, VelocityCommand
from sim_bridge.simulation import Simulation


class Walker(Protocol):
    """The gait, or what walks in its place."""

    def step(self, frame: SensorFrame, command: VelocityCommand) -> JointTargets: ...

    @property
    def status(self) -> GaitStatus: ...


class Answer(NamedTuple):
    """What belongs to one control period."""

    command: VelocityCommand
    targets: JointTargets | None
    """None where no frame has arrived yet, as of the status."""
    status: GaitStatus | None


class Answers:
    """Asks a walker about each control period of a simulation."""

    def __init__(
        self,
        simulation: Simulation,
        walker: Walker,
        command_at: Callable[[float], VelocityCommand],
        *,
        ahead: bool,
    ) -> None:
        """command_at: the command by time since now [s]; ahead: it depends on that time alone."""
        self._simulation = simulation
        self._walker = walker
        self._command_at = command_at
        self._ahead = ahead
        self._began = simulation.time
        self._answers: deque[Answer | Exception] = deque()

    def next(self) -> Answer:
        """Of this control period; once in each. What the walker raises, it raises in its period."""
        if not self._answers:
            self._ask()
        answer = self._answers.popleft()
        if isinstance(answer, Exception):
            raise answer
        return answer

    def _ask(self) -> None:
        time, period = self._simulation.time - self._began, self._simulation.control_period
        frames = self._simulation.coming() if self._ahead else [self._simulation.sense()]
        for frame in frames:
            command = self._command_at(time * 1e-9)
            if frame is None:
                self._answers.append(Answer(command, None, None))
            else:
                try:
                    targets = self._walker.step(frame, command)
                    self._answers.append(Answer(command, targets, self._walker.status))
                except Exception as error:
                    self._answers.append(error)
                    break
            time += period
