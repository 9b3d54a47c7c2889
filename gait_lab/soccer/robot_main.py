"""The executable `robot`: gait, vision and player of one robot in one process.

The nodes are those of their own executables, with their names, topics and parameters; a parameter
is given to one of them as `NODE:NAME`. Fewer processes look for each other, and messages between
the three stay in this one.
"""

from typing import TYPE_CHECKING

from robot_core.ros.executable import executable

if TYPE_CHECKING:
    from rclpy.node import Node

main = executable(
    "robot",
    "Walk, see and play: the nodes gait, vision and player in one process.",
    "gait_lab.soccer.robot_main:gait",
    "nao_soccer.ros.vision_node:VisionNode",
    "nao_soccer.ros.player_node:PlayerNode",
)


def gait() -> "Node":
    """The gait, without the times of arrival, which the shared executor does not tell."""
    from nao_lipm_gait.ros.node import GaitNode

    return GaitNode(times_arrival=False)


if __name__ == "__main__":
    raise SystemExit(main())
