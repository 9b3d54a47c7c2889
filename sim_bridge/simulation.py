"""One simulated robot, stepped from Python: joint targets in, sensors and ground truth out."""

from collections.abc import Iterator
from contextlib import AbstractContextManager
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from robot_core.command_input import PUSH_ABSURD
from robot_core.errors import NaoGaitError
from robot_core.message_checks import read_array
from robot_core.schema import Number
from robot_core.types import STANDSTILL, JointTargets, Point2, SensorFrame
from sim_bridge.ball import FARTHEST, Ball
from sim_bridge.plant import Plant, load_plant
from sim_bridge.robot import GroundTruth
from sim_bridge.trials.trial import (
    CONTROL_PERIOD,
    PUSH_DURATION,
    Responder,
    Tick,
    TrialSpec,
    make_world,
    run_responder,
)
from sim_bridge.world import World


class Observation(NamedTuple):
    """The robot after a control period.

    Attributes:
        time: [s] since the reset.
        frame: The newest sensor frame that has passed the sensor delay; None before the first one.
        truth: Exact state; for metrics and tests, not for a controller.
        fallen: The torso is tilted over 45 deg, or under half its height at the reset.
    """

    time: float
    frame: SensorFrame | None
    truth: GroundTruth
    fallen: bool


class _Given(Responder):
    """Takes the targets that the user has set before each step."""

    command, status = STANDSTILL, None
    targets: JointTargets | None = None

    def respond(self, tick: Tick) -> bool:
        return True


class Simulation(AbstractContextManager["Simulation"]):
    """One simulated robot. It depends on its arguments and the targets alone.

    Use it as a context manager, or call `close`.

    Args:
        robot: Shipped name of the robot, or its URDF, MJCF or robot file.
        engine: `mujoco` or `pybullet`.
        seed: The individual: its joint zeros, sensor biases, strength, friction; -1 = the nominal
            robot.
        plant: What motors, sensors and floor are like: a plant, or its name or file.
        noise_seed: Seed of the sensor noise.
        control_period: [s] that one step lasts, a multiple of the plant's physics step.
        ball: x, y [m] of a ball on the floor; None = no ball.

    Attributes:
        world: The simulated world, for all that this class does not offer: robots, ball, faults.

    Raises:
        NaoGaitError: An argument is not allowed, or the engine is not installed or cannot honour
            the plant.
    """

    world: World

    def __init__(
        self,
        robot: str = "nao_h21_v33",
        *,
        engine: str = "mujoco",
        seed: int = 0,
        plant: str | Plant = "reference",
        noise_seed: int = 0,
        control_period: float = CONTROL_PERIOD,
        ball: Point2 | None = None,
    ) -> None:
        self._spec = TrialSpec(
            robot_seed=seed, noise_seed=noise_seed, urdf=str(robot), engine=engine,
            control_period=control_period,
        )  # fmt: skip
        self._plant = plant if isinstance(plant, Plant) else load_plant(plant)
        self._ball = None
        if ball is not None:
            self._ball = Ball(*read_array(ball, "ball", (2,), FARTHEST, "m").tolist())
        self._closed = False
        self._ticks: Iterator[Tick] | None = None
        self.world = self._make_world()

    def _make_world(self) -> World:
        try:
            return make_world(self._spec, plant=self._plant, ball=self._ball)
        except NaoGaitError as error:
            if error.field == "robot_seed":
                raise NaoGaitError("seed", error.value, error.allowed) from None
            raise

    def reset(self, seed: int | None = None) -> Observation:
        """Begin anew at time 0, with the same noise: the same targets give the same run.

        Args:
            seed: Another individual from now on; None keeps it.

        Returns:
            The robot at rest; its frame is None.

        Raises:
            NaoGaitError: The simulation is closed, or the seed is not allowed.
        """
        self._check_open("reset")
        if seed is not None:
            self._spec = replace(self._spec, robot_seed=seed)
        if self._ticks is not None or seed is not None:
            world = self._make_world()
            self.world.close()
            self.world = world
        self._given = _Given()
        self._ticks = run_responder(self.world, self._given, _undisturbed, past_falls=True)
        return self._observe(next(self._ticks))

    def step(self, targets: JointTargets | ArrayLike | None = None) -> Observation:
        """Advance by one control period.

        Args:
            targets: Joint targets, or joint angles (n,) [rad] with full stiffness; None holds the
                last ones.

        Returns:
            The robot at the end of the period.

        Raises:
            NaoGaitError: The targets are not usable (nothing moves), the simulation is closed or
                was not reset, or it has become unstable.
        """
        ticks = self._begun("step")
        if targets is not None and not isinstance(targets, JointTargets):
            targets = JointTargets(0, targets)  # type: ignore[arg-type]
        self.world.robot.command(targets)  # refuses bad ones before the loop sees them
        self._given.targets = targets
        tick = next(ticks, None)
        if tick is None:
            raise NaoGaitError("step", "a simulation that has become unstable", "step after reset")
        return self._observe(tick)

    def push(self, impulse: float, direction: float = 0.0) -> None:
        """Push the torso at its centre of mass for 0.1 s from now on.

        Args:
            impulse: [N s], up to 200.
            direction: [rad] in the world, counter-clockwise from x.

        Raises:
            NaoGaitError: A number is not allowed, or the simulation is closed or was not reset.
        """
        self._begun("push")
        most = PUSH_ABSURD * PUSH_DURATION
        impulse = Number(-most, most, "N s").check("impulse", impulse)
        direction = Number(-100.0, 100.0, "rad").check("direction", direction)
        towards = np.array((np.cos(direction), np.sin(direction), 0.0))
        self.world.robot.push(impulse / PUSH_DURATION * towards, PUSH_DURATION)

    def close(self) -> None:
        """Free the engine; may be called more than once."""
        self._closed = True
        self.world.close()

    def _observe(self, tick: Tick) -> Observation:
        frame = self.world.robot.sense()
        return Observation(tick.truth.stamp * 1e-9, frame, tick.truth, tick.fallen)

    def _check_open(self, method: str) -> None:
        if self._closed:
            raise NaoGaitError(method, "a closed simulation", f"{method} before close")

    def _begun(self, method: str) -> Iterator[Tick]:
        self._check_open(method)
        if self._ticks is None:
            raise NaoGaitError(method, "no reset before it", f"{method} after reset")
        return self._ticks

    def __exit__(self, *_: object) -> None:
        self.close()


def _undisturbed(world: World, tick: Tick) -> None:
    """Pushes come from the caller, between two steps."""
