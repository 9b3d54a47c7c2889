"""What a player does with the packets of a league: each version, penalty, set play and phase.

The packets are put together byte by byte, by the names in the leagues' header files. Run as a
program, this file prints the table of docs/league.md.
"""

import math
import struct
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

from nao_soccer.behavior.basic import START_PLACES
from nao_soccer.behavior.mind import Decision, Mind
from nao_soccer.behavior.situation import Body
from nao_soccer.game_state import GamePhase, GameState, Phase, Role, SetPlay
from nao_soccer.player import SIGNAL_HOLD, TOUCH_WAIT, Identity, Player
from nao_soccer.referee.protocol import VERSIONS, decode
from nao_soccer.team.link import GameTime, TeamLink
from nao_soccer.team.message import NEVER, TeamMessage
from nao_soccer.team.message import decode as decode_team
from nao_soccer.vision.settings import settings_of_scene
from nao_soccer.world.settings import WorldSettings
from nao_soccer.world.state import BallEstimate, Obstacle, PoseEstimate, WorldState
from robot_core.errors import NaoGaitError
from robot_core.field import Field, Goals
from robot_core.robot import load_robot
from robot_core.types import FALLEN, STAND, PoseCovariance

SCENE = settings_of_scene("pitch_small")
GOALS = SCENE.goals or Goals()
SETTINGS = WorldSettings(field=SCENE.field, goals=GOALS)
NAO = load_robot("nao_h21_v33")
PLAYING = 3
STANDS, TO_PLACE, PLAYS, KEEPS_OFF, GUARDS = (
    "stands", "walks to its place", "plays the ball", "keeps 0.75 m from the ball", "guards",
)  # fmt: skip
PLAYS_SHORT = "plays the ball, but not into the goal"
ENTRY, WHERE_IT_STOOD = "beside the touch line", "where it stood"

_SPL = (
    "none", "illegal ball contact", "pushing", "motion in set", "inactive", "illegal position",
    "leaving", "pick-up", "local game stuck", "illegal position in set", "stance",
)  # fmt: skip
_OLD = dict(enumerate(_SPL)) | {14: "substitute", 15: "manual"}
_HSL = (
    "none", "illegal positioning", "motion in set", "local game stuck", "incapable", "pick-up",
    "ball holding", "leaving", "arms or hands", "pushing", "sent off", "substitute",
)  # fmt: skip
_HSL_20 = (
    "none", "illegal positioning", "motion in set", "motion in stop", "local game stuck",
    "incapable", "pick-up", "ball holding", "leaving", "arms or hands", "pushing", "cautioned",
    "sent off", "substitute",
)  # fmt: skip
PENALTIES = {
    15: _OLD, 16: _OLD | {11: "motion in initial"}, 17: _OLD | {11: "motion in initial"},
    18: _OLD | {11: "motion in standby"}, 19: dict(enumerate(_HSL)), 20: dict(enumerate(_HSL_20)),
}  # fmt: skip
IN_PLACE = ("motion in set", "motion in initial", "motion in standby", "motion in stop")
SPL_SET_PLAYS = ("none", "goal kick", "pushing free kick", "corner kick", "kick-in", "penalty kick")
HSL_SET_PLAYS = (
    "none", "direct free kick", "indirect free kick", "penalty kick", "throw-in", "goal kick",
    "corner kick",
)  # fmt: skip
STATES = ("initial", "ready", "set", "playing", "finished", "standby")
PARTS = ("normal", "shoot-out", "extra time", "timeout")


def packet(
    version: int,
    *,
    state: int = PLAYING,
    set_play: int = 0,
    part: int = 0,
    kicking: int = 255,
    penalty: int = 0,
    keeper: int = 0,
    stopped: bool = False,
    count: int = 1,
    secondary: int = 0,
    first: bool = True,
) -> bytes:
    """A packet of teams 1 and 2 with the penalty of player 1 of team 1; others are substitutes."""
    old = version <= 18
    data = b"RGme" + bytes((version, count, 5, 0, 0 if old else stopped, part, state, set_play))
    data += bytes((first, kicking)) + struct.pack("<hh", 300, secondary)
    extra = bytes({19: 2, 20: 1}.get(version, 0))
    away = 14 if old else 11 if version == 19 else 13
    for number in (1, 2):
        data += bytes((number, 0, 2, keeper if number == 1 else 0, 0, 0))
        data += struct.pack("<HH", 0, 1200)
        for player in range(1, 21):
            mine = penalty if number == 1 else 0
            data += bytes((mine if player == 1 else away, 0)) + extra
    return data


