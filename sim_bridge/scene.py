"""A scene: a field with goals and poles, a ball, and the robots on it.

One YAML file per scene, in `config/scenes/`. The world has the frame of the field (see
`robot_core.field`). The plant is not part of a scene: it says what floor and robots are made of.
"""

import os
from pathlib import Path
from typing import Any

import attrs
import yaml

from robot_core import schema
from robot_core.errors import NaoGaitError
from robot_core.field import COLORS, TEAMS, Field, Goals, Pole, faults
from robot_core.resources import find
from robot_core.robot import RobotDescription, load_robot
from robot_core.schema import NAME, Group, Kind, Number, Sequence, Settings
from robot_core.types import Pose2
from sim_bridge.ball import Ball
from sim_bridge.robot import START_STATES, RobotSpec
from sim_bridge.surroundings import Surroundings
from sim_bridge.terrain import Prism

FLOOR = "floor"
"""Name of the scene with one robot without a name on an endless floor; it has no file."""
RESERVED = ("field", "ground_truth", "sim_bridge", "world")
"""Names that topics or frames of the world have."""
ROBOTS = 22
"""Largest number of robots."""


@attrs.frozen
class PoseKind(Kind):
    """A place on the floor and a heading."""

    @property
    def allowed(self) -> str:
        """What is allowed, for error messages."""
        return "[x, y, heading]: two numbers from -50 to 50 m, one from -6.3 to 6.3 rad"

    def check(self, where: str, value: Any) -> Pose2:
        """Return (x, y, heading)."""
        if isinstance(value, list | tuple) and len(value) == 3:
            try:
                x, y = (Number(-50.0, 50.0).check(where, each) for each in value[:2])
                return x, y, Number(-6.3, 6.3).check(where, value[2])
            except NaoGaitError:
                pass
        raise NaoGaitError(where, value, self.allowed)


@attrs.frozen
class SceneBall(Settings):
    """The ball; the SPL's unless its size is given."""

    x: float = schema.number(0.0, -50.0, 50.0, "m", "Start, x.")
    y: float = schema.number(0.0, -50.0, 50.0, "m", "Start, y.")
    radius: float = schema.number(0.05, 0.02, 0.2, "m", "Radius.")
    mass: float = schema.number(0.044, 0.005, 2.0, "kg", "Mass.")
    color: str = schema.choice(tuple(COLORS), "Colour.", default="orange")


@attrs.frozen
class SceneRobot(Settings):
    """One robot of a scene."""

    name: str = schema.field(NAME, meaning="Name, under which its topics are.")
    team: str = schema.choice(TEAMS, "Team.", default=schema.REQUIRED)
    number: int = schema.number(
        minimum=1, maximum=20, whole=True, meaning="Number of the player, unique in its team."
    )
    urdf: str = schema.text(
        meaning="Shipped name or file of the robot; a file may be beside the scene."
    )
    pose: Pose2 = schema.field(PoseKind(), meaning="Start: x [m], y [m], heading [rad].")
    seed: int = schema.number(
        0, -1, 2**31 - 1, whole=True, meaning="Number of the individual; -1 = the nominal robot."
    )
    start_state: str = schema.choice(START_STATES, "Pose of the body at the start.")


