"""The executable `gait`: a thin ROS 2 node around the gait core."""

from collections.abc import Sequence

from nao_lipm_gait.ros.stop_request import StopRequest

NAME = "gait"
DESCRIPTION = "Walk a NAO: cmd_vel, joint_states and imu/data in, joint_command out."


def main(args: Sequence[str] | None = None) -> int:
    """Run the node until Ctrl-C or SIGTERM; the exit status."""
    stop = StopRequest()
    stop.install()
    # Late, because these imports take a second in which Ctrl-C shall be clean too.
    from nao_lipm_gait.ros.node import GaitNode
    from nao_lipm_gait.ros.process import run, spin

    return run(NAME, DESCRIPTION, GaitNode, spin, args, stop)


if __name__ == "__main__":
    raise SystemExit(main())
