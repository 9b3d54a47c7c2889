"""Kicks, plans and walking: the decisions of a player, without a simulation."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.walks.lipm.steady_walk import double_step_duration, stride_for
from nao_soccer import player as player_module
from nao_soccer.behavior import basic
from nao_soccer.behavior.ball_plan import Planner
from nao_soccer.behavior.duel import DuelSettings
from nao_soccer.behavior.kicks import KickTable, load_kicks
from nao_soccer.behavior.mind import Mind
from nao_soccer.behavior.situation import Body, Situation
from nao_soccer.behavior.walking import (
    APART_FROM,
    Round,
    WalkLimits,
    kept_apart,
    walk_to,
)
from nao_soccer.game_state import GameState, Phase, Role
from nao_soccer.player import Identity, Player
from nao_soccer.referee.protocol import ControlMessage, Penalty, PlayerInfo, TeamInfo
from nao_soccer.referee.protocol import decode as decode_control
from nao_soccer.team.message import NEVER, TeamMessage, decode
from nao_soccer.vision.settings import settings_of_scene
from nao_soccer.world.settings import WorldSettings
from nao_soccer.world.state import (
    BallEstimate,
    HeadMode,
    Obstacle,
    PoseEstimate,
    TeamMate,
    WorldState,
)
from robot_core.errors import NaoGaitError
from robot_core.field import Goals
from robot_core.geometry import compose, relative, rotate_planar
from robot_core.motion.library import MotionLibrary, shipped_library
from robot_core.robot import RobotDescription, load_robot
from robot_core.types import GaitState, Pose2, PoseCovariance, VelocityCommand

SCENE = settings_of_scene("pitch_small")
GOALS = SCENE.goals or Goals()
SETTINGS = WorldSettings(field=SCENE.field, goals=GOALS)
LIMITS = WalkLimits()
DUEL = DuelSettings()
TABLE = load_kicks("nao_h21")
NAO = load_robot("nao_h21_v33")
VARIANCE = (0.0004, 0.0, 0.0004)


def planner() -> Planner:
    return Planner(TABLE, LIMITS, SCENE.field, GOALS)


def world(
    own: tuple[float, float, float],
    ball: tuple[float, float] | None,
    *,
    time: float = 0.0,
    valid: bool = True,
    upright: bool = True,
    velocity: tuple[float, float] = (0.0, 0.0),
    robots: tuple[tuple[float, float], ...] = (),
) -> WorldState:
    """A world model without errors; ball and robots are in the field."""

    def seen(place: tuple[float, float]) -> tuple[float, float]:
        dx, dy = place[0] - own[0], place[1] - own[1]
        c, s = math.cos(own[2]), math.sin(own[2])
        return c * dx + s * dy, -s * dx + c * dy

    estimate = None
    if ball is not None:
        estimate = BallEstimate(
            seen(ball), velocity, VARIANCE, ball, velocity, VARIANCE, VARIANCE, 0.1, True
        )
    obstacles = tuple(
        Obstacle(seen(each), each, VARIANCE, (0.0, 0.0), None, False, 0.1) for each in robots
    )
    pose = PoseEstimate(own, PoseCovariance(xx=0.001, yy=0.001, yaw=0.001), valid)
    return WorldState(round(time * 1e9), pose, estimate, obstacles, upright=upright)


@given(st.floats(-math.pi, math.pi), st.floats(-2.0, 2.0))
def test_the_gait_walks_most_of_what_players_ask(bearing: float, turn: float) -> None:
    limits, parameters = WalkLimits(), GaitParameters()
    x, y = limits.forward * math.cos(bearing), limits.side * math.sin(bearing)
    asked = limits.command(9.0 * x, 9.0 * y, 9.0 * turn * limits.turn)
    stride = stride_for(asked, parameters)
    duration = double_step_duration(abs(stride.y), parameters)
    walked = 2.0 * stride.x / duration, stride.y / duration, stride.yaw / duration
    assert math.hypot(*walked) > 0.7 * math.hypot(*asked)


# -- kicks -----------------------------------------------------------------------------------------


def test_the_table_agrees_with_the_motions() -> None:
    motions = shipped_library(load_robot("nao_h21_v33")).motions
    for kick in TABLE.kicks:
        motion = motions[kick.motion].kick
        assert motion is not None
        assert math.dist(kick.spot, (motion.x, motion.y)) < 0.03
        assert abs(math.remainder(kick.direction - motion.direction, math.tau)) < 0.1


@pytest.mark.parametrize("kick", TABLE.kicks, ids=lambda kick: kick.motion)
def test_at_its_pose_the_ball_lies_on_the_spot_and_goes_the_way(kick) -> None:
    pose = kick.robot_pose((0.4, -0.3), 0.7)
    x, y, _ = compose(pose, (*kick.spot, 0.0))
    assert (x, y) == pytest.approx((0.4, -0.3))
    assert math.remainder(pose[2] + kick.direction - 0.7, math.tau) == pytest.approx(0.0, abs=1e-9)


def test_a_kick_table_that_misses_a_field_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "kicks.yaml"
    file.write_text("kicks:\n  - {motion: kick_front_left, x: 0.16, y: 0.06}\n")
    with pytest.raises(NaoGaitError, match="direction") as error:
        load_kicks(file)
    assert "\n" not in str(error.value)
    row = {field: 0.5 for field in ("x", "y", "direction", "direction_spread", "distance")}
    row |= {"distance_spread": 0.1, "speed": 1.0, "seconds": 3.0}
    line = "  - {motion: hop, " + ", ".join(f"{k}: {v}" for k, v in row.items()) + "}\n"
    file2 = tmp_path / "twice.yaml"
    file2.write_text("kicks:\n" + line + line)
    with pytest.raises(NaoGaitError, match="twice"):
        load_kicks(file2)


# -- plans -----------------------------------------------------------------------------------------


def test_with_the_ball_at_its_heel_and_the_goal_behind_the_robot_kicks_back() -> None:
    """Fig. 10 of Friedmann et al.: it does not see the goal, but knows where it is."""
    own = (1.75, 0.0, math.pi)
    ball = (own[0] + 0.1, own[1] - 0.06)
    plan = planner().choose(own, ball, stands=True)
    assert plan.name == "kick_backheel_left"
    assert math.cos(plan.direction) > 0.9
    assert planner().choose(own, ball, valid=False).dribbles


def test_a_free_ball_far_from_the_goal_goes_far_and_one_with_an_opponent_goes_at_once() -> None:
    own, ball = (-1.5, 0.3, 0.0), (-1.2, 0.3)
    free = planner().choose(own, ball)
    assert abs(free.direction) < 0.2
    assert free.kick.distance > 1.4
    assert planner().choose(own, ball, [(-0.7, 0.1)]).dribbles


def test_a_robot_in_the_way_changes_the_direction() -> None:
    free = planner().choose((0.5, 0.0, 0.0), (0.8, 0.0))
    blocked = planner().choose((0.5, 0.0, 0.0), (0.8, 0.0), [(1.6, 0.0)])
    assert abs(free.direction) < 0.05
    assert abs(blocked.direction) > 0.1


def test_a_ball_at_a_post_is_not_sent_into_the_post() -> None:
    ball = (2.14, -0.57)
    plan = planner().choose((1.9, -0.7, 0.8), ball)
    post = (2.25, -0.55)
    dx, dy = math.cos(plan.direction), math.sin(plan.direction)
    across = abs((post[0] - ball[0]) * dy - (post[1] - ball[1]) * dx)
    along = (post[0] - ball[0]) * dx + (post[1] - ball[1]) * dy
    assert along < 0.0 or across > 0.1


@pytest.mark.parametrize("ball", [(-0.1, 0.0), (0.7, 0.0), (1.3, 0.3)])
def test_an_opponent_behind_the_ball_is_passed(ball: tuple[float, float]) -> None:
    """Head on over the ball: no plan pushes it into the opponent's feet."""
    opponent = (ball[0] + 0.17, ball[1])
    plan = planner().choose((ball[0] - 0.16, ball[1] + 0.06, 0.0), ball, [opponent])
    assert plan
    assert 0.17 * abs(math.sin(plan.direction)) > 0.14
    assert math.cos(plan.direction) > -0.2


