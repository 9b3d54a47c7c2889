"""What a physics engine must offer. Everything else about a simulated robot is shared code."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from robot_core.robot import RobotDescription
from robot_core.robot.camera import CameraView, RgbImage
from robot_core.types import FloatArray
from sim_bridge.ball import BallState
from sim_bridge.body import Body
from sim_bridge.individual import Individual, draw_individual
from sim_bridge.plant import Plant, with_sensors_of
from sim_bridge.shapes import Color
from sim_bridge.soles import sole_points
from sim_bridge.state import StartState, StepInput, TrueState


@dataclass(frozen=True, slots=True)
class RobotModel:
    """One individual robot, as an engine builds it.

    Attributes:
        name: Unique in its world; empty for a robot that is alone.
    """

    description: RobotDescription
    plant: Plant
    individual: Individual
    body: Body
    name: str = ""

    @property
    def prefix(self) -> str:
        """What the names of its parts begin with in a world with several robots."""
        return f"{self.name}/" if self.name else ""


def make_robot_model(
    description: RobotDescription,
    plant: Plant,
    seed: int,
    name: str = "",
    color: Color | None = None,
) -> RobotModel:
    """One individual of this kind of robot in this plant.

    Args:
        description: Facts of all robots of this kind.
        plant: Kind of robot and floor.
        seed: Number of the individual; -1 = nominal.
        name: Unique in its world; empty for a robot that is alone.
        color: Red, green, blue of its torso in pictures; None = those of the URDF.

    Raises:
        NaoGaitError: The seed is not allowed, or the soles do not fit the floor.
    """
    plant = with_sensors_of(plant, description)
    individual = draw_individual(plant, description, seed)
    body = Body(description, individual, sole_points(plant, description), color)
    return RobotModel(description, plant, individual, body, name)


BALL = -1
"""Stands for the ball where robots are told apart by their index."""


class Backend(Protocol):
    """A physics engine with some robots on a floor; they keep their order."""

    def reset(self, starts: Sequence[StartState]) -> None:
        """Put each robot at its start, at rest, with no memory of what was before."""

    def place(self, robot: int, start: StartState) -> None:
        """Put one robot at its start, at rest; the others and the ball stay as they are."""

    def step(self, inputs: Sequence[StepInput]) -> None:
        """Advance by one physics step, with one input per robot."""

    def observe(self) -> list[TrueState]:
        """The state of each robot now.

        Raises:
            NaoGaitError: The simulation has become unstable, in an engine that notices it.
        """

    def disturb(self, robot: int, torque_share: FloatArray, friction: float | None) -> None:
        """Set the faults of a robot from now on; a reset does not repair them.

        Args:
            robot: Index of the robot.
            torque_share: (n,) share of each motor's torque that is left, 0 to 1.
            friction: Coefficient of both soles on the floor; None = the individual's own.
        """

    def ball(self) -> BallState | None:
        """The ball now; None in a world without one."""

    def put_ball(self, position: FloatArray, velocity: FloatArray) -> None:
        """Put the ball at (3,) [m] in the world, with (3,) [m/s] of its centre and no spin."""

    def touches(self) -> set[tuple[int, int]]:
        """Pairs of robots, and of `BALL` and a robot, that touch: their indices in rising order."""

    def render(self, view: CameraView) -> RgbImage:
        """The world as last observed, as a camera in the world frame images it, without effects.

        Only in a world with what can be seen.

        Raises:
            NaoGaitError: What the engine needs for images is not installed.
        """

    def picture(self) -> FloatArray:
        """(n,) what images depend on, as last observed; NaoGaitError if it is not in one array."""

    def show(self, picture: FloatArray) -> None:
        """Let `render` show a `picture` of the same world, until the next step."""

    def close(self) -> None:
        """Free the engine; may be called more than once."""
