"""A queue whose items arrive later than they are sent."""

import heapq
from typing import Generic, TypeVar

Item = TypeVar("Item")


class Channel(Generic[Item]):
    """Delivers each item at its time, in ticks or ns, and those of one time in sending order."""

    def __init__(self) -> None:
        self._items: list[tuple[int, int, Item]] = []
        self._count = 0

    def send(self, due: int, item: Item) -> None:
        """Add an item that arrives at time `due`."""
        heapq.heappush(self._items, (due, self._count, item))
        self._count += 1

    def receive(self, now: int) -> list[Item]:
        """Remove and return every item that has arrived by `now`."""
        arrived = []
        while self._items and self._items[0][0] <= now:
            arrived.append(heapq.heappop(self._items)[2])
        return arrived
