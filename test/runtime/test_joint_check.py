"""Joints that do not follow their targets are found, named, and never walked with."""

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np
import pytest

from gait_lab.faults.campaign import FaultRun, run_fault
from gait_lab.faults.harness import Fault, Harness
from gait_lab.faults.messages import Command, Delivery, Message
from nao_lipm_gait.runtime.inputs import JointInput
from nao_lipm_gait.runtime.joint_check import LAGS, JointCheck
from nao_lipm_gait.runtime.reporter import PublisherCounts
from robot_core.geometry import rotation_matrix
from robot_core.robot import RobotDescription, load_robot
from robot_core.types import FloatArray, GaitState, VelocityCommand
from simulation_runs import standing

pytest.importorskip("mujoco")
ROBOT = load_robot()
Distortion = Callable[[FloatArray], FloatArray]


def changed(robot: RobotDescription, joints: tuple[str, ...], change: Distortion) -> Distortion:
    """Changes the angles of these joints."""
    index = [robot.index(name) for name in joints]

    def apply(angles: FloatArray) -> FloatArray:
        angles = np.array(angles, dtype=float)
        angles[..., index] = change(angles[..., index])
        return angles

    return apply


def exchanged(robot: RobotDescription, *pairs: tuple[str, str]) -> Distortion:
    """Each of two joints has the name of the other."""
    order = list(range(len(robot.joint_names)))
    for first, second in pairs:
        a, b = robot.index(first), robot.index(second)
        order[a], order[b] = b, a
    return lambda angles: np.array(angles, dtype=float)[..., order]


def sides(robot: RobotDescription) -> tuple[tuple[str, str], ...]:
    return tuple(zip(robot.left_leg.names, robot.right_leg.names, strict=True))


# -- signals ---------------------------------------------------------------------------------------


def targets(ticks: int = 300) -> FloatArray:
    """Each joint moves about an angle of its own, in a phase of its own."""
    time = 0.01 * np.arange(ticks)[:, None]
    joints = np.arange(len(ROBOT.joint_names))
    middle = 0.3 + 0.05 * (joints % 7)
    return middle + 0.15 * np.sin(12.0 * time + 0.9 * joints)


def judged(change: Distortion, late: int = 0, walking: bool = True) -> JointCheck:
    """The check after readings that are `late` ticks behind their targets."""
    check, wanted = JointCheck(ROBOT, 0.01), targets()
    noise = np.random.default_rng(3).normal(0.0, 0.002, wanted.shape)
    for tick in range(10, len(wanted) - 10):
        check.update(change(wanted[tick - late]) + noise[tick], wanted[tick], walking=walking)
    return check


@pytest.mark.parametrize("late", LAGS)
def test_joints_that_follow_late_or_early_prove_themselves(late: int) -> None:
    check = judged(lambda angles: angles, late)
    assert check.trouble == ""
    assert check.done


def test_a_stand_proves_no_joint() -> None:
    assert not judged(lambda angles: angles, walking=False).done


WRONG: dict[str, Distortion] = {
    "sign of the reading or of the command": changed(ROBOT, ("RHipRoll",), lambda q: -q),
    "scale 0.5": changed(ROBOT, ("RKneePitch",), lambda q: 0.5 * q),
    "scale 2": changed(ROBOT, ("LAnklePitch",), lambda q: 2.0 * q),
    "unit deg instead of rad": changed(ROBOT, ("LHipPitch",), np.degrees),
    "zero off by 0.3": changed(ROBOT, ("RAnkleRoll",), lambda q: q + 0.35),
    "does not move": changed(ROBOT, ("LKneePitch",), lambda q: 0.0 * q + 0.4),
    "KneePitch?; also": exchanged(ROBOT, ("LKneePitch", "RKneePitch")),
    "exchanged with L": exchanged(ROBOT, ("LKneePitch", "LAnklePitch")),
}


@pytest.mark.parametrize("guess", WRONG)
@pytest.mark.parametrize("late", [0, 3])
def test_what_is_wrong_is_guessed(guess: str, late: int) -> None:
    check = judged(WRONG[guess], late)
    assert guess in check.trouble
    assert not check.done


