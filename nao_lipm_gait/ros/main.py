"""The executable `gait`: the gait as a ROS 2 node."""

from collections.abc import Sequence

from nao_lipm_gait.ros.process import StopRequest, run, spin

NAME = "gait"
DESCRIPTION = "Walk a NAO: cmd_vel, joint_states and imu/data in, joint_command out."


def main(args: Sequence[str] | None = None) -> int:
    """Run the node until Ctrl-C or SIGTERM; returns the exit status."""
    stop = StopRequest()
    stop.install()
    # Imported late: it takes a second, in which a signal must already end the process quietly.
    from nao_lipm_gait.ros.node import GaitNode

    return run(NAME, DESCRIPTION, GaitNode, spin, args, stop)


if __name__ == "__main__":
    raise SystemExit(main())