def test_the_runner_up_does_something_else_and_takes_longer() -> None:
    plan = planner().choose((0.5, 0.0, 0.0), (0.8, 0.0))
    assert plan.runner_up is not None
    assert not plan.is_like(plan.runner_up)
    assert plan.runner_up.seconds >= plan.seconds
    assert plan.runner_up.runner_up is None


def test_a_plan_is_kept_unless_another_one_is_clearly_better() -> None:
    own, ball = (1.0, 0.3, -0.9), (1.3, 0.05)
    plans = {planner().choose(own, ball).name}
    before = planner().choose((own[0], own[1], own[2] - 0.4), ball)
    kept = planner().choose(own, ball, before=before)
    best = planner().choose(own, ball)
    assert kept.name == before.name or kept.seconds < before.seconds - 2.0 or kept.name in plans
    assert kept.seconds <= best.seconds + 2.0


places = st.tuples(st.floats(-2.2, 2.2), st.floats(-1.4, 1.4))


@given(places, st.floats(-3.1, 3.1), places, st.lists(places, max_size=3))
@settings(max_examples=100)
def test_there_is_always_a_plan(
    place: tuple[float, float], yaw: float, ball: tuple[float, float], robots: list
) -> None:
    plan = planner().choose((*place, yaw), ball, robots)
    assert math.isfinite(plan.seconds)
    assert plan.approach >= 0.0
    # No kick back into the own goal: away from it, or across the field in front of a goal.
    assert math.cos(plan.direction) > -0.2 or ball[0] > 1.5


# -- walking ---------------------------------------------------------------------------------------


def arrive(
    start: tuple[float, float, float], obstacles: tuple[Round, ...] = (), seconds: float = 30.0
) -> tuple[tuple[float, float, float], float]:
    """Walk ideally from a pose to the origin; where the robot is then, and its nearest approach."""
    pose, nearest = start, math.inf
    for _ in range(round(seconds / 0.05)):
        c, s = math.cos(pose[2]), math.sin(pose[2])

        def inner(point: tuple[float, float]) -> tuple[float, float]:
            dx, dy = point[0] - pose[0], point[1] - pose[1]  # noqa: B023
            return c * dx + s * dy, -s * dx + c * dy  # noqa: B023

        target = (*inner((0.0, 0.0)), math.remainder(-pose[2], math.tau))
        around = [Round(inner(each.position), each.radius, each.influence) for each in obstacles]
        command = walk_to(target, LIMITS, around)
        assert math.hypot(command.x / LIMITS.forward, command.y / LIMITS.side) < 3.0
        pose = compose(pose, (0.05 * command.x, 0.05 * command.y, 0.05 * command.yaw))
        for each in obstacles:
            nearest = min(nearest, math.dist(pose[:2], each.position) - each.radius)
    return pose, nearest