@pytest.mark.parametrize("urdf", ["nao_h21_v33", "booster_t1"])
@pytest.mark.parametrize("exchange", [True, False])
def test_exchanged_joints_are_named_within_a_tenth_of_a_second(urdf: str, exchange: bool) -> None:
    """A knee bends by 0.3 rad in 0.1 s; loads press both, one more than the other."""
    robot = load_robot(urdf)
    knees = robot.left_leg.knee_pitch, robot.right_leg.knee_pitch
    left, right = map(robot.index, knees)
    change = exchanged(robot, knees) if exchange else lambda angles: angles
    check, pressed = JointCheck(robot, 0.01), 0.5 if robot.soft_joint else 0.1
    for tick in range(50):
        target = np.array(robot.stand_pose)
        target[left] += 0.03 * min(max(0, tick - 40), 10)
        reached = target.copy()
        reached[left] -= 0.07 * pressed
        reached[right] -= 0.03 * pressed
        check.update(change(reached), target, walking=tick > 20)
        assert tick > 40 or check.trouble == ""
    assert (f"exchanged with {knees[1]}?" in check.trouble) == exchange
    assert bool(check.trouble) == exchange


def test_a_motor_that_a_load_turns_half_as_far_is_not_named() -> None:
    robot = load_robot("op3")
    joint, check = robot.index("l_hip_roll"), JointCheck(robot, 0.01)
    random = np.random.default_rng(3)
    for tick in range(200):
        target = np.array(robot.stand_pose)
        target[joint] += 0.15 * np.sin(0.2 * tick)
        reached = target.copy()
        reached[joint] = 0.5 * target[joint] + random.normal(0.0, 0.001)
        check.update(reached, target, walking=True)
        assert check.trouble == ""


def test_single_readings_that_are_wrong_are_no_wrong_joint() -> None:
    """Spikes of up to 2 rad in a tenth of the readings."""
    random, knee = np.random.default_rng(5), ROBOT.index("LKneePitch")

    def with_spikes(angles: FloatArray) -> FloatArray:
        angles = angles.copy()
        if random.uniform() < 0.1:
            angles[knee] += random.uniform(-2.0, 2.0)
        return angles

    check, wanted = JointCheck(ROBOT, 0.01), targets()
    for target in wanted:
        check.update(with_spikes(target), target, walking=True)
        assert check.trouble == ""


def test_motors_that_are_switched_on_late_are_forgiven() -> None:
    check, wanted = JointCheck(ROBOT, 0.01), targets(200)
    for target in wanted:
        check.update(wanted[0], target, walking=True)
    assert check.trouble
    for target in wanted:
        check.update(target, target, walking=True)
    assert check.trouble == ""


@pytest.mark.parametrize("known", [True, False])
def test_late_targets_of_a_computer_that_was_held_up_are_not_judged(known: bool) -> None:
    check, wanted = JointCheck(ROBOT, 0.01), 3.0 * targets(200)
    held = wanted[40]
    for tick in (*range(10, 41), *range(60, 200)):
        ticks = 20 if known and tick == 60 else 1
        measured = held if 60 <= tick < 72 else wanted[tick]
        check.update(measured, wanted[tick], walking=True, ticks=ticks)
        if check.trouble:
            break
    assert (check.trouble == "") == known


def test_a_few_lost_readings_are_bridged() -> None:
    check, wanted = JointCheck(ROBOT, 0.01), targets()
    for tick in range(10, 280, 3):
        check.update(wanted[tick], wanted[tick], walking=True, ticks=3)
    assert check.done


# -- robots ----------------------------------------------------------------------------------------


class Wrong(Fault):
    """Joint angles that are changed as measured, or as executed."""

    def __init__(self, measured: Distortion | None, executed: Distortion | None) -> None:
        super().__init__(np.random.default_rng(0))
        self._measured, self._executed = measured, executed

    def on_sensor(self, harness: Harness, message: Message) -> Iterable[Delivery[Message]]:
        joints = message.content
        if isinstance(joints, JointInput) and self._measured is not None:
            position = self._measured(np.array(joints.position)).tolist()
            message = replace(message, content=replace(joints, position=position))
        yield Delivery(0, message)

    def on_command(self, harness: Harness, command: Command) -> Iterable[Delivery[Command]]:
        if self._executed is not None:
            position = self._executed(command.targets.position)
            position = np.clip(position, harness.robot.lower, harness.robot.upper)
            command = replace(command, targets=command.targets._replace(position=position))
        yield Delivery(0, command)


