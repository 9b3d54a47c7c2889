"""The four force sensors of each sole and their errors."""

import numpy as np
import pytest

from robot_core.errors import NaoGaitError
from robot_core.robot import RobotDescription, load_robot
from sim_bridge.force_sensors import ForceSensorModel, wrench_of
from sim_bridge.individual import draw_individual
from sim_bridge.plant import Plant, with_options
from sim_bridge.world import World

FOUR = ("force_sensors.four", True)
ERRORS = (
    FOUR, ("force_sensors.gain", 0.2), ("force_sensors.offset", 1.0),
    ("force_sensors.noise", 0.3), ("force_sensors.dead_zone", 1.0),
)  # fmt: skip
LOAD = (np.array([3.0, -2.0, 30.0, 0.2, -0.9, 0.4]), np.array([0.0, 0.0, 25.0, -0.1, -0.5, 0.0]))


def model(robot: RobotDescription, plant: Plant, seed: int = 3) -> ForceSensorModel:
    return ForceSensorModel(robot, plant, draw_individual(plant, robot, seed), 0)


def test_by_default_the_wrenches_are_exact(robot: RobotDescription, reference: Plant) -> None:
    for found, exact in zip(model(robot, reference).read(LOAD), LOAD, strict=True):
        assert found is exact


def test_four_exact_sensors_feel_the_normal_force_and_where_it_acts(
    robot: RobotDescription, reference: Plant
) -> None:
    for found, exact in zip(
        model(robot, with_options(reference, (FOUR,))).read(LOAD), LOAD, strict=True
    ):
        assert found[2:5] == pytest.approx(exact[2:5])
        assert not found[[0, 1, 5]].any(), "they feel no shear"


def test_each_sensor_has_its_own_constant_errors(
    robot: RobotDescription, reference: Plant
) -> None:
    plant = with_options(reference, (FOUR, ("force_sensors.gain", 0.2)))
    first, other = model(robot, plant), model(robot, plant, seed=4)
    assert np.array_equal(first.read(LOAD)[0], first.read(LOAD)[0])
    assert not np.allclose(first.read(LOAD)[0], other.read(LOAD)[0])
    for found, exact in zip(first.read(LOAD), LOAD, strict=True):
        assert 0.0 < abs(found[2] / exact[2] - 1.0) < 0.2


def test_noise_begins_again_with_a_restart(robot: RobotDescription, reference: Plant) -> None:
    sensors = model(robot, with_options(reference, ERRORS))
    before = [sensors.read(LOAD)[0] for _ in range(5)]
    sensors.restart()
    assert np.array_equal(before, [sensors.read(LOAD)[0] for _ in range(5)])
    assert not np.array_equal(before[0], before[1])


def test_small_loads_are_not_felt(robot: RobotDescription, reference: Plant) -> None:
    plant = with_options(reference, (FOUR, ("force_sensors.dead_zone", 5.0)))
    light = np.array([0.0, 0.0, 8.0, 0.0, 0.0, 0.0])
    assert model(robot, plant, -1).read((light, light))[0][2] == 0.0


def test_a_wrench_is_the_sum_of_its_forces() -> None:
    places = load_robot("nao_v6").force_sensors[0]
    wrench = wrench_of(np.array([1.0, 2.0, 3.0, 4.0]), places)
    assert wrench[2] == 10.0
    moments = [y * load for (_, y), load in zip(places, (1.0, 2.0, 3.0, 4.0), strict=True)]
    assert wrench[3] == pytest.approx(sum(moments))


def test_the_errors_change_no_walk_and_no_other_error(
    robot: RobotDescription, reference: Plant
) -> None:
    plain = draw_individual(reference, robot, 5)
    drawn = draw_individual(with_options(reference, ERRORS), robot, 5)
    assert np.array_equal(plain.joint_zero, drawn.joint_zero)
    assert plain.friction == drawn.friction
    assert not plain.force_offset.any()
    assert drawn.force_gain.shape == (2, 4)


def test_a_robot_without_force_sensors_refuses_them(reference: Plant, mujoco_only: None) -> None:
    with pytest.raises(NaoGaitError, match=r"force_sensors.four: .*has no force sensors"):
        World.single(load_robot("bruno"), with_options(reference, (FOUR,)), engine="mujoco")


def test_the_truth_stays_exact(
    robot: RobotDescription, reference: Plant, mujoco_only: None
) -> None:
    with World.single(
        robot, with_options(reference, ERRORS), 7, engine="mujoco"
    ) as world:
        for _ in range(80):
            world.step()
        truth, reading = world.robot.truth(), world.robot.read()
    weight = 9.81 * 4.88
    assert truth.sole_force.sum() == pytest.approx(weight, rel=0.04)
    felt = sum(wrench[2] for wrench in reading.sole_wrench)
    assert abs(felt - truth.sole_force.sum()) > 0.2
