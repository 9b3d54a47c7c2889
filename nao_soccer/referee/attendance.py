"""What a referee keeps beside the rules: the time of the match, who plays and who is heard."""

from collections.abc import Iterable
from pathlib import Path

import attrs

from robot_core import schema
from robot_core.errors import NaoGaitError
from robot_core.field import TEAMS
from robot_core.resources import find
from robot_core.schema import NAME, Settings, number

SILENCE = 2_000_000_000
"""[ns] of match time after a return message, of which robots send two per second, after which a
player is not heard any more."""


class MatchClock:
    """Match time [ns] that never decreases; the match begins `wait` [ns] after the first stamp."""

    def __init__(self, wait: int = 0) -> None:
        self._wait = wait
        self._began = 0
        self._last: int | None = None

    def at(self, stamp: int) -> int:
        """The time [ns] since the match began; negative before.

        A stamp that is smaller than the last one is of a simulation that was started again: the
        match goes on from the time that it had reached.
        """
        if self._last is None:
            self._began = stamp + self._wait
        elif stamp < self._last:
            self._began -= self._last - stamp
        self._last = stamp
        return stamp - self._began


class RollCall:
    """Which players of a match, by team and number, have answered lately."""

    def __init__(self, players: Iterable[tuple[int, int]]) -> None:
        self._heard: dict[tuple[int, int], int | None] = dict.fromkeys(players)

    def note(self, team: int, player: int, time: int) -> None:
        """A message of a player has come at a time [ns] of the match."""
        if (team, player) in self._heard:
            self._heard[team, player] = time

    def count(self, time: int) -> int:
        """Number of players who were heard lately, at a time [ns] of the match."""
        return sum(at is not None and time - at < SILENCE for at in self._heard.values())


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
