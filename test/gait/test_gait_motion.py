"""Motions in the gait: which may begin when, and what follows them."""

import dataclasses
import math

import numpy as np
import pytest
import yaml

from nao_lipm_gait.gait import Gait
from nao_lipm_gait.parameters import GaitParameters
from obedient_robot import PARAMETERS, PERIOD, UPRIGHT, ObedientRobot
from robot_core.errors import NaoGaitError
from robot_core.motion.library import MotionLibrary, load_library
from robot_core.robot import load_robot
from robot_core.types import GaitState, VelocityCommand

ROBOT = load_robot()
FORWARD = VelocityCommand(0.1, 0.0, 0.0)
G = 9.81
ON_FRONT, ON_BACK, ON_LEFT = (-G, 0.0, 0.0), (G, 0.0, 0.0), (0.0, -G, 0.0)
MOTIONS = {
    "nod": {"poses": {"down": {"HeadPitch": 0.3}}},
    "crouch": {"poses": {"down": {"KneePitch": 1.2, "HipPitch": -0.7, "AnklePitch": -0.5}},
               "ends": "sitting"},
    "rise": {"starts": "sitting", "poses": {}},
    "up_front": {"starts": "lying_front", "poses": {"down": {"ShoulderPitch": 0.0}}},
    "up_back": {"starts": "lying_back", "poses": {"down": {"ShoulderPitch": 2.0}}},
    "over_left": {"starts": "lying_left", "ends": "lying_front",
                  "poses": {"down": {"ShoulderPitch": 1.0}}},
}  # fmt: skip


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> MotionLibrary:
    folder = tmp_path_factory.mktemp("motions")
    for name, content in MOTIONS.items():
        stand = content.get("ends", "standing") == "standing"
        keyframes = [{"pose": pose, "time": 0.4} for pose in content["poses"]]
        keyframes += [{"pose": "stand", "time": 0.4}] if stand else []
        text = yaml.safe_dump({"meaning": name, **content, "keyframes": keyframes})
        (folder / f"{name}.yaml").write_text(text, encoding="utf-8")
    return load_library(folder, ROBOT)


def obedient(library: MotionLibrary, **parameters: float | bool) -> ObedientRobot:
    """A robot that knows these motions and has no delay."""
    return ObedientRobot(ROBOT, PARAMETERS.replace(feedback_delay=0.0, **parameters), library)


def test_stand_motion_stand(library: MotionLibrary) -> None:
    nao = obedient(library)
    nao.run(1.0)
    nao.gait.request_motion("nod")
    assert nao.states(1.0) == [GaitState.MOTION, GaitState.STAND]
    assert nao.gait.status.motion == ""


@pytest.mark.parametrize(("name", "turned"), [("nao_h21_v33", 0.0), ("nao_v6", 0.2)])
def test_a_yaw_gyro_sees_that_a_kick_turns_the_robot(name: str, turned: float) -> None:
    nao = ObedientRobot(load_robot(name), PARAMETERS)
    nao.run(1.0)
    nao.gait.request_motion("kick_front_right")
    nao.run(0.5)
    nao.rate = (0.0, 0.0, 0.2)
    nao.run(1.0)
    nao.rate = (0.0, 0.0, 0.0)
    assert nao.states(4.0) == [GaitState.MOTION, GaitState.STAND]
    assert nao.gait.status.base_footprint_in_odom[2] == pytest.approx(turned, abs=0.01)


def test_a_walk_stops_for_a_motion_and_goes_on_without_a_jump(library: MotionLibrary) -> None:
    nao = obedient(library)
    nao.run(1.0)
    nao.run(3.0, FORWARD)
    nao.gait.request_motion("nod")
    way, moving = [], []
    for _ in range(600):
        way.append(nao.tick(FORWARD).position)
        moving.append(nao.gait.state in (GaitState.MOTION, GaitState.STAND))
    steps = np.abs(np.diff(way, axis=0))[np.array(moving[1:])]
    assert len(steps) > 80, "the motion and the stand before and after it"
    assert (steps.max(axis=0) <= 0.5 * ROBOT.velocity_limit * 0.01).all()
    nao.gait.request_motion("nod")
    assert nao.states(6.0, FORWARD) == [
        GaitState.WALK, GaitState.STOP, GaitState.STAND, GaitState.MOTION, GaitState.STAND,
        GaitState.WALK,
    ]  # fmt: skip


