"""Robots that play in the simulation: alone, and the course of a match."""

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from gait_lab.bench.policies import policy_of
from gait_lab.bench.suites.abilities import AbilitySpec, play_ability
from gait_lab.bench.suites.solo import SoloSpec, play_solo
from gait_lab.soccer.kick_table import table
from gait_lab.soccer.match import BallWatch, Match, MatchResult, MatchSpec, match_scene
from gait_lab.soccer.match_command import play
from gait_lab.soccer.pitch import Pitch, is_upright
from gait_lab.soccer.snapshots import (
    RobotSnapshot,
    Snapshot,
    dribble_strokes,
    is_turned,
    wrong_half,
)
from nao_soccer.behavior.duel import DuelSettings
from nao_soccer.behavior.kicks import load_kicks
from nao_soccer.game_state import GameState, Phase
from nao_soccer.referee.rules import Goal, PutRobot, RobotPlace
from robot_core.errors import NaoGaitError
from robot_core.types import GETTING_UP, Pose2
from sim_bridge.scene import load_scene
from sim_bridge.trials.dribble import DribbleResult, DribbleSpec, dribble
from sim_bridge.trials.kick import KickResult, KickSpec
from sim_bridge.trials.result_cache import ResultCache

pytest.importorskip("mujoco")


def test_a_robot_before_the_goal_scores() -> None:
    result = play_solo(SoloSpec(seed=1, start=(1.45, 0.1, 0.0), ball=(1.75, 0.1), limit=25.0))
    assert result.goal is not None, result.path
    assert result.falls == 0


def test_a_robot_may_start_where_the_ball_of_the_scene_lies() -> None:
    assert play_solo(SoloSpec(start=(0.0, 0.0, 0.0), ball=(0.6, 0.0), limit=0.1)).falls == 0


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_ball_before_a_foot_of_a_walking_robot_goes_straight_ahead(side: float) -> None:
    """Between the feet it goes aside: so dribbling leads one foot to it."""
    before, between = (
        dribble(DribbleSpec(robot_seed=1, engine="mujoco", across=across, speed=0.35))
        for across in (0.06 * side, 0.0)
    )
    assert before.stood
    assert abs(before.direction) < 0.05
    assert before.distance > 0.8
    assert abs(between.direction) > 0.15


def test_with_the_goal_behind_it_the_robot_scores_by_a_kick_backwards() -> None:
    """Fig. 10 of Friedmann et al.: it does not see the goal, but knows where it is."""
    result = play_ability(AbilitySpec(name="backheel", seed=3))
    assert result.done, result.doing


def test_a_fallen_robot_that_is_put_back_stands_at_once() -> None:
    """It does not get up once more where it already stands on its feet."""
    scene = load_scene("pitch_small")
    (first, *_) = scene.robots
    with Pitch(scene.replace(robots=(first,)), 1, "mujoco", "reference") as pitch:
        (player,) = pitch.players
        states = []
        for ticks in pitch.run():
            if pitch.count == 100:
                player.gait.request_motion("dive_left")
            if pitch.count == 550:
                assert ticks[0].status is not None
                assert ticks[0].status.state is GETTING_UP
                pitch.world.reset_robot(first.name)
                player.put_back()
            if pitch.count > 560:
                states.append(is_upright(ticks[0]))
            if pitch.count >= 700:
                break
    assert all(states)


def test_a_player_that_is_started_again_does_nothing_of_before() -> None:
    scene = load_scene("pitch_small")
    (first, *_) = scene.robots
    with Pitch(scene.replace(robots=(first,)), 1, "mujoco", "reference") as pitch:
        (player,) = pitch.players
        player.player.game = GameState(phase=Phase.PLAYING)
        for _ in pitch.run():
            if player.decision is not None and not player.decision.action.walk.is_zero:
                break
        pitch.restart_player(0)
        assert player.decision is None
        assert player._walk.is_zero


def test_a_robot_whose_place_is_taken_is_put_back_once_it_is_free() -> None:
    with Match(MatchSpec(minutes=0.2, seed=2)) as match:
        name, calls = match.pitch.scene.robots[0].name, []

        def reset(robot: str, _pose: Pose2) -> None:
            calls.append(robot)
            if len(calls) < 3:
                raise NaoGaitError("reset", robot, "a free place")

        match.pitch.world.reset_robot = reset  # type: ignore[method-assign]
        match.referee.penalized = lambda _: True  # type: ignore[method-assign]
        match._put_back(PutRobot(name, match.pitch.scene.robots[0].pose))
        for frame in match.play():
            if frame.time >= 1.0:
                break
    assert calls == [name] * 3


