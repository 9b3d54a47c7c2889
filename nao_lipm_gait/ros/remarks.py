"""What there is to say: collected for the next report, and logged where that does not flood."""

from collections import Counter
from collections.abc import Callable

from nao_lipm_gait.ros.health import Level, Remark
from nao_lipm_gait.ros.throttle import Throttle

SENSORS, WALK, COMMANDS = "sensors", "walk", "commands"
_PER_REPORT = 32
"""A flood of bad messages shall not grow a list."""


class Remarks:
    """Remarks by group, and how many messages were refused."""

    def __init__(self, log: Callable[[Level, str], None], clock: Callable[[], float]) -> None:
        """clock: any monotonic time [s]."""
        self._log = log
        self._clock = clock
        self._throttle = Throttle()
        self._said: dict[str, list[Remark]] = {SENSORS: [], WALK: [], COMMANDS: []}
        self.rejected: Counter[str] = Counter()
        """Refused messages per topic."""

    def tell(self, group: str, level: Level, key: str, text: str, burst: int = 1) -> None:
        """Into the next report; into the log `burst` times per key and period."""
        said = self._said[group]
        if len(said) < _PER_REPORT:
            said.append(Remark(level, text))
        held_back = self._throttle.allow(key, self._clock(), burst)
        if held_back is not None:
            more = f" ({held_back} more like it)" if held_back else ""
            self._log(level, text + more)

    def take(self) -> dict[str, tuple[Remark, ...]]:
        """What was said since the last call, by group."""
        taken = {group: tuple(said) for group, said in self._said.items()}
        for said in self._said.values():
            said.clear()
        return taken
