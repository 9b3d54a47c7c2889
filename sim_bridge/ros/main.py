"""The executable `sim_bridge`: a simulated robot behind the topics of a real one."""

from collections.abc import Sequence

from nao_lipm_gait.ros.process import StopRequest

NAME = "sim_bridge"
DESCRIPTION = "Simulate a robot: joint_command in; joint_states, imu/data and ground truth out."


def main(args: Sequence[str] | None = None) -> int:
    """Run the node until Ctrl-C or SIGTERM; returns the exit status."""
    stop = StopRequest()
    stop.install()
    # After `install`: these imports take about a second, and Ctrl-C must end them quietly too.
    from nao_lipm_gait.ros.process import run
    from sim_bridge.ros.node import BridgeNode
    from sim_bridge.ros.stepping import drive

    return run(NAME, DESCRIPTION, BridgeNode, drive, args, stop)


if __name__ == "__main__":
    raise SystemExit(main())
