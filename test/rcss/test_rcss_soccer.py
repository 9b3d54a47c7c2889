"""A player on the server: places, game, voice and eyes, and what it answers."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gait_lab.cli import main
from gait_lab.rcss.agent import Agent
from gait_lab.rcss.eyes import ServerEyes
from gait_lab.rcss.field import ServerField
from gait_lab.rcss.game import game_state, mode_of
from gait_lab.rcss.match import TeamProcess, guest_words, play, starts
from gait_lab.rcss.player import PLANS
from gait_lab.rcss.server import is_installed
from gait_lab.rcss.speech import pack, unpack
from nao_lipm_gait import load_robot
from nao_soccer.behavior.ball_plan import Planner
from nao_soccer.behavior.kicks import kicks_of
from nao_soccer.behavior.walking import WalkLimits
from nao_soccer.game_state import Phase, Role, SetPlay
from nao_soccer.team.message import BallMessage, TeamMessage
from nao_soccer.vision.percepts import Kind
from rcss_bridge.codec import SPEECH_MAX, Game, Polar, SeenPlayer, Sight
from rcss_bridge.joints import server_robot
from rcss_server import cycle_message
from robot_core.errors import NaoGaitError
from robot_core.types import STANDSTILL

K1 = load_robot("booster_k1")
SERVER_K1 = server_robot("K1")
STAND = [
    math.degrees(K1.stand_pose[K1.index(joint)]) for joint in SERVER_K1.effectors
]


def game(mode: str, ours: str = "left") -> Game:
    teams = ("us", "them") if ours == "left" else ("them", "us")
    return Game(12.0, mode, *teams, (2, 1))


# -- the game --------------------------------------------------------------------------------------


@pytest.mark.parametrize("ours", ["left", "right"])
@pytest.mark.parametrize(
    ("mode", "phase", "set_play"),
    [
        ("KickOff", Phase.PLAYING, SetPlay.NONE), ("KickIn", Phase.PLAYING, SetPlay.KICK_IN),
        ("corner_kick", Phase.PLAYING, SetPlay.CORNER_KICK),
        ("goal_kick", Phase.PLAYING, SetPlay.GOAL_KICK),
        ("direct_free_kick", Phase.PLAYING, SetPlay.FREE_KICK), ("Goal", Phase.SET, SetPlay.NONE),
    ],
)  # fmt: skip
def test_a_set_play_is_ours_or_theirs(ours: str, mode: str, phase: Phase, set_play: SetPlay):
    theirs = "right" if ours == "left" else "left"
    state = game_state(game(f"{mode}_{ours}", ours), "us", 3, 4.0)
    assert (state.phase, state.set_play, state.own_kick) == (phase, set_play, True)
    assert (state.own_score, state.other_score) == ((2, 1) if ours == "left" else (1, 2))
    state = game_state(game(f"{mode}_{theirs}", ours), "us", 3, 4.0)
    assert state.own_kick is False
    assert state.phase is (Phase.SET if mode == "KickOff" else phase)
    assert not game_state(game(f"{mode}_{theirs}", ours), "us", 3, 4.0).goalkeeper


def test_play_on_is_everybodys_and_unknown_modes_are_played():
    for mode in ("PlayOn", "something_new"):
        state = game_state(game(mode), "us", 1, 4.0)
        assert (state.phase, state.own_kick, state.ball_free) == (Phase.PLAYING, None, True)
        assert state.goalkeeper
    assert game_state(game("GameOver"), "us", 1, 4.0).phase is Phase.FINISHED
    assert mode_of(game("BeforeKickOff"), "us").puts_back


# -- the voice -------------------------------------------------------------------------------------

METRES = st.floats(-26.0, 26.0)


@given(METRES, METRES, st.floats(-3.1, 3.1), METRES, METRES, st.floats(0.0, 3.5))
def test_what_is_said_is_understood_in_the_size_of_any_robot(x, y, yaw, bx, by, age):
    said = TeamMessage(
        0, 5, 0, 0, (x, y, yaw), True, False, False, Role.STRIKER, 7.5,
        BallMessage((bx, by), (0.0, 0.0), 0.5, age),
    )  # fmt: skip
    data = pack(said, "us", 1.0)
    assert len(data) == SPEECH_MAX
    heard = unpack(data, "us", 2.0)
    assert np.array(heard.pose[:2]) * 2.0 == pytest.approx((x, y), abs=0.05)
    assert abs(math.remainder(heard.pose[2] - yaw, math.tau)) <= math.pi / 64.0 + 1e-9
    assert heard.ball is not None
    assert np.array(heard.ball.position) * 2.0 == pytest.approx((bx, by), abs=0.05)
    assert heard.ball.age == pytest.approx(age, abs=0.126)
    assert heard.ball.deviation == pytest.approx(0.25)
    assert (heard.player, heard.role, heard.seconds_to_ball) == (5, Role.STRIKER, 7.5)
    assert unpack(pack(replace(said, ball=None), "us", 1.0), "us", 1.0).ball is None


@given(st.binary(max_size=12))
def test_other_teams_messages_are_refused_or_are_messages(data: bytes):
    try:
        heard = unpack(data, "us", 1.7)
    except NaoGaitError:
        return
    heard.encode()


# -- the eyes --------------------------------------------------------------------------------------


def polar(point: np.ndarray) -> Polar:
    distance = float(np.linalg.norm(point))
    return Polar(distance, math.atan2(point[1], point[0]), math.asin(point[2] / distance))


@pytest.fixture(scope="module")
def field() -> ServerField:
    return ServerField("fifa7vs7", K1.size)


def sight_from(x: float, y: float, yaw: float, field: ServerField, height: float) -> Sight:
    """Everything before a camera that looks level, at a pose [m] in the field."""
    c, s = math.cos(yaw), math.sin(yaw)

    def seen(place: tuple[float, float], z: float) -> Polar:
        dx, dy = place[0] - x, place[1] - y
        return polar(np.array((c * dx + s * dy, c * dy - s * dx, z - height)))

    marks = {
        name: seen((K1.size * mx, K1.size * my), 0.0) for name, (mx, my) in field.marks.items()
    }
    ahead = {name: each for name, each in marks.items() if abs(each.azimuth) < 1.0}
    head = seen((x + 2.0 * c, y + 2.0 * s), 0.8)
    mate = SeenPlayer("us", 7, {"head": head})
    myself = SeenPlayer("us", 3, {"lfoot": seen((x + 0.1 * c, y + 0.1 * s), 0.1)})
    return Sight(ahead, seen((x + 3.0 * c, y + 3.0 * s), 0.11), (mate, myself))


LEVEL = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def test_exact_eyes_see_things_where_they_are_at_the_size_of_a_nao(field: ServerField):
    eyes = ServerEyes(K1, field, "us", 3, exact=True)
    torso = (0.0, 0.0, 0.5, 0.0, 0.0, 0.0)
    camera = eyes._camera.in_torso(K1.stand_pose).position
    pose = (-8.0 + camera[0], 2.0, 0.0)
    eyes.look(20_000_000, sight_from(*pose, field, 0.5 + camera[2]), K1.stand_pose, torso)
    (percepts,) = eyes.arrived(20_000_000)
    poles = field.poles
    seen = [each for each in percepts.objects if each.kind is Kind.POLE]
    assert len(seen) > 5
    for each in seen:
        assert each.place is not None
        place = np.array(each.position) + np.array((-8.0, 2.0)) / K1.size
        assert place == pytest.approx((poles[each.place].x, poles[each.place].y), abs=1e-6)
    (mate,) = [each for each in percepts.objects if each.kind is Kind.ROBOT_RED]
    assert mate.position == pytest.approx(((2.0 + camera[0]) / K1.size, 0.0), abs=1e-6)
    assert percepts.ball is not None
    assert percepts.ball.position == pytest.approx(((3.0 + camera[0]) / K1.size, 0.0), abs=1e-6)


def test_eyes_err_miss_and_are_late_as_measured(field: ServerField):
    eyes = ServerEyes(K1, field, "us", 3, exact=False)
    torso = (0.0, 0.0, 0.5, 0.0, 0.0, 0.0)
    camera = eyes._camera.in_torso(K1.stand_pose).position
    sight = sight_from(-8.0 + camera[0], 2.0, 0.0, field, 0.5 + camera[2])
    found = []
    for count in range(200):
        eyes.look(count * 80_000_000, sight, K1.stand_pose, torso)
        found += eyes.arrived(count * 80_000_000)
    assert 195 < len(found) < 200, "the last ones are on their way"
    balls = np.array([each.ball.position for each in found if each.ball is not None])
    assert 0.0 < np.std(balls[:, 0]) < 0.2
    assert np.mean(balls[:, 0]) == pytest.approx((3.0 + camera[0]) / K1.size, abs=0.2)
    counts = [len(each.objects) for each in found]
    assert min(counts) < max(counts) < len(sight.marks), "far landmarks are missed"


def test_landmarks_of_the_teams_are_each_others_reflection(field: ServerField):
    left, right, poles = field.places(right=False), field.places(right=True), field.poles
    assert len(left) == len(set(right.values())) == 30
    for name, index in left.items():
        mine, theirs = poles[index], poles[right[name]]
        assert (mine.x, mine.y) == (-theirs.x, -theirs.y)
    assert poles[left["g_lup"]].x < 0.0 < poles[left["g_lup"]].y


# -- a player in a match ---------------------------------------------------------------------------


def messages(mode: str, count: int, first: int, field: ServerField, more=()):
    """A K1 that stands at the place of a player 2, and sees from there."""
    seen = sight_from(-6.15, 0.0, 0.0, field, 0.83)

    def pol(each: Polar) -> list:
        return ["pol", each.distance, math.degrees(each.azimuth), math.degrees(each.elevation)]

    see = ["See", *[[name, pol(each)] for name, each in seen.marks.items()], ["B", pol(seen.ball)]]
    for index in range(first, first + count):
        yield cycle_message(
            SERVER_K1, 0.02 * index, angles=STAND, mode=mode,
            more=[*([see] if index % 2 == 0 else []), *more],
        )  # fmt: skip


def test_a_player_takes_its_place_waits_and_goes_to_the_ball(field: ServerField):
    agent = Agent(SERVER_K1, "ours", number=2, field="fifa7vs7", exact=True)
    assert agent.player is not None
    answers = [
        agent.cycle(each, STANDSTILL) for each in messages("BeforeKickOff", 150, 0, field)
    ]
    assert b"(beam " in answers[0]
    assert not any(b"(beam " in each for each in answers[1:])
    assert agent.player.command == STANDSTILL
    answers = [agent.cycle(each, STANDSTILL) for each in messages("KickOff_Left", 60, 150, field)]
    assert agent.player.command.x > 0.1
    own = agent.player.decision.world.own
    assert own.valid
    assert K1.size * own.pose[0] == pytest.approx(-6.2, abs=0.4)
    assert any(b"(SPK say " in each for each in answers)
    for each in messages("KickOff_Right", 10, 210, field):
        agent.cycle(each, STANDSTILL)
    assert agent.player.command == STANDSTILL


@pytest.mark.parametrize(
    ("mode", "waits"),
    [
        ("KickOff_Left", True), ("KickIn_Left", True), ("free_kick_left", True),
        ("goal_kick_left", False), ("PlayOn", False),
    ],
)  # fmt: skip
def test_whoever_may_touch_a_ball_once_waits_behind_it(
    mode: str, waits: bool, field: ServerField
):
    agent = Agent(SERVER_K1, "ours", number=2, field="fifa7vs7", exact=True)
    for each in messages(mode, 60, 0, field):
        agent.cycle(each, STANDSTILL)
    player = agent.player
    assert player is not None
    assert player.decision is not None
    assert player.player.role is Role.STRIKER
    assert player.command.x > 0.1, "it goes to the ball in any case"
    assert ("wait" in [each.state for each in player.decision.path]) is waits
    assert player.player.game.ball_distance < 0.5 or not waits


def test_in_the_second_half_it_plays_on_the_other_side(field: ServerField):
    agent = Agent(SERVER_K1, "theirs", number=2, field="fifa7vs7", exact=True)
    assert agent.player is not None
    answers = [agent.cycle(each, STANDSTILL) for each in messages("BeforeKickOff", 4, 0, field)]
    assert float(answers[0].split(b"(beam ")[1].split()[0]) < 0.0, "the server turns it"
    places = agent.player._eyes.places
    assert field.poles[places["g_lup"]].x > 0.0, "the left goal is the opponents'"


def test_after_a_goal_all_go_back_to_their_places(field: ServerField):
    agent = Agent(SERVER_K1, "ours", number=2, field="fifa7vs7", exact=True)
    for each in messages("PlayOn", 5, 0, field):
        assert b"(beam " not in agent.cycle(each, STANDSTILL)
    (answer,) = [
        each
        for each in (agent.cycle(one, STANDSTILL) for one in messages("Goal_Right", 5, 5, field))
        if b"(beam " in each
    ]
    x = float(answer.split(b"(beam ")[1].split()[0])
    assert -1.5 < x < 0.0, "the team that kicks off stands at the ball"


@pytest.mark.parametrize("table", ["booster_k1_rcss", "booster_t1_rcss"])
def test_a_kick_goes_past_a_robot_that_is_far_in_its_way(field: ServerField, table: str):
    limits, own, ball, robot = WalkLimits(), (-0.4, 0.0, 0.0), (0.0, 0.0), (3.0, 0.0)
    kicks = kicks_of(table)
    planner = Planner(kicks, limits, field.field, field.goals, PLANS)
    free, past = planner.choose(own, ball), planner.choose(own, ball, [robot])
    assert not free.dribbles
    assert not past.dribbles
    assert abs(free.direction) < 0.05 < abs(past.direction) < 0.3


# -- matches of the bench --------------------------------------------------------------------------


def test_a_robot_alone_and_its_ball_begin_within_8_m_of_the_goal():
    found = list(starts(200, 27.5))
    assert found == list(starts(200, 27.5))
    for robot, ball in found:
        assert 2.9 < math.dist(ball, (27.5, 0.0)) < 8.1
        assert math.dist(robot[:2], ball) < 3.1
        assert robot[0] < 27.5


@pytest.mark.slow
@pytest.mark.skipif(not is_installed(), reason="rcsssmj is not installed")
def test_the_real_server_plays_the_end_of_a_half():
    account = play(SERVER_K1, (1, 1), 6.0, exact=True)
    assert account.ended
    assert account.seconds == pytest.approx(6.0, abs=0.1)
    assert account.falls == account.get_ups == account.put_back == 0
    assert len(account.cpu) == pytest.approx(2 * 300, abs=6), "of both, from the kick-off on"
    assert account.server > 0.0


@pytest.mark.parametrize("command", ["", "  ", 'python "x', "no-such-program {port}", "/"])
def test_another_teams_command_is_refused_before_the_server_starts(command: str, capsys):
    assert main(["bench", "rcss_match", "--against", command]) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert "against: got" in line


def test_another_teams_command_names_port_and_number():
    words = guest_words("python 'a {b}.py' -n{number} --port {port}", 3100, 7)
    assert words == ["python", "a {b}.py", "-n7", "--port", "3100"]


def test_a_team_that_finds_no_server_says_so():
    with (
        TeamProcess(1, SERVER_K1, "left_team", 1, 0.0, exact=True) as team,
        pytest.raises(NaoGaitError, match="server"),
    ):
        team.join()