def world(
    ball: tuple[float, float] | None = (0.4, 0.05), time: float = 0.0, *, valid: bool = True
) -> WorldState:
    """The robot stands in the middle, and sees the ball [m] before it."""
    estimate = None
    if ball is not None:
        var = (0.0004, 0.0, 0.0004)
        estimate = BallEstimate(ball, (0.0, 0.0), var, ball, (0.0, 0.0), var, var, 0.1, True)
    pose = PoseEstimate((0.0, 0.0, 0.0), PoseCovariance(xx=0.001, yy=0.001, yaw=0.001), valid)
    return WorldState(round(time * 1e9), pose, estimate, ())


def act(player: Player, start: float = 0.0) -> Decision:
    """The last one of some decisions."""
    for tick in range(6):
        decision = player.decide_in(world(time=start + 0.05 * tick), Body())
    return decision


def doing(decision: Decision) -> str:
    """What a decision does, in the words of the table."""
    states = [each.state for each in decision.path]
    if "play" not in states[1:2]:
        return TO_PLACE if "take place" in states else STANDS
    if "keeper" in states:
        return GUARDS
    if states[-1] == "wait":
        x, y = decision.action.walk.x, decision.action.walk.y
        return KEEPS_OFF if 0.4 * x + 0.05 * y < 0.0 else f"walks to the ball, {states}"
    return PLAYS if "play the ball" in [each.option for each in decision.path] else str(states)


@cache
def reaction(**fields: int) -> str:
    """What a new player does after this packet."""
    player = Player(Identity(1, 1, 1), NAO, SETTINGS)
    player.hear_referee(packet(**fields), 0.0)
    done = doing(act(player))
    if done == PLAYS and not shoots(player, 0.3):
        return PLAYS_SHORT
    return done


def before_goal(time: float, *others: tuple[float, float]) -> WorldState:
    """The ball lies a metre before the goal; others [m] as the robot behind it sees them."""
    x = SCENE.field.length / 2.0 - 1.0
    state = world((0.3, 0.05), time)
    assert state.ball is not None
    var = (0.01, 0.0, 0.01)
    robots = tuple(
        Obstacle(each, (x - 0.3 + each[0], each[1]), var, (0.0, 0.0), None, False, 0.1)
        for each in others
    )
    return replace(
        state, own=replace(state.own, pose=(x - 0.3, 0.0, 0.0)),
        ball=replace(state.ball, position_in_field=(x, 0.05)), obstacles=robots,
    )  # fmt: skip


def shoots(player: Player, time: float, *others: tuple[float, float]) -> bool:
    """Whether the player means to send a ball before the goal into it, and not past it."""
    plan = player.decide_in(before_goal(time, *others), Body(STAND)).plan
    assert plan is not None
    return plan.seconds < 5.0


@cache
def after_penalty(version: int, code: int) -> str:
    """Where the player takes itself to be when its penalty is over."""
    player = Player(Identity(1, 1, 1), NAO, SETTINGS, (-1.0, 1.0, 0.0))
    stamp = 0
    for count, penalty in enumerate((0, code, 0), start=1):
        state = 1 if count == 1 else PLAYING  # it was there before the game began
        data = packet(version, state=state, penalty=penalty, count=count)
        player.hear_referee(data, stamp * 1e-9)
        player.decide(Body(), stamp)
        for _ in range(10):
            stamp += 10_000_000
            player.world.add_odometry(stamp, (0.0, 0.0, 0.0))
        decision = player.decide(Body(), stamp)
        assert decision is not None
    x, y, _ = decision.world.own.pose
    if math.dist((x, y), (-1.0, 1.0)) < 0.3:
        return WHERE_IT_STOOD
    entry = SCENE.field.entries()[0]
    return ENTRY if abs(x - entry[0]) < 0.3 and abs(y) < entry[1] + 0.1 else f"{x:.1f}, {y:.1f}"