@given(st.floats(-2.0, 2.0), st.floats(-1.5, 1.5), st.floats(-3.1, 3.1))
@settings(max_examples=25)
def test_the_robot_arrives_from_everywhere(x: float, y: float, yaw: float) -> None:
    pose, _ = arrive((x, y, yaw))
    assert math.hypot(*pose[:2]) < 0.02
    assert abs(math.remainder(pose[2], math.tau)) < 0.05


@pytest.mark.parametrize("y", [-0.1, 0.0, 0.05])
def test_the_robot_walks_around_an_obstacle_in_its_way(y: float) -> None:
    pose, nearest = arrive((-2.0, y, 0.0), (Round((-1.0, 0.0), 0.3),), 40.0)
    assert math.hypot(*pose[:2]) < 0.05
    assert nearest > -0.12


def test_commands_stay_inside_the_limits_and_keep_their_direction() -> None:
    command = LIMITS.command(1.0, 0.5, 2.0)
    load = math.hypot(
        command.x / LIMITS.forward, command.y / LIMITS.side, command.yaw / LIMITS.turn
    )
    assert load == pytest.approx(1.0)
    assert command.y / command.x == pytest.approx(0.5)
    assert LIMITS.command(0.1, 0.0, 0.0) == VelocityCommand(0.1, 0.0, 0.0)


@pytest.mark.parametrize("heading", [0.0, 0.4, -0.9])
def test_two_robots_that_walk_into_each_other_stop_before_they_touch(heading: float) -> None:
    ahead = VelocityCommand(0.35, 0.0, 0.0)
    poses = [(-1.0, 0.0, 0.0), (1.0, 0.05, math.pi + heading)]
    nearest = math.inf
    for _ in range(200):
        moves = []
        for own, other in (poses, poses[::-1]):
            c, s = math.cos(own[2]), math.sin(own[2])
            dx, dy = other[0] - own[0], other[1] - own[1]
            command = kept_apart(
                ahead, [Round((c * dx + s * dy, -s * dx + c * dy), DUEL.apart, APART_FROM)], LIMITS
            )
            moves.append(compose(own, (0.05 * command.x, 0.05 * command.y, 0.0)))
        poses = moves
        nearest = min(nearest, math.dist(poses[0][:2], poses[1][:2]))
    assert nearest > 0.9 * DUEL.apart


def test_two_robots_that_push_a_ball_between_them_brake_in_time() -> None:
    """Their walk follows the command late, and each sees the other too late and too far away."""
    late, seen_late, too_far = 4, 2, 0.04  # [0.05 s], [0.05 s], [m]
    gaps, commands = [0.8], [0.0]
    for _ in range(100):
        seen = gaps[max(0, len(gaps) - 1 - seen_late)] + too_far
        other = Round((seen, 0.0), DUEL.apart, APART_FROM, DUEL.gain_ball)
        commands.append(kept_apart(VelocityCommand(0.35), [other], LIMITS).x)
        gaps.append(gaps[-1] - 2.0 * 0.05 * commands[max(0, len(commands) - 1 - late)])
    assert min(gaps) > 0.25  # nearer, feet tread on feet
    assert gaps[-1] < 0.4  # both are still at the ball


def test_the_nearer_another_robot_the_slower_is_the_turn() -> None:
    turns = [
        kept_apart(VelocityCommand(yaw=1.5), [Round((gap, 0.0), DUEL.apart)], LIMITS).yaw
        for gap in (DUEL.apart + 0.2, DUEL.apart - 0.02, DUEL.apart - 0.06, DUEL.apart - 0.12)
    ]
    assert turns == sorted(turns, reverse=True)
    assert (turns[0], turns[-1]) == (1.5, 0.0)
    assert turns[1] < 0.6


def test_a_robot_far_away_or_behind_changes_nothing() -> None:
    command = VelocityCommand(0.3, 0.0, 0.2)
    assert (
        kept_apart(command, [Round((2.0, 0.0), DUEL.apart), Round((-0.5, 0.1), DUEL.apart)], LIMITS)
        == command
    )


# -- the tree --------------------------------------------------------------------------------------


def states(mind: Mind, state: WorldState, **more) -> list[str]:
    body = more.pop("body", Body())
    return [each.state for each in mind.update(state, body, **more).path]


def new_mind() -> Mind:
    return Mind(TABLE, SCENE.field, GOALS)


def test_the_referee_is_obeyed_whatever_the_ball_does() -> None:
    mind = new_mind()
    state = world((-1.0, 0.0, 0.0), (0.0, 0.0))
    assert states(mind, state)[-1] == "walk behind ball"
    for phase in (Phase.INITIAL, Phase.SET, Phase.FINISHED):
        decision = mind.update(state, Body(), GameState(phase=phase))
        assert decision.path[-1].state == "stand still"
        assert decision.action.walk.is_zero
    for waits in (GameState(penalized=True), GameState(stopped=True)):
        assert mind.update(state, Body(), waits).action.walk.is_zero


