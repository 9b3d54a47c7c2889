"""A floor with robots and an optional ball, stepped by control periods."""

import math
from collections.abc import Sequence
from typing import Self

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.robot import RobotDescription
from sim_bridge.ball import Ball, BallState, ball_position
from sim_bridge.engines.registry import make_backend
from sim_bridge.plant import Plant
from sim_bridge.robot import RobotSpec, SimulatedRobot
from sim_bridge.terrain import prisms

_SECOND = 1_000_000_000


class World:
    """Robots on one floor in one physics engine. No threads, no wall clock.

    Use it as a context manager, or call `close`.

    Attributes:
        robots: the robots, in the order in which they were given.
        ground: prisms that rise above the floor.
        control_period: [ns] simulated time of one `step`.
        time: [ns] since the start; a reset does not set it back.
    """

    def __init__(
        self,
        plant: Plant,
        robots: Sequence[RobotSpec],
        *,
        engine: str = "pybullet",
        control_period: float = 0.01,
        gui: bool = False,
        ball: Ball | None = None,
    ) -> None:
        """Build the robots and the engine, and put everything at its start.

        Args:
            plant: kind of the robots and their floor. The first robot's seed draws the terrain.
            robots: at least one; both engines can simulate exactly one.
            engine: `pybullet` or `mujoco`.
            control_period: [s], a multiple of the plant's physics step.
            gui: open the engine's own window.
            ball: ball on the floor; None = none.

        Raises:
            NaoGaitError: an argument is not allowed, or the engine cannot honour the plant.
        """
        step = round(plant.physics.step * _SECOND)
        period = round(control_period * _SECOND) if math.isfinite(control_period) else 0
        if period <= 0 or period % step:
            allowed = f"a multiple of {plant.physics.step} s"
            raise NaoGaitError("control_period", control_period, allowed)
        if not robots:
            raise NaoGaitError("robots", "no robot", "at least one")
        self.control_period = period
        self.ground = prisms(plant.terrain, robots[0].seed)
        self.robots = tuple(SimulatedRobot(spec, plant, self.ground, period) for spec in robots)
        self._ball = ball
        self._engine = make_backend(
            engine, [robot.model for robot in self.robots], self.ground, gui=gui, ball=ball
        )
        self.time = 0
        self.reset()

    @classmethod
    def single(
        cls,
        robot: RobotDescription,
        plant: Plant,
        robot_seed: int = 0,
        noise_seed: int = 0,
        *,
        engine: str = "pybullet",
        sensor_delay: float | None = None,
        control_period: float = 0.01,
        gui: bool = False,
        start_state: str = "stand",
        ball: Ball | None = None,
    ) -> Self:
        """A world with one robot; `RobotSpec` and the constructor explain the arguments."""
        spec = RobotSpec(robot, robot_seed, noise_seed, sensor_delay, start_state)
        return cls(
            plant, [spec], engine=engine, control_period=control_period, gui=gui, ball=ball
        )

    @property
    def robot(self) -> SimulatedRobot:
        """The robot of a world that has one."""
        (robot,) = self.robots
        return robot

    @property
    def ball(self) -> BallState | None:
        """The ball now; None in a world without one."""
        return self._engine.ball()

    def put_ball(self, x: float, y: float) -> None:
        """Put the ball at rest on the floor at x, y [m] in the world."""
        if self._ball is None:
            raise NaoGaitError("ball", (x, y), "put_ball only in a world with a ball")
        self._engine.put_ball(ball_position(x, y, self._ball.radius, self.ground))

    def reset(self) -> None:
        """Put all robots back to their starts, at rest; delayed frames are lost, time continues."""
        self._engine.reset([robot.start for robot in self.robots])
        if self._ball is not None and self.ground:
            self.put_ball(self._ball.x, self._ball.y)
        for robot, state in zip(self.robots, self._engine.observe(), strict=True):
            robot.restart(self.time, state)

    def step(self) -> None:
        """Advance by one control period with the last commands of the robots.

        Raises:
            NaoGaitError: the simulation has become unstable.
        """
        for index, robot in enumerate(self.robots):
            faults = robot.new_faults()
            if faults is not None:
                self._engine.disturb(index, *faults)
        for inputs in zip(*(robot.step_inputs() for robot in self.robots), strict=True):
            self._engine.step(inputs)
        self.time += self.control_period
        for robot, state in zip(self.robots, self._engine.observe(), strict=True):
            robot.observe(self.time, state)

    def close(self) -> None:
        """Free the engine; may be called more than once."""
        self._engine.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
