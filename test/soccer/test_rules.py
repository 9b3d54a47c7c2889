"""The referee: phases, goals, balls out, and robots that lie or leave."""

import math
from collections.abc import Sequence

import pytest

from nao_soccer.game_state import Phase, SetPlay
from nao_soccer.referee.attendance import SILENCE, MatchClock, RollCall
from nao_soccer.referee.protocol import Penalty, decode, seen_by
from nao_soccer.referee.rules import (
    Order,
    PutBall,
    PutRobot,
    Referee,
    RobotPlace,
    Rules,
    free_place,
)
from nao_soccer.vision.settings import settings_of_scene
from robot_core.field import Field, Goals

SCENE = settings_of_scene("pitch_small")
PLAYERS = {"red1": ("red", 1), "red2": ("red", 2), "blue1": ("blue", 1), "blue2": ("blue", 2)}
STARTS = {"red1": (-1.9, 0.0), "red2": (-0.7, 0.4), "blue1": (1.9, 0.0), "blue2": (0.7, -0.4)}
RULES = Rules(half=60.0, ready=5.0, set=2.0)


class Game:
    """A referee with robots and a ball that stay where they are put."""

    def __init__(self, rules: Rules = RULES) -> None:
        field, goals = SCENE.field, SCENE.goals
        assert isinstance(field, Field)
        assert isinstance(goals, Goals)
        self.referee = Referee(field, goals, PLAYERS, rules)
        self.ball = (0.0, 0.0, 0.05)
        self.robots = {name: RobotPlace(place, True) for name, place in STARTS.items()}
        self.time = 0.0
        self.orders: list[Order] = []

    def run(self, seconds: float) -> Sequence[Order]:
        """Let time pass; the orders of this time."""
        new: list[Order] = []
        for _ in range(round(seconds / 0.1)):
            self.time += 0.1
            for order in self.referee.update(self.time, self.ball, self.robots):
                new.append(order)
                if isinstance(order, PutBall):
                    self.ball = (*order.position, 0.05)
        return new

    def kick_off(self) -> None:
        """Until the ball is in play."""
        while self.referee.phase is not Phase.PLAYING:
            self.run(0.1)

    def shoot(self, name: str, x: float, y: float) -> None:
        """A robot moves the ball to a place."""
        place = self.robots[name]
        self.robots[name] = RobotPlace((x, y), True)
        self.ball = (x, y, 0.05)
        self.run(0.1)
        self.robots[name] = place


def test_a_match_goes_through_its_phases_and_ends_in_time() -> None:
    game = Game()
    phases = []
    while not game.referee.over and game.time < 1000.0:
        game.run(0.1)
        game.ball = (0.3 * math.sin(game.time), 0.0, 0.05)
        if not phases or phases[-1] is not game.referee.phase:
            phases.append(game.referee.phase)
    half = [
        Phase.INITIAL, Phase.STANDBY, Phase.READY, Phase.SET, Phase.PLAYING, Phase.FINISHED,
    ]  # fmt: skip
    assert phases == half + half
    assert game.time == pytest.approx(game.referee.rules.duration, abs=1.0)


def test_the_second_half_begins_where_the_pause_ends() -> None:
    game = Game()
    told: list[tuple[Phase, bool]] = []
    while not game.referee.over and game.time < 1000.0:
        game.run(0.1)
        message = game.referee.message()
        if (message.phase, message.first_half) not in told:
            told.append((message.phase, message.first_half))
    phases = [
        Phase.INITIAL, Phase.STANDBY, Phase.READY, Phase.SET, Phase.PLAYING, Phase.FINISHED,
    ]  # fmt: skip
    assert told == [(phase, first) for first in (True, False) for phase in phases]


def test_before_the_second_half_robots_are_carried_to_their_starts_and_penalties_end() -> None:
    game = Game(RULES.replace(penalty=100.0))
    game.kick_off()
    game.robots["red1"] = RobotPlace((-1.0, 3.0), True)  # beyond the touch line
    game.robots["blue2"] = RobotPlace((-1.0, 0.3), True)
    game.run(1.0)
    assert game.referee.penalized("red1")
    while game.referee.message().first_half:
        orders = game.run(0.1)
    starts = {
        each.name: each.pose for each in orders if isinstance(each, PutRobot)
    }
    assert {name: pose[:2] for name, pose in starts.items()} == STARTS
    assert {name: pose[2] for name, pose in starts.items()} == {
        name: 0.0 if name.startswith("red") else math.pi for name in STARTS
    }
    assert not game.referee.penalized("red1")
    game.referee.not_put_back("blue2")  # something is there
    assert game.run(0.1) == [PutRobot("blue2", starts["blue2"])]
    while game.referee.phase is not Phase.READY:
        game.run(0.1)
    game.referee.not_put_back("blue2")
    (order,) = game.run(0.1)
    assert isinstance(order, PutRobot)
    assert abs(order.pose[1]) > 1.5, "beside the touch line"
    assert game.referee.penalty("blue2") is Penalty.PICK_UP


