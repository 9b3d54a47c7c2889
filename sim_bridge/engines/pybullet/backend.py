"""The plant in PyBullet."""

import contextlib
from collections.abc import Sequence

import numpy as np

from robot_core.errors import NaoGaitError
from robot_core.robot.camera import CameraView, RgbImage
from robot_core.types import FloatArray
from sim_bridge.ball import BallState
from sim_bridge.engines.backend import BALL, RobotModel
from sim_bridge.engines.pybullet.library import bullet, silenced
from sim_bridge.engines.pybullet.pictures import PyBulletPictures
from sim_bridge.engines.pybullet.robot_state import PyBulletRobot, refuse
from sim_bridge.engines.pybullet.scene import (
    FIXTURE,
    ROBOT,
    add_ball,
    add_fixtures,
    add_floor,
    add_pitch,
    add_terrain,
    add_tiles,
    set_physics,
)
from sim_bridge.state import StartState, StepInput, TrueState
from sim_bridge.surroundings import PLAIN_FLOOR, Surroundings


class PyBulletBackend:
    """`Backend` with PyBullet.

    It caps velocities at 100 m/s and rad/s: an unstable simulation stays finite, and unnoticed.

    A position servo is a constraint on the joint's velocity with a torque limit. It has no
    stiffness of its own, so stiffness, rotor inertia, dry friction and play are refused.

    Attributes:
        client: Of PyBullet; for pictures.
    """

    def __init__(
        self,
        robots: Sequence[RobotModel],
        surroundings: Surroundings = PLAIN_FLOOR,
        *,
        gui: bool = False,
        visual: bool = False,
    ) -> None:
        """Connect to PyBullet; the world is built by `reset`.

        Args:
            robots: The individuals, at least one.
            surroundings: What is around them.
            gui: Open PyBullet's window.
            visual: Images can be rendered, which is always so.

        Raises:
            NaoGaitError: PyBullet cannot honour an option of the plant, or the window cannot be
                opened.
        """
        plant = robots[0].plant
        refuse(plant, [robot.description for robot in robots])
        self._physics, self._surroundings = plant.physics, surroundings
        self._gui, self._bodies = gui, [robot.body for robot in robots]
        self._pictures: PyBulletPictures | None = None
        self._observed: list[TrueState] = []
        with silenced():
            self.client: int = bullet.connect(bullet.GUI if gui else bullet.DIRECT)
        if self.client < 0:
            raise NaoGaitError("gui", gui, "false where there is no display")
        self._robots = [PyBulletRobot(self.client, robot) for robot in robots]

    def reset(self, starts: Sequence[StartState]) -> None:
        """See `Backend`. Builds a new world: moved bodies would keep contacts and caches."""
        with silenced():
            bullet.resetSimulation(physicsClientId=self.client)
            self._build()
        for robot, start in zip(self._robots, starts, strict=True):
            robot.place(start)

    def place(self, robot: int, start: StartState) -> None:
        """See `Backend`."""
        self._robots[robot].place(start)

    def _build(self) -> None:
        client, physics, around = self.client, self._physics, self._surroundings
        with_ball = around.ball is not None
        set_physics(client, physics)
        floor = add_floor(client)
        terrain = add_terrain(client, around.ground, visible=self._gui)
        if self._gui and around.carpet is None:
            add_tiles(client)
        elif self._gui:
            add_pitch(client, around)
        add_fixtures(client, around.fixtures, visible=self._gui)
        bits = [ROBOT << index for index in range(len(self._robots))]
        for robot, bit in zip(self._robots, bits, strict=True):
            robot.build(
                floor,
                terrain,
                visible=self._gui,
                ball=with_ball,
                bit=bit,
                meets=FIXTURE | sum(bits) & ~bit,
            )
        if around.ball is not None:
            self._ball_body = add_ball(client, around.ball, physics.gravity)

    def step(self, inputs: Sequence[StepInput]) -> None:
        """See `Backend`."""
        for robot, given in zip(self._robots, inputs, strict=True):
            robot.apply(given)
        bullet.stepSimulation(physicsClientId=self.client)
        for robot in self._robots:
            robot.watch()

    def observe(self) -> list[TrueState]:
        """See `Backend`."""
        self._observed = [robot.observe() for robot in self._robots]
        return self._observed

    def touches(self) -> set[tuple[int, int]]:
        """See `Backend`."""
        owners = {robot.body: index for index, robot in enumerate(self._robots)}
        if self._surroundings.ball is not None:
            owners[self._ball_body] = BALL
        contacts = bullet.getContactPoints(physicsClientId=self.client)
        pairs = {(owners.get(each[1]), owners.get(each[2])) for each in contacts if each[8] <= 0.0}
        return {(min(i, j), max(i, j)) for i, j in pairs if not (i is None or j is None or i == j)}

    def render(self, view: CameraView) -> RgbImage:
        """See `Backend`."""
        if self._pictures is None:
            self._pictures = PyBulletPictures(self._bodies, self._surroundings)
        return self._pictures.render(view, self._observed, self.ball())

    def picture(self) -> FloatArray:
        """See `Backend`."""
        raise NaoGaitError("engine", "pybullet", "mujoco, for images that another process renders")

    def show(self, picture: FloatArray) -> None:
        """See `Backend`."""
        raise NaoGaitError("engine", "pybullet", "mujoco, for images that another process renders")

    def disturb(self, robot: int, torque_share: FloatArray, friction: float | None) -> None:
        """See `Backend`."""
        self._robots[robot].disturb(torque_share, friction)

    def ball(self) -> BallState | None:
        """See `Backend`."""
        if self._surroundings.ball is None:
            return None
        body, client = self._ball_body, self.client
        position, _ = bullet.getBasePositionAndOrientation(body, physicsClientId=client)
        velocity, _ = bullet.getBaseVelocity(body, physicsClientId=client)
        return BallState(np.array(position), np.array(velocity))

    def put_ball(self, position: FloatArray, velocity: FloatArray) -> None:
        """See `Backend`."""
        still = [0.0, 0.0, 0.0]
        body, client = self._ball_body, self.client
        bullet.resetBasePositionAndOrientation(
            body, position.tolist(), [*still, 1.0], physicsClientId=client
        )
        bullet.resetBaseVelocity(body, velocity.tolist(), still, physicsClientId=client)

    def close(self) -> None:
        """See `Backend`."""
        if self._pictures is not None:
            self._pictures.close()
            self._pictures = None
        if self.client >= 0:
            with contextlib.suppress(bullet.error):
                bullet.disconnect(physicsClientId=self.client)
            self.client = -1

    def __del__(self) -> None:
        if getattr(self, "client", -1) >= 0:
            self.close()