Row = tuple[str, str, str, str, str]
"""What, its name, what the player does and is expected to do, and what comes after it."""


@cache
def rows(version: int) -> list[tuple[Row, str]]:
    """The rows of a version, each with what is right."""
    found: list[tuple[Row, str]] = []

    def add(what: str, name: str, right: str, after: str = "", **fields: int) -> None:
        found.append(((what, name, reaction(version=version, **fields), right, after), right))

    last = 6 if version in (17, 18) else 5
    for state, name in enumerate(STATES[:last]):
        add("state", name, {1: TO_PLACE, 3: PLAYS}.get(state, STANDS), state=state)
    for code, name in PENALTIES[version].items():
        if code:
            after = WHERE_IT_STOOD if name in IN_PLACE else ENTRY
            got = after_penalty(version, code)
            add("penalty", name, STANDS, f"then {got}", penalty=code)
            assert got == after, (version, name, got)
    for code, name in enumerate(SPL_SET_PLAYS if version <= 18 else HSL_SET_PLAYS):
        # Without a set play it is a kick-off, whose time for the kicking team runs.
        what = {"set_play": code, "secondary": 8}
        name = name if code else "kick-off"
        right = PLAYS_SHORT if name == "indirect free kick" else PLAYS
        add("set play of the own team", name, right, kicking=1, **what)
        add("set play of the others", name, KEEPS_OFF, kicking=2, **what)
    for part, name in enumerate(PARTS):
        if name == "shoot-out":
            add(name, "own shot, the kicker", PLAYS, part=part, kicking=1, set_play=5)
            add(name, "own shot, before it", STANDS, part=part, kicking=1, state=2)
            keeps = {"part": part, "kicking": 2, "keeper": 1}
            add(name, "shot of the others, the goalkeeper", GUARDS, **keeps)
            add(name, "nobody's shot", STANDS, part=part)
            waits = 14 if version <= 18 else 11 if version == 19 else 13
            add(name, "who was not chosen", STANDS, part=part, kicking=1, penalty=waits)
        else:
            right = STANDS if name == "timeout" else PLAYS
            add("game phase", name, right, part=part)
    if version > 18:
        add("stopped", "stopped", STANDS, stopped=True)
    return found


def table() -> str:
    """The table of docs/league.md; packets with the same answer share a row."""
    versions: dict[tuple[str, str, str], list[int]] = {}
    for version in VERSIONS:
        for (what, name, got, _, after), _ in rows(version):
            answer = f"{got}, {after}" if after else got
            versions.setdefault((what, name, answer), []).append(version)
    found: dict[tuple[str, str], dict[tuple[int, ...], list[str]]] = {}
    for (what, name, answer), known in versions.items():
        assert known == list(range(known[0], known[-1] + 1))
        found.setdefault((what, answer), {}).setdefault(tuple(known), []).append(name)
    lines = ["| packet | the player | if it says (only in versions) |", "|---|---|---|"]
    for (what, answer), names in found.items():
        said = []
        for known, same in names.items():
            span = f" ({'-'.join(map(str, dict.fromkeys((known[0], known[-1]))))})"
            said.append(", ".join(same) + ("" if known == tuple(VERSIONS) else span))
        lines.append(f"| {what} | {answer} | {'; '.join(said)} |")
    return "\n".join(lines) + "\n"


@pytest.mark.xdist_group("league")  # they share the players of `rows`
@pytest.mark.parametrize("version", VERSIONS)
def test_a_player_does_what_the_packet_asks_for(version: int) -> None:
    wrong = [row for row, right in rows(version) if row[2] != right]
    assert not wrong


@pytest.mark.xdist_group("league")
def test_the_table_in_the_docs_is_that_of_the_code() -> None:
    page = Path(__file__).parents[2] / "docs" / "league.md"
    assert table() in page.read_text(encoding="utf-8")


