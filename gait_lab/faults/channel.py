"""Messages between the robot, the gait and the operator, and the channels that deliver them."""

import heapq
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


class Channel(Generic[Item]):
    """A queue that delivers each item at its tick, and the items of one tick in sending order."""

    def __init__(self) -> None:
        self._items: list[tuple[int, int, Item]] = []
        self._count = 0

    def send(self, due: int, item: Item) -> None:
        """Add an item that arrives at tick `due`."""
        heapq.heappush(self._items, (due, self._count, item))
        self._count += 1

    def receive(self, now: int) -> list[Item]:
        """Remove and return every item that has arrived by tick `now`."""
        arrived = []
        while self._items and self._items[0][0] <= now:
            arrived.append(heapq.heappop(self._items)[2])
        return arrived
