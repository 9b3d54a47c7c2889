"""Who plays in a scene, as far as a referee needs to know."""

from pathlib import Path

import attrs

from robot_core import schema
from robot_core.errors import NaoGaitError
from robot_core.field import TEAMS
from robot_core.resources import find
from robot_core.schema import NAME, Settings, number


@attrs.frozen
class ScenePlayer(Settings):
    """A robot of a scene."""

    name: str = schema.field(NAME, meaning="Name, under which its topics are.")
    team: str = schema.choice(TEAMS, "Team.", default=schema.REQUIRED)
    number: int = number(minimum=1, maximum=20, whole=True, meaning="Number of the player.")


def players_of_scene(name_or_path: str | Path) -> dict[str, tuple[str, int]]:
    """Team and number of each robot of a scene, by name.

    Raises:
        NaoGaitError: The file cannot be used, or the scene has no robots with teams.
    """
    path = find("scenes", name_or_path)
    scene = schema.read_yaml(path, "scene")
    where = f"scene {path}: robots"
    robots = scene.get("robots") if isinstance(scene, dict) else None
    if not isinstance(robots, list) or not robots:
        raise NaoGaitError(where, robots, "a list of robots")
    players = {}
    keys = {field.name for field in schema.fields(ScenePlayer)}
    for index, robot in enumerate(robots):
        if not isinstance(robot, dict):
            raise NaoGaitError(f"{where}[{index}]", robot, "a mapping")
        known = {key: value for key, value in robot.items() if key in keys}
        player = ScenePlayer.from_mapping(known, f"{where}[{index}].")
        players[player.name] = (player.team, player.number)
    return players
