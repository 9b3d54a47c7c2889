"""Players on a server of the bench, all in this process: a team alone, or a match."""

import math
import select
import shlex
import subprocess
import time
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from gait_lab.rcss.agent import Agent
from gait_lab.rcss.field import FIELD
from gait_lab.rcss.game import HALF
from gait_lab.rcss.server import Server
from nao_soccer.game_state import Role
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
"""[s] after which a kick-off does not wait for another team any longer."""


class Member(NamedTuple):
    """A player and its connection."""

    team: str
    number: int
    client: Client
    agent: Agent


@dataclass
class Account:
    """What came of a game.

    Attributes:
        seconds: Played time [s].
        score: Goals of the left and the right team.
        put_back: How often the referee put a robot beside the field.
        one_striker: Share of the time of all teams with exactly one striker.
        wall: Wall time [s].
        cpu: Processor time [s] of each player in each cycle.
    """

    seconds: float = 0.0
    score: tuple[int, int] = (0, 0)
    falls: int = 0
    put_back: int = 0
    one_striker: float = 0.0
    wall: float = 0.0
    cpu: list[float] = field(default_factory=list)
    ended: bool = False


class Squad(AbstractContextManager["Squad"]):
    """All players of a server; use it as a context manager.

    Args:
        server: The server.
        robot: What all of them are.
        numbers: Numbers of the players of each team.
        exact: They play with percepts without errors, misses and delay.

    Attributes:
        robot: What all of them are.
        members: The players.
    """

    def __init__(
        self, server: Server, robot: ServerRobot, numbers: Sequence[Sequence[int]], *, exact: bool
    ) -> None:
        self.robot, self._exact = robot, exact
        self.members = [
            Member(team, number, Client("127.0.0.1", server.port, robot.name, team, number),
                   self._agent(team, number))
            for team, ones in zip(TEAMS, numbers, strict=False)
            for number in ones
        ]  # fmt: skip
        self.cpu: list[float] = []
        self.percepts: Percepts | None = None

    def _agent(self, team: str, number: int) -> Agent:
        return Agent(self.robot, team, number=number, field=FIELD, exact=self._exact)

    @property
    def complete(self) -> bool:
        """All players are on the server."""
        return all(each.client.heard for each in self.members)

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
            words = shlex.split(command.format(port=port, number=number))
            try:
                process = subprocess.Popen(
                    words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
                )
            except (OSError, IndexError) as error:
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


def play(
    robot: ServerRobot,
    players: tuple[int, int],
    seconds: float,
    *,
    exact: bool,
    against: str = "",
    half: int = 0,
) -> Account:
    """Play the last `seconds` [s] of a half, to its end; the left team kicks off.

    Args:
        robot: What our players are.
        players: Number of players of the left and the right team.
        seconds: Length of the game.
        exact: We play with percepts without errors, misses and delay.
        against: Command of the right team's players, see `Guests`; empty = it is ours too.
        half: 0 or 1.

    Raises:
        ServerGoneError: The server has ended.
        NaoGaitError: The command does not run, or its players do not come.
    """
    account = Account()
    rules, whole_half = ("fifa", FIFA_HALF) if max(players) > LEAGUE_SIZE else ("ssim", HALF)
    begin = (half + 1) * whole_half - seconds
    numbers = [range(1, count + 1) for count in (players[:1] if against else players)]
    with (
        Server("--rules", rules, "--phase", str(half), "--time", f"{begin:g}") as server,
        Squad(server, robot, numbers, exact=exact) as squad,
        ExitStack() as stack,
    ):
        while not squad.members[0].client.heard:  # who comes first gets the left side
            squad.cycle()
        guests = Guests(against, server.port, players[1] if against else 0)
        stack.enter_context(guests)
        for _ in range(round((COMES_WITHIN if against else STANDS_WITHIN) / CYCLE)):
            if not guests.complete:
                break
            squad.cycle()
            if server.joined == sum(players) and squad.complete and all(
                each.agent.landing.count and each.agent.stands for each in squad.members
            ):
                break
        if against and server.joined < sum(players):
            raise NaoGaitError("against", against, "a command whose players join the game")
        squad.cpu.clear()
        beams = sum(each.agent.landing.count for each in squad.members)
        began, whole, ones = time.monotonic(), 0, 0
        server.order("(kickOff Left)")
        while True:
            squad.cycle()
            percepts = squad.percepts
            assert percepts is not None
            game = percepts.game
            if game.mode == "GameOver":
                account.ended = True
                break
            if game.mode == "PlayOn":
                for team in {each.team for each in squad.members}:
                    roles = [_role(each) for each in squad.members if each.team == team]
                    whole += 1
                    ones += roles.count(Role.STRIKER) == 1
            account.seconds = game.time - begin
            account.score = game.score
        account.wall = time.monotonic() - began
        account.falls = sum(each.agent.falls for each in squad.members)
        drops = sum(each.agent.landing.count for each in squad.members) - beams
        account.put_back = drops - sum(account.score) * len(squad.members)
        account.one_striker = ones / whole if whole else math.nan
        account.cpu = squad.cpu
    return account


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
        if squad.complete and member.agent.landing.count and member.agent.stands:
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


def _role(member: Member) -> Role | None:
    player = member.agent.player
    return None if player is None else player.player.role
