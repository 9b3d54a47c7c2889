"""Numeric kinematics of legs with offsets: against Pinocchio, the closed forms and their mirror."""

import dataclasses

import numpy as np
import pytest

from nao_lipm_gait.whole_body.body_model import BodyModel, SolePose
from nao_lipm_gait.whole_body.leg_kinematics import LegColumns, LegSolution
from nao_lipm_gait.whole_body.legs import make_legs
from nao_lipm_gait.whole_body.numeric_legs import MAX_STEPS, NumericLegs
from nao_lipm_gait.whole_body.yaw_hip_legs import YawHipLegs
from robot_core.motion.joints import mirror_law
from robot_core.robot import RobotDescription, load_robot

ROBOTS = ("booster_t1", "booster_k1", "op3")


@pytest.fixture(scope="module", params=ROBOTS)
def robot(request: pytest.FixtureRequest) -> RobotDescription:
    return load_robot(request.param)


def soles_at(body: BodyModel, position: np.ndarray) -> tuple[SolePose, SolePose]:
    body.set_joints(position)
    return body.sole_in_torso(1), body.sole_in_torso(-1)


def written(robot: RobotDescription, solution: LegSolution) -> np.ndarray:
    position = np.array(robot.stand_pose)
    LegColumns(robot, robot.left_leg).write(solution.left, position)
    LegColumns(robot, robot.right_leg).write(solution.right, position)
    return position


def gaits(robot: RobotDescription, ticks: int) -> list[np.ndarray]:
    """Joint angles that move as fast as those of a walk."""
    rng = np.random.default_rng(3)
    legs = [robot.index(name) for leg in (robot.left_leg, robot.right_leg) for name in leg.names]
    rate, phase = rng.uniform(2.0, 10.0, 12), rng.uniform(0.0, 6.0, 12)
    poses = []
    for tick in range(ticks):
        pose = np.array(robot.stand_pose)
        pose[legs] += 0.25 * np.sin(rate * 0.01 * tick + phase)
        poses.append(pose)
    return poses


def test_these_legs_have_no_closed_form(robot: RobotDescription) -> None:
    assert isinstance(make_legs(robot), NumericLegs)


def test_soles_reach_their_targets(robot: RobotDescription) -> None:
    body, legs = BodyModel(robot), make_legs(robot)
    for pose in gaits(robot, 300):
        solution = legs.solve(*soles_at(body, pose))
        assert solution.reach_error == 0.0
        np.testing.assert_allclose(written(robot, solution), pose, atol=1e-5)


def test_a_leap_is_solved_in_one_tick(robot: RobotDescription) -> None:
    rng = np.random.default_rng(5)
    body = BodyModel(robot)
    legs = [robot.index(name) for leg in (robot.left_leg, robot.right_leg) for name in leg.names]
    for _ in range(30):
        pose = np.array(robot.stand_pose)
        pose[legs] += rng.uniform(-0.3, 0.3, 12)
        wanted = soles_at(body, pose)
        got = soles_at(body, written(robot, make_legs(robot).solve(*wanted)))
        for a, b in zip(wanted, got, strict=True):
            np.testing.assert_allclose(a.position, b.position, atol=1e-5)
            np.testing.assert_allclose(a.normal, b.normal, atol=1e-5)
            np.testing.assert_allclose(a.forward, b.forward, atol=1e-5)


def test_the_mirror_image_has_mirrored_angles(robot: RobotDescription) -> None:
    def flipped(sole: SolePose) -> SolePose:
        (px, py, pz), (fx, fy, fz), (nx, ny, nz) = sole.position, sole.forward, sole.normal
        return SolePose((px, -py, pz), (fx, -fy, fz), (nx, -ny, nz))

    body, law = BodyModel(robot), mirror_law(robot)
    legs, mirror_legs = make_legs(robot), make_legs(robot)
    for pose in gaits(robot, 60):
        left, right = soles_at(body, pose)
        plain = written(robot, legs.solve(left, right))
        mirrored = written(robot, mirror_legs.solve(flipped(right), flipped(left)))
        # The models of the makers are symmetric to a fraction of a millimetre.
        np.testing.assert_allclose(law.mirrored(plain), mirrored, atol=5e-3)


def test_a_sole_out_of_reach_is_reported_and_forgotten(robot: RobotDescription) -> None:
    body, legs = BodyModel(robot), make_legs(robot)
    left, right = soles_at(body, np.array(robot.stand_pose))
    x, y, z = left.position
    far = SolePose((x, y, 1.5 * z), left.forward, left.normal)
    for _ in range(3):
        solution = legs.solve(far, right)
        assert solution.reach_error > 0.1 * abs(z)
        assert np.isfinite(written(robot, solution)).all()
    for _ in range(MAX_STEPS):
        solution = legs.solve(left, right)
    assert solution.reach_error == 0.0
    np.testing.assert_allclose(written(robot, solution), robot.stand_pose, atol=1e-5)


def test_it_agrees_with_the_closed_form() -> None:
    robot = load_robot("bruno")
    body, closed, numeric = BodyModel(robot), make_legs(robot), NumericLegs(robot)
    assert isinstance(closed, YawHipLegs)
    for pose in gaits(robot, 100):
        soles = soles_at(body, pose)
        a, b = written(robot, closed.solve(*soles)), written(robot, numeric.solve(*soles))
        np.testing.assert_allclose(a, b, atol=1e-5)


def test_a_waist_is_held_where_the_stand_has_it() -> None:
    robot = load_robot("booster_t1")
    turned = np.array(robot.stand_pose)
    turned[robot.index("Waist")] = 0.2
    robot = dataclasses.replace(robot, stand_pose=turned)
    solution = make_legs(robot).solve(*soles_at(BodyModel(robot), turned))
    np.testing.assert_allclose(written(robot, solution), turned, atol=1e-5)
