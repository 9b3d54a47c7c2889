"""What every engine's motors share: where setpoints go, and how strong a motor is."""

import dataclasses

import attrs
import numpy as np
import pytest

from robot_core.robot import RobotDescription
from robot_core.types import FloatArray
from sim_bridge.individual import NOMINAL, Individual, draw_individual
from sim_bridge.motors import Setpoints, TorqueLimits
from sim_bridge.plant import Plant, load_plant

SUBSTEPS = 5
PERIOD = 0.01


@pytest.fixture(scope="module")
def plant() -> Plant:
    return load_plant("reference")


@pytest.fixture(scope="module")
def nominal(plant: Plant, robot: RobotDescription) -> Individual:
    return draw_individual(plant, robot, NOMINAL)


def setpoints(robot: RobotDescription, plant: Plant, individual: Individual) -> Setpoints:
    made = Setpoints(robot, plant, individual, SUBSTEPS)
    made.reset(robot.stand_pose)
    return made


def advance(made: Setpoints, target: FloatArray) -> FloatArray:
    """(substeps, n)."""
    return np.array(list(made.advance(target.copy())))


def moved(robot: RobotDescription, **joints: float) -> FloatArray:
    pose = np.array(robot.stand_pose)
    for joint, angle in joints.items():
        pose[robot.index(joint)] += angle
    return pose


def test_setpoints_go_straight_to_the_target(
    robot: RobotDescription, plant: Plant, nominal: Individual
) -> None:
    target = moved(robot, LHipRoll=0.03, HeadYaw=-0.05)
    rows = advance(setpoints(robot, plant, nominal), target)
    assert rows.shape == (SUBSTEPS, 22)
    for number, row in enumerate(rows, start=1):
        expected = robot.stand_pose + (target - robot.stand_pose) * number / SUBSTEPS
        assert row == pytest.approx(expected, abs=1e-12)


def test_no_faster_than_the_joint(
    robot: RobotDescription, plant: Plant, nominal: Individual
) -> None:
    made, target = setpoints(robot, plant, nominal), np.array(robot.lower)
    target[robot.index("RHipYawPitch")] = target[robot.index("LHipYawPitch")]
    before = np.array(robot.stand_pose)
    for _ in range(200):
        rows = advance(made, target)
        steps = np.diff(np.vstack([before, rows]), axis=0)
        assert (np.abs(steps) <= robot.velocity_limit * PERIOD / SUBSTEPS + 1e-12).all()
        before = rows[-1]
    assert before == pytest.approx(target)
    free = attrs.evolve(plant, motor=attrs.evolve(plant.motor, speed_limit=False))
    assert advance(setpoints(robot, free, nominal), target)[-1] == pytest.approx(target)


def test_no_further_than_the_limits(
    robot: RobotDescription, plant: Plant, nominal: Individual
) -> None:
    for sign, limit in ((1.0, robot.upper), (-1.0, robot.lower)):
        made = setpoints(robot, plant, nominal)
        for _ in range(300):
            rows = advance(made, np.full(22, sign * 10.0))
        assert rows[-1] == pytest.approx(limit)
        assert made.current == pytest.approx(limit)


def test_zero_errors_are_added_last(robot: RobotDescription, plant: Plant) -> None:
    """Limits apply to commanded angles; the encoder offset shifts the true angle."""
    individual = draw_individual(plant, robot, 3)
    made = setpoints(robot, plant, individual)
    for _ in range(300):
        rows = advance(made, np.full(22, 10.0))
    assert rows[-1] == pytest.approx(robot.upper + individual.joint_zero)
    assert made.current == pytest.approx(robot.upper)


def test_shared_motor_follows_the_leader(
    robot: RobotDescription, plant: Plant, nominal: Individual
) -> None:
    left, right = robot.index("LHipYawPitch"), robot.index("RHipYawPitch")
    rows = advance(setpoints(robot, plant, nominal), moved(robot, LHipYawPitch=-0.03))
    assert rows[-1, left] == rows[-1, right] == pytest.approx(-0.03)
    rows = advance(setpoints(robot, plant, nominal), moved(robot, RHipYawPitch=-0.03))
    assert rows[-1, left] == rows[-1, right] == 0.0


KNEE = 7.7856
"""[N m] stall torque of a pitch motor of the legs."""


def limits(
    robot: RobotDescription, plant: Plant, individual: Individual, **options: object
) -> TorqueLimits:
    changed = attrs.evolve(plant, motor=attrs.evolve(plant.motor, **options))
    return TorqueLimits(robot, changed, individual)


