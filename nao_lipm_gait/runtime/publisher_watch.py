"""Topics that have more publishers than they should."""

from collections.abc import Callable
from dataclasses import dataclass

from nao_lipm_gait.runtime.diagnostics import COMMANDS, SENSORS, WALK, Diagnostics
from robot_core.log import Level


@dataclass(frozen=True, slots=True)
class PublisherCounts:
    """Publishers on the topics of this gait, as discovery sees them.

    Attributes:
        cmd_vel: Senders of velocity commands.
        joint_states: Robots.
        joint_command: Gaits, this one included.
        mismatched: Senders of `cmd_vel` with another message type, described.
    """

    cmd_vel: int = 1
    joint_states: int = 1
    joint_command: int = 1
    mismatched: str = ""


class PublisherWatch:
    """Reports topics that have more publishers than they should.

    Discovery keeps a process that was killed until its lease ends. A second publisher is therefore
    logged only if it is still there after that time. The reports show it at once.

    Args:
        diagnostics: Takes what was found.
        clock: Any monotonic time [s].
    """

    LEASE = 25.0
    """[s] The default lease of Fast DDS is 20 s, of Cyclone DDS 10 s."""

    def __init__(self, diagnostics: Diagnostics, clock: Callable[[], float]) -> None:
        self._diagnostics = diagnostics
        self._clock = clock
        self._since: dict[str, float] = {}

    def update(self, counts: PublisherCounts) -> None:
        """Compare the numbers with those that are allowed; to be called once per second."""
        n = counts.joint_states
        self._check(
            "joint_states", n, SENSORS, Level.ERROR,
            f"{n} publishers on joint_states; allowed: one robot; does another run share this "
            "ROS_DOMAIN_ID?",
        )  # fmt: skip
        n = counts.joint_command
        self._check(
            "joint_command", n, WALK, Level.ERROR,
            f"{n} publishers on joint_command; allowed: one gait; the simulated robot "
            "executes only the commands of the first",
        )  # fmt: skip
        n = counts.cmd_vel
        self._check(
            "cmd_vel", n, COMMANDS, Level.WARN,
            f"{n} publishers on cmd_vel; the newest command counts",
        )  # fmt: skip
        if counts.mismatched:
            self._diagnostics.begin(COMMANDS, Level.ERROR, "cmd_vel type", counts.mismatched)
        else:
            self._diagnostics.end("cmd_vel type", "every sender of cmd_vel uses the right type")

    def _check(self, topic: str, count: int, group: str, level: Level, text: str) -> None:
        key = f"publishers of {topic}"
        if count <= 1:
            self._since.pop(topic, None)
            self._diagnostics.end(key, f"one publisher on {topic} again")
            return
        now = self._clock()
        if now - self._since.setdefault(topic, now) > self.LEASE:
            self._diagnostics.begin(group, level, key, text)
        else:
            self._diagnostics.remark(group, level, text)
