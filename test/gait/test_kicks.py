"""Kicks and get-ups on the simulated robot."""

import math

import numpy as np
import pytest

from nao_lipm_gait.gait import Gait
from nao_lipm_gait.parameters import GaitParameters
from robot_core.motion.library import shipped_library
from robot_core.robot import load_robot
from robot_core.types import STANDSTILL, GaitState, JointTargets, VelocityCommand
from sim_bridge.trials.get_up import GetUpSpec, get_up
from sim_bridge.trials.kick import KickSpec, kick
from sim_bridge.trials.rollout import RolloutSpec, make_pair
from sim_bridge.trials.tasks import find_task
from sim_bridge.world import World

ROBOT = load_robot()
MOTIONS = list(shipped_library(ROBOT).motions.values())
KICKS = {motion.name: motion.kick for motion in MOTIONS if motion.kick is not None}


def test_there_are_twenty_kicks_in_pairs() -> None:
    kinds = {name.rsplit("_", 1)[0] for name in KICKS}
    ahead = {"front", "hard", "nudge", "diagonal", "outward", "inward"}
    others = {"side", "across", "backheel", "back_diagonal"}
    assert kinds == {f"kick_{kind}" for kind in ahead | others}
    for kind in kinds:
        left, right = KICKS[f"{kind}_left"], KICKS[f"{kind}_right"]
        assert (left.x, left.y) == (right.x, -right.y)
        assert left.direction == -right.direction


# -- on the simulated robot ------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "distance"), [("kick_front_left", 0.6), ("kick_side_right", 0.5)]
)
def test_a_kick_sends_the_ball_where_it_says_and_the_robot_stands(
    name: str, distance: float
) -> None:
    result = kick(KickSpec(name, robot_seed=3, engine="mujoco"))
    assert result.stood
    assert result.distance > distance
    assert abs(math.remainder(result.direction - KICKS[name].direction, math.tau)) < 0.15


@pytest.mark.parametrize("side", ["front", "back"])
def test_a_robot_on_the_floor_gets_up_and_walks(side: str) -> None:
    result = get_up(GetUpSpec(side, robot_seed=7, engine="mujoco"))
    assert result.at_once
    assert result.time is not None
    assert result.time < 8.0
    assert result.torque_use.max() <= 1.0 + 1e-6


class Driver:
    """A simulated robot with its gait, tick after tick."""

    def __init__(self, simulation: World, gait: Gait) -> None:
        self.simulation, self.gait = simulation, gait
        self._targets: JointTargets | None = None

    def run(self, seconds: float, command: VelocityCommand = STANDSTILL) -> list[GaitState]:
        """The states that the gait goes through."""
        states: list[GaitState] = []
        for _ in range(round(seconds * 100)):
            self.simulation.robot.command(self._targets)
            self.simulation.step()
            frame = self.simulation.robot.sense()
            if frame is not None:
                self._targets = self.gait.step(frame, command)
            if not states or states[-1] is not self.gait.state:
                states.append(self.gait.state)
        return states


@pytest.mark.parametrize(("x", "y"), [(80.0, 0.0), (0.0, 90.0)])
def test_felled_by_a_push_it_is_up_and_walking_again_without_a_person(x: float, y: float) -> None:
    """Forward, and to a side on which it comes to lie and from which it rolls over first."""
    forward = VelocityCommand(0.12, 0.0, 0.0)
    spec = RolloutSpec(
        find_task("forward"), robot_seed=1, engine="mujoco",
        parameters=GaitParameters(get_up=True),
    )  # fmt: skip
    simulation, gait = make_pair(spec)
    nao = Driver(simulation, gait)
    with simulation:
        nao.run(1.0)
        nao.run(2.0, forward)
        simulation.robot.push(np.array((x, y, 0.0)), 0.1)
        states = nao.run(20.0, forward)
        assert GaitState.FALLEN in states
        assert GaitState.GETTING_UP in states
        assert states[-1] is GaitState.WALK
        before = simulation.robot.truth()
        nao.run(2.0, forward)
        after = simulation.robot.truth()
        assert math.dist(before.com[:2], after.com[:2]) > 0.12
        assert after.torso_position[2] > 0.25


def test_it_lets_itself_down_limp_and_gets_up_when_asked() -> None:
    spec = RolloutSpec(
        find_task("stand"), robot_seed=2, engine="mujoco", parameters=GaitParameters(get_up=True)
    )
    simulation, gait = make_pair(spec)
    nao = Driver(simulation, gait)
    with simulation:
        nao.run(1.0)
        gait.request_motion("relax")
        assert nao.run(8.0) == [GaitState.MOTION, GaitState.RELAXED]
        assert simulation.robot.truth().torso_position[2] < 0.12
        gait.request_motion("get_up")
        assert nao.run(9.0)[-1] is GaitState.STAND
        assert simulation.robot.truth().torso_position[2] > 0.25
