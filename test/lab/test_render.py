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
    stage = Renderer(robot, draw_individual(load_plant("ideal"), robot, NOMINAL))
    yield stage
    stage.close()


def test_a_picture_of_the_robot(stage: Renderer, robot: RobotDescription) -> None:
    def photograph(x: float, z: float, turn: np.ndarray = UPRIGHT) -> np.ndarray:
        at = np.array([x, 0.0, z])
        return stage.photograph(at, turn, robot.stand_pose, np.zeros(2), 120, 100)

    empty = photograph(50.0, 0.32).astype(int)  # out of sight
    picture = photograph(0.0, 0.32)
    assert picture.shape == (100, 120, 3)
    assert picture.dtype == np.uint8
    robot_pixels = np.abs(picture.astype(int) - empty).sum(axis=2) > 60
    rows, columns = np.nonzero(robot_pixels)
    assert 0.04 < robot_pixels.mean() < 0.4
    assert 50 < np.median(columns) < 70, "in the middle"
    assert np.ptp(rows) > 1.5 * np.ptp(columns[rows < np.median(rows) - 20]), "higher than wide"
    fallen = np.array([0.0, math.sin(math.pi / 4), 0.0, math.cos(math.pi / 4)])
    lying = np.abs(photograph(0.0, 0.05, fallen).astype(int) - empty).sum(axis=2) > 60
    assert np.nonzero(lying)[0].mean() > rows.mean() + 10, "further down in the picture"


def test_joints_show(stage: Renderer, robot: RobotDescription) -> None:
    def photograph(joints: np.ndarray) -> np.ndarray:
        at = np.array([0.0, 0.0, 0.32])
        return stage.photograph(at, UPRIGHT, joints, np.zeros(2), 120, 100)

    before = photograph(robot.stand_pose)
    assert np.array_equal(photograph(robot.stand_pose), before)
    raised = np.array(robot.stand_pose)
    raised[robot.index("RShoulderPitch")] = -1.5
    assert (photograph(raised) != before).any(axis=2).mean() > 0.005
