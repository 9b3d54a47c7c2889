"""Zeros of leg joints from stands and steps: recovered from what the law says, and only then."""

from collections.abc import Sequence

import numpy as np
import pytest
from scipy.optimize import root
from scipy.spatial.transform import Rotation

from nao_lipm_gait.calibration import Calibration, SensorCorrection
from nao_lipm_gait.estimation.joint_zeros import (
    EVIDENCE,
    STAND_SIGMA,
    STEPS_SIGMA,
    TILT_SIGMA,
    Means,
    Pose,
    Zero,
    _Legs,
    corrected,
    in_words,
    joint_zeros,
    judged_joints,
    wrong_zeros,
)
from nao_lipm_gait.estimation.sole_levelling import CORNER_STIFFNESS
from nao_lipm_gait.whole_body.body_model import BodyModel
from robot_core.motion.joints import mirror_law
from robot_core.robot import load_robot
from robot_core.types import GRAVITY, FloatArray

ROBOT = load_robot("nao_v6")
LEGS = _Legs(ROBOT)
JOINTS = judged_joints(ROBOT)
WRONG = 0.07
"""[rad]"""


def leg_angles(hip: float, knee: float, ankle: float, apart: float = 0.0) -> FloatArray:
    """Joint angles (n,) [rad] of both legs; `apart`: hips rolled outwards, soles level."""
    position = np.array(ROBOT.stand_pose)
    for side, leg in ((1.0, ROBOT.left_leg), (-1.0, ROBOT.right_leg)):
        for joint, angle in (
            (leg.hip_pitch, hip), (leg.knee_pitch, knee), (leg.ankle_pitch, ankle),
            (leg.hip_roll, side * apart), (leg.ankle_roll, -side * apart),
        ):  # fmt: skip
            position[ROBOT.index(joint)] = angle
    return position


POSES = (
    leg_angles(-0.7, 1.4, -0.75), leg_angles(-1.2, 1.6, -0.65), leg_angles(-0.3, 1.45, -0.95),
    leg_angles(-0.7, 1.4, -0.75, apart=0.12),
)  # fmt: skip
"""As walked, leaning ahead, leaning back, with the feet apart."""


def zero_of(joint: str, zero: float) -> FloatArray:
    position = LEGS.turned(np.zeros(len(ROBOT.joint_names)), Zero(joint, zero, 0.0, 0.0, 0.0))
    return np.array(position)


def measured(
    zeros: FloatArray, imu: Sequence[float] = (0.0, 0.0, 0.0), noise: int | None = None
) -> list[Pose]:
    """What a robot with zeros (n,) [rad] measures whose IMU is turned by a vector [rad]."""
    random = np.random.default_rng(noise)
    share = 0.0 if noise is None else 1.0
    mounting = Rotation.from_rotvec(imu)

    def seen(up: FloatArray, sigma: Sequence[float]) -> FloatArray:
        blur = share * random.normal(0.0, (*sigma, 0.0))
        return np.array(GRAVITY * (mounting.apply(up) + blur))

    poses = []
    for position in POSES:
        true = position + zeros
        steps = Means(position, seen(LEGS.mean_normal(true), STEPS_SIGMA))
        tilt = LEGS.tilt(true) + share * random.normal(0.0, TILT_SIGMA)
        stand = Means(position, seen(LEGS.resting(true), STAND_SIGMA))
        poses.append(Pose(steps, (float(tilt[0]), float(tilt[1])), stand))
    return poses


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("joint", JOINTS)
def test_a_wrong_zero_is_named_with_its_size(joint: str, sign: float) -> None:
    zero = sign * WRONG
    found = joint_zeros(ROBOT, measured(zero_of(joint, zero)))
    assert found[0].joint == joint
    assert found[0].evidence > EVIDENCE
    assert found[0].zero == pytest.approx(zero, abs=2.0 * found[0].sigma)
    assert found[0].zero == pytest.approx(zero, rel=0.3)
    words = in_words(wrong_zeros(found))
    assert words.startswith(f"a zero is wrong: that of {joint} by {'+' if sign > 0.0 else '-'}")


@pytest.mark.parametrize("imu", [(0.02, 0.0, 0.0), (0.0, 0.02, 0.0), (-0.015, -0.015, 0.01)])
def test_an_imu_askew_or_a_floor_that_slopes_is_no_zero(imu: tuple[float, float, float]) -> None:
    found = joint_zeros(ROBOT, measured(np.zeros(len(ROBOT.joint_names)), imu))
    assert not wrong_zeros(found)
    assert in_words(wrong_zeros(found)) == "no leg joint stands out by a wrong zero"


def test_ordinary_zeros_are_right_and_the_deviation_is_that_of_the_errors() -> None:
    random = np.random.default_rng(1)
    named, scaled = 0, []
    for seed in range(12):
        zeros = sum(zero_of(joint, float(np.clip(random.normal(0.0, 0.0087), -0.0175, 0.0175)))
                    for joint in JOINTS)  # fmt: skip
        imu = random.normal(0.0, 0.009, 3)
        named += bool(wrong_zeros(joint_zeros(ROBOT, measured(zeros, imu, noise=seed))))
        joint = JOINTS[seed % len(JOINTS)]
        wrong = zeros + zero_of(joint, WRONG)
        for each in joint_zeros(ROBOT, measured(wrong, imu, noise=seed)):
            if each.joint == joint:
                scaled.append((each.zero - wrong[ROBOT.index(joint)]) / each.sigma)
    assert named == 0
    assert 0.4 < np.std(scaled) < 1.6