def test_a_match_begins_and_each_team_has_one_striker() -> None:
    with Match(MatchSpec(minutes=0.1, seed=2)) as match:
        for frame in match.play():
            last = frame
            if frame.time >= 4.0:
                break
        players = match.pitch.players
    assert last.phase == Phase.READY
    for team in ("red", "blue"):
        roles = [each.role for name, each in last.robots.items() if name.startswith(team)]
        assert sorted(roles) == ["striker", "supporter"]
    for player in players:
        assert player.player.game.phase is Phase.READY
        assert player.decision is not None
        assert player.decision.path[1].state == "take place"
    assert match.pitch.messages > 8


def test_of_two_robots_at_the_ball_the_nearer_goes_on_and_the_other_steps_back() -> None:
    """Fig. 11 of Friedmann et al."""
    result = play_ability(AbilitySpec(name="two at the ball", seed=4))
    assert result.done, result.doing


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        (MatchSpec(scene="nowhere"), "scene"),
        (MatchSpec(robots=5), "at most 2 robots of team red"),
        (MatchSpec(robots=-1), "robots: got -1; allowed: a whole number of at least 1"),
        (MatchSpec(robots=0.5), "robots: got 0.5"),
        (MatchSpec(seed="x"), "seed: got 'x'"),
        (MatchSpec(minutes=math.nan), "minutes: got nan; allowed: a number from 0.1 to 60 min"),
        (MatchSpec(minutes="long"), "minutes: got 'long'"),
        (MatchSpec(loss=2.0), "loss: got 2.0"),
    ],
)
def test_a_match_that_cannot_be_played_is_refused(spec: MatchSpec, message: str) -> None:
    with pytest.raises(NaoGaitError, match=message):
        match_scene(spec)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"policy": ["contested"]}, "NAME=VALUE"),
        ({"policy": ["contest=1"]}, "did you mean contested"),
        ({"vision": "camera", "policy": ["contested=0"]}, "without ROS 2"),
    ],
)
def test_what_a_match_cannot_do_is_said_before_it(
    tmp_path: Path, options: dict[str, Any], said: str
) -> None:
    given = {
        "vision": "model", "eyes": None, "real_time": False, "composed": False, "video": False,
    } | options  # fmt: skip
    with pytest.raises(NaoGaitError, match=said):
        play(lambda _: None, out=tmp_path / "match", json=None, minutes=0.1, **given)


def test_a_policy_is_that_of_one_team() -> None:
    assert policy_of(["contested=0", "lift=0.4"]) == DuelSettings(contested=0.0, lift=0.4)
    assert policy_of([]) == DuelSettings()


def test_a_robot_without_cameras_cannot_play(tmp_path: Path) -> None:
    blind = tmp_path / "blind.yaml"
    blind.write_text("base: nao_h21\nurdf: nao_h21_v33\ncameras: {}\n")
    with pytest.raises(NaoGaitError, match="cameras: got"):
        Match(MatchSpec(robots=1, minutes=0.1, urdf=str(blind)))


def test_the_written_table_of_kicks_can_be_read(tmp_path: Path) -> None:
    kicks = [
        KickResult(KickSpec("kick_front_left", robot_seed=seed), 1.0 + seed, 0.1, 1.2, True, 2.9)
        for seed in (0, 1)
    ]
    dribbles = [
        DribbleResult(
            DribbleSpec(robot_seed=seed, across=place, speed=0.35),
            (0.12, place), place / 3.0, 1.0 + seed, 1.3, stood,
        )
        for place in (0.06, -0.06, 0.125, -0.125)
        for seed, stood in ((0, True), (2, True), (9, False))
    ]  # fmt: skip
    file = tmp_path / "kicks.yaml"
    file.write_text(table("nao_h21_v33", kicks, dribbles))
    read = load_kicks(file)
    assert [each.distance for each in read.kicks] == [1.5]
    left, right, outward, _ = read.dribbles
    assert outward.motion == "dribble_outward_left"
    assert (outward.y, outward.direction) == (0.125, pytest.approx(0.0417))
    assert (left.distance, left.distance_spread) == (2.0, 1.0)  # that of the robot that fell is out
    assert (left.y, right.y) == (0.06, -0.06)
    assert (left.direction, right.direction) == (0.02, -0.02)


def test_a_finished_match_is_not_played_again(tmp_path: Path) -> None:
    goals = [Goal(40.5, "red", "red2", False), Goal(80.0, "blue", "red1", True)]
    spec = MatchSpec(seed=3, frames=False)
    result = MatchResult(
        spec, {"red": 1, "blue": 1}, goals, 300.0, falls={"red1": 2}, kicks=3, strokes=25,
        wrong_half=0, messages=900, one_striker=0.98, conflict=0.4,
    )  # fmt: skip
    file = str(tmp_path / "matches.jsonl")
    ResultCache(file, MatchResult.restored).add(spec, result)
    kept = ResultCache(file, MatchResult.restored)
    assert kept.result(spec) == result
    assert kept.result(replace(spec, seed=4)) is None
    assert kept.result(replace(spec, loss=0.3)) is None