def test_a_blind_robot_stands_and_goes_on_once_it_sees_again() -> None:
    mind = new_mind()
    state = world((-1.0, 0.0, 0.0), (0.0, 0.0))
    assert not mind.update(state, Body()).action.walk.is_zero
    for changes in ({"image_age": 2.5}, {"sight_age": 20.0}):
        blind = mind.update(replace(state, **changes), Body())
        assert blind.path[-1].state == "stand still"
        assert blind.action.walk.is_zero
        assert mind.update(replace(state, **changes, upright=False), Body()).action.motion
        mind.update(replace(state, **changes), Body())
        assert not mind.update(state, Body()).action.walk.is_zero


def test_a_fallen_robot_gets_up_before_anything_else() -> None:
    mind = new_mind()
    down = mind.update(world((0.0, 0.0, 0.0), (0.5, 0.0), upright=False), Body(GaitState.FALLEN))
    assert down.action.motion == "get_up"
    assert down.action.walk.is_zero
    assert states(mind, world((0.0, 0.0, 0.0), (0.5, 0.0), time=0.1))[0] == "upright"


def test_a_robot_that_stays_down_asks_again_and_again_but_not_while_it_gets_up() -> None:
    mind, motion, asked = new_mind(), "", []
    for i in range(700):
        state = GaitState.GETTING_UP if 300 < i < 550 else GaitState.FALLEN
        down = world((0.0, 0.0, 0.0), (0.5, 0.0), time=0.1 * i, upright=False)
        action = mind.update(down, Body(state)).action
        if action.motion and action.motion != motion:  # as the node tells the gait
            asked.append(i)
        motion = action.motion
    assert len(asked) == 3
    assert asked[0] == 0
    assert 150 < asked[1] < 300
    assert 550 <= asked[2] < 560


def test_a_ball_that_nobody_knows_is_searched() -> None:
    mind = new_mind()
    seen = [states(mind, world((0.0, 0.0, 0.0), None, time=0.1 * i))[-1] for i in range(200)]
    assert list(dict.fromkeys(seen)) == ["look", "turn", "walk"]


def test_who_turns_to_search_turns_on_past_the_place_where_the_ball_was() -> None:
    mind, turned = new_mind(), []
    for i in range(90):
        state = world((0.0, 0.0, -0.06 * i), (1.0, 0.3), time=0.1 * i)
        lost = replace(state.ball, age=9.0, seen_recently=False)
        decision = mind.update(replace(state, ball=lost), Body(GaitState.WALK))
        if decision.path[-1].state == "turn":
            turned.append(decision.action.walk.yaw)
    assert len(turned) > 60
    assert max(turned) < -0.5


def test_towards_a_far_place_beside_it_the_robot_turns_and_walks_no_side_steps() -> None:
    walk = walk_to((1.5, 1.5, 0.0), LIMITS)
    assert walk.yaw > 0.6
    assert walk.x > 0.15
    assert walk.y == pytest.approx(0.0, abs=1e-6)
    near = walk_to((0.2, 0.2, 0.0), LIMITS)
    assert near.y > 0.1


def test_of_two_who_see_the_ball_one_goes_on_and_the_other_steps_back() -> None:
    """Fig. 11 of Friedmann et al.: striker and supporter, both near the ball."""
    ball = (0.5, 0.1)
    striker, supporter = new_mind(), new_mind()
    near = striker.update(world((0.2, 0.1, 0.0), ball), Body(), role=Role.STRIKER)
    back = supporter.update(world((0.1, -0.4, 0.8), ball), Body(), role=Role.SUPPORTER)
    assert near.path[2].state == "striker"
    assert near.action.walk.x >= 0.0
    assert back.path[-1].state == "support"
    x, *_ = compose((0.0, 0.0, 0.8), (back.action.walk.x, back.action.walk.y, 0.0))
    assert x < 0.0  # away from the opponents' goal


def test_who_waits_ahead_of_the_ball_waits_as_far_ahead_as_kicks_go() -> None:
    """At the place for a kick of 1 m it stands, and walks ahead for one of 2 m."""
    here = 0.0, 0.2 * SCENE.field.width, -2.3
    walks = []
    for ahead in (1.0, 2.0):
        duel = DuelSettings(receive_ahead=ahead, receive_aside=0.2)
        mind = Mind(TABLE, SCENE.field, GOALS, LIMITS, duel=duel)
        decision = mind.update(
            world(here, (-1.0, -0.5)), Body(), role=Role.SUPPORTER, rank=basic.RECEIVER
        )
        assert decision.path[-1].state == "support"
        walks.append(compose((0.0, 0.0, here[2]), (*decision.action.walk[:2], 0.0)))
    assert walks[0][0] == pytest.approx(0.0, abs=0.02)
    assert walks[1][0] > 0.05


def test_of_two_opponents_at_the_ball_the_later_one_keeps_off() -> None:
    alone, later = (
        new_mind().update(world((0.0, 0.0, 0.0), (0.35, 0.0), robots=robots), Body())
        for robots in ((), ((0.5, 0.0),))
    )
    assert alone.action.walk.x > 0.1
    assert later.action.walk.x < 0.05


@pytest.mark.parametrize("x", [-1.2, -0.2, 0.3, 1.4])
def test_of_two_opponents_equally_near_to_the_ball_one_keeps_off(x: float) -> None:
    """Head on over the ball; each in the field of its team, with errors of what it sees."""
    kept = []
    for side in (1.0, -1.0):
        ball = (side * x, 0.0)
        state = world((ball[0] - 0.23, 0.0, 0.0), ball, robots=((ball[0] + 0.2, 0.03),))
        situation = Situation(
            state, GameState(), Body(), Role.STRIKER, None, SCENE.field, GOALS, LIMITS
        )
        (opponent,) = situation.near_robots()
        kept.append((opponent.radius, opponent.gain))
    assert sorted(kept) == [(DUEL.apart, DUEL.gain_ball), (DUEL.apart_wide, DUEL.gain)]