@pytest.mark.parametrize("version", [14, 21])
def test_other_versions_are_refused_in_one_line(version: int) -> None:
    with pytest.raises(NaoGaitError, match="version") as error:
        decode(packet(18)[:4] + bytes((version,)) + packet(18)[5:])
    assert "\n" not in str(error.value)


# -- set plays -------------------------------------------------------------------------------------

OTHERS_KICK = GameState(own_kick=False, ball_free=False, set_play=SetPlay.KICK_IN)


@pytest.mark.parametrize("role", [Role.STRIKER, Role.SUPPORTER])
@pytest.mark.parametrize("valid", [True, False])
def test_nobody_goes_near_the_ball_in_a_set_play_of_the_others(role: Role, *, valid: bool) -> None:
    """From each state that can be reached while the ball is free, and for half a minute."""
    for before in (0, 3, 30, 70, 130, 260, 300):
        mind = Mind(_kicks(), SCENE.field, GOALS)
        time = 0.0
        for tick in range(before):
            time = 0.05 * tick
            mind.update(world((0.3, 0.0), time, valid=valid), Body(), GameState(), role)
        for _ in range(40):
            time += 0.05
            near = world((0.3, 0.0), time, valid=valid)
            decision = mind.update(near, Body(), OTHERS_KICK, role)
            assert decision.action.walk.x <= 0.0, decision.path
            assert not decision.action.motion
    assert decision.action.walk.x < 0.0, "it steps back"
    for tick in range(200):  # and does not come back
        far = world((GameState().ball_distance + 0.02, 0.0), time + 0.05 * tick, valid=valid)
        walk = mind.update(far, Body(), OTHERS_KICK, role).action.walk
        assert walk.x < 0.05


def _kicks():
    from nao_soccer.behavior.kicks import kicks_of

    return kicks_of(NAO.motions)


@pytest.mark.parametrize("scene", ["spl", "hsl_small"])
@pytest.mark.parametrize("kind", [SetPlay.GOAL_KICK, SetPlay.PENALTY_KICK])
def test_a_striker_waits_outside_of_the_penalty_area(scene: str, kind: SetPlay) -> None:
    field = settings_of_scene(scene).field
    assert isinstance(field, Field)
    mind = Mind(_kicks(), field, GOALS)
    side = 1.0 if kind is SetPlay.GOAL_KICK else -1.0
    mark = side * (field.length / 2.0 - field.penalty_mark)
    inside = side * (field.length / 2.0 - field.penalty_area_length + 0.2)
    here = world(None)
    own = replace(here.own, pose=(inside, 0.0, 0.0 if side > 0.0 else math.pi))
    ball = world((abs(mark - inside), 0.0)).ball
    assert ball is not None
    ball = replace(ball, position_in_field=(mark, 0.0))
    game = replace(OTHERS_KICK, set_play=kind)
    for tick in range(20):
        state = replace(here, own=own, ball=ball, stamp=tick * 50_000_000)
        decision = mind.update(state, Body(), game)
    assert decision.action.walk.x < -0.02, "backwards, out of the area"


def test_who_took_an_indirect_free_kick_scores_when_another_one_has_touched_the_ball() -> None:
    for mates_wait in (True, False):
        player = Player(Identity(1, 1, 2), NAO, SETTINGS)
        player.hear_referee(packet(20, set_play=2, kicking=1), 0.0)
        act(player)
        assert player.role is Role.STRIKER
        player.hear_referee(packet(20, count=2), 1.0)
        assert not shoots(player, 1.0)
        assert not shoots(player, 2.0, (0.3, 1.0)), "it stands aside"
        message = player.team_message(2.0)
        assert message is not None
        assert decode_team(message).seconds_to_ball == NEVER, "a mate is to go to the ball"
        if mates_wait:
            assert not shoots(player, 10.0)
            assert shoots(player, 1.0 + TOUCH_WAIT)
        else:
            assert shoots(player, 3.0, (0.3, 0.3))
            assert shoots(player, 4.0), "for good"


