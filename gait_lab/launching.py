"""What the launch files start. Each parameter of a node is an argument of the launch.

An argument that is left out leaves the node's own default in place. All arguments are checked
before anything starts, as the nodes check them; everything ends if a node or the recorder ends.
"""

import difflib
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import yaml
from ament_index_python.packages import PackageNotFoundError, get_package_prefix
from launch.action import Action
from launch.actions import (
    DeclareLaunchArgument,
    ExecuteProcess,
    OpaqueFunction,
    SetEnvironmentVariable,
    Shutdown,
)
from launch.launch_context import LaunchContext
from launch.launch_description import LaunchDescription
from launch.substitutions import EnvironmentVariable
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from gait_lab.soccer.player_nodes import player_parameters, referee_ports
from nao_lipm_gait.calibration_file import calibration_of
from nao_lipm_gait.parameters import BY_NAME
from nao_lipm_gait.presets import preset_for
from nao_lipm_gait.ros import node as gait
from nao_soccer.ros import player_node, referee_node, vision_node
from nao_soccer.vision.colors import load_color_table
from nao_soccer.vision.settings import settings_of_scene
from robot_core.errors import NaoGaitError
from robot_core.motion.library import library_of
from robot_core.resources import share
from robot_core.robot import load_robot
from robot_core.ros.parameters import URDF
from robot_core.ros.process import domain_id
from robot_core.schema import Field, Number, Switch, read_yaml
from sim_bridge.engines.registry import check_installed
from sim_bridge.plant import load_plant
from sim_bridge.ros import parameters as bridge
from sim_bridge.scene import FLOOR, Scene, load_scene

PACKAGE = "nao_lipm_gait"
RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
TRANSFORMS = [("/tf", "tf"), ("/tf_static", "tf_static")]
"""Remappings of the nodes of one robot out of several: all robots have the same frames."""
OF_THE_FLOOR = (*(each.name for each in bridge.OF_THE_FLOOR), gait.CALIBRATION.name)
"""Arguments for the robot of the floor: those of another scene differ from each other."""
FIELDS: Mapping[str, Sequence[Field]] = {
    "sim_bridge": bridge.NODE_PARAMETERS,
    "gait": (*gait.NODE_PARAMETERS, BY_NAME["feedback"], BY_NAME["feedback_delay"]),
    "vision": (vision_node.SCENE, vision_node.COLORS),
    "player": (player_node.SCENE,),
    "referee": (
        referee_node.SCENE, referee_node.MINUTES, referee_node.KICK_OFF, referee_node.KEEPERS,
    ),
}  # fmt: skip
"""Parameters of each node that are arguments, by its executable."""


class Extra(NamedTuple):
    """An argument that is no parameter of a node."""

    name: str
    default: str
    meaning: str


EXTRAS = (
    Extra("namespace", "", "namespace of all nodes"),
    Extra("params_file", "", "YAML file of ROS parameters for all nodes; arguments come before it"),
    Extra("vision", "false", "what each robot with cameras sees; needs a field, publishes images"),
    Extra("rviz", "false", "open RViz with the robot, its footsteps and pendulum"),
    Extra("record", "", "record everything: true, or a new folder for the bag"),
    Extra("robot_state_publisher", "auto",
          "transforms of the robot's links: true, false, or auto (if that package is installed)"),
)  # fmt: skip


class Robot(NamedTuple):
    """A robot that gets a gait; `player`: parameters of its player, None without."""

    namespace: str
    urdf: str
    several: bool = False
    player: Mapping[str, Any] | None = None

    @property
    def sees(self) -> bool:
        """Whether it has cameras."""
        return bool(load_robot(self.urdf).cameras)


