"""The executable `gait`: the gait as a ROS 2 node."""

import signal
from collections.abc import Sequence

NAME = "gait"
DESCRIPTION = "Walk a NAO: cmd_vel, joint_states and imu/data in, joint_command out."


def main(args: Sequence[str] | None = None) -> int:
    """Run the node until Ctrl-C or SIGTERM; returns the exit status."""
    # Everything is imported after this line: Ctrl-C must end the process quietly from the start.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    from robot_core.ros.process import StopRequest, run, spin

    stop = StopRequest()
    stop.install()
    from nao_lipm_gait.ros.node import GaitNode

    return run(NAME, DESCRIPTION, GaitNode, spin, args, stop)


if __name__ == "__main__":
    raise SystemExit(main())
