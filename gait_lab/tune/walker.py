"""A walk whose command follows the gait's own steps, with pushes; a timed task cannot say that."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Protocol

import numpy as np

from gait_lab.analysis.metrics import has_fallen
from gait_lab.analysis.trace import Recorder, Trace
from gait_lab.trials.trial import CONTROL_PERIOD
from nao_lipm_gait.gait import Gait
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.robot import RobotDescription, load_robot
from nao_lipm_gait.types import STANDSTILL, GaitStatus, JointTargets, VelocityCommand
from sim_bridge.plant import load_plant
from sim_bridge.world import World


@dataclass(frozen=True, slots=True)
class Setting:
    """Who walks, on what."""

    parameters: GaitParameters = field(default_factory=GaitParameters)
    robot_seed: int = 0
    engine: str = "mujoco"
    plant: str = "reference"
    urdf: str = "nao_h21_v33"


@dataclass(frozen=True, slots=True)
class Push:
    """A force on the torso in the world frame."""

    time: float
    """[s] since the start."""
    force: tuple[float, float, float]
    """[N]."""
    duration: float = 0.1
    """[s]."""


class Pilot(Protocol):
    """Who steers: sees the gait's status, as a person at a joystick would; never the truth."""

    def __call__(self, time: float, status: GaitStatus | None) -> VelocityCommand | None:
        """The command at a time [s]; None ends the walk."""


@lru_cache(maxsize=4)
def _robot(urdf: str) -> RobotDescription:
    return load_robot(urdf)


def walk(
    setting: Setting, pilot: Pilot, *, time_limit: float, pushes: Sequence[Push] = ()
) -> tuple[Trace, bool]:
    """The trace of a walk until the pilot ends it, a fall, or the time limit [s]; did it fall?"""
    robot = _robot(setting.urdf)
    gait = Gait(robot, setting.parameters)
    with World.single(
        robot,
        load_plant(setting.plant),
        robot_seed=setting.robot_seed,
        engine=setting.engine,
        control_period=CONTROL_PERIOD,
    ) as simulation:
        return _walk(simulation, gait, pilot, time_limit, sorted(pushes, key=lambda p: p.time))


def _walk(
    simulation: World, gait: Gait, pilot: Pilot, time_limit: float, pushes: list[Push]
) -> tuple[Trace, bool]:
    recorder = Recorder()
    targets: JointTargets | None = None
    status: GaitStatus | None = None
    truth = simulation.robot.truth()
    height = float(truth.torso_position[2])
    recorder.add(truth, STANDSTILL)
    waiting = list(pushes)
    while (now := simulation.time * 1e-9) < time_limit:
        while waiting and waiting[0].time <= now:
            push = waiting.pop(0)
            simulation.robot.push(np.array(push.force), push.duration)
        simulation.robot.command(targets)
        simulation.step()
        command = pilot(simulation.time * 1e-9, status)
        if command is None:
            break
        frame = simulation.robot.sense()
        if frame is not None:
            targets = gait.step(frame, command)
            status = gait.status
        truth = simulation.robot.truth()
        recorder.add(truth, command, status)
        if has_fallen(truth.torso_position, truth.torso_quaternion, height):
            return recorder.trace(), True
    return recorder.trace(), False
