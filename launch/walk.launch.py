"""Start the gait and the simulated robot: `ros2 launch nao_lipm_gait walk.launch.py gui:=true`."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, Shutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

# name, default, type, which node takes it, meaning
ARGUMENTS = (
    ("urdf", "nao_h21_v33", str, "both", "robot model: a shipped name or the path of a URDF file"),
    ("gui", "false", bool, "bridge", "open the window of the physics engine"),
    ("engine", "pybullet", str, "bridge", "physics engine"),
    ("plant", "reference", str, "bridge", "plant: a shipped name or the path of a YAML file"),
    ("robot_seed", "0", int, "bridge", "which individual robot; -1 is the nominal one"),
    ("sensor_delay", "0.04", float, "bridge", "age of the sensor data when published [s]"),
    ("real_time_factor", "1.0", float, "bridge", "speed of simulated time; 0 = as fast as it goes"),
    ("lockstep", "false", bool, "bridge", "physics waits for the gait's answer: deterministic"),
    ("start_state", "stand", str, "bridge", "how the robot starts"),
    ("preset", "default", str, "gait", "gait parameters: a shipped name or a YAML file"),
    ("feedback", "true", bool, "gait", "false walks open loop"),
    ("command_interface", "joint_state", str, "gait",
     "joint_state, forward_command or joint_trajectory"),
    ("enable_stamped_cmd_vel", "false", bool, "gait", "cmd_vel is a TwistStamped"),
)


def _parameters(node: str) -> dict[str, ParameterValue]:
    return {
        name: ParameterValue(LaunchConfiguration(name), value_type=kind)
        for name, _, kind, taker, _ in ARGUMENTS
        if taker in (node, "both")
    }


def generate_launch_description() -> LaunchDescription:
    namespace = LaunchConfiguration("namespace")
    return LaunchDescription(
        [
            DeclareLaunchArgument("namespace", default_value="", description="of both nodes"),
            *(
                DeclareLaunchArgument(name, default_value=default, description=meaning)
                for name, default, _, _, meaning in ARGUMENTS
            ),
            Node(
                package="nao_lipm_gait",
                executable="sim_bridge",
                name="sim_bridge",
                namespace=namespace,
                output="screen",
                parameters=[_parameters("bridge")],
                on_exit=Shutdown(reason="the simulated robot is gone"),
            ),
            Node(
                package="nao_lipm_gait",
                executable="gait",
                name="gait",
                namespace=namespace,
                output="screen",
                parameters=[{"use_sim_time": True}, _parameters("gait")],
                on_exit=Shutdown(reason="the gait is gone"),
            ),
        ]
    )
