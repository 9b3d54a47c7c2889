"""Kinematics of legs with a yaw joint in each hip, against Pinocchio and against their symmetry."""

import dataclasses
from math import pi

import numpy as np
import pytest

from nao_lipm_gait.walks.base import BodyTargets, SoleTarget
from nao_lipm_gait.whole_body.body_model import BodyModel, SolePose
from nao_lipm_gait.whole_body.com_placement import ComPlacement
from nao_lipm_gait.whole_body.leg_kinematics import LegAngles, LegSolution, read_leg_geometry
from nao_lipm_gait.whole_body.legs import make_legs
from nao_lipm_gait.whole_body.numeric_legs import NumericLegs
from nao_lipm_gait.whole_body.yaw_hip_legs import YawHipLegs
from robot_core.geometry import rotation_from_rpy
from robot_core.robot import RobotDescription, load_robot
from robot_core.types import Point3

MIRROR = np.array((-1.0, -1.0, 1.0, 1.0, 1.0, -1.0))


@pytest.fixture(scope="module")
def robot() -> RobotDescription:
    return load_robot("bruno")


@pytest.fixture(scope="module")
def body(robot: RobotDescription) -> BodyModel:
    return BodyModel(robot)


def soles_of(body: BodyModel, position: np.ndarray) -> tuple[SolePose, SolePose]:
    body.set_joints(position)
    return body.sole_in_torso(1), body.sole_in_torso(-1)


def values(leg: LegAngles) -> np.ndarray:
    """(6,) joint angles from the hip down [rad]."""
    return np.array((
        leg.hip_yaw, leg.hip_roll, leg.hip_pitch, leg.knee_pitch, leg.ankle_pitch, leg.ankle_roll,
    ))  # fmt: skip


def axes(sole: SolePose) -> tuple[Point3, Point3, Point3]:
    return sole.position, sole.forward, sole.normal


def with_legs(robot: RobotDescription, left: LegAngles, right: LegAngles) -> np.ndarray:
    position = np.array(robot.stand_pose)
    for leg, angles in ((robot.left_leg, left), (robot.right_leg, right)):
        position[[robot.index(name) for name in leg.names]] = values(angles)
    return position


def assert_reached(
    robot: RobotDescription, body: BodyModel, solution: LegSolution, wanted: tuple[SolePose, ...]
) -> None:
    reached = soles_of(body, with_legs(robot, solution.left, solution.right))
    for got, pose in zip(reached, wanted, strict=True):
        for one, other in zip(axes(got), axes(pose), strict=True):
            assert one == pytest.approx(other, abs=1e-9)


def random_leg(robot: RobotDescription, rng: np.random.Generator, mirror: bool) -> LegAngles:
    """Any angles inside the limits of a leg."""
    leg = robot.right_leg if mirror else robot.left_leg
    limits = [robot.limits[name] for name in leg.names]
    angles = [rng.uniform(limit.lower, limit.upper) for limit in limits]
    angles[3] = rng.uniform(0.05, limits[3].upper)  # a knee bends one way
    return LegAngles(*angles)


def test_inverse_of_pinocchio_over_the_whole_range(
    robot: RobotDescription, body: BodyModel
) -> None:
    rng = np.random.default_rng(11)
    legs = make_legs(robot)
    assert isinstance(legs, YawHipLegs)
    for _ in range(500):
        left, right = random_leg(robot, rng, False), random_leg(robot, rng, True)
        solution = legs.solve(*soles_of(body, with_legs(robot, left, right)))
        assert values(solution.left) == pytest.approx(values(left), abs=1e-7)
        assert values(solution.right) == pytest.approx(values(right), abs=1e-7)
        assert solution.reach_error == 0.0
        assert solution.left_yaw_error == solution.right_yaw_error == 0.0


def test_any_rotation_of_each_sole_is_exact(robot: RobotDescription, body: BodyModel) -> None:
    rng = np.random.default_rng(3)
    legs = make_legs(robot)
    for _ in range(100):
        wanted = []
        for side in (1.0, -1.0):
            rows = np.array(rotation_from_rpy(*rng.uniform(-0.4, 0.4, 2), rng.uniform(-1.2, 1.2)))
            place = rng.uniform((-0.08, -0.05, -0.26), (0.08, 0.05, -0.2))
            place[1] += side * 0.06
            wanted.append(SolePose(tuple(place), tuple(rows[:, 0]), tuple(rows[:, 2])))
        solution = legs.solve(*wanted)
        if solution.reach_error == 0.0:
            assert_reached(robot, body, solution, tuple(wanted))


