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
from dataclasses import asdict
from pathlib import Path
from typing import NamedTuple

from gait_lab.demo.node_processes import NodeProcesses
from gait_lab.faults.messages import Message
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


def ros_is_installed() -> bool:
    """Whether there is an rclpy to import."""
    return importlib.util.find_spec("rclpy") is not None


def replay_over_ros(
    script: Sequence[Sequence[Message]], period: float, parameters: Mapping[str, object]
) -> ReplayTimes:
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
    return ReplayTimes(*json.loads(done.stdout))


def _as_data(message: Message) -> list[object]:
    """Topic, type and fields, as JSON has them."""
    content = message.content
    fields = {
        name: value if isinstance(value, int | float | str) else list(value)
        for name, value in asdict(content).items()
        if value is not None
    }
    return [message.topic, type(content).__name__, fields]