def test_a_new_half_begins_where_the_first_one_did() -> None:
    start = (-2.0, -1.5, 1.57)
    for known, places in ((start, [start]), (None, SCENE.field.entries())):
        player = Player(Identity(1, 1, 1), NAO, SETTINGS, known)
        stamp = 0

        def pose_after(data: bytes, player: Player = player) -> tuple[float, float, float]:
            nonlocal stamp
            player.hear_referee(data, stamp * 1e-9)
            for _ in range(10):
                stamp += 10_000_000
                player.world.add_odometry(stamp, (0.0, 0.0, 0.0))
            decision = player.decide(Body(), stamp)
            assert decision is not None
            return decision.world.own.pose

        pose_after(packet(18, state=0))
        player.world.start(((1.0, 1.0, 0.0),))
        for count, state in enumerate((1, 2, PLAYING, 4), start=2):
            pose = pose_after(packet(18, state=state, count=count))
            assert math.dist(pose[:2], (1.0, 1.0)) < 0.3, "where it played"
        pose = pose_after(packet(18, state=0, count=6, first=False))
        assert min(math.dist(pose[:2], place[:2]) for place in places) < 0.3
        player.world.start(((1.0, 1.0, 0.0),))
        for count, state in enumerate((5, 1, 2, PLAYING), start=7):
            pose = pose_after(packet(18, state=state, count=count, first=False))
            assert math.dist(pose[:2], (1.0, 1.0)) < 0.3, "once"


def test_a_stopped_game_lets_nobody_get_up() -> None:
    mind = Mind(_kicks(), SCENE.field, GOALS)
    down = replace(world(), upright=False)
    stopped = mind.update(down, Body(FALLEN), GameState(stopped=True))
    assert not stopped.action.motion
    assert mind.update(down, Body(FALLEN), GameState()).action.motion == "get_up"


# -- places ----------------------------------------------------------------------------------------


def _target(field: Field, ball: tuple[float, float], rank: int, phase: Phase) -> tuple:
    """Where a supporter goes: the place at which it stands still."""
    mind = Mind(_kicks(), field, GOALS)
    mate = world()
    striker = replace_mate(mate)
    x, y, yaw = -2.0, 0.1 * rank, 0.0
    for tick in range(3000):
        estimate = world(ball).ball
        assert estimate is not None
        dx, dy = ball[0] - x, ball[1] - y
        c, s = math.cos(yaw), math.sin(yaw)
        seen = replace(estimate, position=(c * dx + s * dy, c * dy - s * dx))
        own = PoseEstimate((x, y, yaw), PoseCovariance(xx=0.001, yy=0.001, yaw=0.001), True)
        state = WorldState(tick * 50_000_000, own, seen, ())
        game = GameState(phase=phase)
        walk = mind.update(state, Body(), game, Role.SUPPORTER, striker, rank).action.walk
        if tick > 20 and walk.is_zero:
            return x, y
        x += 0.05 * (c * walk.x - s * walk.y)
        y += 0.05 * (s * walk.x + c * walk.y)
        yaw = math.remainder(yaw + 0.05 * walk.yaw, math.tau)
    return x, y


def replace_mate(_state: WorldState):
    """A striker somewhere."""
    from nao_soccer.world.state import TeamMate

    return TeamMate(9, 0, (0.0, 0.0, 0.0), True, False, None)


@pytest.mark.parametrize("scene", ["spl", "hsl_small"])
@pytest.mark.parametrize("phase", [Phase.READY, Phase.PLAYING])
@pytest.mark.parametrize("ball", [(0.0, 0.0), (-2.5, -1.0), (3.8, -2.5)])
def test_each_supporter_of_a_team_has_its_own_place(
    scene: str, phase: Phase, ball: tuple[float, float]
) -> None:
    field = settings_of_scene(scene).field
    assert isinstance(field, Field)
    places = [_target(field, ball, rank, phase) for rank in range(len(START_PLACES))]
    apart = min(
        math.dist(places[i], places[j]) for i in range(len(places)) for j in range(i)
    )
    assert apart > 0.45, places
    if phase is Phase.READY:
        assert max(x for x, _ in places) < -0.3, "in its own half"


