"""Robots and what surrounds them, stepped by control periods."""

from collections.abc import Sequence
from contextlib import AbstractContextManager
from typing import Any, Self, TypedDict, Unpack, cast

import numpy as np

from robot_core.errors import NaoGaitError
from robot_core.field import BallPlace
from robot_core.message_checks import read_array
from robot_core.robot import RobotDescription
from robot_core.robot.camera import CameraView, RgbImage
from robot_core.schema import Choice, Number
from robot_core.types import FloatArray, Point2, Pose2
from sim_bridge.ball import Ball, BallState, ball_position
from sim_bridge.cameras.camera import CameraSettings
from sim_bridge.engines.backend import Backend
from sim_bridge.engines.registry import make_backend
from sim_bridge.places import check_free, check_places
from sim_bridge.plant import Plant
from sim_bridge.robot import RobotSpec, SimulatedRobot
from sim_bridge.scene import Scene
from sim_bridge.state import StartState
from sim_bridge.surroundings import Surroundings
from sim_bridge.terrain import prisms

LONGEST_PERIOD = 1.0
"""[s] of one control period."""
MAX_PLACE = 50.0
"""[m, rad] of a place that is asked for."""
MAX_BALL_SPEED = 20.0
"""[m/s] that a ball can be given."""
_SECOND = 1_000_000_000


class WorldOptions(TypedDict, total=False):
    """Keyword arguments of `World`, whatever is in it."""

    engine: str
    control_period: float
    gui: bool
    visual: bool
    cameras: CameraSettings | None


class _Closed:
    """The engine of a closed world."""

    def close(self) -> None:
        """Nothing is left to free."""

    def __getattr__(self, _: str) -> Any:
        raise NaoGaitError("world", "a closed world", "calls before close")


