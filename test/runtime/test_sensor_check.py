"""Sensors that measure something else than they should: the robot stands and says why."""

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np
import pytest

from gait_lab.faults.harness import Fault, Harness
from gait_lab.faults.messages import Delivery, Message
from nao_lipm_gait.runtime.inputs import ImuInput
from robot_core.log import LogLine
from robot_core.types import GaitState, Point3, VelocityCommand
from simulation_runs import standing

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


class Shoved(Distorted):
    """Also shoves the robot forward until it falls: its toes are loaded until it lies."""

    height_when_limp = 0.0
    """[m] of the torso over the floor."""

    def before_physics(self, harness: Harness) -> None:
        if harness.seconds() > 1.0 and not harness.fallen:
            harness.push_robot(np.array((25.0, 0.0, 0.0)))
        limp = any(gait.controller.state is GaitState.FALLEN for gait in harness.gaits)
        if limp and self.height_when_limp == 0.0:
            self.height_when_limp = float(harness.truth.torso_position[2])


class StartedInAFall(Shoved):
    """The gait is gone while the robot begins to fall."""

    def before_physics(self, harness: Harness) -> None:
        super().before_physics(harness)
        leans = harness.seconds() > 1.0 and harness.truth.torso_position[2] < 0.98 * harness.height
        if harness.gaits and harness.seconds() < 1.0:
            harness.kill_gait()
        elif leans and not harness.gaits:
            harness.start_gait()


def drive(
    change: Distortion, every: int = 1, urdf: str = "nao_h21_v33", seed: int = 3,
    command: Point3 = (0.15, 0.0, 0.0), seconds: float = 2.5, engine: str = "mujoco",
    kind: type[Distorted] = Distorted,
) -> tuple[Harness, str]:  # fmt: skip
    """A robot that is told to walk after 1 s, and its errors."""
    world, parameters = standing(urdf, seed, engine)
    errors: list[str] = []
    with world:
        harness = Harness(world, parameters, kind(change, every), VelocityCommand(*command))
        say = harness.gaits[0].controller.reporter.say
        take = say.take_log

        def taken() -> tuple[LogLine, ...]:
            lines = take()
            errors.extend(line.text for line in lines if line.level.name == "ERROR")
            return lines

        say.take_log = taken  # type: ignore[method-assign]
        harness.run(round(100 * seconds))
    return harness, "\n".join(errors)


@pytest.mark.parametrize("urdf", ["nao_h21_v33", "bruno"])
def test_right_sensors_let_the_robot_walk(urdf: str) -> None:
    harness, errors = drive(lambda rate, force: (rate, force), urdf=urdf)
    assert errors == ""
    assert harness.gaits[0].controller.state is GaitState.WALK


def test_soles_that_rock_along_one_axis_are_no_wrong_sensor() -> None:
    """The first steps of this robot leave more unexplained along x than its force along x."""
    harness, errors = drive(
        lambda rate, force: (rate, force), 1, "bruno", 8, (0.2, 0.0, 0.6), 2.0, "pybullet"
    )
    assert errors == ""
    assert harness.gaits[0].controller.state is GaitState.WALK


def mapped(gyro: object, accelerometer: object) -> Distortion:
    """Gyro and accelerometer, each times a matrix or a number."""

    def change(rate: Point3, force: Point3) -> tuple[Point3, Point3]:
        x, y, z = (_matrix(gyro) @ np.array(rate)).tolist()
        ax, ay, az = (_matrix(accelerometer) @ np.array(force)).tolist()
        return (x, y, z), (ax, ay, az)

    return change


def _matrix(factor: object) -> np.ndarray:
    value = np.array(factor, dtype=float)
    return value * np.eye(3) if value.ndim == 0 else np.diag(value) if value.ndim == 1 else value


def about_z(degrees: float) -> np.ndarray:
    cos, sin = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array(((cos, -sin, 0.0), (sin, cos, 0.0), (0.0, 0.0, 1.0)))


def about_y(degrees: float) -> np.ndarray:
    return about_z(degrees)[np.ix_([1, 2, 0], [1, 2, 0])]


def axes(order: str) -> np.ndarray:
    return np.eye(3)[["xyz".index(axis) for axis in order]]


IN_THE_STAND = {
    "unit g": mapped(1.0, 1.0 / 9.81),
    "unit or scale": mapped(1.0, 100.0),
    "gravity removed": lambda w, a: (w, (a[0], a[1], a[2] - 9.81)),
    "sign": mapped(1.0, -1.0),
    "sign (up is positive)": mapped((1, -1, -1), (1, -1, -1)),
    "axes x and z": mapped(1.0, axes("zyx")),
    "axes y and z": mapped(1.0, axes("xzy")),
    "deg/s": mapped(57.3, 1.0),
    "allowed: 50": mapped(10.0, 1.0),
}
"""Distortions by what is said of them before the robot takes a step."""
IN_THE_FIRST_STEPS = {
    "gyro -x": mapped((-1, 1, 1), 1.0),
    "gyro -y": mapped((1, -1, 1), 1.0),
    "gyro -x -y": mapped((-1, -1, 1), 1.0),
    "gyro negative": mapped(-1.0, 1.0),
    "gyro yxz": mapped(axes("yxz"), 1.0),
    "gyro +90": mapped(about_z(90.0), 1.0),
    "gyro -90": mapped(about_z(-90.0), 1.0),
    "gyro 45": mapped(about_z(45.0), 1.0),
    "gyro xzy": mapped(axes("xzy"), 1.0),
    "gyro zyx": mapped(axes("zyx"), 1.0),
    "gyro yzx": mapped(axes("yzx"), 1.0),
    "gyro zxy": mapped(axes("zxy"), 1.0),
    "gyro too small": mapped(1.0 / 57.3, 1.0),
    "gyro dead": mapped(0.0, 1.0),
    "gyro x dead": mapped((0, 1, 1), 1.0),
    "gyro y dead": mapped((1, 0, 1), 1.0),
    "imu 180": mapped(about_z(180.0), about_z(180.0)),
    "imu 90": mapped(about_z(90.0), about_z(90.0)),
    "imu -90": mapped(about_z(-90.0), about_z(-90.0)),
    "imu 45": mapped(about_z(45.0), about_z(45.0)),
    "accelerometer yxz": mapped(1.0, axes("yxz")),
    "accelerometer -x": mapped(1.0, (-1, 1, 1)),
    "accelerometer -y": mapped(1.0, (1, -1, 1)),
    "accelerometer -x -y": mapped(1.0, (-1, -1, 1)),
}
ROBOTS = {
    ("nao_h21_v33", 3): (0.15, 0.0, 0.0), ("nao_h21_v33", 8): (0.0, 0.1, 0.0),
    ("nao_v6", 4): (0.0, 0.0, 0.6), ("nao_v6", 11): (0.3, 0.0, 0.0),
    ("bruno", 6): (0.15, 0.0, 0.0),
}  # fmt: skip
"""Robots and their commands."""
SAID = ("unit g", "gravity removed", "sign", "axes x and z", "deg/s")
QUICK = ("gyro -x", "imu 90")
"""Distortions that are tried each time; all are slow tests."""


