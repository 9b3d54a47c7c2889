"""The swing foot of a tilted robot is corrected against gravity."""

import itertools

import pytest

from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.walks.base import BodyTargets, SoleTarget
from nao_lipm_gait.whole_body.tilt_compensation import DEADBAND, TiltCompensation
from robot_core.geometry import ORIGIN
from robot_core.types import LEFT, RIGHT

P = GaitParameters()
TARGETS = BodyTargets(
    (0.0, 0.01, 0.24), SoleTarget(-0.05, 0.06, 0.0, 0.0), SoleTarget(0.06, -0.06, 0.02, 0.0),
    0.04, ORIGIN,
)


def values(sole: SoleTarget) -> tuple[float, ...]:
    return sole.x, sole.y, sole.z, sole.yaw, sole.pitch, sole.roll


def settled(targets: BodyTargets, support: int, tilt: tuple[float, float]) -> BodyTargets:
    compensation = TiltCompensation()
    for _ in range(50):
        result = compensation.apply(targets, support, tilt, P, 0.01)
    return result


def test_a_tilt_within_the_deadband_changes_nothing() -> None:
    inside = 0.9 * DEADBAND
    assert settled(TARGETS, LEFT, (inside, -inside)) is TARGETS


def test_a_robot_that_pitches_forward_raises_the_foot_ahead_and_its_toes() -> None:
    result = settled(TARGETS, LEFT, (0.0, 0.3))
    assert result.right_sole.z > TARGETS.right_sole.z + 0.005
    assert result.right_sole.pitch < -0.05
    assert values(result.left_sole) == values(TARGETS.left_sole)
    assert result.com_in_q[0] < TARGETS.com_in_q[0]


def mirrored(targets: BodyTargets) -> BodyTargets:
    def sole(s: SoleTarget) -> SoleTarget:
        return SoleTarget(s.x, -s.y, s.z, -s.yaw, s.pitch, -s.roll)

    x, y, z = targets.com_in_q
    left, right = sole(targets.right_sole), sole(targets.left_sole)
    return BodyTargets((x, -y, z), left, right, targets.torso_pitch, ORIGIN)


def test_left_and_right_are_mirror_images() -> None:
    one = settled(TARGETS, LEFT, (0.2, 0.25))
    other = mirrored(settled(mirrored(TARGETS), RIGHT, (-0.2, 0.25)))
    assert one.com_in_q == pytest.approx(other.com_in_q)
    assert values(one.left_sole) == pytest.approx(values(other.left_sole))
    assert values(one.right_sole) == pytest.approx(values(other.right_sole))


def test_a_landed_foot_loses_its_rotation() -> None:
    compensation = TiltCompensation()
    for _ in range(20):
        compensation.apply(TARGETS, LEFT, (0.0, 0.3), P, 0.01)
    turned = [
        compensation.apply(TARGETS, RIGHT, (0.0, 0.0), P, 0.01).right_sole.pitch for _ in range(60)
    ]
    assert turned[0] < -0.05
    assert all(a <= b for a, b in itertools.pairwise(turned))
    assert turned[-1] == pytest.approx(0.0, abs=0.005)


def test_without_a_gain_nothing_is_compensated() -> None:
    off = P.replace(tilt_pitch_gain=0.0)
    result = TiltCompensation().apply(TARGETS, LEFT, (0.3, 0.3), off, 0.01)
    assert result.com_in_q == TARGETS.com_in_q
    assert values(result.left_sole) == values(TARGETS.left_sole)
    assert values(result.right_sole) == values(TARGETS.right_sole)
