"""A ROS domain for one run, so that two runs on one machine never meet."""

import itertools
import os
import socket

RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
FIRST, LAST = 1, 101
"""On Linux the ports of higher domains overlap with those of outgoing connections."""

_turn = itertools.count()


def stay_local() -> None:
    """Talk to this machine alone, unless the user has said how far; to be called before rclpy.init.

    Whoever reaches a topic commands the robot: the network is opened on purpose or not at all.
    """
    os.environ.setdefault(RANGE, "LOCALHOST")


class DomainClaim:
    """Holds a ROS_DOMAIN_ID until `release` or the end of the process, however that comes.

    The claim is a name in Linux's abstract socket namespace: the kernel frees it with the process,
    so nothing is left behind. Only runs that claim see each other; a domain that somebody set by
    hand is not known here.
    """

    def __init__(self) -> None:
        # Never the same twice in a row: late messages of a run that was killed may still be there.
        start = os.getpid() + next(_turn)
        count = LAST - FIRST + 1
        for offset in range(count):
            domain = FIRST + (start + offset) % count
            holder = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
            try:
                holder.bind(f"\0nao_lipm_gait_domain_{domain}")
            except OSError:
                holder.close()
                continue
            self.domain = domain
            self._holder = holder
            return
        raise OSError(f"all ROS domains from {FIRST} to {LAST} are claimed")

    def environment(self) -> dict[str, str]:
        """A copy of the environment for processes of this run: this domain, this machine only."""
        return {
            **os.environ,
            "ROS_DOMAIN_ID": str(self.domain),
            RANGE: "LOCALHOST",
        }

    def release(self) -> None:
        self._holder.close()

    def __enter__(self) -> "DomainClaim":
        return self

    def __exit__(self, *_: object) -> None:
        self.release()