@pytest.mark.parametrize(
    "guess", [pytest.param(e, marks=() if e in SAID else pytest.mark.slow) for e in IN_THE_STAND]
)
def test_a_wrong_imu_keeps_the_robot_standing_and_is_named(guess: str) -> None:
    harness, errors = drive(IN_THE_STAND[guess])
    assert guess in errors
    assert harness.gaits[0].controller.state is GaitState.STAND
    assert harness.truth.torso_position[0] < 0.03, "it has not walked"
    assert not harness.fallen


@pytest.mark.parametrize("degrees", [30.0, -50.0])
def test_a_robot_with_a_tilted_imu_stands_and_is_limp_after_a_fall(degrees: float) -> None:
    """Its accelerometer shows the fall by how far it turns."""
    tilted = mapped(about_y(degrees), about_y(degrees))
    harness, errors = drive(tilted)
    assert "mounting of the IMU" in errors
    assert harness.gaits[0].controller.state is GaitState.STAND
    assert not harness.fallen
    if degrees > 0.0:  # else the force passes the vertical on its way
        harness, _ = drive(tilted, kind=Shoved)
        lies_limp(harness)


def test_a_gait_that_starts_while_the_robot_falls_lets_it_go_limp() -> None:
    """The first force differs from the soles' normal, as that of an IMU that is mounted askew."""
    harness, _ = drive(lambda rate, force: (rate, force), kind=StartedInAFall)
    lies_limp(harness)


def lies_limp(harness: Harness) -> None:
    assert harness.fallen
    assert isinstance(harness.fault, Shoved)
    assert harness.fault.height_when_limp > 0.08, "before it lies"
    assert harness.gaits[0].controller.state is GaitState.FALLEN


@pytest.mark.parametrize("name", QUICK)
def test_axes_that_do_not_fit_end_the_first_steps(name: str) -> None:
    ends_upright(name, "nao_h21_v33", 3)


@pytest.mark.slow
@pytest.mark.parametrize(("urdf", "seed"), ROBOTS)
@pytest.mark.parametrize("name", [*IN_THE_STAND, *IN_THE_FIRST_STEPS])
def test_no_robot_walks_or_falls_with_a_wrong_imu(name: str, urdf: str, seed: int) -> None:
    ends_upright(name, urdf, seed)


def ends_upright(name: str, urdf: str, seed: int) -> None:
    change = IN_THE_STAND.get(name) or IN_THE_FIRST_STEPS[name]
    harness, errors = drive(change, 1, urdf, seed, ROBOTS[urdf, seed], seconds=6.0)
    assert "imu/data" in errors
    assert not harness.fallen
    assert harness.gaits[0].controller.state is GaitState.STAND


def test_a_yaw_gyro_with_the_wrong_sign_ends_the_first_turn() -> None:
    wrong = mapped((1, 1, -1), 1.0)
    harness, errors = drive(wrong, 1, "nao_v6", 4, (0.0, 0.0, 0.6), seconds=3.5)
    assert "sign of angular_velocity.z?" in errors
    assert not harness.fallen


@pytest.mark.parametrize("every", [2, 3])
def test_sensors_at_another_rate_than_the_control_period_are_named(every: int) -> None:
    harness, errors = drive(lambda rate, force: (rate, force), every)
    assert f"set control_period to {0.01 * every:g}" in errors
    assert harness.gaits[0].controller.state is GaitState.STAND
    assert not harness.fallen


@pytest.mark.parametrize("unit", [(np.degrees(1.0), 1.0), (1.0, 1.0 / 9.81)])
def test_a_unit_that_changes_in_a_walk_ends_it(unit: tuple[float, float]) -> None:
    samples = 0

    def change(rate: Point3, force: Point3) -> tuple[Point3, Point3]:
        nonlocal samples
        samples += 1
        turn, push = unit if samples > 300 else (1.0, 1.0)
        return scaled(rate, turn), scaled(force, push)

    harness, errors = drive(change, seed=5, command=(0.15, 0.0, 0.1), seconds=6.5)
    assert not harness.fallen
    assert harness.gaits[0].controller.state is GaitState.STAND
    assert "imu/data" in errors


def scaled(vector: Point3, factor: float) -> Point3:
    x, y, z = vector
    return factor * x, factor * y, factor * z
