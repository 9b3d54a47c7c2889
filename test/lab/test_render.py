"""Pictures show the robot where it is put."""

import math
from collections.abc import Iterator

import numpy as np
import pytest

from gait_lab.analysis.render import Renderer
from robot_core.robot import RobotDescription
from sim_bridge.individual import NOMINAL, draw_individual
from sim_bridge.plant import load_plant

UPRIGHT = np.array([0.0, 0.0, 0.0, 1.0])


@pytest.fixture
def stage(robot: RobotDescription) -> Iterator[Renderer]:
    with Renderer(robot, draw_individual(load_plant("ideal"), robot, NOMINAL)) as stage:
        yield stage


def test_a_picture_of_the_robot(stage: Renderer, robot: RobotDescription) -> None:
    stage.lay_floor((0.0, 0.0))
    stage.pose(np.array([50.0, 0.0, 0.32]), UPRIGHT, robot.stand_pose)  # out of sight
    empty = stage.photograph((0.0, 0.0), 120, 100).astype(int)
    stage.pose(np.array([0.0, 0.0, 0.32]), UPRIGHT, robot.stand_pose)
    picture = stage.photograph((0.0, 0.0), 120, 100)
    assert picture.shape == (100, 120, 3)
    assert picture.dtype == np.uint8
    robot_pixels = np.abs(picture.astype(int) - empty).sum(axis=2) > 60
    rows, columns = np.nonzero(robot_pixels)
    assert 0.04 < robot_pixels.mean() < 0.4
    assert 50 < np.median(columns) < 70, "in the middle"
    assert np.ptp(rows) > 1.5 * np.ptp(columns[rows < np.median(rows) - 20]), "higher than wide"
    fallen = np.array([0.0, math.sin(math.pi / 4), 0.0, math.cos(math.pi / 4)])
    stage.pose(np.array([0.0, 0.0, 0.05]), fallen, robot.stand_pose)
    lying = np.abs(stage.photograph((0.0, 0.0), 120, 100).astype(int) - empty).sum(axis=2) > 60
    assert np.nonzero(lying)[0].mean() > rows.mean() + 10, "further down in the picture"


def test_joints_show(stage: Renderer, robot: RobotDescription) -> None:
    at = np.array([0.0, 0.0, 0.32])
    stage.pose(at, UPRIGHT, robot.stand_pose)
    before = stage.photograph((0.0, 0.0), 120, 100)
    assert np.array_equal(stage.photograph((0.0, 0.0), 120, 100), before)
    raised = np.array(robot.stand_pose)
    raised[robot.index("RShoulderPitch")] = -1.5
    stage.pose(at, UPRIGHT, raised)
    assert (stage.photograph((0.0, 0.0), 120, 100) != before).any(axis=2).mean() > 0.005
