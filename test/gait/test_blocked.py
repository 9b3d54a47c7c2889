"""A robot that walks against something: its odometry says that it does not know where it is."""

from pathlib import Path

import numpy as np
import pytest

from gait_lab.faults.harness import Fault, Harness
from nao_lipm_gait.estimation.odometry_covariance import OdometryCovariance
from nao_lipm_gait.presets import preset_for
from robot_core.robot import load_robot
from robot_core.types import VelocityCommand
from sim_bridge.scene import load_scene
from sim_bridge.trials.trial import make_scene_world

pytest.importorskip("mujoco")
ROBOT = "{name: r, team: red, number: 1, urdf: nao_h21_v33, seed: 3, pose: [0, 0, 0]}"
WALL = ", ".join(f"{{x: 0.4, y: {y}, height: 1.0}}" for y in (-0.4, -0.2, 0.0, 0.2, 0.4))


def walk(folder: Path, poles: str) -> tuple[list[bool], float, float]:
    """A walk of 0.15 m/s: which ticks slip; error and deviation [m] of the odometry along x."""
    path = folder / "scene.yaml"
    path.write_text(f"poles: [{poles}]\nrobots: [{ROBOT}]\n")
    parameters = preset_for(load_robot("nao_h21_v33"), "default")
    with make_scene_world(load_scene(path), noise_seed=3) as world:
        fault = Fault(np.random.default_rng(0))
        harness = Harness(world, parameters, fault, VelocityCommand(0.15))
        start = harness.truth.torso_position[0]
        slips = []
        while harness.seconds() < 7.0 and not harness.fallen:
            harness.step()
            if harness.status is not None:
                slips.append(harness.status.slipping)
        status, way = harness.status, harness.truth.torso_position[0] - start
    assert status is not None
    error = status.base_footprint_in_odom[0] - way
    return slips, abs(error), status.pose_covariance.xx**0.5


def test_odometry_of_a_robot_that_walks_against_a_wall_is_uncertain(tmp_path: Path) -> None:
    slips, error, sigma = walk(tmp_path, WALL)
    assert any(slips)
    assert error > 0.2, "it walks on in its odometry"
    assert error < 3.0 * sigma
    assert not any(slips[:250]), "it reaches the wall after 2.5 s"


def test_a_robot_that_walks_freely_does_not_slip(tmp_path: Path) -> None:
    slips, error, sigma = walk(tmp_path, "")
    assert not any(slips)
    assert error < 3.0 * sigma < 0.3


def test_the_way_on_slipping_soles_may_be_all_wrong() -> None:
    covariance = OdometryCovariance()
    for step in range(1, 11):
        covariance.step((0.1 * step, 0.0, 0.0), 1e-6, slipping=step > 5)
    xx, xy, yy, *_ = covariance.pose
    assert xx**0.5 == pytest.approx(1.0 - 0.2, abs=0.05), "from four steps before it was noticed"
    assert yy**0.5 < 0.1
    assert xx * yy > xy * xy
    covariance.step((1.1, 0.0, 0.0), 1e-6)
    assert covariance.pose.xx - xx < 0.01
