"""The executable `lola_bridge`: a NAO V6 behind the gait's topics."""

import signal
from collections.abc import Sequence

NAME = "lola_bridge"
DESCRIPTION = "A NAO V6 through LoLA: joint_command in; joint_states, imu/data, soles, battery out."


def main(args: Sequence[str] | None = None) -> int:
    """Run the node until Ctrl-C or SIGTERM; returns the exit status."""
    # Everything is imported after this line: Ctrl-C must end the process quietly from the start.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    from robot_core.ros.process import StopRequest, run

    stop = StopRequest()
    stop.install()
    from lola_bridge.ros.node import LolaBridgeNode, serve

    return run(NAME, DESCRIPTION, LolaBridgeNode, serve, args, stop)


if __name__ == "__main__":
    raise SystemExit(main())