def test_without_a_motion_the_library_changes_nothing(library: MotionLibrary) -> None:
    ways = []
    for motions in (library, MotionLibrary()):
        nao = obedient(motions)
        nao.run(1.0)
        ways.append(np.array([answer.position for answer in nao.run(3.0, FORWARD)]))
    np.testing.assert_array_equal(*ways)


def test_sitting_is_held_until_a_stand_is_asked_for(library: MotionLibrary) -> None:
    nao = obedient(library)
    nao.run(1.0)
    nao.gait.request_motion("crouch")
    assert nao.states(3.0, FORWARD) == [GaitState.MOTION]
    assert nao.joints[ROBOT.index("LKneePitch")] == pytest.approx(1.2)
    with pytest.raises(NaoGaitError, match=r"nod, which starts standing.*rise"):
        nao.gait.request_motion("nod")
    nao.gait.request_stand()
    assert nao.states(0.9) == [GaitState.MOTION, GaitState.STAND]


def test_unknown_motions_and_get_ups_while_standing_are_refused(library: MotionLibrary) -> None:
    nao = obedient(library)
    nao.run(1.0)
    with pytest.raises(NaoGaitError, match=r"motion: got 'fly'.*crouch, nod"):
        nao.gait.request_motion("fly")
    with pytest.raises(NaoGaitError, match="lying; the robot is standing"):
        nao.gait.request_motion("get_up")
    with pytest.raises(NaoGaitError, match="up_front, which starts lying_front"):
        nao.gait.request_motion("up_front")
    assert nao.states(0.5) == [GaitState.STAND]


@pytest.mark.parametrize(
    ("force", "motion"), [(ON_FRONT, "up_front"), (ON_BACK, "up_back"), (ON_LEFT, "over_left")]
)
def test_the_get_up_fits_the_side(
    library: MotionLibrary, force: tuple[float, float, float], motion: str
) -> None:
    nao = obedient(library, get_up=True)
    nao.lie_down(force)
    seen = set()
    for _ in range(100):
        nao.tick()
        seen.add(nao.gait.status.motion)
    assert seen == {"", motion}


def test_a_robot_that_got_up_stands_and_walks_on(library: MotionLibrary) -> None:
    nao = obedient(library, get_up=True)
    nao.lie_down(ON_FRONT)
    while nao.gait.state is not GaitState.GETTING_UP:
        nao.tick(FORWARD)
        assert nao.stamp < 2 * 10**10, "it never began"
    nao.force = UPRIGHT
    assert nao.states(2.0, FORWARD) == [GaitState.GETTING_UP, GaitState.STAND, GaitState.WALK]


def test_it_tries_again_but_not_for_ever(library: MotionLibrary) -> None:
    nao = obedient(library, get_up=True)
    nao.lie_down(ON_BACK)
    states = nao.states(20.0)
    assert states.count(GaitState.GETTING_UP) == 5
    assert nao.gait.state is GaitState.FALLEN
    nao.gait.request_motion("get_up")
    assert GaitState.GETTING_UP in nao.states(1.0)


def test_without_a_request_the_robot_stays_down(library: MotionLibrary) -> None:
    nao = obedient(library)
    nao.lie_down(ON_FRONT)
    assert nao.states(3.0)[-1] is GaitState.FALLEN
    assert nao.tick().stiffness == 0.0
    relaxed = obedient(library, get_up=True)
    relaxed.run(1.0)
    relaxed.gait.request_relax()
    relaxed.run(0.1)
    relaxed.force = ON_FRONT
    assert relaxed.states(6.0) == [GaitState.RELAXED]
    relaxed.gait.request_motion("get_up")
    assert GaitState.GETTING_UP in relaxed.states(1.0)


def test_relax_ends_a_motion_at_once(library: MotionLibrary) -> None:
    nao = obedient(library)
    nao.run(1.0)
    nao.gait.request_motion("nod")
    nao.run(0.2)
    nao.gait.request_relax()
    assert nao.tick().stiffness == 0.0
    assert nao.states(1.0) == [GaitState.RELAXED]