@attrs.frozen
class Scene(Settings):
    """What stands on the floor of a world."""

    name: str = schema.text()
    robots: tuple[SceneRobot, ...] = schema.field(Sequence(Group(SceneRobot), 1, ROBOTS))
    field: Field | None = schema.field(Group(Field), None, "Lines on a carpet; null = none.")
    goals: Goals | None = schema.field(Group(Goals), None, "Goals; null = none.")
    poles: tuple[Pole, ...] = schema.field(Sequence(Group(Pole)), (), "Landmarks.")
    ball: SceneBall | None = schema.field(Group(SceneBall), None, "The ball; null = none.")

    def robot_specs(
        self, *, noise_seed: int = 0, sensor_delay: float | None = None
    ) -> tuple[RobotSpec, ...]:
        """The robots for a world; each has sensor noise of its own.

        Args:
            noise_seed: Of the first robot; the next ones have the numbers after it.
            sensor_delay: [s]; None = the plant's.

        Raises:
            NaoGaitError: A URDF cannot be used.
        """
        loaded: dict[str, RobotDescription] = {}
        specs = []
        for index, robot in enumerate(self.robots):
            if robot.urdf not in loaded:
                try:
                    loaded[robot.urdf] = load_robot(robot.urdf)
                except NaoGaitError as error:
                    field = "urdf" if error.field == "robot" else error.field
                    where = f"scene {self.name}: {robot.name}: {field}"
                    raise NaoGaitError(where, error.value, error.allowed) from error
            specs.append(
                RobotSpec(
                    loaded[robot.urdf],
                    robot.seed,
                    noise_seed + index,
                    sensor_delay,
                    robot.start_state,
                    name=robot.name,
                    pose=robot.pose,
                    color=COLORS[robot.team],
                )
            )
        return tuple(specs)

    def surroundings(self, ground: tuple[Prism, ...] = ()) -> Surroundings:
        """What surrounds the robots.

        Args:
            ground: Prisms that rise above the floor.

        Raises:
            NaoGaitError: The scene has a field and the ground is not level.
        """
        if ground and self.field is not None:
            raise NaoGaitError("plant terrain", "uneven", f"flat or carpet in scene {self.name}")
        ball = None
        if self.ball is not None:
            ball = Ball(**{**self.ball.as_dict(), "color": COLORS[self.ball.color]})
        return Surroundings(ground, ball, self.field, self.goals, self.poles)

    def to_yaml(self) -> str:
        """The scene as a YAML file, with all defaults."""
        return yaml.safe_dump(self.plain(), sort_keys=False, default_flow_style=None)


def load_scene(name_or_path: str | Path) -> Scene:
    """Read a scene from a shipped name or a YAML file.

    Raises:
        NaoGaitError: The file, a key or a value cannot be used; a name or a number is there twice.
    """
    path = find("scenes", name_or_path)
    values = schema.read_yaml(path, "scene")
    if isinstance(values, dict):
        values = {"name": path.stem, **values}
    scene = _checked(values, f"scene {path}: ")
    robots = tuple(
        attrs.evolve(robot, urdf=str(beside))
        if os.path.isfile(beside := path.parent / robot.urdf)
        else robot
        for robot in scene.robots
    )
    return attrs.evolve(scene, robots=robots)


def parse_scene(text: str) -> Scene:
    """Read what `Scene.to_yaml` has written; NaoGaitError as `load_scene`."""
    return _checked(schema.parse_yaml(text, "scene"), "scene: ")


def _checked(values: object, where: str) -> Scene:
    scene = Scene.from_mapping(values, where)
    _check(scene, where)
    return scene


def _check(scene: Scene, where: str) -> None:
    """Refuse what does not fit together."""
    names = [robot.name for robot in scene.robots]
    shirts = [(robot.team, robot.number) for robot in scene.robots]
    for index, robot in enumerate(scene.robots):
        if robot.name in RESERVED:
            raise NaoGaitError(f"{where}robots", robot.name, f"a name other than {RESERVED}")
        if robot.name in names[:index]:
            raise NaoGaitError(f"{where}robots", f"{robot.name} twice", "each name once")
        if shirts[index] in shirts[:index]:
            shirt = f"{robot.team} {robot.number} twice"
            raise NaoGaitError(f"{where}robots", shirt, "each number once in a team")
    if scene.goals is not None and scene.field is None:
        raise NaoGaitError(f"{where}goals", "goals without a field", "null, or give a field")
    for key, value, allowed in () if scene.field is None else faults(scene.field, scene.goals):
        raise NaoGaitError(f"{where}{key}", value, allowed)