class World(AbstractContextManager["World"]):
    """Robots on one floor in one physics engine. No threads, no wall clock.

    Nothing but contact and the shared floor connects the robots: each has its own errors, sensor
    noise and delay line.

    Use it as a context manager, or call `close`.

    Attributes:
        robots: The robots, in the order in which they were given.
        scene: Field and robots by their names; None = a plain floor.
        surroundings: Ground, field, goals, poles and ball.
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
        visual: bool = False,
        cameras: CameraSettings | None = None,
        ball: Ball | None = None,
        scene: Scene | None = None,
    ) -> None:
        """Build the robots and the engine, and put everything at its start.

        Args:
            plant: Kind of the robots and their floor. The first robot's seed draws the terrain.
            robots: At least one; several must have different names.
            engine: `pybullet` or `mujoco`.
            control_period: [s], a multiple of the plant's physics step, at most 1.
            gui: Open the engine's own window.
            visual: With what can be seen, for pictures; always so with `gui` or cameras.
            cameras: Settings of the robots' cameras; None = without cameras.
            ball: Ball on a floor without a scene; None = none.
            scene: Field, goals, poles and ball; None = a plain floor.

        Raises:
            NaoGaitError: An argument is not allowed, robots overlap, or the engine cannot honour
                the plant or render images.
        """
        if not isinstance(plant, Plant):
            raise NaoGaitError("plant", plant, "a Plant")
        if not (isinstance(robots, Sequence) and all(isinstance(r, RobotSpec) for r in robots)):
            raise NaoGaitError("robots", robots, "a list of RobotSpec")
        step = round(plant.physics.step * _SECOND)
        longest = Number(plant.physics.step, LONGEST_PERIOD, "s")
        period = round(longest.check("control_period", control_period) * _SECOND)
        if period % step:
            allowed = f"a multiple of {plant.physics.step} s"
            raise NaoGaitError("control_period", control_period, allowed)
        if not robots:
            raise NaoGaitError("robots", "no robot", "at least one")
        names = [spec.name for spec in robots]
        if len(set(names)) < len(names) or (len(names) > 1 and "" in names):
            raise NaoGaitError("robots", ", ".join(map(repr, names)), "each name once, none empty")
        self.control_period, self.scene = period, scene
        ground = prisms(plant.terrain, robots[0].seed)
        self.surroundings = (
            Surroundings(ground, ball) if scene is None else scene.surroundings(ground)
        )
        self.robots = tuple(
            SimulatedRobot(spec, plant, ground, period, cameras) for spec in robots
        )
        check_places(self.robots, self.surroundings)
        self._engine: Backend = make_backend(
            engine,
            [robot.model for robot in self.robots],
            self.surroundings,
            gui=gui,
            visual=visual or cameras is not None,
        )
        self.time = 0
        self.reset()
        if cameras is not None:
            self._check_rendering()

    @classmethod
    def single(
        cls,
        robot: RobotDescription,
        plant: Plant,
        robot_seed: int = 0,
        noise_seed: int = 0,
        *,
        sensor_delay: float | None = None,
        start_state: str = "stand",
        ball: Ball | None = None,
        **options: Unpack[WorldOptions],
    ) -> Self:
        """A world with one robot; `RobotSpec` and the constructor explain the arguments."""
        spec = RobotSpec(robot, robot_seed, noise_seed, sensor_delay, start_state)
        return cls(plant, [spec], ball=ball, **options)

    @classmethod
    def of_scene(
        cls,
        scene: Scene,
        plant: Plant,
        *,
        noise_seed: int = 0,
        sensor_delay: float | None = None,
        **options: Unpack[WorldOptions],
    ) -> Self:
        """The world of a scene; `RobotSpec` and the constructor explain the arguments."""
        robots = scene.robot_specs(noise_seed=noise_seed, sensor_delay=sensor_delay)
        return cls(plant, robots, scene=scene, **options)

    @property
    def robot(self) -> SimulatedRobot:
        """The robot of a world that has one."""
        (robot,) = self.robots
        return robot

    @property
    def ball(self) -> BallState | None:
        """The ball now; None in a world without one."""
        return self._engine.ball()

    @property
    def ball_place(self) -> BallPlace | None:
        """Where the ball is; None without a ball or a field."""
        ball = self.ball
        return None if ball is None else self.surroundings.place_of(ball)

    @property
    def touches(self) -> set[tuple[int, int]]:
        """Pairs of robots, and of `BALL` and a robot, that touch: their indices in rising order."""
        return self._engine.touches()

    def put_ball(self, x: float, y: float, velocity: Point2 = (0.0, 0.0)) -> None:
        """Put the ball on the floor.

        Args:
            x: [m] in the world.
            y: [m] in the world.
            velocity: x, y [m/s] of its centre; it does not spin.

        Raises:
            NaoGaitError: There is no ball, or a number is not usable.
        """
        ball = self.surroundings.ball
        if ball is None:
            raise NaoGaitError("ball", (x, y), "put_ball only in a world with a ball")
        ground = self.surroundings.ground
        speed = read_array(velocity, "ball velocity", (2,), MAX_BALL_SPEED, "m/s")
        place = ball_position(x, y, ball.radius, ground)
        self._engine.put_ball(place, np.array((*speed, 0.0)))

    def reset(self) -> None:
        """Put all robots and the ball back to their starts, at rest; delayed frames are lost.

        Time continues.
        """
        self._engine.reset([robot.start for robot in self.robots])
        ball = self.surroundings.ball
        if ball is not None and self.surroundings.ground:
            self.put_ball(ball.x, ball.y)
        for robot, state in zip(self.robots, self._engine.observe(), strict=True):
            robot.restart(self.time, state)

    def reset_robot(self, name: str, pose: Pose2 | None = None) -> None:
        """Put one robot back to its start, at rest; its delayed frames are lost.

        Args:
            name: The robot.
            pose: x, y [m], heading [rad] at which it is put instead.

        Raises:
            NaoGaitError: There is no such robot, or another one or the ball is at this place.
        """
        names = tuple(robot.name for robot in self.robots)
        index = names.index(Choice(names).check("robot", name))
        if pose is not None:
            x, y, heading = read_array(pose, "pose", (3,), MAX_PLACE, "m, rad").tolist()
            pose = x, y, heading
        robot = self.robots[index]
        spec, ball = self.surroundings.ball, self.ball
        here = None if spec is None or ball is None else (ball.position, spec.radius)
        start = robot.start if pose is None else robot.start_at(pose)
        check_free(robot, start, self.robots, here)
        self._engine.place(index, start)
        robot.restart(self.time, self._engine.observe()[index])

    def step(self) -> None:
        """Advance by one control period with the last commands of the robots.

        Raises:
            NaoGaitError: The simulation has become unstable.
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
        for robot in self.robots:
            robot.expose(self.render)

    def render(self, view: CameraView) -> RgbImage:
        """The world now, as a camera in the world frame would image it, without effects.

        Only in a world with cameras, or that is `visual`.

        Raises:
            NaoGaitError: What the engine needs for images is not installed.
        """
        return self._engine.render(view)

    def picture(self) -> FloatArray:
        """What images of the world now depend on; `show` takes it, in the same world elsewhere.

        Raises:
            NaoGaitError: The engine cannot tell.
        """
        return self._engine.picture()

    def show(self, picture: FloatArray) -> None:
        """Let images show what a world was like; `reset` before the next `step`."""
        self._engine.show(picture)

    def pose(self, states: Sequence[StartState], ball: FloatArray | None = None) -> None:
        """Put robots and ball (3,) [m] somewhere for a picture: time does not pass, nothing moves.

        Places are not checked; `reset` before the next `step`.
        """
        self._engine.reset(states)
        if ball is not None:
            self._engine.put_ball(ball, np.zeros(3))
        self._engine.observe()

    def _check_rendering(self) -> None:
        """Render an image; NaoGaitError if something is missing for it."""
        robot = self.robots[0]
        try:
            self.render(robot.cameras[0].view(robot.state))
        except NaoGaitError:
            self.close()
            raise

    def close(self) -> None:
        """Free the engine; may be called more than once."""
        self._engine.close()
        self._engine = cast(Backend, _Closed())

    def __exit__(self, *_: object) -> None:
        self.close()
