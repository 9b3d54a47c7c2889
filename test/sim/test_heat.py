"""Temperatures of the motors and the battery."""

import math

import numpy as np
import pytest

from robot_core.errors import NaoGaitError
from robot_core.robot import load_robot
from robot_core.types import JointTargets
from sim_bridge.heat import HeatModel, status
from sim_bridge.plant import Plant, with_options
from sim_bridge.world import World

ROBOT = load_robot("nao_v6")
KNEE = ROBOT.index("LKneePitch")
ON = ("heat.enabled", True)
STILL = np.zeros(22)


@pytest.fixture
def plant(reference: Plant) -> Plant:
    return with_options(reference, (ON,))


def load(plant: Plant, share: float) -> np.ndarray:
    """Joint torques (22,) of which the knee's is a share of its nominal torque."""
    torque = np.zeros(22)
    torque[KNEE] = share * ROBOT.motors["LKneePitch"].nominal_torque * plant.motor.torque_fraction
    return torque


def test_the_nominal_torque_leads_to_the_named_rise_with_one_time_constant(plant: Plant) -> None:
    heat = HeatModel(ROBOT, plant)
    for _ in range(500):
        state = heat.step(load(plant, 1.0), STILL, 1.0)
    assert state.temperature[KNEE] == pytest.approx(25.0 + 60.0 * (1.0 - math.exp(-1.0)), abs=1e-6)
    assert heat.final[KNEE] == pytest.approx(85.0)
    assert state.temperature[KNEE + 1] == 25.0


def test_heat_grows_with_the_square_of_the_torque_and_goes_away(plant: Plant) -> None:
    heat = HeatModel(ROBOT, plant)
    rises = []
    for share in (0.5, 1.0):
        heat.restart()
        heat.step(load(plant, share), STILL, 10.0)
        rises.append(heat.state.temperature[KNEE] - 25.0)
    assert rises[1] == pytest.approx(4.0 * rises[0])
    for _ in range(100):
        heat.step(STILL, STILL, 100.0)
    assert heat.state.temperature[KNEE] == pytest.approx(25.0, abs=1e-3)


def test_power_is_loss_and_mechanical_power_and_empties_the_battery(plant: Plant) -> None:
    motor, heat = ROBOT.motors["LKneePitch"], HeatModel(ROBOT, plant)
    torque = motor.nominal_torque
    loss = motor.no_load_speed * torque**2 / motor.stall_torque
    velocity = np.zeros(22)
    velocity[KNEE] = 2.0
    state = heat.step(load(plant, 1.0), velocity, 1.0)
    assert state.power == pytest.approx(15.0 + loss + 2.0 * torque)
    assert state.current[KNEE] == pytest.approx(torque * motor.no_load_speed / 21.6)
    assert state.charge == pytest.approx(1.0 - state.power / 225000.0)
    braking = heat.step(load(plant, 1.0), -velocity, 1.0)
    assert braking.power == pytest.approx(15.0 + loss), "braking feeds nothing back"


def test_a_hot_motor_fades_and_an_empty_battery_ends_it_all(reference: Plant) -> None:
    hot = with_options(reference, (ON, ("heat.ambient", 50.0), ("heat.rise", 200.0)))
    heat = HeatModel(ROBOT, hot)
    shares = [heat.step(load(hot, 1.0), STILL, 5.0).share[KNEE] for _ in range(60)]
    assert shares[0] == 1.0
    assert shares == sorted(shares, reverse=True)
    assert shares[-1] == 0.0
    assert heat.state.share[KNEE + 1] == 1.0
    assert [status(t, hot) for t in (74.0, 76.0, 80.0, 90.0)] == [0, 1, 2, 3]
    low = with_options(reference, (ON, ("heat.charge", 0.01)))
    weak = HeatModel(ROBOT, low).state.share
    assert weak == pytest.approx(np.full(22, (18.0 + 0.066) / 21.6))
    empty = HeatModel(ROBOT, low)
    empty.step(STILL, STILL, 1000.0)
    assert not empty.state.share.any()


def test_a_robot_whose_motors_are_not_known_refuses(plant: Plant) -> None:
    with pytest.raises(NaoGaitError, match=r"heat\.enabled"):
        HeatModel(load_robot("bruno"), plant)


def test_a_standing_robot_warms_its_knees(
    reference: Plant, engine: str
) -> None:
    fast = with_options(
        reference, (ON, ("heat.time_constant", 1.0), ("heat.rise", 200.0), ("heat.limit", 76.0))
    )
    with World.single(ROBOT, fast, -1, engine=engine) as world:
        world.robot.command(JointTargets(0, ROBOT.stand_pose))
        assert world.robot.heat is not None
        height = world.robot.truth().torso_position[2]
        for _ in range(600):
            world.step()
        knees = world.robot.heat.state.temperature[KNEE]
        assert knees > world.robot.heat.state.temperature[ROBOT.index("HeadYaw")]
        world.reset()
        assert world.robot.heat.state.temperature.max() == 25.0
        assert world.robot.truth().torso_position[2] == pytest.approx(height, abs=0.01)


def test_without_heat_nothing_changes(reference: Plant, mujoco_only: None) -> None:
    with World.single(ROBOT, reference, 0, engine="mujoco") as world:
        world.step()
        assert world.robot.heat is None
