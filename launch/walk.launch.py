"""Start the gait and the simulated robot: `ros2 launch nao_lipm_gait walk.launch.py rviz:=true`.

With `scene:=pitch` the world has several robots. Each has a gait in a namespace of its name, and
transforms on the `tf` of that namespace, because all robots have the same frames. With
`vision:=true` each robot of a scene that has cameras has a `vision` too.

An argument that is left out leaves the node's own default in place. All arguments are checked
before anything starts; everything ends if a node or the recorder ends.
"""

import time
from pathlib import Path
from typing import NamedTuple

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

from robot_core.errors import NaoGaitError

# name, type, nodes that take it, meaning (default)
ARGUMENTS = (
    ("scene", str, ("sim_bridge", "vision"), "floor, pitch, pitch_small or a YAML file (floor)"),
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
    ("cameras", bool, ("sim_bridge",), "publish images of the robots' cameras (false)"),
    ("camera_rate", float, ("sim_bridge",), "images per second of each camera [Hz] (10.0)"),
    ("camera_width", int, ("sim_bridge",), "columns of an image (320)"),
    ("camera_height", int, ("sim_bridge",), "rows of an image (240)"),
    ("camera_delay", float, ("sim_bridge",), "age of the images when published [s] (the plant's)"),
    ("camera_noise", float, ("sim_bridge",), "noise of a pixel, of 255 (the plant's)"),
    ("colors", str, ("vision",), "colour classes: shipped table or YAML file (pitch)"),
    ("preset", str, ("gait",), "gait parameters: shipped name or YAML file (default)"),
    ("motions", str, ("gait",), "folder of motion files (those that are shipped)"),
    ("calibration", str, ("gait",), "calibration file of the robot (none)"),
    ("control_period", float, ("gait",), "distance of two joint states [s] (0.01)"),
    ("feedback", bool, ("gait",), "false walks open loop (the preset's)"),
    ("feedback_delay", float, ("gait",), "sensor delay plus motor lag [s] (the preset's)"),
    ("command_interface", str, ("gait",),
     "joint_state, forward_command or joint_trajectory (joint_state)"),
    ("enable_stamped_cmd_vel", bool, ("gait",), "cmd_vel is a TwistStamped (false)"),
    ("bias_wait", float, ("gait",), "longest stand until the gyro's bias is known [s] (20.0)"),
    ("hot_speed", float, ("gait",), "factor on the velocity while a motor is hot (1.0)"),
    ("sensor_age", bool, ("gait",), "measure the age of the sensors, not in lockstep (false)"),
    ("coast", bool, ("gait",), "walk on while single messages are lost, not in lockstep (false)"),
    ("cmd_vel_timeout", float, ("gait",), "an older velocity command means stop [s] (0.5)"),
)  # fmt: skip

# name, default, meaning: what is started beside bridge and gait
EXTRAS = (
    ("vision", "false", "what each robot with cameras sees; needs a field, publishes images"),
    ("rviz", "false", "open RViz with the robot, its footsteps and pendulum"),
    ("record", "", "record everything: true, or a new folder for the bag"),
    ("robot_state_publisher", "auto",
     "transforms of the robot's links: true, false, or auto (if that package is installed)"),
)  # fmt: skip
OF_THE_FLOOR = ("urdf", "robot_seed", "start_state", "ball", "calibration")
"""Arguments for the robot of the floor: those of another scene differ from each other."""
RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
TRUE, FALSE = ("true", "1"), ("false", "0", "")

TRANSFORMS = [("/tf", "tf"), ("/tf_static", "tf_static")]
"""Remappings of the nodes of one robot out of several."""

KINDS = {int: "a whole number", float: "a number", bool: "true or false", str: "text"}


def _value(context: LaunchContext, argument: str, kind: type) -> ParameterValue:
    value = ParameterValue(LaunchConfiguration(argument), value_type=kind)
    try:
        value.evaluate(context)
    except ValueError as error:
        raise NaoGaitError(argument, _text(context, argument), KINDS[kind]) from error
    return value


def _text(context: LaunchContext, argument: str) -> str:
    return LaunchConfiguration(argument).perform(context)


def _is_on(context: LaunchContext, argument: str) -> bool:
    got = _text(context, argument)
    if got.lower() not in (*TRUE, *FALSE):
        raise NaoGaitError(argument, got, "true or false")
    return got.lower() in TRUE


def _installed(package: str) -> bool:
    from ament_index_python.packages import PackageNotFoundError, get_package_prefix

    try:
        get_package_prefix(package)
    except PackageNotFoundError:
        return False
    return True


def _require(argument: str, got: str, package: str) -> None:
    if not _installed(package):
        raise NaoGaitError(argument, got, f"false, or install the package {package}")


# -- what is started -------------------------------------------------------------------------------


class Robot(NamedTuple):
    """A robot that gets a gait.

    Attributes:
        namespace: Of its topics.
        urdf: Shipped name or file.
        several: It is one of several in a scene.
        sees: It has cameras.
    """

    namespace: str
    urdf: str
    several: bool
    sees: bool = False