def test_mirrored_soles_give_mirrored_joints(robot: RobotDescription, body: BodyModel) -> None:
    rng = np.random.default_rng(5)
    legs = make_legs(robot)

    def mirrored(sole: SolePose) -> SolePose:
        (px, py, pz), (fx, fy, fz), (nx, ny, nz) = axes(sole)
        return SolePose((px, -py, pz), (fx, -fy, fz), (nx, -ny, nz))

    for _ in range(50):
        left = random_leg(robot, rng, False)
        right = LegAngles(*MIRROR * values(random_leg(robot, rng, False)))
        soles = soles_of(body, with_legs(robot, left, right))
        there = legs.solve(mirrored(soles[1]), mirrored(soles[0]))
        assert values(there.left) == pytest.approx(MIRROR * values(right), abs=1e-7)
        assert values(there.right) == pytest.approx(MIRROR * values(left), abs=1e-7)


def test_out_of_reach_is_reported_and_the_leg_points_there(robot: RobotDescription) -> None:
    legs, geometry = make_legs(robot), read_leg_geometry(robot)
    level = ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    longest = geometry.thigh + geometry.tibia
    x, y, z = geometry.left_hip
    near = SolePose((x, -y, z - 0.2 - geometry.foot_height), *level)
    far = SolePose((x, y, z - geometry.foot_height - longest - 0.03), *level)
    solution = legs.solve(far, near)
    assert solution.reach_error == pytest.approx(0.03)
    assert values(solution.left) == pytest.approx(np.zeros(6), abs=1e-12)
    assert solution.right.knee_pitch > 0.3


def test_singular_poses_keep_finite_angles(robot: RobotDescription, body: BodyModel) -> None:
    legs = make_legs(robot)
    stretched = LegAngles(0.3, 0.1, -0.2, 0.0, 0.1, 0.2)
    sideways = LegAngles(0.0, pi / 2.0, 0.2, 0.6, 0.1, 0.0)  # yaw and pitch are one axis
    for angles in (stretched, sideways):
        wanted = soles_of(body, with_legs(robot, angles, LegAngles(0.0, 0.0, -0.4, 0.8, -0.4, 0.0)))
        solution = legs.solve(*wanted)
        assert np.isfinite(values(solution.left)).all()
        reached = soles_of(body, with_legs(robot, solution.left, solution.right))
        for one, other in zip(axes(reached[0]), axes(wanted[0]), strict=True):
            assert one == pytest.approx(other, abs=1e-6)
    # The ankle at the hip: the direction of the leg is undefined.
    x, y, z = read_leg_geometry(robot).left_hip
    inside = SolePose(
        (x, y, z - read_leg_geometry(robot).foot_height), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
    )
    assert np.isfinite(values(legs.solve(inside, inside).left)).all()


@pytest.mark.parametrize("torso_yaw", [0.0, 0.2])
def test_com_soles_and_torso_reach_their_targets(
    robot: RobotDescription, body: BodyModel, torso_yaw: float
) -> None:
    placement = ComPlacement(robot, BodyModel(robot), make_legs(robot))
    left, right = SoleTarget(0.04, 0.06, 0.0, 0.3), SoleTarget(-0.03, -0.05, 0.02, -0.1)
    targets = BodyTargets(
        (0.012, 0.01, 0.225), left, right, 0.04, (0.0, 0.0, 0.0), torso_yaw
    )
    for _ in range(4):
        placed = placement.place(targets)
    assert placed.residual == 0.0
    soles = soles_of(body, placed.position)
    com = np.array(body.set_joints(placed.position))
    # Midway between the feet, and then ahead.
    rotation = np.array(rotation_from_rpy(0.0, 0.04, 0.1 + torso_yaw))
    for wanted, got in ((left, soles[0]), (right, soles[1])):
        offset = rotation @ (com - np.array(got.position))
        asked = np.array(targets.com_in_q) - np.array((wanted.x, wanted.y, wanted.z))
        np.testing.assert_allclose(offset, asked, atol=3e-4)
        forward = rotation @ np.array(got.forward)
        assert np.arctan2(forward[1], forward[0]) == pytest.approx(wanted.yaw, abs=1e-9)


def test_legs_with_offsets_have_no_closed_form(robot: RobotDescription) -> None:
    urdf = robot.urdf.replace('xyz="0.0 0.0 -0.11"', 'xyz="0.004 0.0 -0.11"', 1)
    assert urdf != robot.urdf
    assert isinstance(make_legs(dataclasses.replace(robot, urdf=urdf)), NumericLegs)
