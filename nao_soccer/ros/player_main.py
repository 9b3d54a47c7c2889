"""The executable `player`: world model, behaviour and team of one robot as a ROS 2 node."""

from robot_core.ros.executable import executable

main = executable(
    "player",
    "Play: vision/*, odom and gait/support in; cmd_vel, gait/*, pose and ball out.",
    "nao_soccer.ros.player_node:PlayerNode",
)

if __name__ == "__main__":
    raise SystemExit(main())