def _robots(context: LaunchContext) -> list[Robot]:
    from robot_core.robot import load_robot
    from sim_bridge.scene import FLOOR, load_scene

    namespace, asked = _text(context, "namespace"), _text(context, "scene")
    if asked in ("", FLOOR):
        return [Robot(namespace, _text(context, "urdf"), False)]
    scene = load_scene(asked)
    for argument in OF_THE_FLOOR:
        got = _text(context, argument)
        if got:
            allowed = f"nothing: it differs between the robots of scene {scene.name}"
            raise NaoGaitError(argument, got, allowed)
    return [
        Robot(f"{namespace}/{robot.name}", robot.urdf, True, bool(load_robot(robot.urdf).cameras))
        for robot in scene.robots
    ]


def _with_vision(context: LaunchContext, robots: list[Robot]) -> list[Robot]:
    """The robots that get a vision; the bridge then publishes images."""
    if not _is_on(context, "vision"):
        return []
    from nao_soccer.vision.settings import settings_of_scene
    from sim_bridge.scene import FLOOR

    asked = _text(context, "scene")
    if asked in ("", FLOOR):
        raise NaoGaitError("vision", "true", "false, or a scene with a field")
    settings_of_scene(asked)
    if _text(context, "cameras") and not _is_on(context, "cameras"):
        raise NaoGaitError("cameras", "false", "true, because vision needs images")
    context.launch_configurations["cameras"] = "true"
    return [robot for robot in robots if robot.sees]


def _everything(context: LaunchContext) -> list[Action]:
    """Check all arguments, then start all processes: an error here leaves nothing running."""
    robots = _robots(context)
    seeing = _with_vision(context, robots)
    return [
        *(each for robot in robots for each in _state_publisher(context, robot)),
        *(each for robot in robots for each in _rviz(context, robot)),
        *_recorder(context),
        _node(context, "sim_bridge"),
        *(_node(context, "gait", robot) for robot in robots),
        *(_node(context, "vision", robot) for robot in seeing),
    ]


def _node(context: LaunchContext, name: str, robot: Robot | None = None) -> Node:
    """One of the nodes; `robot`: whose gait or vision it is."""
    given = {
        argument: _value(context, argument, kind)
        for argument, kind, nodes, _ in ARGUMENTS
        if name in nodes and _text(context, argument)
    }
    # The bridge publishes the simulated time and itself uses the wall clock.
    given["use_sim_time"] = name != "sim_bridge"
    if robot is not None and robot.urdf:
        given["urdf"] = ParameterValue(robot.urdf, value_type=str)
    return Node(
        package="nao_lipm_gait",
        executable=name,
        name=name,
        namespace=LaunchConfiguration("namespace") if robot is None else robot.namespace,
        output="screen",
        parameters=[given],
        remappings=TRANSFORMS if robot is not None and robot.several else [],
        on_exit=Shutdown(reason=f"{name} has ended"),
    )


def _rviz(context: LaunchContext, robot: Robot) -> list[Action]:
    if not _is_on(context, "rviz"):
        return []
    _require("rviz", _text(context, "rviz"), "rviz2")
    from robot_core.resources import share

    return [
        Node(
            package="rviz2",
            executable="rviz2",
            namespace=robot.namespace,
            remappings=TRANSFORMS if robot.several else [],
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
        raise NaoGaitError("record", folder, "a folder that does not exist yet")
    for package in ("ros2bag", "rosbag2_storage_mcap"):
        _require("record", asked, package)
    command = ["ros2", "bag", "record", "--all", "--storage", "mcap", "--output", folder]
    return [
        ExecuteProcess(
            cmd=[*command, "--use-sim-time"],
            output="screen",
            on_exit=Shutdown(reason="the recorder has ended"),
        )
    ]


def _state_publisher(context: LaunchContext, robot: Robot) -> list[Action]:
    """The transforms of the robot's links; the gait publishes those from odom to the root link."""
    asked = _text(context, "robot_state_publisher").lower()
    if asked == "auto":
        if not _installed("robot_state_publisher"):
            return []
    elif not _is_on(context, "robot_state_publisher"):
        return []
    else:
        _require("robot_state_publisher", asked, "robot_state_publisher")
    from robot_core.robot import load_robot

    urdf = load_robot(robot.urdf or "nao_h21_v33").urdf
    return [
        Node(
            package="robot_state_publisher",
            executable="robot_state_publisher",
            namespace=robot.namespace,
            parameters=[{"robot_description": ParameterValue(urdf, value_type=str),
                         "use_sim_time": True}],
            # The bridge publishes the same text already.
            remappings=[
                ("robot_description", "robot_state_publisher/robot_description"),
                *(TRANSFORMS if robot.several else []),
            ],
        ),
    ]  # fmt: skip


def generate_launch_description() -> LaunchDescription:
    """Declare one argument per parameter of the nodes and per extra, and start everything."""
    return LaunchDescription(
        [
            # This machine alone, also for what is started beside the nodes, unless told otherwise.
            SetEnvironmentVariable(
                RANGE, EnvironmentVariable(RANGE, default_value="LOCALHOST")
            ),
            DeclareLaunchArgument(
                "namespace", default_value="", description="namespace of all nodes"
            ),
            *(
                DeclareLaunchArgument(name, default_value="", description=meaning)
                for name, _, _, meaning in ARGUMENTS
            ),
            *(
                DeclareLaunchArgument(name, default_value=default, description=meaning)
                for name, default, meaning in EXTRAS
            ),
            OpaqueFunction(function=_everything),
        ]
    )
