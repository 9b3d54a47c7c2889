"""The executable `lola_server`: a simulated NAO V6 behind LoLA's socket."""

from robot_core.ros.executable import executable

main = executable(
    "lola_server",
    "Simulate a NAO V6 behind LoLA's socket; ground truth over ROS.",
    "sim_bridge.lola.node:LolaServerNode",
    loop="sim_bridge.lola.node:drive",
)

if __name__ == "__main__":
    raise SystemExit(main())
