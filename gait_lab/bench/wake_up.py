"""How late the machine wakes a process that does nothing but sleep to given times.

Command line: python wake_up.py BEGIN PERIOD COUNT. It imports nothing of the package, so it
starts at once.
"""

import json
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import AbstractContextManager
from itertools import pairwise


def sleep_until(due: float) -> float:
    """Sleep until `due` on the monotonic clock [s]; how late this process woke up [s]."""
    time.sleep(max(0.0, due - time.monotonic()))
    return time.monotonic() - due


class Sleeper(AbstractContextManager["Sleeper"]):
    """A process that sleeps to deadlines and computes nothing, beside one that does.

    It has the priority of this process and wakes up in the middle between the deadlines of the
    other, so its delay is the machine's own: of the kernel and of all other load.

    Args:
        begin: First deadline of the other process on the monotonic clock [s].
        period: Time between two deadlines [s].
        count: Number of deadlines.
    """

    def __init__(self, begin: float, period: float, count: int) -> None:
        times = (repr(begin + 0.5 * period), repr(period), str(count))
        self._process = subprocess.Popen(
            [sys.executable, __file__, *times], stdout=subprocess.PIPE
        )

    def lateness(self) -> tuple[float, ...]:
        """How late it woke up at each deadline [s]; waits for its end."""
        output, _ = self._process.communicate()
        return tuple(json.loads(output))

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.wait()


def deviations(times: Sequence[float], period: float) -> tuple[float, ...]:
    """How much each interval between these times differs from the period, sorted; same units."""
    return tuple(sorted(abs(after - before - period) for before, after in pairwise(times)))


def main() -> None:
    """Sleep to the deadlines of the command line and print how late each wake-up was [s]."""
    begin, period, count = float(sys.argv[1]), float(sys.argv[2]), int(sys.argv[3])
    json.dump([sleep_until(begin + index * period) for index in range(count)], sys.stdout)


if __name__ == "__main__":
    main()
