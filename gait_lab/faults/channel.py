"""Messages under way: what was sent, where to, and when it arrives."""

import heapq
from dataclasses import dataclass
from typing import Generic, TypeVar

from nao_lipm_gait.runtime.inputs import Input
from nao_lipm_gait.types import JointTargets

Item = TypeVar("Item")


@dataclass(frozen=True, slots=True)
class Message:
    """Something for the gait."""

    topic: str
    content: Input


@dataclass(frozen=True, slots=True)
class Command:
    """Something for the robot."""

    sender: str
    targets: JointTargets


class Channel(Generic[Item]):
    """Gives items out at their tick, and those of one tick in the order in which they were put."""

    def __init__(self) -> None:
        self._items: list[tuple[int, int, Item]] = []
        self._count = 0

    def put(self, due: int, item: Item) -> None:
        """`due`: tick at which it arrives."""
        heapq.heappush(self._items, (due, self._count, item))
        self._count += 1

    def take(self, now: int) -> list[Item]:
        """All that has arrived by tick `now`."""
        arrived = []
        while self._items and self._items[0][0] <= now:
            arrived.append(heapq.heappop(self._items)[2])
        return arrived
