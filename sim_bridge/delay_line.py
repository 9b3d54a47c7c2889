"""A pure delay for whole sensor readings, whose stamps it keeps."""

from collections import deque
from typing import Generic, TypeVar

from robot_core.errors import NaoGaitError

Item = TypeVar("Item")


class DelayLine(Generic[Item]):
    """Returns the newest item that is at least `delay` old.

    Attributes:
        delay: [ns].
    """

    def __init__(self, delay: int) -> None:
        """`delay`: [ns], at least 0."""
        if delay < 0:
            raise NaoGaitError("delay", delay, "at least 0 ns")
        self.delay = delay
        self._items: deque[tuple[int, Item]] = deque()

    def put(self, stamp: int, item: Item) -> None:
        """Add an item sampled at `stamp` [ns]; stamps must increase.

        Raises:
            NaoGaitError: This one does not.
        """
        if self._items and stamp <= self._items[-1][0]:
            raise NaoGaitError("stamp", stamp, f"later than {self._items[-1][0]} ns")
        self._items.append((stamp, item))

    def newest(self, now: int) -> Item | None:
        """The newest item with stamp <= now - delay; None before the first one is old enough.

        Older items are dropped, so `now` must not go backwards.
        """
        limit = now - self.delay
        items = self._items
        while len(items) > 1 and items[1][0] <= limit:
            items.popleft()
        return items[0][1] if items and items[0][0] <= limit else None

    def coming(self, now: int, period: int) -> list[Item | None]:
        """The results of `newest` now and after each of the next periods [ns] that are known now.

        They are known if the next item is put no sooner than one period from now.
        """
        self.newest(now)  # drops older items
        return [self._at(now + later) for later in range(0, self.delay + period, period)]

    def _at(self, now: int) -> Item | None:
        limit = now - self.delay
        return next((item for stamp, item in reversed(self._items) if stamp <= limit), None)

    def clear(self) -> None:
        """Drop all items."""
        self._items.clear()
