"""Leg kinematics against Pinocchio, the body placement, and the joint limits."""

import numpy as np
import pytest

from nao_lipm_gait.walks.base import BodyTargets, SoleTarget
from nao_lipm_gait.whole_body.body_model import BodyModel, SolePose
from nao_lipm_gait.whole_body.com_placement import ComPlacement
from nao_lipm_gait.whole_body.leg_kinematics import LegAngles
from nao_lipm_gait.whole_body.legs import make_legs
from robot_core.geometry import rotation_from_rpy
from robot_core.joint_limits import JointLimits
from robot_core.robot import LegJoints, RobotDescription


@pytest.fixture(scope="module")
def body(robot: RobotDescription) -> BodyModel:
    return BodyModel(robot)


def leg_columns(robot: RobotDescription, leg: LegJoints) -> list[int]:
    return [robot.index(name) for name in leg.names]


def values(*legs: LegAngles) -> list[float]:
    """Joint angles from the hips down."""
    return [
        angle
        for leg in legs
        for angle in (
            leg.hip_yaw, leg.hip_roll, leg.hip_pitch, leg.knee_pitch, leg.ankle_pitch,
            leg.ankle_roll,
        )
    ]  # fmt: skip


def random_legs(robot: RobotDescription, rng: np.random.Generator) -> np.ndarray:
    """Joint angles with random legs inside 70 % of their range, knees bent."""
    position = np.array(robot.stand_pose)
    for leg in (robot.left_leg, robot.right_leg):
        for name in leg.names:
            limit = robot.limits[name]
            position[robot.index(name)] = 0.7 * rng.uniform(limit.lower, limit.upper)
        position[robot.index(leg.knee_pitch)] = rng.uniform(0.05, 1.6)
    position[robot.index(robot.right_leg.hip_yaw)] = position[robot.index(robot.left_leg.hip_yaw)]
    return position


def test_inverse_of_pinocchio_over_random_reachable_poses(
    robot: RobotDescription, body: BodyModel
) -> None:
    rng = np.random.default_rng(7)
    legs = make_legs(robot)
    for _ in range(300):
        position = random_legs(robot, rng)
        body.set_joints(position)
        solution = legs.solve(body.sole_in_torso(1), body.sole_in_torso(-1))
        got = np.array(values(solution.left, solution.right))
        columns = leg_columns(robot, robot.left_leg) + leg_columns(robot, robot.right_leg)
        np.testing.assert_allclose(got, position[columns], atol=1e-4)
        assert solution.reach_error == 0.0


def test_position_and_normal_are_exact_even_where_the_yaw_is_not(
    robot: RobotDescription, body: BodyModel
) -> None:
    legs = make_legs(robot)
    position = np.array(robot.stand_pose)
    body.set_joints(position)
    left, right = body.sole_in_torso(1), body.sole_in_torso(-1)
    # Turn the left sole alone: one shared joint cannot turn one foot without the other.
    up = (0.0, 0.0, 1.0)
    turned = SolePose(left.position, (np.cos(0.4), np.sin(0.4), 0.0), up)
    level = SolePose(right.position, (1.0, 0.0, 0.0), up)
    solution = legs.solve(turned, level)
    position[leg_columns(robot, robot.left_leg)] = values(solution.left)
    position[leg_columns(robot, robot.right_leg)] = values(solution.right)
    body.set_joints(position)
    for side, wanted in ((1, turned), (-1, level)):
        reached = body.sole_in_torso(side)
        assert reached.position == pytest.approx(wanted.position, abs=1e-9)
        assert reached.normal == pytest.approx(wanted.normal, abs=1e-9)
    assert solution.left_yaw_error == pytest.approx(solution.right_yaw_error, abs=1e-4)
    assert solution.left_yaw_error == pytest.approx(0.2, abs=0.02)


def test_out_of_reach_is_reported_and_points_the_right_way(
    robot: RobotDescription, body: BodyModel
) -> None:
    body.set_joints(np.array(robot.stand_pose))
    left, right = body.sole_in_torso(1), body.sole_in_torso(-1)
    x, y, z = left.position
    far = SolePose((x, y, z - 0.05), left.forward, left.normal)
    solution = make_legs(robot).solve(far, right)
    straight = 0.1 + 0.1029
    assert solution.reach_error == pytest.approx(
        -far.position[2] - 0.085 - 0.04519 - straight, abs=2e-3
    )
    assert solution.left.knee_pitch == 0.0