def ends_standing(
    urdf: str, measured: Distortion | None, executed: Distortion | None = None, seed: int = 3,
    walk: tuple[float, float, float] = (0.15, 0.0, 0.3), engine: str = "mujoco",
    seconds: float = 3.0, farthest: float = 0.05,
) -> str:  # fmt: skip
    """A robot that is told to walk after 1 s stands at the end; what is said of its sensors."""
    world, parameters = standing(urdf, seed, engine)
    with world:
        harness = Harness(world, parameters, Wrong(measured, executed), VelocityCommand(*walk))
        harness.run(round(100 * seconds))
        assert not harness.fallen
        assert harness.gaits[0].controller.state is GaitState.STAND
        assert harness.truth.torso_position[0] < farthest, "it has taken a first step at most"
        assert harness.invariants.listed() == ()
        return "\n".join(harness.invariants.explained)


def test_a_robot_whose_soles_cannot_be_where_its_joints_say_gets_no_targets() -> None:
    said = ends_standing(
        "nao_h21_v33", changed(ROBOT, ("RAnklePitch",), lambda q: -q), seconds=2.0
    )
    assert "angle between the soles" in said


@pytest.mark.parametrize(("fault", "seed"), [("gait_restart", 45), ("silence", 51)])
def test_a_robot_that_leans_on_the_foot_of_a_held_step_walks_on(fault: str, seed: int) -> None:
    assert run_fault(FaultRun(fault, seed)).outcome == "walks"


@pytest.mark.parametrize("urdf", ["nao_h21_v33", "nao_v6"])
def test_worn_gears_that_hold_a_hip_in_the_first_sway_are_not_stuck(urdf: str) -> None:
    assert run_fault(FaultRun("none", 303, urdf=urdf, plant="worn")).outcome == "walks"


@pytest.mark.parametrize("scale", [0.0, np.pi / 180.0])
def test_legs_that_read_nearly_zero_get_no_targets(scale: float) -> None:
    said = ends_standing("nao_v6", lambda q: scale * q, seconds=2.0)
    assert "all leg joints" in said


def test_legs_that_bend_the_other_way_get_no_targets() -> None:
    said = ends_standing("op3", lambda q: -q, seconds=2.0)
    assert "all leg joints" in said


def test_motors_that_give_way_are_compared_with_where_their_targets_lead_them() -> None:
    wrong = changed(load_robot("booster_t1"), ("Right_Ankle_Roll",), lambda q: -q)
    assert "Right_Ankle_Roll" in ends_standing("booster_t1", wrong, seed=2)


def test_exchanged_knees_of_a_robot_with_soft_motors_end_the_first_step() -> None:
    robot = load_robot("booster_t1")
    knees = robot.left_leg.knee_pitch, robot.right_leg.knee_pitch
    assert "exchanged with" in ends_standing("booster_t1", exchanged(robot, knees), seed=2)


def test_a_joint_that_is_named_in_the_third_step_ends_the_walk_at_once() -> None:
    wrong = changed(load_robot("booster_t1"), ("Right_Ankle_Roll",), lambda q: 2.0 * q)
    walk = (0.4, 0.0, 0.3)
    said = ends_standing("booster_t1", wrong, seed=6, walk=walk, seconds=4.0, farthest=0.1)
    assert "Right_Ankle_Roll" in said


def test_a_joint_in_degrees_that_is_wrong_twice_in_a_stand_remains_so() -> None:
    robot = load_robot("booster_t1")
    said = ends_standing("booster_t1", changed(robot, ("Right_Hip_Roll",), np.degrees), seed=2)
    assert "position[Right_Hip_Roll]" in said