def test_the_feet_stay_low_beside_other_robots() -> None:
    lifts = [
        new_mind().update(world((0.0, 0.0, 0.0), (1.0, 0.0), robots=robots), Body()).action.lift
        for robots in ((), ((3.0, 0.0),), ((0.6, 0.3),), ((-0.6, 0.3),))
    ]
    assert lifts == [1.0, 1.0, DUEL.lift, DUEL.lift]


def in_duel(heading: float, ball: tuple[float, float]) -> tuple[str, VelocityCommand]:
    """What a robot in its own half does with an opponent beyond the ball; from the third update."""
    mind, own = new_mind(), (-1.0, 0.2, heading)
    x, y = compose(own, (*ball, 0.0))[:2]
    opponent = compose(own, (ball[0] + 0.4, ball[1], 0.0))[:2]  # far enough not to brake
    for i in range(3):
        state = world(own, (x, y), time=0.1 * i, robots=(opponent,))
        decision = mind.update(state, Body(GaitState.WALK))
    return decision.path[-1].state, decision.action.walk


@pytest.mark.parametrize(("y", "aside"), [(0.06, 0.0), (-0.06, 0.0), (0.13, 1.0), (-0.13, -1.0)])
def test_in_a_duel_a_ball_at_the_feet_is_pushed_ahead_at_once(y: float, aside: float) -> None:
    state, walk = in_duel(0.8, (0.2, y))
    assert state == "push"
    assert walk.x > (0.1 if aside == 0.0 else 0.0)
    assert walk.y * aside >= 0.0
    assert abs(walk.y) > 0.05 or aside == 0.0


@pytest.mark.parametrize("y", [0.03, -0.06, 0.1, -0.13])
def test_the_foot_that_pushes_swings_through_the_ball(y: float) -> None:
    """Beside the foot's middle the ball would be missed, or touched by an edge only."""
    situation = Situation(
        world((0.0, 0.0, 0.0), (0.18, y)), GameState(), Body(), Role.STRIKER, None, SCENE.field,
        GOALS, LIMITS,
    )  # fmt: skip
    kick = basic.push(situation).kick
    assert kick is not None
    x, y, direction = kick
    ahead, aside = rotate_planar(x, y - math.copysign(basic.PUSH_FOOT, y), -direction)
    assert ahead > 0.0
    assert aside == pytest.approx(0.0, abs=0.005)


@pytest.mark.parametrize(
    ("ahead", "gap", "low"), [(0.2, 0.6, True), (0.2, 1.2, False), (-0.2, 0.6, True)]
)
def test_feet_are_kept_low_beside_others(ahead: float, gap: float, low: bool) -> None:
    """A low foot does not tread on theirs; of one that kicks the gait takes no notice of that."""
    mind, ball = new_mind(), (ahead - 1.0, 0.06)
    for i in range(3):
        state = world((-1.0, 0.0, 0.0), ball, time=0.1 * i, robots=((gap - 1.0, 0.0),))
        action = mind.update(state, Body(GaitState.WALK)).action
    assert (action.kick is not None) is (low and ahead > 0.0)
    assert action.lift == (DUEL.lift if low else 1.0)


def test_no_foot_kicks_while_the_robot_steps_back() -> None:
    """From another robot that is too near, with the ball between their feet."""
    for x, kicks in ((-0.45, True), (-0.75, False)):
        mind = new_mind()
        for i in range(3):
            state = world((-1.0, 0.0, 0.0), (-0.8, 0.06), time=0.1 * i, robots=((x, -0.05),))
            decision = mind.update(state, Body(GaitState.WALK))
        assert decision.path[-1].state == "push"
        assert (decision.action.walk.x > 0.0) is kicks
        assert (decision.action.kick is not None) is kicks


def test_a_ball_is_not_pushed_towards_the_own_goal_nor_without_need() -> None:
    assert in_duel(2.5, (0.2, 0.06))[0] != "push"
    assert in_duel(0.8, (0.2, 0.3))[0] != "push"
    alone = new_mind().update(world((-1.0, 0.2, 0.8), (-0.9, 0.4)), Body(GaitState.WALK))
    assert alone.path[-1].state != "push"


def test_a_robot_that_walks_to_its_place_looks_for_robots_and_for_landmarks() -> None:
    mind, game = new_mind(), GameState(phase=Phase.READY)
    heads = [
        mind.update(world((-2.0, 0.0, 0.0), (-2.2, 0.5), time=0.1 * i), Body(), game).action.head
        for i in range(60)
    ]
    looks = [head is HeadMode.AHEAD for head in heads]
    assert 0.5 < np.mean(looks) < 0.8
    longest = max(len(run) for run in "".join("ax"[each] for each in looks).split("x"))
    assert longest < 10