def test_a_duel_lasts_while_both_teams_are_at_the_ball_and_a_ball_that_lies_rests() -> None:
    robots = [SimpleNamespace(name=team + "1", team=team) for team in ("red", "blue")]
    referee = SimpleNamespace(phase=Phase.PLAYING)
    pitch = SimpleNamespace(ball=(0.0, 0.0), scene=SimpleNamespace(robots=robots))
    watch = BallWatch(SimpleNamespace(referee=referee, pitch=pitch))  # type: ignore[arg-type]

    def pass_time(seconds: float, blue: float, *, upright: bool = True, speed: float = 0.0) -> None:
        for _ in range(round(10 * seconds)):
            pitch.ball = pitch.ball[0] + 0.1 * speed, 0.0
            x = pitch.ball[0]
            watch.watch(0.1, {
                "red1": RobotPlace((x - 0.3, 0.0), True),
                "blue1": RobotPlace((x + blue, 0.0), upright),
            })  # fmt: skip

    pass_time(0.1, 2.0)
    pass_time(4.0, 2.0, speed=0.5)
    pass_time(3.0, 0.3)
    pass_time(0.6, 0.8)  # a short break
    pass_time(2.0, 0.3)
    pass_time(2.0, 0.3, upright=False)
    pass_time(0.5, 0.3)  # too short for a duel
    referee.phase = Phase.SET
    pass_time(3.0, 0.3)
    assert watch.duels == pytest.approx([5.5], abs=0.15)
    assert watch.playing == pytest.approx(12.1)
    assert watch.rest == pytest.approx(8.1 / 12.1, abs=0.02)


def test_an_own_goal_is_one_of_the_wrong_half_only_if_the_robot_took_it_for_the_others() -> None:
    def frame(
        time: float, believed: float, option: str = "play the ball: dribble", ball: float = -1.7
    ) -> Snapshot:
        path = ("player: upright", option)
        robot = RobotSnapshot(
            -1.5, 0.0, 3.1, "walk", "striker", option, is_turned(3.1, believed), path
        )
        return Snapshot(time, (ball, 0.0), {"red1": robot}, "playing", (0, 0))

    goal = Goal(10.0, "blue", "red1", True)
    assert wrong_half([goal], [frame(9.9, 0.1), frame(10.1, 3.0)]) == 1
    assert wrong_half([goal], [frame(9.9, 3.0), frame(10.1, 0.1)]) == 0
    assert wrong_half([goal._replace(own=False)], [frame(9.9, 0.1)]) == 0
    assert wrong_half([goal], [frame(9.9, 0.1, "player: get up")]) == 0
    assert wrong_half([goal], [frame(9.9, 0.1, "search for the ball: look")]) == 0
    rolled = frame(9.9, 0.1, "supporter: support", ball=-2.2)  # what it believes later is no matter
    assert wrong_half([goal], [frame(8.1, 0.1), rolled]) == 1
    assert wrong_half([goal], [frame(8.1, 3.0), rolled]) == 0


def test_a_stroke_is_a_ball_that_a_dribbling_robot_makes_faster() -> None:
    def course(speeds: list[float], robot: RobotSnapshot) -> list[Snapshot]:
        """A ball that rolls along x, the robot 0.15 m behind it."""
        frames, x = [], 0.0
        for index, speed in enumerate(speeds):
            x += 0.2 * speed
            moved = robot._replace(x=robot.x + x)
            frames.append(Snapshot(0.2 * index, (x, 0.0), {"red1": moved}, "playing", (0, 0)))
        return frames

    dribbles = RobotSnapshot(-0.15, 0.0, 0.0, "walk", "striker", "play the ball: dribble")
    two_strokes = [0.0, 0.0, 1.0, 1.4, 0.9, 0.5, 0.2, 1.2, 1.0]
    assert dribble_strokes(course(two_strokes, dribbles)) == 2
    pushes = dribbles._replace(doing="play the ball: push")
    assert dribble_strokes(course(two_strokes, pushes)) == 2
    assert dribble_strokes(course([0.0, 0.1, 0.2, 0.3, 0.3], dribbles)) == 0
    away, kicks = dribbles._replace(y=0.5), dribbles._replace(doing="play the ball: kick")
    assert dribble_strokes(course(two_strokes, away)) == 0
    assert dribble_strokes(course(two_strokes, kicks)) == 0