def test_torque_at_standstill(robot: RobotDescription, plant: Plant, nominal: Individual) -> None:
    knee = robot.index("LKneePitch")
    assert limits(robot, plant, nominal).standstill[knee] == pytest.approx(0.7 * KNEE)
    whole = limits(robot, plant, nominal, torque_fraction=1.0)
    assert whole.standstill[knee] == pytest.approx(KNEE)
    weak = dataclasses.replace(nominal, motor_strength=0.85)
    assert limits(robot, plant, weak).standstill[knee] == pytest.approx(0.85 * 0.7 * KNEE)


def test_a_follower_has_no_motor(
    robot: RobotDescription, plant: Plant, nominal: Individual
) -> None:
    torque = limits(robot, plant, nominal).standstill
    assert torque[robot.index("LHipYawPitch")] == pytest.approx(0.7 * 11.9773)
    assert torque[robot.index("RHipYawPitch")] == 0.0
    assert np.count_nonzero(torque == 0.0) == 1


def test_a_driving_motor_weakens_with_speed(
    robot: RobotDescription, plant: Plant, nominal: Individual
) -> None:
    model, knee = limits(robot, plant, nominal), robot.index("LKneePitch")
    top = robot.motors["LKneePitch"].no_load_speed
    for share, left in ((0.0, 1.0), (0.5, 0.5), (-0.5, 0.5), (1.0, 0.0), (1.5, 0.0)):
        velocity = np.full(22, share * top)
        assert model.driving(velocity)[knee] == pytest.approx(left * 0.7 * KNEE)
        same = np.sign(velocity)  # torque and wish in the direction of motion
        now = model.now(velocity, same, 2.0 * velocity)
        assert now[knee] == pytest.approx(left * 0.7 * KNEE)


def test_a_braking_motor_has_all_its_torque(
    robot: RobotDescription, plant: Plant, nominal: Individual
) -> None:
    model, knee = limits(robot, plant, nominal), robot.index("LKneePitch")
    velocity = np.full(22, 4.0)
    slowing = model.now(velocity, -np.ones(22), velocity)
    about_to = model.now(velocity, np.ones(22), 0.5 * velocity)
    assert slowing[knee] == about_to[knee] == pytest.approx(0.7 * KNEE)
    assert model.now(velocity, np.ones(22), 2.0 * velocity)[knee] < 0.5 * 0.7 * KNEE


def test_without_the_line_speed_does_not_matter(
    robot: RobotDescription, plant: Plant, nominal: Individual
) -> None:
    model = limits(robot, plant, nominal, torque_speed_line=False)
    velocity = np.full(22, 100.0)
    assert np.array_equal(model.driving(velocity), model.standstill)
    assert np.array_equal(model.now(velocity, velocity, velocity), model.standstill)
    assert np.isinf(model.top_speed).all()
    assert not model.loss.any()
    assert limits(robot, plant, nominal).loss.any()


@pytest.mark.parametrize("line", [True, False])
def test_the_span_holds_the_same_limits(
    robot: RobotDescription, plant: Plant, nominal: Individual, line: bool
) -> None:
    model = limits(robot, plant, nominal, torque_speed_line=line)
    for velocity in np.random.default_rng(5).uniform(-9.0, 9.0, (50, 22)):
        span = model.span(velocity)
        for row, sign in ((0, -1.0), (1, 1.0)):
            torque = sign * np.ones(22)
            expected = model.now(velocity, torque, velocity + 100.0 * torque)
            if line:  # the servo's next demand is unknown here
                braking = velocity * torque < 0.0
                expected = np.where(braking, model.standstill, model.driving(velocity))
            assert sign * span[row] == pytest.approx(expected)


@pytest.mark.parametrize("line", [True, False])
def test_motors_at_their_limits_are_counted(
    robot: RobotDescription, plant: Plant, nominal: Individual, line: bool
) -> None:
    model = limits(robot, plant, nominal, torque_speed_line=line)
    random, counts = np.random.default_rng(6), []
    for velocity in random.uniform(-9.0, 9.0, (50, 22)):
        span = model.span(velocity)
        torque = random.uniform(*span)
        beyond = (torque < 0.8 * span[0]) | (torque > 0.8 * span[1])
        counts.append(model.saturated(velocity, torque, 0.8))
        assert counts[-1] == np.count_nonzero(beyond)
        assert model.saturated(velocity, torque, np.full(22, 0.8)) == counts[-1]
    assert len(set(counts)) > 3
    assert model.saturated(velocity, np.zeros(22), 0.8) == 0