def test_a_robot_that_is_lost_looks_around_before_it_walks_to_its_place() -> None:
    mind, game = new_mind(), GameState(phase=Phase.READY)
    for i in range(60):
        decision = mind.update(
            world((-2.1, -0.5, 0.0), None, time=0.1 * i, valid=i < 10), Body(), game
        )
        if 10 < i < 25:  # a short doubt changes nothing
            assert decision.action.walk.x != 0.0 or decision.action.walk.y != 0.0
    assert decision.action.head is HeadMode.LOCALIZE
    assert (decision.action.walk.x, decision.action.walk.y) == (0.0, 0.0)
    assert 0.0 < decision.action.walk.yaw < 0.6


def test_a_robot_beside_this_one_that_may_have_moved_is_looked_at_more_often() -> None:
    def share(age: float) -> float:
        mind, looks = new_mind(), []
        for i in range(72):
            state = world((-2.0, 0.0, 0.0), (-0.5, 0.0), time=0.1 * i, robots=((-2.0, 0.5),))
            aged = replace(state, obstacles=(replace(state.obstacles[0], age=age),))
            looks.append(mind.update(aged, Body(GaitState.WALK)).action.head is HeadMode.AHEAD)
        return float(np.mean(looks))

    assert share(0.1) < 0.4
    assert share(2.0) > 0.6


MATE = TeamMate(2, 0, (-1.5, 0.0, 0.0), valid=True)


@pytest.mark.parametrize("mates", [(), (MATE,)])
def test_a_striker_that_is_lost_leaves_the_ball_to_others_and_plays_on_after_3_s(
    mates: tuple[TeamMate, ...],
) -> None:
    mind, looked = new_mind(), []
    for i in range(180):
        state = world((-1.0, 0.0, 0.0), (-0.8, 0.05), time=0.1 * i, valid=i < 10)
        decision = mind.update(replace(state, mates=mates), Body(GaitState.WALK))
        if decision.path[-1].state == "find place":
            looked.append(0.1 * i)
            assert mind.lost
            assert decision.action.walk.is_zero
    assert looked[0] > 2.5  # a short doubt changes nothing
    assert looked[-1] - looked[0] == pytest.approx(3.0, abs=0.3)
    assert len(looked) == pytest.approx(30, abs=3)
    found = mind.update(world((-1.0, 0.0, 0.0), (-0.8, 0.05), time=18.0), Body(GaitState.WALK))
    assert found.path[-2].state == "play"
    assert not mind.lost


def test_during_a_kick_off_of_the_others_the_robot_keeps_its_distance() -> None:
    mind = new_mind()
    game = GameState(own_kick=False, ball_free=False)
    path = states(mind, world((-0.9, 0.0, 0.0), (0.0, 0.0)), game=game)
    path = states(mind, world((-0.9, 0.0, 0.0), (0.0, 0.0), time=0.1), game=game)
    path = states(mind, world((-0.9, 0.0, 0.0), (0.0, 0.0), time=0.2), game=game)
    assert path[-1] == "wait"


@pytest.mark.parametrize(
    ("ball", "velocity", "state"),
    [
        ((-1.2, 0.0), (-1.2, 0.0), "stay"),
        ((-1.2, 0.3), (-1.2, 0.0), "dive left"),
        ((-1.2, -0.3), (-1.2, 0.0), "dive right"),
        ((-1.2, 0.0), (-1.2, 1.5), "guard"),
        ((-1.2, 0.3), (-0.6, 0.0), "guard"),
        ((-1.2, 0.0), (0.0, 0.0), "guard"),
    ],
    ids=["at the feet", "left", "right", "wide", "too slow", "rests"],
)
def test_a_keeper_dives_for_a_shot_and_not_for_a_ball_that_misses(
    ball: tuple[float, float], velocity: tuple[float, float], state: str
) -> None:
    mind = new_mind()
    for time in (0.0, 0.1):
        decision = mind.update(
            world((-2.05, 0.0, 0.0), ball, velocity=velocity, time=time), Body(), role=Role.KEEPER
        )
    assert decision.path[-1].state == state
    assert decision.action.motion == (state.replace(" ", "_") if "dive" in state else "")


