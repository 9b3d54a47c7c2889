"""The executable `vision`: images to percepts as a ROS 2 node."""

from robot_core.ros.executable import executable

main = executable(
    "vision",
    "See: images, camera_info, joint_states, gait/torso_pose in; vision/* out.",
    "nao_soccer.ros.vision_node:VisionNode",
)

if __name__ == "__main__":
    raise SystemExit(main())
