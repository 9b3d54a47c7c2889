"""The executable `sim_bridge`: a simulated robot behind the topics of a real one."""

from robot_core.ros.executable import executable

main = executable(
    "sim_bridge",
    "Simulate a robot: joint_command in; joint_states, imu/data and ground truth out.",
    "sim_bridge.ros.node:BridgeNode",
    loop="sim_bridge.ros.stepping:drive",
)

if __name__ == "__main__":
    raise SystemExit(main())
