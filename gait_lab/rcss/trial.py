"""Walks, drops and get-ups on the server, judged by the true pose that it tells."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from gait_lab.rcss.agent import Agent
from gait_lab.rcss.eyes import IMAGE
from gait_lab.rcss.field import BALL
from rcss_bridge.body import CYCLE
from rcss_bridge.client import Client
from rcss_bridge.codec import torso_truth
from robot_core.errors import NaoGaitError
from robot_core.geometry import compose, relative, rotate_each, yaw_of_quaternion
from robot_core.robot.camera import CameraModel
from robot_core.types import STAND, STANDSTILL, FloatArray, Point2, Pose2, VelocityCommand
from sim_bridge.trials.tasks import AXES, Task

START: Pose2 = (-12.0, 0.0, 0.0)
"""Where walks begin: nothing is within 14 m."""
LANDS_WITHIN = 8.0
"""[s] after a beam; a robot that does not stand then has fallen."""
STANDS_AFTER = 0.5
"""[s] for which a robot has to stand before it counts as up."""
KICK_TIME = 12.0
"""[s] after which a kicked ball has come to rest."""
GIVEN_UP_AFTER = 40.0
"""[s] after which a robot that lies is not waited for."""
NO_ANSWER = b"(syn)"
"""What a player says who has nothing to say in a cycle."""
_AXIS = {"x": 0, "y": 1, "yaw": 2}


class LateClient(Client):
    """A player some of whose answers come a cycle late.

    The server then has no answer in that cycle, and the late one is replaced by the next.

    Args:
        late: Share of the answers that are late.
    """

    def __init__(
        self, host: str, port: int, robot: str, team: str, number: int, *, late: float = 0.0
    ) -> None:
        super().__init__(host, port, robot, team, number)
        self._late = late
        self._random = np.random.default_rng(0)

    def send(self, message: bytes) -> None:
        """Answer a message, or be late."""
        super().send(NO_ANSWER if self._random.uniform() < self._late else message)


class ServerWalk(NamedTuple):
    """A walk.

    Attributes:
        fell: It fell, or did not land.
        velocity: Mean in the measured window: forward, left [m/s], turn [rad/s].
    """

    fell: bool
    velocity: tuple[float, float, float]

    def speed(self, task: Task) -> float:
        """The speed along the axis of a task, in cm/s or deg/s, positive along its command."""
        assert task.axis is not None
        _, factor = AXES[task.axis]
        return factor * math.copysign(1.0, task.asked) * self.velocity[_AXIS[task.axis]]


def walk(client: Client, agent: Agent, task: Task, wait: float) -> ServerWalk:
    """Be dropped, stand for `wait` [s], walk a task.

    Raises:
        ServerGoneError: The server has ended.
        NaoGaitError: It does not take beams now.
    """
    falls, drops = agent.falls, agent.landing.count
    agent.beam(START)
    stood = time = 0.0
    while stood < wait:
        client.send(agent.cycle(client.receive(), STANDSTILL))
        dropped = agent.landing.count > drops
        stood = stood + CYCLE if dropped and agent.stands else 0.0
        time += CYCLE
        if not dropped and time > LANDS_WITHIN:
            raise NaoGaitError("server", "no beam", "a server before its kick-off")
        if agent.falls > falls or time > LANDS_WITHIN + wait:
            return ServerWalk(True, (math.nan,) * 3)
    places: list[tuple[float, float]] = []
    yaws: list[float] = []
    for count in range(round(task.end / CYCLE)):
        message = client.receive()
        client.send(agent.cycle(message, task.command_at(count * CYCLE)))
        if agent.falls > falls:
            return ServerWalk(True, (math.nan,) * 3)
        if count * CYCLE >= task.start:
            (x, y, _), (qw, qx, qy, qz) = torso_truth(message)
            places.append((x, y))
            yaws.append(yaw_of_quaternion(qx, qy, qz, qw))
    return ServerWalk(False, _mean_velocity(np.array(places), np.unwrap(yaws)))


def wander(
    client: Client, agent: Agent, command_at: Callable[[float], VelocityCommand], seconds: float
) -> int:
    """Walk commands that change, for some time [s]; how often it fell.

    Raises:
        ServerGoneError: The server has ended.
    """
    falls = agent.falls
    for count in range(round(seconds / CYCLE)):
        client.send(agent.cycle(client.receive(), command_at(count * CYCLE)))
    return agent.falls - falls


def lands(client: Client, agent: Agent, place: Callable[[], None]) -> bool:
    """Be dropped by `place` without warning; whether it notices, lands and stands.

    Raises:
        ServerGoneError: The server has ended.
    """
    falls, drops = agent.falls, agent.landing.count
    place()
    up = _stands(client, agent, LANDS_WITHIN, lambda: agent.landing.count > drops)
    return not math.isnan(up) and agent.falls == falls


def gets_up(client: Client, agent: Agent, place: Callable[[], None]) -> float:
    """Be laid down by `place`; the time [s] from the ground until it stands, NaN if it never does.

    Raises:
        ServerGoneError: The server has ended.
    """
    place()
    lies = False

    def has_lain() -> bool:
        nonlocal lies
        lies = lies or not agent.stands
        return lies

    return _stands(client, agent, GIVEN_UP_AFTER, has_lain)


class ServerKick(NamedTuple):
    """A kick of a standing robot.

    Attributes:
        fell: It fell, or never stood.
        distance: [m] from where the ball was put to where it came to rest.
        direction: [rad] of its way, counter-clockwise from the robot's heading before the kick.
    """

    fell: bool
    distance: float
    direction: float


def kick(
    client: Client, agent: Agent, motion: str, spot: Point2, place: Callable[[], None],
    lay: Callable[[float, float], None],
) -> ServerKick:  # fmt: skip
    """Be dropped by `place`, and kick a ball that `lay` puts before the standing robot.

    Args:
        client: The robot's.
        agent: The robot.
        motion: The kick.
        spot: Of the ball, x, y [m] in base_footprint.
        place: Drops the robot.
        lay: Puts the ball somewhere on the field, x, y [m].

    Raises:
        ServerGoneError: The server has ended.
    """
    falls, drops = agent.falls, agent.landing.count
    place()
    _stands(client, agent, LANDS_WITHIN, lambda: agent.landing.count > drops)
    before = _footprint(_cycles(client, agent, STANDS_AFTER), agent)
    x, y, _ = compose(before, (*spot, 0.0))
    lay(x, y)
    _cycles(client, agent, STANDS_AFTER)
    agent.gait.request_motion(motion)
    message = _cycles(client, agent, KICK_TIME)
    percepts = agent.percepts
    assert percepts is not None
    if percepts.sight is None:  # as in every second cycle
        message = _cycles(client, agent, CYCLE)
        percepts = agent.percepts
    ball = None if percepts is None or percepts.sight is None else percepts.sight.ball
    if ball is None or agent.falls > falls:
        return ServerKick(True, math.nan, math.nan)
    robot = agent.robot
    camera = CameraModel(robot, next(iter(robot.cameras)), IMAGE).in_torso(robot.stand_pose)
    height = agent.gait.torso_pose[2] + float(camera.position[2]) - BALL
    away = math.sqrt(max(0.0, ball.distance**2 - height**2))
    ahead, aside = away * math.cos(ball.azimuth), away * math.sin(ball.azimuth)
    eye = agent.gait.torso_pose[0] + float(camera.position[0])
    bx, by, _ = relative(compose(_footprint(message, agent), (eye + ahead, aside, 0.0)), before)
    way = bx - spot[0], by - spot[1]
    return ServerKick(False, math.hypot(*way), math.atan2(way[1], way[0]))


def _footprint(message: bytes, agent: Agent) -> Pose2:
    """The true pose of base_footprint of a robot that stands, on the field."""
    (x, y, _), (qw, qx, qy, qz) = torso_truth(message)
    torso_x, torso_y = agent.gait.torso_pose[:2]
    return compose((x, y, yaw_of_quaternion(qx, qy, qz, qw)), (-torso_x, -torso_y, 0.0))


def _cycles(client: Client, agent: Agent, seconds: float) -> bytes:
    """Stand for some time [s]; the last message."""
    message = b""
    for _ in range(round(seconds / CYCLE)):
        message = client.receive()
        client.send(agent.cycle(message, STANDSTILL))
    return message


def _stands(client: Client, agent: Agent, limit: float, begun: Callable[[], bool]) -> float:
    """Stand still until it has stood for `STANDS_AFTER`; the time [s] since `begun`, or NaN."""
    time = stood = 0.0
    for _ in range(round(limit / CYCLE)):
        client.send(agent.cycle(client.receive(), STANDSTILL))
        if not begun():
            continue
        time += CYCLE
        up = agent.stands and agent.gait.state is STAND
        stood = stood + CYCLE if up else 0.0
        if stood >= STANDS_AFTER:
            return time - STANDS_AFTER
    return math.nan


def _mean_velocity(places: FloatArray, yaws: FloatArray) -> tuple[float, float, float]:
    """Forward, left and turn of places (n, 2) [m] and headings (n,) [rad], one each cycle."""
    dx, dy = np.diff(places, axis=0).T
    ahead, aside = rotate_each(dx, dy, -0.5 * (yaws[1:] + yaws[:-1]))
    seconds = CYCLE * len(dx)
    return (
        float(np.sum(ahead)) / seconds,
        float(np.sum(aside)) / seconds,
        float(yaws[-1] - yaws[0]) / seconds,
    )