# -- messages --------------------------------------------------------------------------------------


MESSAGE = TeamMessage(
    1, 1, 0, 0, (0.0, 0.0, 0.0), True, False, False, Role.STRIKER, 1.0, None
)  # fmt: skip


def spent(players: int, budget: int, *, extra: bool) -> tuple[list[int], int]:
    """Messages of a team in each half of 10 min (extra time: 5 min), and what is left."""
    radios = [TeamLink(1, number, Field(), players) for number in range(1, players + 1)]
    clocks = [GameTime() for _ in radios]
    halves: list[int] = []
    parts = [(GamePhase.NORMAL, True, 600), (GamePhase.NORMAL, False, 600)]
    if extra:
        parts += [(GamePhase.EXTRA_TIME, True, 300), (GamePhase.EXTRA_TIME, False, 300)]
    left, now = budget, 0.0
    told: GameState | None = None
    for part, first, length in parts:
        sent = last = 0
        for tick in range(-55 * 5, length * 5):  # to the places before the kick-off, then play
            now += 0.2
            phase = Phase.READY if tick < 0 else Phase.PLAYING
            remaining = float(math.ceil(length - max(0, tick) / 5))
            game = GameState(
                phase, seconds_remaining=remaining, first_half=first, game_phase=part,
                message_budget=left,
            )  # fmt: skip
            if told is None or tick % 3 == 0:  # a packet each 0.6 s
                told = game
            for radio, clock in zip(radios, clocks, strict=True):
                clock.hear(told)
                data = radio.send(
                    now, lambda _: MESSAGE, urgent=tick % 20 == 0, budget=told.message_budget,
                    remaining=clock.left(told),
                )  # fmt: skip
                if data is not None:
                    left, sent, last = left - 1, sent + 1, tick
        assert last > (length - 30) * 5, "to the end"
        halves.append(sent)
    return halves, left


@pytest.mark.parametrize("players", [2, 4, 5, 7])
@pytest.mark.parametrize("budget", [1200, 12000])
@pytest.mark.parametrize("extra", [False, True])
def test_the_budget_lasts_to_the_end_of_both_halves(
    players: int, budget: int, *, extra: bool
) -> None:
    halves, left = spent(players, budget, extra=extra)
    assert left >= 0
    assert halves[0] < 0.55 * budget
    assert halves[1] > 0.5 * halves[0]


# -- whistle and gesture ---------------------------------------------------------------------------


def test_the_whistle_begins_the_game_and_one_of_another_field_is_forgotten() -> None:
    player = Player(Identity(1, 1, 1), NAO, SETTINGS)
    player.hear_referee(packet(18, state=1, kicking=2), 0.0)
    player.hear_whistle(0.1)
    assert player.game.phase is Phase.READY, "a whistle means something in set only"
    player.hear_referee(packet(18, state=2, kicking=2, count=2), 1.0)
    player.hear_whistle(1.2)
    assert player.game.phase is Phase.PLAYING
    assert doing(act(player, 1.2)) == KEEPS_OFF
    player.hear_referee(packet(18, state=2, kicking=2, count=3), 12.0)
    assert player.game.phase is Phase.PLAYING
    assert player.game.ball_free
    player.hear_referee(packet(18, state=2, kicking=2, count=4), 1.2 + SIGNAL_HOLD)
    assert player.game.phase is Phase.SET, "nobody else heard it"
    player.hear_referee(packet(18, state=3, kicking=255, count=5), 20.0)
    player.hear_whistle(20.5)
    assert player.game.phase is Phase.PLAYING


def test_the_gesture_sends_the_robots_to_their_places() -> None:
    player = Player(Identity(1, 1, 1), NAO, SETTINGS)
    player.hear_referee(packet(18, state=5), 0.0)
    assert doing(act(player)) == STANDS
    player.hear_gesture("ready", 1.0)
    assert doing(act(player, 1.0)) == TO_PLACE
    with pytest.raises(NaoGaitError, match="gesture"):
        player.hear_gesture("goal", 2.0)


if __name__ == "__main__":
    sys.stdout.write(table())
