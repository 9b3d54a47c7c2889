"""Messages between the robot, the gait and the operator."""

from dataclasses import dataclass
from typing import Generic, NamedTuple, TypeVar

from nao_lipm_gait.runtime.inputs import Input
from robot_core.types import JointTargets

Item = TypeVar("Item")


@dataclass(frozen=True, slots=True)
class Message:
    """A message to the gait, with the fields that it reads."""

    topic: str
    content: Input


@dataclass(frozen=True, slots=True)
class Command:
    """A joint command to the robot."""

    sender: str
    targets: JointTargets


class Delivery(NamedTuple, Generic[Item]):
    """A message or command that arrives after `delay` control ticks."""

    delay: int
    item: Item
