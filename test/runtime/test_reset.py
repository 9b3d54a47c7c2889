"""A robot that is put back to its start stands, whatever it did before."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
import pytest

from gait_lab.faults.harness import Fault, Harness
from nao_lipm_gait.presets import preset_for
from robot_core.geometry import rotation_matrix
from robot_core.robot import load_robot
from robot_core.types import FALLEN, GETTING_UP, MOTION, STAND, GaitState, VelocityCommand
from sim_bridge.robot import START_STATES
from sim_bridge.trials.rollout import RolloutSpec
from sim_bridge.trials.tasks import TASKS
from sim_bridge.trials.trial import make_world

pytest.importorskip("mujoco")
pytest.importorskip("pybullet")
PUSH = 14.0
"""[m/s^2] for 0.1 s: it fells every robot."""


def walk(harness: Harness) -> None:
    harness.command = VelocityCommand(0.15)
    harness.run(80)


def fall(harness: Harness, after: int) -> None:
    """Push the robot, and wait [ticks]; 0.05 s after the push it is still upright."""
    walk(harness)
    mass = sum(link.mass for link in harness.world.robot.body.links)
    angle = 1.3 * harness.world.robot.spec.seed
    for _ in range(10):
        harness.push_robot(PUSH * mass * np.array((np.cos(angle), np.sin(angle), 0.0)))
        harness.step()
    harness.run(after)


def get_up(harness: Harness, after: int) -> None:
    fall(harness, 250)
    controller = harness.gaits[0].controller
    controller.answer(controller.get_up)
    harness.run(after)


def kick(harness: Harness, after: int) -> None:
    harness.gaits[0].controller.request_motion("kick_front_left")
    harness.run(after)


Before = Callable[[Harness], None]
CASES: dict[str, tuple[Before, tuple[GaitState, ...]]] = {
    "walks": (walk, ()),
    "tips": (lambda h: fall(h, 5), ()),
    "falls": (lambda h: fall(h, 25), ()),
    "has fallen": (lambda h: fall(h, 60), (FALLEN,)),
    "lies": (lambda h: fall(h, 200), (FALLEN,)),
    "lies for long": (lambda h: fall(h, 400), (FALLEN,)),
    "begins to get up": (lambda h: get_up(h, 100), (GETTING_UP, FALLEN)),
    "gets up": (lambda h: get_up(h, 300), ()),
    "kicks": (lambda h: kick(h, 40), (MOTION,)),
    "has kicked": (lambda h: kick(h, 120), ()),
}
"""What a robot does before, and the states in which that ends; empty: any."""
ROBOTS = ("nao_h21_v33", "nao_v6", "bruno")


@contextmanager
def robot(urdf: str, seed: int, engine: str, start_state: str = "stand") -> Iterator[Harness]:
    parameters = preset_for(load_robot(urdf), "default")
    spec = RolloutSpec(
        task=TASKS["stand"], robot_seed=seed, noise_seed=seed, parameters=parameters, urdf=urdf,
        engine=engine,
    )  # fmt: skip
    with make_world(spec, start_state=start_state) as world:
        harness = Harness(world, parameters, Fault(np.random.default_rng(0)), VelocityCommand())
        harness.run(70)
        yield harness


def upright(harness: Harness) -> float:
    """Cosine of the torso's tilt."""
    return float(rotation_matrix(harness.truth.torso_quaternion)[2, 2])


def reset_and_stand(case: str, urdf: str, seed: int, engine: str) -> None:
    before, states = CASES[case]
    with robot(urdf, seed, engine) as harness:
        before(harness)
        controller = harness.gaits[0].controller
        assert not states or controller.state in states
        harness.command = VelocityCommand()
        harness.reset_robot()
        harness.run(460)
        assert controller.state is STAND
        assert not harness.fallen
        assert harness.truth.torso_position[2] > 0.9 * harness.height
        harness.command = VelocityCommand(0.1)
        start = np.array(harness.truth.torso_position)
        harness.run(300)
        assert not harness.fallen
        assert np.linalg.norm((np.array(harness.truth.torso_position) - start)[:2]) > 0.05


@pytest.mark.parametrize(
    ("case", "urdf"),
    [
        ("falls", "nao_h21_v33"), ("has fallen", "bruno"), ("begins to get up", "nao_v6"),
        ("kicks", "nao_h21_v33"), ("has fallen", "op3"),
    ],
)  # fmt: skip
def test_a_robot_that_is_put_back_stands_and_walks(case: str, urdf: str) -> None:
    reset_and_stand(case, urdf, 40, "mujoco")


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["mujoco", "pybullet"])
@pytest.mark.parametrize("seed", range(40, 44))
@pytest.mark.parametrize("urdf", ROBOTS)
@pytest.mark.parametrize("case", CASES)
def test_each_robot_that_is_put_back_stands_and_walks(
    case: str, urdf: str, seed: int, engine: str
) -> None:
    reset_and_stand(case, urdf, seed, engine)


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["mujoco", "pybullet"])
@pytest.mark.parametrize("start_state", [state for state in START_STATES if state != "stand"])
@pytest.mark.parametrize("urdf", ROBOTS)
def test_a_robot_that_begins_lying_lies_after_a_reset_and_gets_up_again(
    urdf: str, start_state: str, engine: str
) -> None:
    with robot(urdf, 40, engine, start_state) as harness:
        controller = harness.gaits[0].controller
        for _ in range(2):
            assert controller.state is FALLEN
            assert upright(harness) < 0.5
            controller.answer(controller.get_up)
            harness.run(1500 if urdf != "bruno" else 3000)
            assert controller.state is STAND
            assert upright(harness) > 0.95
            harness.reset_robot()
            harness.run(130)
