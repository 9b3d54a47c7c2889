"""The executable `referee`: keeps the rules of a match as a ROS 2 node."""

import signal
from collections.abc import Sequence

NAME = "referee"
DESCRIPTION = "Referee: ground truth of ball and robots in; game_state, put_ball and UDP out."


def main(args: Sequence[str] | None = None) -> int:
    """Run the node until Ctrl-C or SIGTERM; returns the exit status."""
    # Everything is imported after this line: Ctrl-C must end the process quietly from the start.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    from robot_core.ros.process import StopRequest, run, spin

    stop = StopRequest()
    stop.install()
    from nao_soccer.ros.referee_node import RefereeNode

    return run(NAME, DESCRIPTION, RefereeNode, spin, args, stop)


if __name__ == "__main__":
    raise SystemExit(main())