def describe(nodes: Sequence[str], defaults: Mapping[str, str]) -> LaunchDescription:
    """The launch of these nodes, with one argument for each of their parameters.

    Args:
        nodes: Executables; those of one robot are started for each robot of the scene.
        defaults: Arguments whose default is not that of the node.
    """
    fields = {field.name: field for name in nodes for field in FIELDS[name]}
    declared = [
        DeclareLaunchArgument(
            field.name,
            default_value=defaults.get(field.name, ""),
            description=f"{field.meaning} ({field.allowed}; default: {field.default})",
        )
        for field in fields.values()
    ]
    declared += [
        DeclareLaunchArgument(
            each.name, default_value=defaults.get(each.name, each.default), description=each.meaning
        )
        for each in EXTRAS
    ]
    known = {*fields, *(each.name for each in EXTRAS)}
    return LaunchDescription(
        [
            # This machine alone, also for what is started beside the nodes, unless told otherwise.
            SetEnvironmentVariable(RANGE, EnvironmentVariable(RANGE, default_value="LOCALHOST")),
            *declared,
            OpaqueFunction(function=lambda context: _Launch(context, nodes, known).everything()),
        ]
    )


class _Launch:
    """Checks all arguments, then names all processes: an error leaves nothing running."""

    def __init__(self, context: LaunchContext, nodes: Sequence[str], known: set[str]) -> None:
        self._text: Mapping[str, str] = context.launch_configurations
        self._refuse_misspelled(known)
        self._nodes = nodes
        self._scene, self._robots = self._find_robots()
        self._given = {name: self._arguments(FIELDS[name]) for name in nodes}
        if "referee" in nodes:
            if self._scene is None:
                raise NaoGaitError("scene", self._text["scene"], "a scene with a field and teams")
            self._given["referee"] |= referee_ports(domain_id())
        self._sees = self._wants_vision()
        if self._sees:
            self._given["sim_bridge"]["cameras"] = True
        self._files = self._parameter_files()

    def everything(self) -> list[Action]:
        """All processes."""
        extras = [
            *(each for robot in self._robots for each in self._state_publisher(robot)),
            *(each for robot in self._robots for each in self._rviz(robot)),
            *self._recorder(),
        ]
        takers = {
            "gait": self._robots,
            "vision": [robot for robot in self._robots if self._sees and robot.sees],
            "player": [robot for robot in self._robots if robot.player is not None],
        }
        return [
            *extras,
            self._node("sim_bridge"),
            *(self._node(name, robot) for name, robots in takers.items() for robot in robots),
            *([self._node("referee")] if "referee" in self._nodes else []),
        ]

    # -- arguments ---------------------------------------------------------------------------------

    def _refuse_misspelled(self, known: set[str]) -> None:
        # An including launch file may have arguments of its own: only what resembles ours is wrong.
        for name in self._text.keys() - known:
            likely = difflib.get_close_matches(name, known, 1, 0.8)
            if likely:
                raise NaoGaitError(name, self._text[name], f"no such argument; {likely[0]} is one")

    def _is_on(self, name: str) -> bool:
        return bool(_parsed(Switch(), name, self._text[name] or "false"))

    def _wants_vision(self) -> bool:
        """Whether robots get a vision; the bridge then publishes images."""
        if "player" not in self._nodes and not self._is_on("vision"):
            return False
        if self._scene is None:
            raise NaoGaitError("vision", "true", "false, or a scene with a field")
        settings_of_scene(self._text["scene"])
        if self._text["cameras"] and not self._is_on("cameras"):
            raise NaoGaitError("cameras", "false", "true, because vision needs images")
        return True

    def _arguments(self, fields: Sequence[Field]) -> dict[str, Any]:
        """The arguments that are given, as the nodes will check them."""
        loaders: Mapping[str, Callable[[str], object]] = {
            "scene": load_scene,
            "urdf": load_robot,
            "robot": load_robot,
            "plant": load_plant,
            "colors": load_color_table,
            "engine": check_installed,
            "preset": partial(_for_each, preset_for, self._robots),
            "motions": partial(_for_each, library_of, self._robots),
            "calibration": partial(_for_each, calibration_of, self._robots),
        }
        found = {}
        for field in fields:
            text = self._text[field.name]
            if not text or (field.name == "scene" and text == FLOOR):
                continue
            value = field.check(_parsed(field.kind, field.name, text))
            try:
                loaders.get(field.name, bool)(text)
            except NaoGaitError as error:
                path = field.name if error.value == text else f"{field.name}: {error.field}"
                raise NaoGaitError(path, error.value, error.allowed) from error
            found[field.name] = value
        return found

    def _find_robots(self) -> tuple[Scene | None, list[Robot]]:
        namespace, asked = self._text["namespace"], self._text["scene"]
        if asked in ("", FLOOR):
            named = self._text["robot"] or self._text["urdf"]
            return None, [Robot(namespace, named or URDF.default)]
        scene = load_scene(asked)
        for argument in OF_THE_FLOOR:
            if self._text[argument]:
                allowed = f"nothing: it differs between the robots of scene {scene.name}"
                raise NaoGaitError(argument, self._text[argument], allowed)
        plays, domain = "player" in self._nodes, domain_id()
        return scene, [
            Robot(
                f"{namespace}/{robot.name}",
                robot.urdf,
                True,
                player_parameters(robot, scene, asked, domain) if plays and robot.team else None,
            )
            for robot in scene.robots
        ]

    def _parameter_files(self) -> list[str]:
        name = self._text["params_file"]
        if not name:
            return []
        content = read_yaml(Path(name), "params_file")
        if not isinstance(content, dict) or not all(
            isinstance(each, dict) and "ros__parameters" in each for each in content.values()
        ):
            allowed = "a YAML file of `NODE: {ros__parameters: {name: value}}`"
            raise NaoGaitError("params_file", name, allowed)
        return [name]

    # -- processes ---------------------------------------------------------------------------------

    def _node(self, name: str, robot: Robot | None = None) -> Node:
        """One of our nodes; `robot`: the one that it belongs to."""
        # The bridge publishes the simulated time and itself uses the wall clock.
        given = {**self._given.get(name, {}), "use_sim_time": name != "sim_bridge"}
        if robot is not None:
            given["urdf"] = robot.urdf
            if name == "player":
                given |= robot.player or {}
        return Node(
            package=PACKAGE,
            executable=name,
            name=name,
            namespace=self._text["namespace"] if robot is None else robot.namespace,
            output="screen",
            parameters=[
                *self._files,
                {key: ParameterValue(value, value_type=type(value))
                 for key, value in given.items()},
            ],
            remappings=TRANSFORMS if robot is not None and robot.several else [],
            on_exit=Shutdown(reason=f"{name} has ended"),
        )  # fmt: skip

    def _rviz(self, robot: Robot) -> list[Action]:
        if not self._is_on("rviz"):
            return []
        _require("rviz", self._text["rviz"], "rviz2")
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

    def _recorder(self) -> list[Action]:
        asked = self._text["record"]
        if asked.lower() in ("", "false", "0"):
            return []
        now = asked.lower() in ("true", "1")
        folder = time.strftime("walk_%Y%m%d_%H%M%S") if now else asked
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

    def _state_publisher(self, robot: Robot) -> list[Action]:
        """The transforms of the robot's links; the gait publishes those from odom to its root."""
        package = "robot_state_publisher"
        asked = self._text[package].lower()
        if asked == "auto":
            if not _installed(package):
                return []
        elif not self._is_on(package):
            return []
        else:
            _require(package, asked, package)
        return [
            Node(
                package=package,
                executable=package,
                namespace=robot.namespace,
                parameters=[
                    {"robot_description": ParameterValue(
                        load_robot(robot.urdf).urdf, value_type=str
                     ), "use_sim_time": True}
                ],
                # The bridge publishes the same text already.
                remappings=[
                    ("robot_description", "robot_state_publisher/robot_description"),
                    *(TRANSFORMS if robot.several else []),
                ],
            ),
        ]  # fmt: skip


def _for_each(load: Callable[[Any, str], object], robots: Sequence[Robot], name: str) -> None:
    for urdf in {robot.urdf for robot in robots}:
        load(load_robot(urdf), name)


def _parsed(kind: object, name: str, text: str) -> Any:
    """The value of an argument's text; what cannot be read stays text, which the field refuses."""
    if isinstance(kind, Switch):
        try:
            return {"true": True, "1": True, "false": False, "0": False}[text.lower()]
        except KeyError:
            raise NaoGaitError(name, text, "true or false") from None
    if isinstance(kind, Number):
        try:
            return yaml.safe_load(text)
        except yaml.YAMLError:
            return text
    return text


def _installed(package: str) -> bool:
    try:
        get_package_prefix(package)
    except PackageNotFoundError:
        return False
    return True


def _require(argument: str, got: str, package: str) -> None:
    if not _installed(package):
        raise NaoGaitError(argument, got, f"false, or install the package {package}")