def test_a_fall_ends_an_upright_motion(library: MotionLibrary) -> None:
    nao = obedient(library)
    nao.run(1.0)
    nao.gait.request_motion("crouch")
    nao.run(0.2)
    angle = 0.9
    nao.force = (-G * math.sin(angle), 0.0, G * math.cos(angle))
    assert nao.states(6.0)[-1] is GaitState.FALLEN


def test_same_frames_give_the_same_motion(library: MotionLibrary) -> None:
    ways = []
    for _ in range(2):
        nao = obedient(library)
        nao.run(1.0)
        nao.gait.request_motion("crouch")
        ways.append(np.array([answer.position for answer in nao.run(1.0)]))
    np.testing.assert_array_equal(*ways)


def test_the_shipped_folder_is_found() -> None:
    gait = Gait(ROBOT, GaitParameters())
    with pytest.raises(NaoGaitError, match="stand"):
        gait.request_motion("nothing")


def test_a_get_up_that_was_asked_for_is_forgotten_on_the_feet(library: MotionLibrary) -> None:
    robot = obedient(library)
    robot.run(1.0)
    robot.gait.request_relax()
    robot.tick()
    robot.gait.request_motion("get_up")  # the side of a limp robot is not known yet
    robot.gait.request_stand()
    robot.run(3.0)
    assert robot.gait.state is GaitState.STAND
    robot.force = ON_FRONT
    states = robot.states(4.0)
    assert GaitState.FALLEN in states
    assert GaitState.GETTING_UP not in states


@pytest.mark.parametrize("again", [1, 2])
@pytest.mark.parametrize("asked", [False, True])
def test_after_a_gap_a_fallen_robot_is_still_down_and_goes_on_getting_up(
    library: MotionLibrary, asked: bool, again: int
) -> None:
    robot = obedient(library)
    robot.run(1.0)
    robot.force = ON_FRONT
    robot.run(2.0)
    if asked:
        robot.gait.request_motion("get_up")
        while robot.gait.state is not GaitState.GETTING_UP:
            robot.tick()
    robot.stamp += 30 * PERIOD
    for _ in range(again):
        robot.gait.restart()
    assert robot.tick().stiffness == 0.0
    assert robot.gait.state is GaitState.FALLEN
    states = robot.states(4.0)
    assert (GaitState.GETTING_UP in states) == asked
    assert GaitState.STAND not in states


def test_a_motion_that_needs_feet_is_forgotten_where_the_first_frame_shows_a_fall(
    library: MotionLibrary,
) -> None:
    robot = obedient(library)
    robot.gait.request_motion("nod")
    robot.force = ON_FRONT
    assert robot.tick().stiffness == 0.0
    assert robot.states(2.0)[-1] is GaitState.FALLEN


def test_a_motion_that_was_asked_for_before_the_first_frame_runs(library: MotionLibrary) -> None:
    robot = obedient(library)
    robot.gait.request_motion("nod")
    assert GaitState.MOTION in robot.states(4.0)


def test_a_fall_ends_the_heading_hold(library: MotionLibrary) -> None:
    with_gyro = dataclasses.replace(ROBOT, gyro_axes=3)
    robot = ObedientRobot(with_gyro, PARAMETERS.replace(feedback_delay=0.0), library)
    robot.run(1.0)
    robot.run(3.0, FORWARD)
    robot.gait.report_fall()
    robot.tick(FORWARD)
    assert robot.gait.state is GaitState.FALLEN
    robot.rate = (0.0, 0.0, 0.5)  # somebody turns the fallen robot
    robot.run(0.4)
    robot.rate = (0.0, 0.0, 0.0)
    assert GaitState.WALK in robot.states(4.0, FORWARD)
    assert robot.gait.status.base_footprint_in_odom[2] == pytest.approx(0.2, abs=0.05)
    turns = [(robot.tick(FORWARD), robot.gait.status.step_size[2])[1] for _ in range(200)]
    assert np.abs(turns).max() < 0.01, "no step turns back to the heading before the fall"


def test_a_motion_that_needs_feet_is_forgotten_when_a_get_up_fails(library: MotionLibrary) -> None:
    robot = obedient(library, get_up=True)
    robot.lie_down(ON_FRONT)
    while robot.gait.state is not GaitState.GETTING_UP:
        robot.tick()
    robot.gait.request_motion("nod")
    motions = {(robot.tick(), robot.gait.status.motion)[1] for _ in range(500)}
    assert motions == {"", "up_front"}
