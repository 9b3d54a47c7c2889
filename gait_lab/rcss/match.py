"""Players on a server of the bench: a robot alone in this process, or a match of two teams."""

import math
import multiprocessing
import os
import select
import shlex
import shutil
import statistics
import subprocess
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from typing import NamedTuple

import numpy as np

from gait_lab.demo.node_processes import end_with_parent
from gait_lab.rcss.agent import BEFORE_KICK_OFF, Agent
from gait_lab.rcss.field import FIELD
from gait_lab.rcss.game import HALF
from gait_lab.rcss.server import Server
from nao_soccer.game_state import Role
from nao_soccer.world.state import WorldState
from rcss_bridge.body import CYCLE
from rcss_bridge.client import TIMEOUT, Client
from rcss_bridge.codec import Percepts
from rcss_bridge.joints import ServerRobot
from robot_core.errors import NaoGaitError
from robot_core.types import STANDSTILL, Point2, Pose2

TEAMS = "left_team", "right_team"
STANDS_WITHIN = 15.0
"""[s] after which a kick-off does not wait for a player any longer."""
LEAGUE_SIZE, FIFA_HALF = 7, 2700.0
"""Largest team by the league's rules; more play by FIFA's, whose halves last so long [s]."""
COMES_WITHIN = 120.0
"""[s] of wall time after which a kick-off does not wait for another team any longer."""


class Member(NamedTuple):
    """A player and its connection."""

    team: str
    number: int
    client: Client
    agent: Agent


@dataclass
class Account:
    """What came of a game, for one team or both.

    Attributes:
        seconds: Played time [s].
        score: Goals of the left and the right team.
        get_ups: How often a robot got up again.
        put_back: How often the referee put a robot beside the field.
        one_striker: Share of the time of all teams with exactly one striker.
        unsure: Share of the time of all upright robots in which they do not know where they are.
        wall: Wall time [s].
        server: Processor time [s] of the server.
        cpu: Processor time [s] of each player in each cycle.
        ended: The referee has ended the half.
    """

    seconds: float = 0.0
    score: tuple[int, int] = (0, 0)
    falls: int = 0
    get_ups: int = 0
    put_back: int = 0
    one_striker: float = math.nan
    unsure: float = math.nan
    wall: float = 0.0
    server: float = 0.0
    cpu: list[float] = field(default_factory=list)
    ended: bool = False


class Squad(AbstractContextManager["Squad"]):
    """Players of one team in this process; use it as a context manager.

    Args:
        port: The server's.
        robot: What all of them are.
        team: Name of their team.
        numbers: Their numbers.
        exact: They play with percepts without errors, misses and delay.
        seed: Of these errors.

    Attributes:
        robot: What all of them are.
        members: The players.
        cpu: Processor time [s] of each answer.
        percepts: The last ones of any player.
    """

    def __init__(
        self, port: int, robot: ServerRobot, team: str, numbers: Sequence[int], *, exact: bool,
        seed: int = 0,
    ) -> None:  # fmt: skip
        self.robot, self._exact, self._seed = robot, exact, seed
        self.members = [
            Member(team, number, Client("127.0.0.1", port, robot.name, team, number),
                   self._agent(team, number))
            for number in numbers
        ]  # fmt: skip
        self.cpu: list[float] = []
        self.percepts: Percepts | None = None

    def _agent(self, team: str, number: int) -> Agent:
        return Agent(
            self.robot, team, number=number, field=FIELD, exact=self._exact, seed=self._seed
        )

    @property
    def complete(self) -> bool:
        """All players are on the server."""
        return all(each.client.heard for each in self.members)

    @property
    def stands(self) -> bool:
        """All players have been dropped and stand."""
        return self.complete and all(
            each.agent.landing.count and each.agent.stands for each in self.members
        )

    def renew(self) -> None:
        """New players in place of the old ones, who forget all."""
        self.members = [
            each._replace(agent=self._agent(each.team, each.number)) for each in self.members
        ]

    def cycle(self) -> None:
        """One cycle of all players; one that joins is answered as soon as it is on the field.

        Raises:
            ServerGoneError: The server has ended, or was silent for `TIMEOUT`.
        """
        waiting = [each for each in self.members if each.client.heard]
        joining = next((each for each in self.members if not each.client.heard), None)
        if joining is not None and not joining.client.connected:
            joining.client.connect_within(10.0)  # one after the other: each one costs seconds
        waiting = waiting or self.members[:1]
        while waiting:
            clients = {each.client: each for each in self.members if each.client.connected}
            ready, _, _ = select.select(list(clients), [], [], TIMEOUT)
            for client in ready or clients:
                member = clients[client]
                self._serve(member)
                if member in waiting:
                    waiting.remove(member)

    def _serve(self, member: Member) -> None:
        message = member.client.receive()
        began = time.process_time()
        answer = member.agent.cycle(message, STANDSTILL)
        self.cpu.append(time.process_time() - began)
        member.client.send(answer)
        self.percepts = member.agent.percepts

    def __exit__(self, *_: object) -> None:
        for member in self.members:
            member.client.close()


