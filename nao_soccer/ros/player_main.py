"""The executable `player`: world model, behaviour and team of one robot as a ROS 2 node."""

import signal
from collections.abc import Sequence

NAME = "player"
DESCRIPTION = "Play: vision/*, odom and gait/support in; cmd_vel, gait/*, pose and ball out."


def main(args: Sequence[str] | None = None) -> int:
    """Run the node until Ctrl-C or SIGTERM; returns the exit status."""
    # Everything is imported after this line: Ctrl-C must end the process quietly from the start.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    from robot_core.ros.process import StopRequest, run, spin

    stop = StopRequest()
    stop.install()
    from nao_soccer.ros.player_node import PlayerNode

    return run(NAME, DESCRIPTION, PlayerNode, spin, args, stop)


if __name__ == "__main__":
    raise SystemExit(main())
