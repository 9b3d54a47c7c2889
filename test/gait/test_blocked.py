"""A robot that walks against something notices it, and its odometry is uncertain."""

from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from gait_lab.faults.harness import Fault, Harness
from nao_lipm_gait.estimation.blocked import STEPS, BlockedDetector
from nao_lipm_gait.estimation.odometry_covariance import OdometryCovariance
from nao_lipm_gait.presets import preset_for
from robot_core.geometry import compose
from robot_core.robot import load_robot
from robot_core.types import Pose2, VelocityCommand
from sim_bridge.scene import load_scene
from sim_bridge.trials.trial import make_scene_world

ROBOT = "{name: r, team: red, number: 1, urdf: nao_h21_v33, seed: 3, pose: [0, 0, 0]}"
WALL = ", ".join(f"{{x: 0.4, y: {y}, height: 1.0}}" for y in (-0.4, -0.2, 0.0, 0.2, 0.4))


# -- the law -------------------------------------------------------------------------------------


def walked(
    wanted: list[Pose2], shares: list[float], start: Pose2 = (0.3, -0.2, 0.7)
) -> tuple[BlockedDetector, list[bool]]:
    """The detector after steps that reach these shares of the wanted ones, and when it noticed."""
    detector, q, noticed = BlockedDetector(), start, []
    detector.step((0.0, 0.0, 0.0), q)
    for (x, y, yaw), share in zip(wanted, shares, strict=True):
        q = compose(q, (share * x, share * y, yaw))
        detector.step((x, y, yaw), q)
        noticed.append(detector.way is not None)
    return detector, noticed


AHEAD, BACK = (0.05, 0.0, 0.0), (-0.05, 0.0, 0.0)
OPENS, CLOSES = (0.0, 0.05, 0.0), (0.0, 0.01, 0.0)


@pytest.mark.parametrize("stride", [(AHEAD, AHEAD), (BACK, BACK), (OPENS, CLOSES)])
def test_steps_that_fall_short_tell_that_the_way_is_blocked(stride: tuple[Pose2, Pose2]) -> None:
    free, held = 10, 2 * STEPS
    wanted = list(stride) * ((free + held) // 2)
    detector, noticed = walked(wanted, [1.0] * free + [0.4] * held)
    assert not any(noticed[:free])
    assert noticed[free + STEPS], "within two strides"
    assert all(now or not before for before, now in pairwise(noticed)), "and so it stays"
    assert detector.way is not None
    assert detector.way[0] * stride[0][0] + detector.way[1] * stride[0][1] > 0.0


def test_it_is_free_again_once_the_steps_are_made() -> None:
    _, noticed = walked([AHEAD] * 40, [0.4] * 20 + [1.0] * 20)
    assert noticed[19]
    assert not noticed[20 + STEPS]


def test_steps_of_a_curve_are_compared_in_their_own_direction() -> None:
    curve = (0.05, 0.01, 0.4)
    assert not any(walked([curve] * 20, [1.0] * 20)[1])
    assert any(walked([curve] * 20, [0.4] * 20)[1])


def test_a_walk_that_speeds_up_may_lag() -> None:
    wanted = [AHEAD] * 10 + [(0.05 + 0.02 * min(n, 3), 0.0, 0.0) for n in range(12)]
    late = [0.05, *(x for x, _, _ in wanted[:-1])]
    shares = [made / x for made, (x, _, _) in zip(late, wanted, strict=True)]
    assert not any(walked(wanted, shares)[1])


def test_steps_in_place_say_nothing() -> None:
    turn = (0.0, 0.0, 0.5)
    assert not any(walked([turn] * 20, [0.0] * 20)[1])


# -- robots -------------------------------------------------------------------------------------


class Walk(NamedTuple):
    """Of 7 s: which ticks were blocked; the odometry's error and deviation along x [m]."""

    blocked: list[bool]
    error: float
    sigma: float


def walk(folder: Path, poles: str) -> Walk:
    """A walk of 0.15 m/s."""
    path = folder / "scene.yaml"
    path.write_text(f"poles: [{poles}]\nrobots: [{ROBOT}]\n")
    parameters = preset_for(load_robot("nao_h21_v33"), "default")
    with make_scene_world(load_scene(path), noise_seed=3) as world:
        fault = Fault(np.random.default_rng(0))
        harness = Harness(world, parameters, fault, VelocityCommand(0.15))
        start = harness.truth.torso_position[0]
        blocked = []
        while harness.seconds() < 7.0 and not harness.fallen:
            harness.step()
            if harness.status is not None:
                blocked.append(harness.status.blocked)
        status, way = harness.status, harness.truth.torso_position[0] - start
    assert status is not None
    error = abs(status.base_footprint_in_odom[0] - way)
    return Walk(blocked, error, status.pose_covariance.xx**0.5)


def test_odometry_of_a_robot_that_walks_against_a_wall_is_uncertain(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    result = walk(tmp_path, WALL)
    assert any(result.blocked)
    assert result.error > 0.2, "it walks on in its odometry"
    assert result.error < 3.0 * result.sigma
    assert not any(result.blocked[:250]), "it reaches the wall after 2.5 s"


def test_a_robot_that_walks_freely_is_not_blocked(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    result = walk(tmp_path, "")
    assert not any(result.blocked)
    assert result.error < 3.0 * result.sigma < 0.3


def test_the_way_of_a_blocked_robot_may_be_all_wrong() -> None:
    covariance = OdometryCovariance()
    for step in range(1, 11):
        covariance.step((0.1 * step, 0.0, 0.0), 1e-6, blocked=step > 5)
    xx, xy, yy, *_ = covariance.pose
    assert xx**0.5 == pytest.approx(1.0 - 0.2, abs=0.05), "from four steps before it was noticed"
    assert yy**0.5 < 0.1
    assert xx * yy > xy * xy
    covariance.step((1.1, 0.0, 0.0), 1e-6)
    assert covariance.pose.xx - xx < 0.01
