"""The executable `gait`: the gait as a ROS 2 node."""

from robot_core.ros.executable import executable

main = executable(
    "gait",
    "Walk a NAO: cmd_vel, joint_states and imu/data in, joint_command out.",
    "nao_lipm_gait.ros.node:GaitNode",
)

if __name__ == "__main__":
    raise SystemExit(main())
