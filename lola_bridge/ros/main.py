"""The executable `lola_bridge`: a NAO V6 behind the gait's topics."""

from robot_core.ros.executable import executable

main = executable(
    "lola_bridge",
    "A NAO V6 through LoLA: joint_command in; joint_states, imu/data, soles, battery out.",
    "lola_bridge.ros.node:LolaBridgeNode",
    loop="lola_bridge.ros.node:serve",
)

if __name__ == "__main__":
    raise SystemExit(main())
