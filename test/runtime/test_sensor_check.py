"""Sensors that measure something else than they should: the robot stands and says why."""

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np
import pytest

from gait_lab.faults.channel import Delivery, Message
from gait_lab.faults.harness import Fault, Harness
from nao_lipm_gait.presets import preset_for
from nao_lipm_gait.runtime.inputs import ImuInput
from robot_core.log import LogLine
from robot_core.robot import load_robot
from robot_core.types import GaitState, Point3, VelocityCommand
from sim_bridge.trials.rollout import RolloutSpec, make_pair
from sim_bridge.trials.tasks import TASKS

pytest.importorskip("mujoco")
Distortion = Callable[[Point3, Point3], tuple[Point3, Point3]]


class Distorted(Fault):
    """Changes gyro and accelerometer; only each `every`-th sample arrives."""

    def __init__(self, change: Distortion, every: int) -> None:
        super().__init__(np.random.default_rng(0))
        self._change, self._every = change, every

    def on_sensor(self, harness: Harness, message: Message) -> Iterable[Delivery[Message]]:
        imu = message.content
        if harness.tick % self._every:
            return
        if isinstance(imu, ImuInput):
            rate, force = self._change(imu.angular_velocity, imu.linear_acceleration)
            changed = replace(imu, angular_velocity=rate, linear_acceleration=force)
            message = replace(message, content=changed)
        yield Delivery(0, message)


def drive(change: Distortion, every: int = 1, urdf: str = "nao_h21_v33") -> tuple[Harness, str]:
    """A robot that is told to walk for 2.5 s, and its errors."""
    parameters = preset_for(load_robot(urdf), "default")
    spec = RolloutSpec(
        task=TASKS["stand"], robot_seed=3, noise_seed=3, parameters=parameters, urdf=urdf,
        engine="mujoco",
    )  # fmt: skip
    world, _ = make_pair(spec)
    errors: list[str] = []
    with world:
        harness = Harness(world, parameters, Distorted(change, every), VelocityCommand(0.15))
        say = harness.gaits[0].controller._reporter.say
        take = say.take_log

        def taken() -> tuple[LogLine, ...]:
            lines = take()
            errors.extend(line.text for line in lines if line.level.name == "ERROR")
            return lines

        say.take_log = taken  # type: ignore[method-assign]
        harness.run(250)
    return harness, "\n".join(errors)


@pytest.mark.parametrize("urdf", ["nao_h21_v33", "bruno"])
def test_right_sensors_let_the_robot_walk(urdf: str) -> None:
    harness, errors = drive(lambda rate, force: (rate, force), urdf=urdf)
    assert errors == ""
    assert harness.gaits[0].controller.state is GaitState.WALK


@pytest.mark.parametrize(
    ("change", "guess"),
    [
        (lambda w, a: (w, (a[0] / 9.81, a[1] / 9.81, a[2] / 9.81)), "unit g"),
        (lambda w, a: (w, (a[0], a[1], a[2] - 9.81)), "gravity removed"),
        (lambda w, a: (w, (-a[0], -a[1], -a[2])), "sign"),
        (lambda w, a: (w, (a[2], a[1], -a[0])), "axes x and z"),
    ],
)
def test_a_wrong_imu_keeps_the_robot_standing_and_is_named(change: Distortion, guess: str) -> None:
    harness, errors = drive(change)
    assert guess in errors
    assert harness.gaits[0].controller.state is GaitState.STAND
    assert not harness.fallen


@pytest.mark.parametrize("every", [2, 3])
def test_sensors_at_another_rate_than_the_control_period_are_named(every: int) -> None:
    harness, errors = drive(lambda rate, force: (rate, force), every)
    assert f"set control_period to {0.01 * every:g}" in errors
    assert harness.gaits[0].controller.state is GaitState.STAND
    assert not harness.fallen


@pytest.mark.parametrize("turn", [(0.0, 1.0), (0.0, -1.0), (-1.0, 0.0)])
def test_an_imu_turned_about_the_vertical_ends_the_first_steps(turn: tuple[float, float]) -> None:
    cos, sin = turn

    def turned(v: Point3) -> Point3:
        return cos * v[0] - sin * v[1], sin * v[0] + cos * v[1], v[2]

    harness, errors = drive(lambda rate, force: (turned(rate), turned(force)))
    assert "first sway" in errors
    harness.run(50)
    assert harness.gaits[0].controller.state is GaitState.STAND
    assert not harness.fallen
