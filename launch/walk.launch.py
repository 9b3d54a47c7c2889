"""Start the gait and the simulated robot: `ros2 launch nao_lipm_gait walk.launch.py gui:=true`.

An argument that is left out leaves the node's own default in place.
"""

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction, Shutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

# name, type, nodes that take it, meaning (default)
ARGUMENTS = (
    ("urdf", str, ("sim_bridge", "gait"), "robot: shipped name or URDF file (nao_h21_v33)"),
    ("gui", bool, ("sim_bridge",), "open the window of the physics engine (false)"),
    ("engine", str, ("sim_bridge",), "physics engine (pybullet)"),
    ("plant", str, ("sim_bridge",), "plant: shipped name or YAML file (reference)"),
    ("robot_seed", int, ("sim_bridge",), "which individual robot; -1 = the nominal one (0)"),
    ("sensor_delay", float, ("sim_bridge",), "age of the sensors when published [s] (the plant's)"),
    ("real_time_factor", float, ("sim_bridge",), "speed; 0 = as fast as possible (1.0)"),
    ("lockstep", bool, ("sim_bridge",), "physics waits for the gait: deterministic (false)"),
    ("start_state", str, ("sim_bridge",), "how the robot starts (stand)"),
    ("push_duration", float, ("sim_bridge",), "how long a push acts [s] (0.1)"),
    ("preset", str, ("gait",), "gait parameters: shipped name or YAML file (default)"),
    ("feedback", bool, ("gait",), "false walks open loop (the preset's)"),
    ("feedback_delay", float, ("gait",), "sensor delay plus motor lag [s] (the preset's)"),
    ("command_interface", str, ("gait",),
     "joint_state, forward_command or joint_trajectory (joint_state)"),
    ("enable_stamped_cmd_vel", bool, ("gait",), "cmd_vel is a TwistStamped (false)"),
    ("cmd_vel_timeout", float, ("gait",), "an older velocity command means stop [s] (0.5)"),
)  # fmt: skip

KINDS = {int: "a whole number", float: "a number", bool: "true or false", str: "text"}


def _value(context: LaunchContext, argument: str, kind: type) -> ParameterValue:
    value = ParameterValue(LaunchConfiguration(argument), value_type=kind)
    try:
        value.evaluate(context)
    except ValueError as error:
        got = LaunchConfiguration(argument).perform(context)
        raise ValueError(f"{argument}: got {got!r}; allowed: {KINDS[kind]}") from error
    return value


def _node(context: LaunchContext, name: str) -> Node:
    given = {
        argument: _value(context, argument, kind)
        for argument, kind, nodes, _ in ARGUMENTS
        if name in nodes and LaunchConfiguration(argument).perform(context)
    }
    # The bridge makes the simulated time and lives on the wall clock itself.
    given["use_sim_time"] = name != "sim_bridge"
    return Node(
        package="nao_lipm_gait",
        executable=name,
        name=name,
        namespace=LaunchConfiguration("namespace"),
        output="screen",
        parameters=[given],
        on_exit=Shutdown(reason=f"{name} has ended"),
    )


def _nodes(context: LaunchContext) -> list[Node]:
    return [_node(context, name) for name in ("sim_bridge", "gait")]


def generate_launch_description() -> LaunchDescription:
    """One argument per parameter of the two nodes, and the nodes."""
    return LaunchDescription(
        [
            DeclareLaunchArgument("namespace", default_value="", description="of both nodes"),
            *(
                DeclareLaunchArgument(name, default_value="", description=meaning)
                for name, _, _, meaning in ARGUMENTS
            ),
            OpaqueFunction(function=_nodes),
        ]
    )
