"""Robots that play in the simulation: alone, and the course of a match."""

import json
import math
from pathlib import Path

import pytest

from gait_lab.soccer.frames import Frame, RobotFrame
from gait_lab.soccer.match import Match, MatchSpec, match_scene
from gait_lab.soccer.replay_page import write_replay
from gait_lab.soccer.scenes import SceneSpec, play_scene
from gait_lab.soccer.solo import SoloSpec, solo
from gait_lab.trials.dribble import DribbleSpec, dribble
from nao_lipm_gait.errors import NaoGaitError
from nao_soccer.game_state import Phase
from nao_soccer.referee.rules import Goal

pytest.importorskip("mujoco")


def test_a_robot_before_the_goal_scores() -> None:
    result = solo(SoloSpec(seed=1, start=(1.45, 0.1, 0.0), ball=(1.75, 0.1), limit=25.0))
    assert result.goal is not None, result.path
    assert result.falls == 0


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_ball_before_a_foot_of_a_walking_robot_goes_straight_ahead(side: float) -> None:
    """Between the feet it goes aside: so dribbling leads one foot to it."""
    before, between = (
        dribble(DribbleSpec(robot_seed=2, engine="mujoco", across=across, speed=0.35))
        for across in (0.06 * side, 0.0)
    )
    assert before.stood
    assert abs(before.direction) < 0.05
    assert before.distance > 1.0
    assert abs(between.direction) > 0.15


def test_with_the_goal_behind_it_the_robot_scores_by_a_kick_backwards() -> None:
    """Fig. 10 of Friedmann et al.: it does not see the goal, but knows where it is."""
    result = play_scene(SceneSpec(name="backheel", seed=3))
    assert result.done, result.doing


def test_a_match_begins_and_each_team_has_one_striker() -> None:
    with Match(MatchSpec(minutes=0.1, seed=2)) as match:
        for frame in match.play():
            last = frame
            if frame.time >= 2.0:
                break
        players = match.pitch.players
    assert last.phase == Phase.READY
    for team in ("red", "blue"):
        roles = [each.role for name, each in last.robots.items() if name.startswith(team)]
        assert sorted(roles) == ["striker", "supporter"]
    for player in players:
        assert player.behavior.game.phase is Phase.READY
        assert player.decision is not None
        assert player.decision.path[1].state == "take place"
    assert match.pitch.messages > 8


def test_of_two_robots_at_the_ball_the_nearer_goes_on_and_the_other_steps_back() -> None:
    """Fig. 11 of Friedmann et al."""
    result = play_scene(SceneSpec(name="two at the ball", seed=4))
    assert result.done, result.doing


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        (MatchSpec(scene="nowhere"), "scene"),
        (MatchSpec(robots=5), "at most 2 robots of team red"),
    ],
)
def test_a_match_that_cannot_be_played_is_refused(spec: MatchSpec, message: str) -> None:
    with pytest.raises(NaoGaitError, match=message):
        match_scene(spec)


def test_the_replay_page_has_the_match(tmp_path: Path) -> None:
    scene = match_scene(MatchSpec())
    robots = {
        robot.name: RobotFrame(*robot.pose, "walk", "striker", "play the ball: dribble </script>")
        for robot in scene.robots
    }
    frames = [Frame(0.2 * i, (0.1 * i, 0.0), robots, "playing", (i // 9, 0)) for i in range(10)]
    path = tmp_path / "replay.html"
    write_replay(path, scene, frames, [Goal(1.8, "red", "red2", False)], "a test")
    text = path.read_text()
    assert "{{" not in text
    data = json.loads(text.split('id="data">')[1].split("</script>")[0].replace("<\\/", "</"))
    assert len(data["frames"]) == 10
    assert data["goals"] == [{"t": 1.8, "team": "red", "player": "red2"}]
    assert {robot["name"] for robot in data["robots"]} == set(robots)
    assert math.isclose(data["frames"][5]["ball"][0], 0.5)
