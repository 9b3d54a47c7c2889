"""The executable `lola_server`: a simulated NAO V6 behind LoLA's socket."""

import signal
from collections.abc import Sequence

NAME = "lola_server"
DESCRIPTION = "Simulate a NAO V6 behind LoLA's socket; ground truth over ROS."


def main(args: Sequence[str] | None = None) -> int:
    """Run the node until Ctrl-C or SIGTERM; returns the exit status."""
    # Everything is imported after this line: Ctrl-C must end the process quietly from the start.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    from robot_core.ros.process import StopRequest, run

    stop = StopRequest()
    stop.install()
    from sim_bridge.lola.node import LolaServerNode, drive

    return run(NAME, DESCRIPTION, LolaServerNode, drive, args, stop)


if __name__ == "__main__":
    raise SystemExit(main())
