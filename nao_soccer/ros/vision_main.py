"""The executable `vision`: images to percepts as a ROS 2 node."""

import signal
from collections.abc import Sequence

NAME = "vision"
DESCRIPTION = "See: images, camera_info, joint_states, gait/torso_pose in; vision/* out."


def main(args: Sequence[str] | None = None) -> int:
    """Run the node until Ctrl-C or SIGTERM; returns the exit status."""
    # Everything is imported after this line: Ctrl-C must end the process quietly from the start.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    from robot_core.ros.process import StopRequest, run, spin

    stop = StopRequest()
    stop.install()
    from nao_soccer.ros.vision_node import VisionNode

    return run(NAME, DESCRIPTION, VisionNode, spin, args, stop)


if __name__ == "__main__":
    raise SystemExit(main())