def test_a_simulation_that_begins_again_does_not_turn_the_match_back() -> None:
    clock = MatchClock(wait=1000)
    assert [clock.at(stamp) for stamp in (5000, 6000, 9000)] == [-1000, 0, 3000]
    assert [clock.at(stamp) for stamp in (0, 500)] == [3000, 3500]
    waiting = MatchClock(wait=1000)
    assert [waiting.at(stamp) for stamp in (300_000, 300_400, 0, 600)] == [-1000, -600, -600, 0]


def test_a_goal_counts_and_the_other_team_kicks_off() -> None:
    game = Game()
    game.kick_off()
    game.shoot("red2", 0.5, 0.0)
    game.shoot("red2", 2.4, 0.1)
    assert game.referee.score == {"red": 1, "blue": 0}
    goal = game.referee.goals_scored[0]
    assert (goal.team, goal.player, goal.own) == ("red", "red2", False)
    assert game.referee.phase is Phase.READY
    game.run(5.3)
    assert game.ball[:2] == (0.0, 0.0)
    state = decode(game.referee.message().encode())
    assert seen_by(state, 2, 1).own_kick is True
    assert seen_by(state, 2, 1).other_score == 1
    assert seen_by(state, 1, 1).own_score == 1
    assert game.referee.score == {"red": 1, "blue": 0}  # counted once


def test_a_goal_into_the_own_goal_is_one_for_the_others() -> None:
    game = Game()
    game.kick_off()
    game.shoot("red1", -2.4, 0.0)
    goal = game.referee.goals_scored[0]
    assert (goal.team, goal.own) == ("blue", True)


def test_a_hard_kick_past_a_robot_is_of_the_one_that_kicked() -> None:
    game = Game()
    game.kick_off()
    game.robots["blue1"] = RobotPlace((0.24, 0.0), True)
    game.robots["red1"] = RobotPlace((-0.19, -0.17), True)
    for step in range(17):
        game.ball = (-0.15 * step, 0.0, 0.05)
        game.run(0.1)
    (goal,) = game.referee.goals_scored
    assert (goal.team, goal.player, goal.own) == ("blue", "blue1", False)


def test_a_ball_that_is_made_faster_beside_an_opponent_was_hit_by_who_is_behind_it() -> None:
    """A push in a duel: the opponent is nearer to the ball, but before it."""
    game = Game()
    game.kick_off()
    game.shoot("blue2", 0.0, 0.0)
    game.robots["red1"] = RobotPlace((-0.2, -0.05), True)
    game.robots["blue2"] = RobotPlace((0.12, -0.15), True)
    for step in range(1, 25):
        game.ball = (0.1 * step, 0.0, 0.05)
        game.run(0.1)
    (goal,) = game.referee.goals_scored
    assert (goal.team, goal.player, goal.own) == ("red", "red1", False)


def test_a_ball_that_rolls_past_a_robot_was_not_touched_by_it() -> None:
    game = Game()
    game.kick_off()
    game.robots["red1"] = RobotPlace((-1.5, 0.2), True)
    game.shoot("blue1", -0.1, 0.0)
    for step in range(23):
        game.ball = (-0.2 - 0.1 * step, 0.0, 0.05)
        game.run(0.1)
    goal = game.referee.goals_scored[0]
    assert (goal.team, goal.player, goal.own) == ("blue", "blue1", False)


@pytest.mark.parametrize(
    ("name", "out", "kind", "own_kick"),
    [
        ("red1", (0.4, 1.7), SetPlay.KICK_IN, False),
        ("blue1", (0.4, -1.7), SetPlay.KICK_IN, True),
        ("red1", (2.4, 1.0), SetPlay.GOAL_KICK, False),
        ("red1", (-2.4, 1.0), SetPlay.CORNER_KICK, False),
    ],
)
def test_a_ball_that_is_out_is_put_back_for_the_right_team(
    name: str, out: tuple[float, float], kind: SetPlay, own_kick: bool
) -> None:
    game = Game()
    game.kick_off()
    game.shoot(name, *out)
    orders = game.run(1.5)
    assert len(orders) == 1
    assert isinstance(orders[0], PutBall)
    x, y = orders[0].position
    assert abs(x) < SCENE.field.length / 2.0
    assert abs(y) < SCENE.field.width / 2.0
    state = seen_by(decode(game.referee.message().encode()), 1, 1)
    assert (state.set_play, state.own_kick, state.ball_free) == (kind, own_kick, False)
    game.run(11.0)
    assert seen_by(decode(game.referee.message().encode()), 1, 1).ball_free


def test_a_set_play_ends_when_the_ball_moves() -> None:
    game = Game()
    game.kick_off()
    assert not seen_by(decode(game.referee.message().encode()), 2, 1).ball_free
    game.shoot("red2", 0.3, 0.0)
    assert seen_by(decode(game.referee.message().encode()), 2, 1).ball_free