@pytest.mark.parametrize("robot", [NAO, load_robot("bruno")], ids=lambda robot: robot.name)
@pytest.mark.parametrize("dives", [True, False])
def test_a_keeper_without_dives_stays_on_its_feet(
    robot: RobotDescription, dives: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It goes on to guard the goal."""
    if not dives:
        monkeypatch.setattr(player_module, "shipped_library", lambda _: MotionLibrary())
    shot = world((-2.05, 0.0, 0.0), (-1.2, 0.3), velocity=(-1.2, 0.0))
    player = Player(Identity(1, 1, waits=False), robot, SETTINGS)
    player.game = GameState(goalkeeper=True)
    for step in range(3):
        decision = player.decide_in(replace(shot, stamp=step * 50_000_000), Body())
    assert decision.path[-1].option == "keeper"
    assert decision.action.motion == ("dive_left" if dives else "")


def test_a_robot_that_stands_on_the_spot_kicks_once() -> None:
    """With the ball at its heel; the kick is requested until it runs, and not again after it."""
    mind, motions = new_mind(), []
    ball = 1.85, -0.06
    (kick,) = (each for each in TABLE.kicks if each.motion == "kick_backheel_left")
    own = kick.robot_pose(
        ball, mind.update(world((1.75, 0.0, math.pi), ball), Body()).plan.direction
    )
    body = Body()
    for i in range(30):
        decision = mind.update(world(own, ball, time=0.1 * (i + 1)), body)
        motions.append(decision.action.motion)
        body = Body(GaitState.MOTION if decision.action.motion else body.state)
    assert motions.count(kick.motion) == 1
    assert set(motions) == {"", kick.motion}


@pytest.mark.parametrize("start", [(-1.0, 0.3, 0.5), (0.9, -0.4, 2.0), (0.4, 0.4, -2.5)])
def test_the_robot_leads_one_foot_to_the_ball_that_it_dribbles(
    start: tuple[float, float, float],
) -> None:
    """From any side, ideally walked: at the touch the ball lies before a foot, not between."""
    mind = Mind(KickTable((), TABLE.dribbles), SCENE.field, GOALS)
    pose, ball = start, (0.0, 0.1)
    for i in range(1500):
        decision = mind.update(world(pose, ball, time=0.02 * i), Body(GaitState.WALK))
        assert decision.plan is not None
        kick = decision.plan.kick
        x, y, _ = relative((*ball, 0.0), pose)
        if abs(x - kick.x) < 0.01 and abs(y) < abs(kick.y) + 0.03:
            break
        pose = compose(pose, tuple(0.02 * each for each in decision.action.walk))
    assert decision.path[-1].state == "dribble"
    assert y == pytest.approx(kick.y, abs=0.025)
    heading = decision.plan.direction - decision.plan.kick.direction
    spread = max(0.15, kick.direction_spread)
    assert math.remainder(pose[2] - heading, math.tau) == pytest.approx(0, abs=spread)
    assert decision.action.walk.x > 0.2


def test_play_goes_on_while_the_referee_is_silent_and_messages_are_lost() -> None:
    """Ten seconds without the referee, 30 % of the team messages lost."""
    random = np.random.default_rng(3)
    team = [Player(Identity(1, number), NAO, SETTINGS) for number in (1, 2)]
    players = (PlayerInfo(), PlayerInfo())
    teams = (TeamInfo(1, 0, 0, 1200, 1, 1, players), TeamInfo(2, 0, 0, 1200, 0, 0, players))
    playing = ControlMessage(teams, Phase.PLAYING, packet=1).encode()
    for each in team:
        each.hear_referee(playing, 0.0)
    counts = []
    for tick in range(1, 201):
        time = 0.05 * tick
        poses = ((-0.6, 0.1, 0.0), (-1.4, -0.4, 0.0))
        for each, mate, pose in zip(team, team[::-1], poses, strict=True):
            decision = each.decide_in(world(pose, (0.0, 0.0), time=time), Body())
            assert decision.path[1].state == "play" or tick == 1
            data = each.team_message(time)
            if data is not None and random.random() >= 0.3:
                mate.hear_mate(data, time)
        counts.append(sum(each.role is Role.STRIKER for each in team))
    assert np.mean(np.array(counts[30:]) == 1) > 0.98  # the first messages take 1.25 s each
    assert team[0].role is Role.STRIKER


# -- what is missing -------------------------------------------------------------------------------


def control(phase: Phase, packet: int = 1, penalty: Penalty = Penalty.NONE) -> bytes:
    """A message of the referee; the penalty is that of player 1 of team 1."""
    players = (PlayerInfo(penalty), PlayerInfo())
    teams = (TeamInfo(1, 0, 0, 1200, 1, 1, players), TeamInfo(2, 0, 0, 1200, 0, 0, players))
    return ControlMessage(teams, phase, packet=packet).encode()


HEARD = TeamMessage(
    1, 2, 0, 0, (-0.3, 0.0, 0.0), True, False, False, Role.STRIKER, 1.0, None
)  # fmt: skip


def new_player(start: Pose2 | None = None, **identity) -> Player:
    return Player(Identity(1, 1, **identity), NAO, SETTINGS, start)


def test_a_player_says_what_it_lacks() -> None:
    player = new_player(players=2)
    state = world((-1.0, 0.0, 0.0), (0.0, 0.0))

    def remark(time: float, **changes) -> str:
        player.decide_in(replace(state, stamp=round(time * 1e9), **changes), Body())
        return player.remark

    assert remark(0.0) == "no referee heard yet: the robot stands"
    player.hear_referee(control(Phase.PLAYING), 0.0)
    assert remark(1.0) == "no team mate heard: this robot plays as if alone"
    assert remark(6.0) == "referee not heard for 6 s: playing goes on"
    lost = replace(state.own, valid=False)
    player.hear_referee(control(Phase.PLAYING, packet=2), 7.0)
    assert remark(7.5, own=lost).startswith("no team mate")
    assert remark(8.5, own=lost).startswith("own pose not valid")
    assert remark(8.5, own=lost, upright=False).startswith("no team mate")
    player.hear_referee(control(Phase.PLAYING, 3, Penalty.PUSHING), 8.6)
    assert remark(8.6, own=lost).startswith("no team mate")
    player.hear_referee(control(Phase.PLAYING, 4), 8.7)
    assert remark(14.0).startswith("referee not heard")
    assert remark(14.0, image_age=3.0) == "no usable image for 3 s: the robot stands"
    assert remark(14.0, sight_age=20.0).endswith("for 20 s: the robot stands")
    alone = new_player(players=1, waits=False)
    alone.decide_in(state, Body())
    assert alone.remark == ""


def test_a_clock_that_begins_again_does_not_silence_a_player() -> None:
    player, mate = new_player(players=2), replace(HEARD, count=1)
    player.hear_referee(control(Phase.PLAYING), 299.0)
    player.hear_mate(mate.encode(), 299.9)
    seen = world((-1.0, 0.0, 0.0), (0.0, 0.0))
    for time in (299.9, 300.0):
        player.decide_in(replace(seen, stamp=round(time * 1e9)), Body())
        player.team_message(time)
    assert player.role is Role.SUPPORTER  # its mate is nearer
    # Of all this nothing counts any more: neither what was heard nor what was sent.
    unseen = world((-1.0, 0.0, 0.0), None, valid=False)
    begin = player.decide_in(unseen, Body())
    assert player.role is Role.STRIKER
    assert player.team_message(0.0) is not None
    later = player.decide_in(replace(unseen, stamp=1_600_000_000), Body())
    assert (begin.path[-1].state, later.path[-1].state) == ("look", "turn")
    player.decide_in(replace(seen, own=unseen.own, stamp=1_700_000_000), Body())
    player.decide_in(replace(seen, own=unseen.own, stamp=2_100_000_000), Body())
    data = player.team_message(2.1)
    assert data is not None
    assert decode(data).seconds_to_ball == NEVER  # it has been lost for two seconds
    player.decide_in(replace(unseen, stamp=3_200_000_000), Body())
    assert player.remark == "referee not heard for 3 s: playing goes on"


def test_a_replayed_packet_of_the_referee_is_left_out_until_the_referee_is_silent() -> None:
    player = new_player(players=1)
    for packet, phase, time in ((200, Phase.SET, 0.0), (255, Phase.PLAYING, 0.5)):
        player.hear_referee(control(phase, packet), time)
    player.hear_referee(control(Phase.SET, 200), 0.6)
    assert player.game.phase is Phase.PLAYING
    player.hear_referee(control(Phase.FINISHED, 0), 1.0)  # its count begins again
    assert player.game.phase is Phase.FINISHED
    player.hear_referee(control(Phase.INITIAL, 200), 9.0)  # another referee
    assert player.game.phase is Phase.INITIAL


def test_a_blind_player_leaves_the_ball_to_its_mate() -> None:
    player = new_player(players=2)
    player.hear_referee(control(Phase.PLAYING), 0.0)
    state = world((-0.3, 0.0, 0.0), (0.0, 0.0))
    player.decide_in(state, Body())
    seen = player.decide_in(replace(state, stamp=50_000_000), Body())
    assert seen.plan is not None
    data = player.team_message(0.05)
    assert data is not None
    assert decode(data).seconds_to_ball < NEVER
    player.decide_in(replace(state, stamp=3_000_000_000, image_age=3.0), Body())
    data = player.team_message(3.0)
    assert data is not None
    assert decode(data).seconds_to_ball == NEVER


@pytest.mark.parametrize(
    ("phase", "late"), [(Phase.INITIAL, False), (Phase.READY, False), (Phase.PLAYING, True)]
)
def test_only_who_begins_in_the_middle_of_a_half_does_not_know_its_place(
    phase: Phase, late: bool
) -> None:
    player = new_player((-1.5, 1.0, -1.5), players=1)
    player.hear_referee(control(phase), 0.0)

    def knows() -> bool:
        player.world.add_odometry(stamp, (0.0, 0.0, 0.0))
        player.decide(Body(), stamp)
        return bool(np.ptp(player.world.localization.particles[:, 0]) < 3.0)

    stamp = 0
    assert knows() is not late
    player.world.start(((-1.5, 1.0, -1.5),))
    player.hear_referee(control(Phase.PLAYING, packet=2), 1.0)
    stamp = 20_000_000
    assert knows(), "forgotten only once"


def test_a_player_comes_back_beside_the_touch_line_unless_its_penalty_was_in_place() -> None:
    start = (-1.5, 1.0, -1.5)
    player = new_player(start, players=1)
    stamp = 0

    def place(*messages: bytes) -> Pose2:
        nonlocal stamp
        for data in messages:
            player.hear_referee(data, stamp * 1e-9)
        player.decide(Body(), stamp)
        for _ in range(50):
            stamp += 10_000_000
            player.world.add_odometry(stamp, (2e-9 * stamp, 0.0, 0.0))
        decision = player.decide(Body(), stamp)
        assert decision is not None
        return decision.world.own.pose

    assert math.dist(place(control(Phase.READY))[:2], start[:2]) == pytest.approx(1.0, abs=0.2)
    away = place(control(Phase.PLAYING, 2), control(Phase.PLAYING, 3, Penalty.INCAPABLE))
    assert math.dist(away[:2], start[:2]) == pytest.approx(2.0, abs=0.3)
    back = place(control(Phase.PLAYING, 4))
    (entry_x, entry_y, _), _ = SCENE.field.entries()
    assert back[0] == pytest.approx(entry_x, abs=0.3)
    assert abs(back[1]) < entry_y + 0.1, "on either side"
    before = place(control(Phase.SET, 5, Penalty.MOTION_IN_SET))
    after = place(control(Phase.SET, 6))
    assert math.dist(after[:2], before[:2]) == pytest.approx(1.0, abs=0.3), "it stayed there"
    player.world.start((start,))
    stopped, resumed = (
        replace(decode_control(control(Phase.PLAYING, packet)), version=20, stopped=stop).encode()
        for packet, stop in ((7, True), (8, False))
    )
    away = place(stopped)
    assert player.game.stopped
    assert not player.game.penalized
    after = place(resumed)
    assert math.dist(after[:2], away[:2]) == pytest.approx(1.0, abs=0.2), "nobody moved the robot"
