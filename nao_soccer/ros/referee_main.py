"""The executable `referee`: keeps the rules of a match as a ROS 2 node."""

from robot_core.ros.executable import executable

main = executable(
    "referee",
    "Referee: ground truth of ball and robots in; game_state, put_ball and UDP out.",
    "nao_soccer.ros.referee_node:RefereeNode",
)

if __name__ == "__main__":
    raise SystemExit(main())
