"""A walk's sensor messages sent to the gait node over ROS 2, at their times by the wall clock.

Two processes do the work: the node `gait`, as in operation, and `replay_process`, which stands for
the robot. This one does not import rclpy.
"""

import importlib.util
import json
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import NamedTuple

from gait_lab.bench.wake_up import deviations
from gait_lab.demo.node_processes import NodeProcesses
from gait_lab.faults.messages import Message
from nao_lipm_gait.runtime.reports import quantile
from robot_core.errors import NaoGaitError
from robot_core.ros.process import DomainClaim


class ReplayTimes(NamedTuple):
    """What the process of the robot measured.

    Attributes:
        sent: [s] at which each joint state was sent.
        answered: [s] at which the gait sent the command that answers it; None without an answer.
        machine: [s] by which a process that only sleeps was late at each tick.
    """

    sent: tuple[float, ...]
    answered: tuple[float | None, ...]
    machine: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class RosReplay:
    """Times of one replay over ROS 2, beside those of a process that only sleeps.

    Attributes:
        latency: [s] from sending a joint state to the gait's sending of its answer, sorted.
        period: [s] by which intervals between answers differ from the control period, sorted.
        machine_wake: [s] by which the sleeping process was late, sorted.
        machine_period: [s] by which intervals between its wake-ups differ from the period, sorted.
        misses: Joint states with no answer, or with one more than a period later.
    """

    latency: tuple[float, ...]
    period: tuple[float, ...]
    machine_wake: tuple[float, ...]
    machine_period: tuple[float, ...]
    misses: int
    count: int

    @classmethod
    def of(cls, times: ReplayTimes, period: float) -> "RosReplay":
        """The distributions of these times; `period` is the control period [s].

        Raises:
            NaoGaitError: Fewer than two answers, of which nothing can be said.
        """
        pairs = zip(times.sent, times.answered, strict=True)
        latency = sorted(after - before for before, after in pairs if after is not None)
        answers = sorted(each for each in times.answered if each is not None)
        if len(answers) < 2:
            found = f"{len(answers)} answers to {len(times.sent)} joint states"
            raise NaoGaitError("replay over ROS 2", found, "a gait that answers")
        woken = [index * period + late for index, late in enumerate(times.machine)]
        return cls(
            tuple(latency),
            deviations(answers, period),
            tuple(sorted(times.machine)),
            deviations(woken, period),
            len(times.sent) - sum(each <= period for each in latency),
            len(times.sent),
        )

    @property
    def latency_excess(self) -> float:
        """99th percentile of the latency minus that of the machine's own wake-up [s]."""
        return quantile(self.latency, 0.99) - quantile(self.machine_wake, 0.99)

    @property
    def period_excess(self) -> float:
        """99th percentile of the period's deviation minus the machine's own [s]."""
        return quantile(self.period, 0.99) - quantile(self.machine_period, 0.99)


def ros_is_installed() -> bool:
    """Whether there is an rclpy to import."""
    return importlib.util.find_spec("rclpy") is not None


def replay_over_ros(
    script: Sequence[Sequence[Message]], period: float, parameters: Mapping[str, object]
) -> RosReplay:
    """Send the messages of each tick to a gait node and take its answers.

    Args:
        script: The messages of each tick.
        period: The control period [s].
        parameters: ROS parameters of the gait node.

    Raises:
        NaoGaitError: The nodes did not find each other, or one of them ended.
    """
    with tempfile.TemporaryDirectory() as name, DomainClaim() as domain:
        folder = Path(name)
        file = folder / "script"
        ticks = [[_as_data(each) for each in messages] for messages in script]
        file.write_text(json.dumps([period, ticks]), encoding="utf-8")
        environment = domain.environment()
        with NodeProcesses(environment, folder) as nodes:
            nodes.start("gait", parameters)
            done = subprocess.run(
                [sys.executable, "-m", "gait_lab.bench.replay_process", str(file)],
                env=environment, capture_output=True, text=True, check=False,
            )  # fmt: skip
            if done.returncode:
                problem = [*done.stderr.splitlines()[-1:], *nodes.log_tails(1)]
                raise NaoGaitError("replay over ROS 2", "; ".join(problem), "a gait that answers")
    return RosReplay.of(ReplayTimes(*json.loads(done.stdout)), period)


def _as_data(message: Message) -> list[object]:
    """Topic, type and fields, as JSON has them."""
    content = message.content
    fields = {
        name: value if isinstance(value, int | float | str) else list(value)
        for name, value in asdict(content).items()
        if value is not None
    }
    return [message.topic, type(content).__name__, fields]
