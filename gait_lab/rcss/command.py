"""`nao_gait rcss`: robots on RoboCup's simulation server, one process each."""

import multiprocessing
import os
import signal
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from multiprocessing.connection import wait
from multiprocessing.process import BaseProcess

from gait_lab.demo.node_processes import end_with_parent
from gait_lab.rcss.agent import Agent
from gait_lab.rcss.field import FIELD, ServerField
from gait_lab.rcss.player import NUMBER_MAX
from gait_lab.terminal import EXIT_FAILED, EXIT_INTERRUPTED, EXIT_OK
from rcss_bridge.body import CYCLE
from rcss_bridge.client import RETRY, Client, ServerGoneError
from rcss_bridge.codec import init
from rcss_bridge.joints import server_robot
from robot_core.errors import NaoGaitError
from robot_core.types import STANDSTILL, VelocityCommand

SETTLED = 2.0
"""[s] that a robot stands after it has landed, before it walks."""
PATIENCE = 30.0
"""[s] for which a lost server, or a place on it, is looked for."""
ASKED_TO_END = signal.SIGINT, signal.SIGTERM
SPEED_MAX, TURN_MAX = 2.0, 4.0
"""Largest commands [m/s], [rad/s]."""


@dataclass(frozen=True, slots=True)
class Job:
    """What one process does.

    Attributes:
        seconds: Simulated time [s] after which it leaves.
        field: The server's field; empty = it does not play soccer.
    """

    host: str
    port: int
    team: str
    number: int
    robot: str
    command: VelocityCommand
    seconds: float
    preset: str
    field: str = ""
    exact: bool = False

    def agent(self) -> Agent:
        """The robot before its first message."""
        start = None if self.field else ServerField(FIELD).start(self.number)
        return Agent(
            server_robot(self.robot), self.team, start, self.preset,
            number=self.number, field=self.field, exact=self.exact,
        )  # fmt: skip


def run(
    host: str,
    port: int,
    team: str,
    number: int,
    players: str | None,
    robot: str,
    drive: str | None,
    seconds: float,
    preset: str,
    field: str,
    exact: bool,
    say: Callable[[str], None],
) -> int:
    """Bring robots onto the field; the exit status.

    Raises:
        NaoGaitError: An argument is not allowed.
    """
    server_robot(robot)
    init(robot, team, number)
    command = STANDSTILL if drive is None else _velocity(drive)
    ServerField(field)
    field = field if drive is None else ""
    numbers = (number,) if players is None else _numbers(players)
    jobs = [
        Job(host, port, team, each, robot, command, seconds, preset, field, exact)
        for each in numbers
    ]
    if len(jobs) == 1:
        return walk(jobs[0], say)
    running: list[BaseProcess] = []
    try:
        return supervise(jobs, _started, running, say)
    except KeyboardInterrupt:
        for process in running:
            process.terminate()
        for process in running:
            process.join()
        return EXIT_INTERRUPTED


def supervise(
    jobs: Sequence[Job],
    start: Callable[[Job], BaseProcess],
    running: list[BaseProcess],
    say: Callable[[str], None],
) -> int:
    """A process for each job until all have ended; who is killed begins anew.

    Args:
        jobs: Of the team.
        start: Starts a process.
        running: Holds the processes that run.
        say: Tells what happens.

    Returns:
        The exit status.
    """
    owners: dict[object, tuple[BaseProcess, Job]] = {}

    def begin(job: Job) -> None:
        process = start(job)
        running.append(process)
        owners[process.sentinel] = process, job

    for job in jobs:
        begin(job)
    status = EXIT_OK
    while owners:
        for ended in wait([process.sentinel for process in running]):
            process, job = owners.pop(ended)
            process.join()
            running.remove(process)
            code = process.exitcode or 0
            if code < 0 and -code not in ASKED_TO_END:
                say(f"{job.team} {job.number}: killed by signal {-code}; it begins anew")
                begin(job)
            elif code:
                status = EXIT_FAILED
    return status


def _started(job: Job) -> BaseProcess:
    context = multiprocessing.get_context("spawn")
    process = context.Process(target=_in_process, args=(job, os.getpid()))
    process.start()
    return process


def walk(job: Job, say: Callable[[str], None], wait: Callable[[float], None] = time.sleep) -> int:
    """One robot on the server until its time is over; the exit status.

    When the server goes or drops it, the robot begins anew. Its place may be taken for some seconds
    then, until the server has noticed.
    """
    who = f"{job.team} {job.number}"
    done, falls, drops, tries = 0.0, 0, 0, 0
    with Client(job.host, job.port, job.robot, job.team, job.number) as client:
        agent = job.agent()
        while True:
            try:
                client.connect_within(PATIENCE, wait)
            except ServerGoneError as error:
                say(f"{who}: {error}")
                return EXIT_FAILED
            try:
                done = _cycles(client, agent, job, done, lambda text: say(f"{who}: {text}"))
            except ServerGoneError as error:
                tries = round(PATIENCE / RETRY) if client.heard else tries - 1
                if client.heard or tries <= 0:
                    say(f"{who}: {error}")
                if tries <= 0:
                    return EXIT_FAILED
                wait(RETRY)
            falls, drops = falls + agent.falls, drops + agent.landing.count
            if done >= job.seconds:
                say(f"{who}: {done:.0f} s, {falls} falls, {drops} drops")
                return EXIT_OK
            if client.heard:
                agent = job.agent()


def _cycles(
    client: Client, agent: Agent, job: Job, done: float, say: Callable[[str], None]
) -> float:
    """Play until the time is over; the time [s] that was played."""
    began, stood, state = None, 0.0, ""
    while True:
        message = client.receive()
        try:
            answer = agent.cycle(message, job.command if stood >= SETTLED else STANDSTILL)
        except NaoGaitError as error:
            say(str(error))
            answer = b"(syn)"
        client.send(answer)
        percepts = agent.percepts
        if percepts is None:
            continue
        if began is None:
            began = percepts.time - done
        stood = stood + CYCLE if agent.stands else 0.0
        if agent.state != state:
            state = agent.state
            say(f"{percepts.time - began:.2f} s {state}")
        if percepts.time - began >= job.seconds:
            return percepts.time - began


def _in_process(job: Job, parent: int) -> None:
    end_with_parent(parent)
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        status = walk(job, lambda text: print(text, flush=True))
    except NaoGaitError as error:
        print(f"{job.team} {job.number}: {error}", flush=True)
        status = EXIT_FAILED
    os._exit(status)


def _velocity(text: str) -> VelocityCommand:
    allowed = (
        f"vx,vy,wz in m/s and rad/s, at most {SPEED_MAX:g} and {TURN_MAX:g}, such as 0.3,0,0"
    )
    try:
        x, y, yaw = map(float, text.split(","))
    except ValueError:
        raise NaoGaitError("drive", text, allowed) from None
    # Comparisons with NaN are false.
    if not (abs(x) <= SPEED_MAX and abs(y) <= SPEED_MAX and abs(yaw) <= TURN_MAX):
        raise NaoGaitError("drive", text, allowed)
    return VelocityCommand(x, y, yaw)


def _numbers(text: str) -> range:
    first, _, last = text.partition("-")
    if first.isdecimal() and last.isdecimal() and 1 <= int(first) <= int(last) <= NUMBER_MAX:
        return range(int(first), int(last) + 1)
    raise NaoGaitError("players", text, f"A-B with 1 <= A <= B <= {NUMBER_MAX}, such as 1-7")