def test_a_second_gait_mends_no_joint_that_was_wrong_before() -> None:
    world, parameters = standing("nao_h21_v33", 3, "mujoco")
    wrong = changed(ROBOT, ("RHipRoll",), lambda q: -q)
    with world:
        told = VelocityCommand(0.15, 0.0, 0.0)
        harness = Harness(world, parameters, Wrong(wrong, None), told)
        harness.run(250)
        harness.start_gait()
        harness.publishers = PublisherCounts(joint_command=2)
        harness.run(150)
        assert harness.gaits[0].controller.state is GaitState.STAND
        assert "RHipRoll" in "".join(harness.invariants.explained)


class Hung(Wrong):
    """Such a robot hangs from its torso."""

    def before_physics(self, harness: Harness) -> None:
        truth, mass = harness.truth, sum(b.mass for b in harness.world.robot.body.links)
        wanted = np.array((0.0, 0.0, harness.height + 0.05))
        turn = rotation_matrix(truth.torso_quaternion)
        velocity = turn @ truth.torso_linear_velocity_in_torso
        force = mass * (150.0 * (wanted - truth.torso_position) - 24.0 * velocity)
        harness.push_robot(force + (0.0, 0.0, 9.81 * mass))


@pytest.mark.parametrize("joint", ["RHipPitch", "RKneePitch", "RAnklePitch"])
def test_commands_with_the_wrong_sign_are_named_while_the_robot_hangs(joint: str) -> None:
    world, parameters = standing("nao_h21_v33", 3, "mujoco")
    with world:
        wrong = Hung(None, changed(ROBOT, (joint,), lambda q: -q))
        harness = Harness(world, parameters, wrong, VelocityCommand(0.1, 0.0, 0.0))
        harness.run(150)
        assert harness.gaits[0].controller.state is GaitState.STAND
        assert f"position[{joint}]" in "".join(harness.invariants.explained)


@pytest.mark.parametrize("urdf", ["nao_h21_v33", "bruno"])
def test_legs_with_exchanged_names_end_the_first_step(urdf: str) -> None:
    robot = load_robot(urdf)
    said = ends_standing(urdf, exchanged(robot, *sides(robot)))
    assert "joint_states position" in said


def test_a_command_that_is_executed_with_the_wrong_sign_is_found() -> None:
    said = ends_standing("nao_h21_v33", None, changed(ROBOT, ("RHipRoll",), lambda q: -q))
    assert "RHipRoll" in said
    assert "sign of the reading or of the command?" in said


def distortions(robot: RobotDescription) -> dict[str, Distortion]:
    right, left = robot.right_leg, robot.left_leg
    wrong: dict[str, Distortion] = {"sides": exchanged(robot, *sides(robot))}
    for name in right.names:
        wrong[f"sign {name}"] = changed(robot, (name,), lambda q: -q)
        wrong[f"20 deg {name}"] = changed(robot, (name,), lambda q: q + 0.35)
        wrong[f"half {name}"] = changed(robot, (name,), lambda q: 0.5 * q)
        wrong[f"double {name}"] = changed(robot, (name,), lambda q: 2.0 * q)
    for one, other in sides(robot):
        wrong[f"signs {other}"] = changed(robot, (one, other), lambda q: -q)
        wrong[f"names {other}"] = exchanged(robot, (one, other))
    wrong["ankle"] = exchanged(robot, (right.ankle_pitch, right.ankle_roll))
    wrong["ankles"] = exchanged(
        robot, (right.ankle_pitch, right.ankle_roll), (left.ankle_pitch, left.ankle_roll)
    )
    wrong["degrees"] = np.degrees
    return wrong


@pytest.mark.slow
@pytest.mark.parametrize("name", distortions(ROBOT))
@pytest.mark.parametrize(("urdf", "seed"), [("nao_h21_v33", 8), ("nao_v6", 4)])
def test_no_nao_walks_or_falls_with_a_wrong_joint(name: str, urdf: str, seed: int) -> None:
    if name == "names RHipYawPitch":
        pytest.skip("one motor turns both")
    ends_standing(urdf, distortions(load_robot(urdf))[name], seed=seed, seconds=6.0)
