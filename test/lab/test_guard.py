"""The target guard never interferes with what the gait does by itself."""

import numpy as np
import pytest

from gait_lab.faults.harness import Fault, Harness
from nao_lipm_gait.presets import preset_for
from robot_core.head_goals import Angles
from robot_core.motion.library import shipped_library
from robot_core.robot import load_robot
from robot_core.types import STANDSTILL, GaitState, VelocityCommand
from sim_bridge.trials.trial import TrialSpec, make_world

pytest.importorskip("mujoco")
ROBOTS = ("nao_h21_v33", "bruno")
FORWARD = VelocityCommand(0.15, 0.0, 0.0)
ON_THE_FLOOR = ("get_up_front", "get_up_back", "roll_over_right", "roll_over_left")


def harness(
    urdf: str,
    start: str = "stand",
    command: VelocityCommand = STANDSTILL,
    get_up: bool = False,
    seed: int = 3,
) -> Harness:
    parameters = preset_for(load_robot(urdf), "default").replace(get_up=get_up)
    spec = TrialSpec(robot_seed=seed, engine="mujoco", urdf=urdf, parameters=parameters)
    world = make_world(spec, start_state=start)
    return Harness(world, parameters, Fault(np.random.default_rng(0)), command)


def until_it_stands(asked: Harness) -> None:
    for _ in range(30):
        asked.run(100)
        if asked.gaits[0].controller.state is GaitState.STAND:
            return
    raise AssertionError(f"no stand after {asked.seconds():.0f} s")


def upright_motions(urdf: str) -> list[str]:
    library = shipped_library(load_robot(urdf))
    # Those to the left are mirrored ones to the right. The one that ends on the floor is the last.
    names = {name for name in library.motions if not name.endswith("_left")}
    return sorted(names - set(ON_THE_FLOOR) - {"relax"}) + ["relax"]


@pytest.mark.parametrize("urdf", ROBOTS)
def test_motions_one_after_the_other_with_a_turned_head(urdf: str) -> None:
    asked = harness(urdf, get_up=True)
    controller = asked.gaits[0].controller
    with asked.world:
        for motion in upright_motions(urdf):
            controller.stand()
            until_it_stands(asked)
            controller.look(Angles(1.2, 0.2))
            asked.run(50)
            controller.request_motion(motion)
            asked.run(200)
            controller.look(None)
    assert controller.reporter.faults == 0, controller.reports()


@pytest.mark.parametrize("urdf", ROBOTS)
@pytest.mark.parametrize("start", ["lying_front", "lying_back"])
def test_getting_up_with_a_turned_head(urdf: str, start: str) -> None:
    asked = harness(urdf, start)
    controller = asked.gaits[0].controller
    with asked.world:
        asked.run(100)
        controller.get_up()
        until_it_stands(asked)
    assert controller.reporter.faults == 0, controller.reports()


@pytest.mark.parametrize("force", [(120.0, 0.0, 0.0), (-120.0, 0.0, 0.0), (0.0, 120.0, 0.0)])
def test_falling_while_walking_and_getting_up(force: tuple[float, float, float]) -> None:
    asked = harness("nao_h21_v33", command=FORWARD, get_up=True)
    controller = asked.gaits[0].controller
    with asked.world:
        asked.run(300)
        for _ in range(10):
            asked.push_robot(np.array(force))
            asked.run(1)
        poses = []
        for _ in range(1100):
            asked.run(1)
            assert controller.last_status is not None
            poses.append(controller.last_status.base_footprint_in_odom)
    assert asked.invariants.fell_at is not None
    places = np.array(poses)
    assert np.abs(np.diff(places[:, :2], axis=0)).max() < 0.02, "odom is continuous (REP-105)"
    assert np.abs(np.diff(np.unwrap(places[:, 2]))).max() < 0.1
    assert controller.reporter.faults == 0, controller.reports()


@pytest.mark.parametrize("doing", ["walk", "relaxed", "sit"])
def test_a_reset_of_the_robot(doing: str) -> None:
    asked = harness("nao_h21_v33", command=FORWARD if doing == "walk" else STANDSTILL)
    controller = asked.gaits[0].controller
    with asked.world:
        asked.run(200)
        if doing == "relaxed":
            controller.relax()
        elif doing == "sit":
            controller.request_motion("sit")
        asked.run(300)
        asked.reset_robot()
        asked.run(300)
    assert controller.reporter.faults == 0, controller.reports()