def test_a_robot_that_lies_is_put_back_and_waits() -> None:
    game = Game()
    game.kick_off()
    game.robots["blue2"] = RobotPlace((0.7, 0.0), False)
    orders = []
    for step in range(25):
        game.ball = (0.01 * step, 0.0, 0.05)
        orders += game.run(1.0)
        if orders:
            break
    assert [order.name for order in orders if isinstance(order, PutRobot)] == ["blue2"]
    message = game.referee.message()
    assert message.teams[1].players[1].penalty is Penalty.INCAPABLE
    assert seen_by(message, 2, 2).penalized
    assert game.referee.falls["blue2"] == 1
    game.robots["blue2"] = RobotPlace(STARTS["blue2"], True)
    game.run(RULES.penalty + 0.5)
    assert not seen_by(game.referee.message(), 2, 2).penalized


def test_a_robot_that_leaves_the_field_is_put_back() -> None:
    game = Game()
    game.kick_off()
    game.robots["red1"] = RobotPlace((-1.0, 2.0), True)
    (order,) = game.run(0.2)
    assert isinstance(order, PutRobot)
    left, _ = SCENE.field.entries()
    assert order == PutRobot("red1", left), "beside the touch line, where it left the field"


def test_two_robots_are_not_put_onto_each_other_and_the_other_team_is_in_its_own_half() -> None:
    game = Game()
    game.kick_off()
    for name in ("red1", "red2", "blue1", "blue2"):
        game.robots[name] = RobotPlace((0.1, 2.0), True)
    poses = {order.name: order.pose for order in game.run(0.1) if isinstance(order, PutRobot)}
    assert len(poses) == 4
    for name, (x, y, yaw) in poses.items():
        own = -1.0 if name.startswith("red") else 1.0
        assert own * x > 0.0
        assert abs(y) > SCENE.field.width / 2.0
        assert math.sin(yaw) * y < 0.0, "it looks into the field"
        rest = [pose[:2] for other, pose in poses.items() if other != name]
        assert min(math.dist((x, y), other) for other in rest) > 0.4


def test_the_told_times_count_down_and_never_say_more_than_there_is() -> None:
    game = Game(Rules(half=60.0, ready=5.0, set=2.0, pause=3.0))
    most: dict[Phase, int] = {}
    while not game.referee.over and game.time < 1000.0:
        game.run(0.1)
        game.ball = (0.3 * math.sin(game.time), 0.0, 0.05)
        message = game.referee.message()
        assert message.seconds_remaining <= 60
        most[message.phase] = max(most.get(message.phase, 0), message.secondary_time)
    assert most == {
        Phase.INITIAL: 0, Phase.STANDBY: 0, Phase.READY: 5, Phase.SET: 2, Phase.PLAYING: 10,
        Phase.FINISHED: 3,
    }  # fmt: skip


def test_the_budget_counts_down_with_the_messages_of_a_team() -> None:
    game = Game()
    game.referee.messages["blue"] = 7
    assert [team.message_budget for team in game.referee.message().teams] == [1200, 1193]


def test_a_robot_that_could_not_be_put_back_is_ordered_again_while_its_penalty_lasts() -> None:
    game = Game()
    game.kick_off()
    game.robots["red1"] = RobotPlace((-1.0, 2.0), True)
    (first,) = game.run(0.1)
    game.referee.not_put_back("red1")
    assert game.run(0.5) == [first]
    game.robots["red1"] = RobotPlace(STARTS["red1"], True)
    game.run(RULES.penalty)
    assert not game.referee.penalized("red1")
    game.referee.not_put_back("red1")
    assert not any(isinstance(order, PutRobot) for order in game.run(0.5))


def test_a_ball_that_rests_for_long_is_put_to_the_middle() -> None:
    game = Game()
    game.kick_off()
    game.shoot("red2", 1.0, 0.5)
    orders = game.run(RULES.stuck + 1.0)
    assert orders == [PutBall((0.0, 0.0))]


def test_the_ball_is_not_put_onto_a_robot() -> None:
    for robot in ((0.0, 0.0), (1.0, 1.3), (-2.0, -1.3)):
        place = free_place(robot, [robot])
        assert math.dist(place, robot) > 0.25


def test_who_is_not_in_the_match_waits_as_a_substitute() -> None:
    game = Game()
    game.kick_off()
    message = decode(game.referee.message().encode())
    waits = [number for number in range(1, 21) if seen_by(message, 1, number).penalized]
    assert waits == list(range(3, 21))
    assert message.teams[0].players[2].penalty is Penalty.SUBSTITUTE


def test_players_are_heard_for_a_while_and_strangers_never() -> None:
    call = RollCall([(1, 1), (1, 2), (2, 1)])
    assert call.count(0) == 0
    call.note(1, 1, 0)
    for number in range(3, 200):
        call.note(9, number, 0)
    assert call.count(SILENCE - 1) == 1
    call.note(2, 1, SILENCE)
    assert call.count(SILENCE) == 1
