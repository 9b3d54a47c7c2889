"""A walk on the server, judged by the true pose that it tells."""

import math
from typing import NamedTuple

import numpy as np

from gait_lab.rcss.agent import Agent
from rcss_bridge.body import CYCLE
from rcss_bridge.client import Client
from rcss_bridge.codec import torso_truth
from robot_core.errors import NaoGaitError
from robot_core.types import STANDSTILL, FloatArray, Pose2
from sim_bridge.trials.tasks import AXES, Task

START: Pose2 = (-12.0, 0.0, 0.0)
"""Where walks begin: nothing is within 14 m."""
LANDS_WITHIN = 8.0
"""[s] after a beam; a robot that does not stand then has fallen."""
_AXIS = {"x": 0, "y": 1, "yaw": 2}


class ServerWalk(NamedTuple):
    """A walk.

    Attributes:
        fell: It fell, or did not land.
        velocity: Mean in the measured window: forward, left [m/s], turn [rad/s].
    """

    landed: bool
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
            return ServerWalk(False, True, (math.nan,) * 3)
    places: list[tuple[float, float]] = []
    yaws: list[float] = []
    for count in range(round(task.end / CYCLE)):
        message = client.receive()
        client.send(agent.cycle(message, task.command_at(count * CYCLE)))
        if agent.falls > falls:
            return ServerWalk(True, True, (math.nan,) * 3)
        if count * CYCLE >= task.start:
            (x, y, _), (qw, qx, qy, qz) = torso_truth(message)
            places.append((x, y))
            yaws.append(math.atan2(2.0 * (qw * qz + qx * qy), 1.0 - 2.0 * (qy * qy + qz * qz)))
    return ServerWalk(True, False, _mean_velocity(np.array(places), np.unwrap(yaws)))


def _mean_velocity(places: FloatArray, yaws: FloatArray) -> tuple[float, float, float]:
    """Forward, left and turn of places (n, 2) [m] and headings (n,) [rad], one each cycle."""
    dx, dy = np.diff(places, axis=0).T
    heading = 0.5 * (yaws[1:] + yaws[:-1])
    c, s = np.cos(heading), np.sin(heading)
    seconds = CYCLE * len(dx)
    ahead, aside = np.sum(c * dx + s * dy), np.sum(c * dy - s * dx)
    return (
        float(ahead) / seconds,
        float(aside) / seconds,
        float(yaws[-1] - yaws[0]) / seconds,
    )
