"""Start the gait and the simulated robot: `ros2 launch nao_lipm_gait walk.launch.py rviz:=true`.

An argument that is left out leaves the node's own default in place.
"""

import time
from pathlib import Path
from typing import TYPE_CHECKING

from launch import LaunchContext, LaunchDescription
from launch.action import Action
from launch.actions import (
    DeclareLaunchArgument,
    ExecuteProcess,
    OpaqueFunction,
    SetEnvironmentVariable,
    Shutdown,
)
from launch.substitutions import EnvironmentVariable, LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

if TYPE_CHECKING:
    from nao_lipm_gait.robot import RobotDescription

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
    ("ball", bool, ("sim_bridge",), "a ball on the floor (false)"),
    ("publish_clock", bool, ("sim_bridge",), "false for all but one of several robots (true)"),
    ("start_state", str, ("sim_bridge",), "how the robot starts (stand)"),
    ("push_duration", float, ("sim_bridge",), "how long a push acts [s] (0.1)"),
    ("preset", str, ("gait",), "gait parameters: shipped name or YAML file (default)"),
    ("motions", str, ("gait",), "folder of motion files (those that are shipped)"),
    ("control_period", float, ("gait",), "distance of two joint states [s] (0.01)"),
    ("feedback", bool, ("gait",), "false walks open loop (the preset's)"),
    ("feedback_delay", float, ("gait",), "sensor delay plus motor lag [s] (the preset's)"),
    ("command_interface", str, ("gait",),
     "joint_state, forward_command or joint_trajectory (joint_state)"),
    ("enable_stamped_cmd_vel", bool, ("gait",), "cmd_vel is a TwistStamped (false)"),
    ("cmd_vel_timeout", float, ("gait",), "an older velocity command means stop [s] (0.5)"),
)  # fmt: skip

# name, default, meaning: what is started beside the two nodes
EXTRAS = (
    ("rviz", "false", "open RViz with the robot, its footsteps and pendulum"),
    ("record", "", "record everything: true, or a new folder for the bag"),
    ("robot_state_publisher", "auto",
     "TF of the robot's links: true, false, or auto: where it is needed and installed"),
)  # fmt: skip
RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
TRUE, FALSE = ("true", "1"), ("false", "0", "")

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


def _text(context: LaunchContext, argument: str) -> str:
    return LaunchConfiguration(argument).perform(context)


def _is_on(context: LaunchContext, argument: str) -> bool:
    got = _text(context, argument)
    if got.lower() not in (*TRUE, *FALSE):
        raise ValueError(f"{argument}: got {got!r}; allowed: true or false")
    return got.lower() in TRUE


def _rviz(context: LaunchContext) -> list[Action]:
    if not _is_on(context, "rviz"):
        return []
    from nao_lipm_gait.resources import share

    return [
        Node(
            package="rviz2",
            executable="rviz2",
            namespace=LaunchConfiguration("namespace"),
            arguments=["-d", str(share("config", "rviz", "walk.rviz"))],
            parameters=[{"use_sim_time": True}],
            output="log",
        )
    ]


def _recorder(context: LaunchContext) -> list[Action]:
    asked = _text(context, "record")
    if asked.lower() in FALSE:
        return []
    folder = time.strftime("walk_%Y%m%d_%H%M%S") if asked.lower() in TRUE else asked
    if Path(folder).exists():
        raise ValueError(f"record: got {folder!r}; allowed: a folder that does not exist yet")
    command = ["ros2", "bag", "record", "--all", "--storage", "mcap", "--output", folder]
    return [ExecuteProcess(cmd=[*command, "--use-sim-time"], output="screen")]


def _state_publisher(context: LaunchContext) -> list[Action]:
    """The links of the robot, and where its body stands over its feet.

    The gait broadcasts odom -> base_footprint; from there on an upright body at its standing height
    is drawn.
    """
    asked = _text(context, "robot_state_publisher").lower()
    if asked != "auto" and not _is_on(context, "robot_state_publisher"):
        return []
    if asked == "auto" and not (_is_on(context, "rviz") and _installed("robot_state_publisher")):
        return []
    from nao_lipm_gait.robot import load_robot

    robot = load_robot(_text(context, "urdf") or "nao_h21_v33")
    x, z = _footprint_in_base(robot)
    namespace = LaunchConfiguration("namespace")
    return [
        Node(
            package="robot_state_publisher",
            executable="robot_state_publisher",
            namespace=namespace,
            parameters=[{"robot_description": ParameterValue(robot.urdf, value_type=str),
                         "use_sim_time": True}],
            # The bridge publishes the same text already.
            remappings=[("robot_description", "robot_state_publisher/robot_description")],
        ),
        Node(
            package="tf2_ros",
            executable="static_transform_publisher",
            namespace=namespace,
            arguments=["--x", f"{-x:.6f}", "--z", f"{-z:.6f}",
                       "--frame-id", "base_footprint", "--child-frame-id", robot.base_frame],
            parameters=[{"use_sim_time": True}],
        ),
    ]  # fmt: skip


def _footprint_in_base(robot: "RobotDescription") -> tuple[float, float]:
    """x, z [m] of the middle between the soles in the base link, in the stand pose."""
    import pinocchio as pin

    model = pin.buildModelFromXML(robot.urdf)
    data = model.createData()
    q = pin.neutral(model)
    for name, angle in zip(robot.joint_names, robot.stand_pose, strict=True):
        q[model.joints[model.getJointId(name)].idx_q] = angle
    pin.framesForwardKinematics(model, data, q)
    base, *soles = (
        data.oMf[model.getFrameId(name, pin.FrameType.BODY)]
        for name in (robot.base_frame, *robot.sole_frames)
    )
    places = [base.actInv(sole).translation for sole in soles]
    return sum(p[0] for p in places) / 2, sum(p[2] for p in places) / 2


def _installed(package: str) -> bool:
    from ament_index_python.packages import PackageNotFoundError, get_package_prefix

    try:
        get_package_prefix(package)
    except PackageNotFoundError:
        return False
    return True


def _extras(context: LaunchContext) -> list[Action]:
    return [*_state_publisher(context), *_rviz(context), *_recorder(context)]


def generate_launch_description() -> LaunchDescription:
    """One argument per parameter of the two nodes, what goes beside them, and all of it."""
    return LaunchDescription(
        [
            # This machine alone, also for what is started beside the nodes, unless told otherwise.
            SetEnvironmentVariable(
                RANGE, EnvironmentVariable(RANGE, default_value="LOCALHOST")
            ),
            DeclareLaunchArgument(
                "namespace", default_value="", description="namespace of both nodes"
            ),
            *(
                DeclareLaunchArgument(name, default_value="", description=meaning)
                for name, _, _, meaning in ARGUMENTS
            ),
            *(
                DeclareLaunchArgument(name, default_value=default, description=meaning)
                for name, default, meaning in EXTRAS
            ),
            OpaqueFunction(function=_nodes),
            OpaqueFunction(function=_extras),
        ]
    )