def test_the_mirrored_robot_has_the_mirrored_zero() -> None:
    law = mirror_law(ROBOT)

    def mirrored(means: Means | None) -> Means:
        assert means is not None
        return Means(means.position[law.partner] * law.sign, means.force * (1.0, -1.0, 1.0))

    poses = measured(zero_of("LKneePitch", WRONG), noise=3)
    others = [
        Pose(mirrored(pose.steps), (-pose.tilt[0], pose.tilt[1]), mirrored(pose.stand))
        for pose in poses if pose.tilt is not None
    ]  # fmt: skip
    left = {each.joint: each for each in joint_zeros(ROBOT, poses)}
    right = {each.joint: each for each in joint_zeros(ROBOT, others)}
    for joint, twin in (("LKneePitch", "RKneePitch"), ("LHipPitch", "RHipPitch")):
        assert left[joint].zero == pytest.approx(right[twin].zero, abs=1e-3)
        assert left[joint].evidence == pytest.approx(right[twin].evidence, abs=0.2)


def test_a_stand_alone_names_no_joint_among_those_that_look_the_same() -> None:
    pose = measured(zero_of("RAnklePitch", WRONG))[0]
    wrong = wrong_zeros(joint_zeros(ROBOT, [Pose(stand=pose.stand)]))
    assert len(wrong) != 1


def test_measurements_that_contradict_each_other_say_nothing() -> None:
    shaken = []
    for number, pose in enumerate(measured(zero_of("LAnkleRoll", 0.08))):
        assert pose.stand is not None
        force = pose.stand.force + (0.0, 0.6 * (-1.0) ** number, 0.0)
        shaken.append(pose._replace(stand=pose.stand._replace(force=force)))
    assert not wrong_zeros(joint_zeros(ROBOT, shaken))


def test_a_robot_rests_where_the_springs_balance_its_weight() -> None:
    position = POSES[1] + zero_of("LKneePitch", 0.01)
    body = BodyModel(ROBOT)
    com = np.array(body.set_joints(position))
    corners = []
    for side in (1, -1):
        sole = body.sole_in_torso(side)
        forward, normal = np.array(sole.forward), np.array(sole.normal)
        corners += [
            np.array(sole.position) + x * forward + side * y * np.cross(normal, forward)
            for x, y in ROBOT.sole_corners
        ]
    corners = np.array(corners)
    weight = body.total_mass * GRAVITY

    def unbalanced(unknown: FloatArray) -> FloatArray:
        height, x, y = unknown
        up = np.array((x, y, np.sqrt(1.0 - x * x - y * y)))
        loads = -CORNER_STIFFNESS * (corners @ up + height)
        assert loads.min() > 0.0 or abs(loads.sum() - weight) > 1e-3
        moment = np.cross(corners - com, np.outer(loads, up)).sum(axis=0)
        return np.array((loads.sum() - weight, *moment[:2]))

    expected = LEGS.resting(position)
    start = (-float((corners @ expected).mean()) - weight / (8.0 * CORNER_STIFFNESS), *expected[:2])
    solved = root(unbalanced, start)
    assert solved.success
    assert LEGS.resting(position)[:2] == pytest.approx(solved.x[1:], abs=3e-4)


def test_the_corrected_calibration_leaves_level_soles_and_a_straight_imu() -> None:
    zero, (stand, *_) = zero_of("RKneePitch", WRONG), POSES
    pitch, roll = LEGS.tilt(stand + zero)
    up = LEGS.resting(stand + zero)
    plain = LEGS.resting(stand)
    before = Calibration(
        sole_pitch=float(np.clip(pitch, -0.059, 0.059)), sole_roll=float(roll),
        imu_roll=float(up[1] - plain[1]), imu_pitch=float(plain[0] - up[0]), gyro_bias_x=0.01,
    )  # fmt: skip
    after = corrected(ROBOT, before, Zero("RKneePitch", WRONG, 0.0, 9.0, 1.0), stand)
    assert after.joint_zero == (("RKneePitch", WRONG),)
    assert (after.imu_roll, after.imu_pitch) == pytest.approx((0.0, 0.0), abs=1e-9)
    assert after.sole_roll == pytest.approx(0.0, abs=1e-9)
    assert after.sole_pitch == pytest.approx(before.sole_pitch - pitch)
    assert after.gyro_bias_x == before.gyro_bias_x
    twice = corrected(ROBOT, after, Zero("RKneePitch", -0.02, 0.0, 9.0, 1.0), stand)
    assert dict(twice.joint_zero)["RKneePitch"] == pytest.approx(WRONG - 0.02)


def test_a_corrected_zero_turns_joints_that_share_a_motor_together() -> None:
    correction = SensorCorrection(ROBOT, Calibration(joint_zero=(("LHipYawPitch", 0.05),)))
    stand = np.array(ROBOT.stand_pose)
    turned = correction.for_model(stand) - stand
    assert turned == pytest.approx(zero_of("LHipYawPitch", 0.05))
    assert np.count_nonzero(turned) == 2
    assert correction.for_motors(correction.for_model(stand)) == pytest.approx(stand)