def test_mirrored_soles_give_mirrored_joints(robot: RobotDescription) -> None:
    placement = ComPlacement(robot, BodyModel(robot), make_legs(robot))
    left = SoleTarget(0.03, 0.06, 0.01, 0.2)
    right = SoleTarget(-0.02, -0.05, 0.0, -0.1)

    def mirror(sole: SoleTarget) -> SoleTarget:
        return SoleTarget(sole.x, -sole.y, sole.z, -sole.yaw)

    targets = BodyTargets((0.01, 0.02, 0.255), left, right, 0.03, (0.0, 0.0, 0.0))
    mirrored = BodyTargets(
        (0.01, -0.02, 0.255), mirror(right), mirror(left), 0.03, (0.0, 0.0, 0.0)
    )
    for _ in range(5):
        a = placement.place(targets).position
    placement = ComPlacement(robot, BodyModel(robot), make_legs(robot))
    for _ in range(5):
        b = placement.place(mirrored).position
    signs = (1.0, -1.0, 1.0, 1.0, 1.0, -1.0)
    left_columns, right_columns = (
        leg_columns(robot, robot.left_leg),
        leg_columns(robot, robot.right_leg),
    )
    np.testing.assert_allclose(a[left_columns], np.array(signs) * b[right_columns], atol=1e-3)
    np.testing.assert_allclose(a[right_columns], np.array(signs) * b[left_columns], atol=1e-3)


def test_com_and_soles_reach_their_targets(
    robot: RobotDescription, body: BodyModel
) -> None:
    placement = ComPlacement(robot, BodyModel(robot), make_legs(robot))
    left = SoleTarget(0.03, 0.055, 0.0, 0.1)
    right = SoleTarget(-0.03, -0.055, 0.02, -0.1)
    targets = BodyTargets((0.012, 0.01, 0.258), left, right, 0.04, (0.0, 0.0, 0.0))
    for _ in range(4):
        placed = placement.place(targets)
    assert placed.residual == 0.0
    com = np.array(body.set_joints(placed.position))
    soles = [body.sole_in_torso(side) for side in (1, -1)]
    rotation = np.array(rotation_from_rpy(0.0, 0.04, 0.0))
    # The torso's yaw is free; take it from the left sole.
    forward = rotation @ np.array(soles[0].forward)
    yaw = 0.1 - np.arctan2(forward[1], forward[0])
    rotation = np.array(rotation_from_rpy(0.0, 0.04, yaw))
    for sole, other in ((left, soles[0]), (right, soles[1])):
        offset = rotation @ (com - np.array(other.position))
        wanted = np.array(targets.com_in_q) - np.array([sole.x, sole.y, sole.z])
        np.testing.assert_allclose(offset, wanted, atol=3e-4)


def test_shared_hips_decide_the_torsos_turn(robot: RobotDescription) -> None:
    soles = SoleTarget(0.03, 0.055, 0.0, 0.1), SoleTarget(-0.03, -0.055, 0.02, -0.1)
    placed = [
        ComPlacement(robot, BodyModel(robot), make_legs(robot)).place(
            BodyTargets((0.0, 0.0, 0.258), *soles, 0.0, (0.0, 0.0, 0.0), torso_yaw)
        )
        for torso_yaw in (0.0, 0.2)
    ]
    np.testing.assert_array_equal(placed[0].position, placed[1].position)


def test_torso_goes_down_where_a_leg_would_be_too_short(robot: RobotDescription) -> None:
    placement = ComPlacement(robot, BodyModel(robot), make_legs(robot))
    wide = BodyTargets(
        (0.0, 0.0, 0.275),
        SoleTarget(0.07, 0.05, 0.0, 0.0),
        SoleTarget(-0.09, -0.05, 0.0, 0.0),
        0.0,
        (0.0, 0.0, 0.0),
    )
    residuals = [placement.place(wide).residual for _ in range(6)]
    assert residuals[-1] == 0.0


def test_limits_cut_joints_and_count_them(robot: RobotDescription) -> None:
    limits = JointLimits(robot)
    position = np.array(robot.stand_pose)
    assert limits.cut(position) == 0
    np.testing.assert_array_equal(position, robot.stand_pose)
    position[robot.index("LKneePitch")] = 9.0
    position[robot.index("HeadYaw")] = -9.0
    assert limits.cut(position) == 2
    assert position[robot.index("LKneePitch")] == robot.limits["LKneePitch"].upper


def test_ankle_roll_is_limited_by_the_ankle_pitch(robot: RobotDescription) -> None:
    limits = JointLimits(robot)
    position = np.array(robot.stand_pose)
    position[robot.index("LAnklePitch")] = 0.9
    position[robot.index("LAnkleRoll")] = 0.4
    assert limits.cut(position) == 1
    assert position[robot.index("LAnkleRoll")] < 0.1


def test_arms_swing_with_the_opposite_foot(robot: RobotDescription) -> None:
    placement = ComPlacement(robot, BodyModel(robot), make_legs(robot))
    left, right = SoleTarget(-0.04, 0.05, 0.0, 0.0), SoleTarget(0.04, -0.05, 0.0, 0.0)
    targets = BodyTargets((0.0, 0.0, 0.25), left, right, 0.0, (0.0, 0.0, 0.0))
    hanging = placement.place(targets).position
    swinging = placement.place(targets, arm_swing=2.0).position
    # The right foot is 8 cm ahead: the left arm comes forward, the right one goes back.
    for joint, change in (("LShoulderPitch", -0.16), ("RShoulderPitch", 0.16)):
        index = robot.index(joint)
        assert swinging[index] - hanging[index] == pytest.approx(change)