def guest_words(command: str, port: int, number: int) -> list[str]:
    """What starts a player of another team: the words of a command without its placeholders.

    Raises:
        NaoGaitError: It is empty, a quotation mark is left open, or no such program is found.
    """
    filled = command.replace("{port}", str(port)).replace("{number}", str(number))
    try:
        words = shlex.split(filled)
    except ValueError as error:
        raise NaoGaitError("against", command, "a command whose quotation marks end") from error
    if not words or shutil.which(words[0]) is None:
        program = words[0] if words else command
        raise NaoGaitError("against", program, "a command whose first word is a program")
    return words


class Guests(AbstractContextManager["Guests"]):
    """Another team's players, a process each, started by its own command.

    Args:
        command: Starts a player; `{port}` and `{number}` stand for where and which.
        port: The server's.
        count: Number of players.
    """

    def __init__(self, command: str, port: int, count: int) -> None:
        self._processes: list[subprocess.Popen[bytes]] = []
        for number in range(1, count + 1):
            try:
                process = subprocess.Popen(
                    guest_words(command, port, number),
                    stdout=subprocess.DEVNULL,
                    stderr=subprocess.DEVNULL,
                )
            except (OSError, NaoGaitError) as error:
                self.__exit__()
                raise NaoGaitError("against", command, "a command that runs") from error
            self._processes.append(process)

    @property
    def complete(self) -> bool:
        """None of the processes has ended."""
        return all(process.poll() is None for process in self._processes)

    def __exit__(self, *_: object) -> None:
        for process in self._processes:
            process.kill()
        for process in self._processes:
            process.wait()


class TeamProcess(AbstractContextManager["TeamProcess"]):
    """A team in a process of its own, so that the teams and the server work at the same time.

    Args:
        port: The server's.
        robot: What all players are.
        team: Name of the team.
        count: Number of players.
        begin: Play time [s] at which the game begins.
        exact: They play with percepts without errors, misses and delay.
        seed: Of these errors.
    """

    def __init__(
        self, port: int, robot: ServerRobot, team: str, count: int, begin: float, *, exact: bool,
        seed: int = 0,
    ) -> None:  # fmt: skip
        context = multiprocessing.get_context("spawn")
        self._team = team
        self._connection, end = context.Pipe()
        self._process = context.Process(
            target=_team,
            args=(end, os.getpid(), port, robot, team, count, begin, exact, seed),
        )
        self._process.start()
        end.close()

    def join(self) -> None:
        """Let its players join, one after the other; return when they are on the field."""
        self._connection.send("join")
        self._said()

    def wait(self) -> None:
        """Return when all stand, or have had `STANDS_WITHIN` for it."""
        self._said()

    def account(self) -> Account:
        """What came of the half for this team, once it is over."""
        account = self._said()
        assert isinstance(account, Account)
        return account

    def _said(self) -> object:
        try:
            said = self._connection.recv()
        except (EOFError, OSError) as error:
            raise NaoGaitError(self._team, "its process has ended", "a half to its end") from error
        if isinstance(said, Exception):
            raise said
        return said

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.join()
        self._connection.close()


def _team(
    parent: Connection, pid: int, port: int, robot: ServerRobot, team: str, count: int,
    begin: float, exact: bool, seed: int,
) -> None:  # fmt: skip
    """What the process of a team does; see `TeamProcess`."""
    end_with_parent(pid)
    with Squad(port, robot, team, range(1, count + 1), exact=exact, seed=seed) as squad:
        parent.recv()
        try:
            while not squad.complete:
                squad.cycle()
            parent.send("joined")
            for _ in range(round(STANDS_WITHIN / CYCLE)):
                squad.cycle()
                if squad.stands:
                    break
            parent.send("stands")
            parent.send(_half(squad, begin))
        except NaoGaitError as error:
            parent.send(error)


def _half(squad: Squad, begin: float) -> Account:
    """Wait for the kick-off and play to the end of the half."""
    account, members = Account(), squad.members
    beams, ones, whole, upright, unsure = 0, 0, 0, 0, 0
    while not account.ended:
        squad.cycle()
        assert squad.percepts is not None
        game = squad.percepts.game
        if game.mode == BEFORE_KICK_OFF:
            squad.cpu.clear()
            beams = sum(each.agent.landing.count for each in members)
            continue
        if game.mode == "PlayOn":
            roles = [_role(each) for each in members]
            whole += 1
            ones += roles.count(Role.STRIKER) == 1
            worlds = [world for each in members if (world := _world(each)) is not None]
            upright += sum(each.upright for each in worlds)
            unsure += sum(each.upright and not each.own.valid for each in worlds)
        account.ended = game.mode == "GameOver"
        if not account.ended:
            account.seconds, account.score = game.time - begin, game.score
    account.falls = sum(each.agent.falls for each in members)
    account.get_ups = sum(each.agent.get_ups for each in members)
    drops = sum(each.agent.landing.count for each in members) - beams
    account.put_back = drops - sum(account.score) * len(members)
    account.one_striker = ones / whole if whole else math.nan
    account.unsure = unsure / upright if upright else math.nan
    account.cpu = squad.cpu
    return account


