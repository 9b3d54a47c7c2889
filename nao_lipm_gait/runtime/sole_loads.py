"""The loads on the soles: whether they carry the robot."""

from robot_core.types import GRAVITY

LIGHT_SHARE = 0.3
"""Share of the robot's weight; with less on both soles they do not carry the robot."""
LOAD_AGE = 300_000_000
"""[ns] Older loads are not used."""


class SoleLoads:
    """Tells from the normal forces since when the soles carry the robot, or do not.

    Args:
        mass: Mass of the robot [kg].
    """

    def __init__(self, mass: float) -> None:
        self._least = LIGHT_SHARE * mass * GRAVITY
        self.clear()

    def clear(self) -> None:
        """Forget all loads."""
        self._force: list[tuple[int, float] | None] = [None, None]
        self._light_since: int | None = None
        self._both_since: int | None = None
        self._carried = [False, False]

    def add(self, side: int, stamp: int, force: float) -> None:
        """Keep a load.

        Args:
            side: 0 left, 1 right.
            stamp: [ns].
            force: Along the normal of the sole [N].
        """
        self._force[side] = stamp, force
        self._carried[side] = self._carried[side] or force > self._least
        left, right = self._force
        if left is None or right is None:
            return
        light = left[1] + right[1] < self._least
        both = 2.0 * min(left[1], right[1]) > self._least
        self._light_since = _first(self._light_since, stamp) if light else None
        self._both_since = _first(self._both_since, stamp) if both else None

    def light_time(self, stamp: int) -> int:
        """Time [ns] until `stamp` for which they have not carried the robot; 0 if unknown."""
        return self._time(self._light_since, stamp)

    def both_time(self, stamp: int) -> int:
        """Time [ns] until `stamp` for which both have carried their part; 0 if unknown."""
        return self._time(self._both_since, stamp)

    def are_known(self, stamp: int) -> bool:
        """Whether the loads of both soles are recent at `stamp` [ns]."""
        return all(each is not None and stamp - each[0] < LOAD_AGE for each in self._force)

    @property
    def sensors_work(self) -> bool:
        """Each sole has carried the robot before: its sensors are connected."""
        return all(self._carried)

    def _time(self, since: int | None, stamp: int) -> int:
        return 0 if since is None or not self.are_known(stamp) else stamp - since


def _first(since: int | None, stamp: int) -> int:
    return stamp if since is None else since
