"""Ground that slopes: found under the stance sole, followed by the soles; nothing when level."""

import math

import pytest

from nao_lipm_gait.estimation.ground_tilt import DEADBAND, GroundTilt
from nao_lipm_gait.presets import load_preset
from nao_lipm_gait.walks.base import BodyTargets, SoleTarget
from nao_lipm_gait.whole_body.ground_adaptation import RETURN_RATE, TURN_RATE, GroundAdaptation
from robot_core.geometry import ORIGIN
from robot_core.types import LEFT, RIGHT
from sim_bridge.trials.rollout import RolloutSpec, rollout
from sim_bridge.trials.tasks import find_task

DT = 0.01
REAR, FRONT = -0.058, 0.102
MIDDLE = 0.022
SLOPE = -math.radians(5.0)
"""[rad] uphill: the toes are high."""
TARGETS = BodyTargets(
    (0.01, 0.01, 0.24), SoleTarget(-0.05, 0.06, 0.0, 0.0), SoleTarget(0.06, -0.06, 0.02, 0.0),
    0.04, ORIGIN,
)  # fmt: skip


def walked(ground: GroundTilt, pitch: float, seconds: float, zmp: float = MIDDLE) -> float:
    """Time [s] until the whole pitch [rad] is taken for ground, steps of 0.2 s; inf if never."""
    found = math.inf
    for tick in range(round(seconds / DT)):
        rocking = 0.02 * math.sin(2.0 * math.pi * tick * DT / 0.4)
        support = LEFT if tick // 20 % 2 == 0 else RIGHT
        ground.update(support, pitch + rocking, zmp, 0.0, DT)
        if abs(ground.stance - pitch) < 0.025:
            found = min(found, tick * DT)
    return found


def test_a_level_walk_with_constant_errors_shows_no_slope() -> None:
    ground = GroundTilt(REAR, FRONT)
    for tick in range(1000):
        ground.update(LEFT, 0.03 + 0.02 * math.sin(tick), MIDDLE, 0.0, DT)
        assert ground.stance == ground.slope == 0.0


def test_a_slope_is_found_within_a_step_and_forgotten_on_level_ground() -> None:
    ground = GroundTilt(REAR, FRONT)
    walked(ground, 0.0, 3.0)
    assert walked(ground, SLOPE, 3.0) < 0.2
    assert ground.slope == pytest.approx(SLOPE, abs=0.02)
    walked(ground, 0.0, 2.0)
    assert ground.stance == ground.slope == 0.0


def test_the_next_foot_will_meet_the_slope_of_the_last_steps() -> None:
    ground = GroundTilt(REAR, FRONT)
    walked(ground, 0.0, 3.0)
    for _ in range(10):
        ground.update(LEFT, SLOPE, MIDDLE, 0.0, DT)
    assert ground.under(LEFT) < ground.under(RIGHT) < 0.0


def test_a_robot_that_rocks_on_its_heels_is_on_no_slope() -> None:
    ground = GroundTilt(REAR, FRONT)
    walked(ground, 0.0, 3.0)
    for _ in range(100):
        ground.update(LEFT, 2.0 * SLOPE, REAR, 0.0, DT)
    assert abs(ground.stance) < 2.0 * DEADBAND


def test_what_a_changing_walk_shows_is_no_slope() -> None:
    ground = GroundTilt(REAR, FRONT)
    walked(ground, 0.0, 3.0)
    for _ in range(100):
        ground.update(LEFT, SLOPE, MIDDLE, 2.0 * abs(SLOPE), DT)
    assert ground.stance == 0.0


def test_on_level_ground_the_targets_are_the_same_ones() -> None:
    ground = GroundTilt(REAR, FRONT)
    assert GroundAdaptation().apply(TARGETS, LEFT, ground, DT, walks=True) is TARGETS


def test_soles_and_com_follow_the_slope_and_the_torso_stays_upright() -> None:
    ground, adaptation = GroundTilt(REAR, FRONT), GroundAdaptation()
    ground.stance = ground.slope = SLOPE
    first = adaptation.apply(TARGETS, LEFT, ground, DT, walks=True)
    assert first.left_sole.pitch == -TURN_RATE * DT
    for _ in range(20):
        result = adaptation.apply(TARGETS, LEFT, ground, DT, walks=True)
    left, right = result.left_sole, result.right_sole
    assert left.pitch == right.pitch == SLOPE
    assert left.z == TARGETS.left_sole.z
    assert right.z - TARGETS.right_sole.z == pytest.approx(-SLOPE * (right.x - left.x))
    assert result.com_in_q[2] - 0.24 == pytest.approx(-SLOPE * (result.com_in_q[0] - left.x))
    assert result.torso_pitch == TARGETS.torso_pitch
    ground.restart()
    stopped = adaptation.apply(TARGETS, LEFT, ground, DT, walks=False)
    assert stopped.left_sole.pitch == pytest.approx(SLOPE + RETURN_RATE * DT)


@pytest.mark.parametrize("follow", [True, False])
def test_a_robot_climbs_a_slope_of_5_deg_because_it_follows_the_ground(follow: bool) -> None:
    pytest.importorskip("mujoco")
    ramp = (
        ("terrain.kind", "ramp"), ("terrain.length", 3.0), ("terrain.width", 4.0),
        ("terrain.height", abs(SLOPE)),
    )  # fmt: skip
    parameters = load_preset("default").replace(follow_ground=follow)
    task = find_task("forward=25").lasting(2.5)
    spec = RolloutSpec(
        task, robot_seed=1, parameters=parameters, plant_options=ramp, engine="mujoco"
    )
    assert rollout(spec).metrics.fell is not follow