def play(
    robot: ServerRobot,
    players: tuple[int, int],
    seconds: float,
    *,
    exact: bool,
    against: str = "",
    half: int = 0,
    seed: int = 0,
) -> Account:
    """Play the last `seconds` [s] of a half, to its end; the left team kicks off.

    Args:
        robot: What our players are.
        players: Number of players of the left and the right team.
        seconds: Length of the game.
        exact: We play with percepts without errors, misses and delay.
        against: Command of the right team's players, see `Guests`; empty = it is ours too.
        half: 0 or 1.
        seed: Of the percepts' errors; each team has its own.

    Raises:
        ServerGoneError: The server has ended.
        NaoGaitError: The command does not run, or its players do not come.
    """
    rules, whole_half = ("fifa", FIFA_HALF) if max(players) > LEAGUE_SIZE else ("ssim", HALF)
    begin = (half + 1) * whole_half - seconds
    ours = players[:1] if against else players
    with (
        Server("--rules", rules, "--phase", str(half), "--time", f"{begin:g}") as server,
        ExitStack() as stack,
    ):
        teams = [
            stack.enter_context(
                TeamProcess(
                    server.port, robot, name, count, begin, exact=exact, seed=2 * seed + side
                )
            )
            for side, (name, count) in enumerate(zip(TEAMS, ours, strict=False))
        ]
        for team in teams:  # who comes first gets the left side
            team.join()
        if against:
            guests = Guests(against, server.port, players[1])
            stack.enter_context(guests)
            until = time.monotonic() + COMES_WITHIN
            while server.joined < sum(players):
                if not guests.complete or time.monotonic() > until:
                    allowed = "a command whose players join the game"
                    raise NaoGaitError("against", against, allowed)
                time.sleep(0.2)
        for team in teams:
            team.wait()
        began, worked = time.monotonic(), server.cpu
        server.order("(kickOff Left)")
        accounts = [team.account() for team in teams]
        wall, worked = time.monotonic() - began, server.cpu - worked
    return Account(
        seconds=accounts[0].seconds,
        score=accounts[0].score,
        falls=sum(each.falls for each in accounts),
        get_ups=sum(each.get_ups for each in accounts),
        put_back=sum(each.put_back for each in accounts),
        one_striker=_mean(each.one_striker for each in accounts),
        unsure=_mean(each.unsure for each in accounts),
        wall=wall,
        server=worked,
        cpu=[time for each in accounts for time in each.cpu],
        ended=all(each.ended for each in accounts),
    )


class Start(NamedTuple):
    """Where a robot alone and the ball begin [m, rad]."""

    robot: Pose2
    ball: Point2


def starts(count: int, goal: float) -> Iterator[Start]:
    """Balls 3 to 8 m from the middle of the goal at x = `goal` [m], robots 1 to 3 m from them."""
    random = np.random.default_rng(0)
    for _ in range(count):
        far, bearing = random.uniform(3.0, 8.0), random.uniform(-0.8, 0.8)
        x, y = goal - far * math.cos(bearing), far * math.sin(bearing)
        gap, around = random.uniform(1.0, 3.0), random.uniform(-math.pi, math.pi)
        place = x + gap * math.cos(around), y + gap * math.sin(around)
        inside = min(place[0], goal - 1.0)
        yield Start((inside, place[1], random.uniform(-math.pi, math.pi)), (x, y))


def alone(squad: Squad, server: Server, start: Start, limit: float) -> tuple[float, int]:
    """Put a lone robot and the ball; time [s] until the goal, NaN without, and its falls."""
    (member,) = squad.members
    for _ in range(round(STANDS_WITHIN / CYCLE)):
        squad.cycle()
        if squad.stands:
            break
    # Out of the goal; then play begins with the ball where it is.
    for order in ("(ball (pos 0 0 0.11) (vel 0 0 0))", "(dropBall)"):
        server.order(order)
        for _ in range(10):
            squad.cycle()
    squad.renew()
    (member,) = squad.members
    x, y, yaw = start.robot
    server.order(f"(ball (pos {start.ball[0]:.3f} {start.ball[1]:.3f} 0.11) (vel 0 0 0))")
    height = squad.robot.drop_height
    server.place(member.team, member.number, (x, y, height, 0.0, 0.0, yaw))
    before = None
    for count in range(round(limit / CYCLE)):
        squad.cycle()
        assert squad.percepts is not None
        score = squad.percepts.game.score[0]
        before = score if before is None else before
        if score > before:
            return count * CYCLE, member.agent.falls
    return math.nan, member.agent.falls


def _mean(shares: Iterable[float]) -> float:
    """Of those that are known."""
    known = [each for each in shares if not math.isnan(each)]
    return statistics.fmean(known) if known else math.nan


def _world(member: Member) -> WorldState | None:
    player = member.agent.player
    return None if player is None or player.decision is None else player.decision.world


def _role(member: Member) -> Role | None:
    player = member.agent.player
    return None if player is None else player.player.role
