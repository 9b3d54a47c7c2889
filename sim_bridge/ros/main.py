"""The executable `sim_bridge`: a simulated robot behind the topics of a real one."""

import signal
from collections.abc import Sequence

NAME = "sim_bridge"
DESCRIPTION = "Simulate a robot: joint_command in; joint_states, imu/data and ground truth out."


def main(args: Sequence[str] | None = None) -> int:
    """Run the node until Ctrl-C or SIGTERM; returns the exit status."""
    # Everything is imported after this line: Ctrl-C must end the process quietly from the start.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    from robot_core.ros.process import StopRequest, run

    stop = StopRequest()
    stop.install()
    from sim_bridge.ros.node import BridgeNode
    from sim_bridge.ros.stepping import drive

    return run(NAME, DESCRIPTION, BridgeNode, drive, args, stop)


if __name__ == "__main__":
    raise SystemExit(main())
