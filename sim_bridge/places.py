"""Whether robots, goals, poles and ball are in each other's place.

A place is the box around a thing, along the axes of the world. Such boxes are a little larger than
what is in them, so that robots which are accepted do not touch.
"""

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from robot_core.errors import NaoGaitError
from robot_core.geometry import rotation_matrix
from robot_core.types import FloatArray
from sim_bridge.robot import SimulatedRobot
from sim_bridge.shapes import half_height
from sim_bridge.state import StartState
from sim_bridge.surroundings import Surroundings


class Place(NamedTuple):
    """A box in the world.

    Attributes:
        name: Of what is there.
        low: (3,) [m] smallest x, y, z.
        high: (3,) [m] largest x, y, z.
    """

    name: str
    low: FloatArray
    high: FloatArray

    def meets(self, other: "Place") -> bool:
        """Whether the boxes overlap."""
        return bool((self.low < other.high).all() and (other.low < self.high).all())


def check_places(robots: Sequence[SimulatedRobot], surroundings: Surroundings) -> None:
    """Refuse robots that start in each other, in a goal, in a pole or on the ball.

    Raises:
        NaoGaitError: Names the two things that overlap.
    """
    starts = [_start_of(robot) for robot in robots]
    if len(robots) == 1 and not surroundings.fixtures:
        return  # the ball may be anywhere
    taken = list(_places_of(surroundings))
    for start in starts:
        _check(start, taken)
        taken.append(start)


def check_free(
    robot: SimulatedRobot,
    start: StartState,
    robots: Iterable[SimulatedRobot],
    ball: tuple[FloatArray, float] | None = None,
) -> None:
    """Refuse to put a robot somewhere while another one or the ball is there.

    Args:
        robot: The robot.
        start: Where it is to be.
        robots: All robots.
        ball: (3,) [m] centre and radius [m]; None = none.

    Raises:
        NaoGaitError: Names what is there.
    """
    taken = [_now(other) for other in robots if other is not robot]
    if ball is not None:
        taken.append(_ball_at(*ball))
    _check(_at(robot, start), taken)


def _check(start: Place, taken: Iterable[Place]) -> None:
    for other in taken:
        if start.meets(other):
            x, y = ((start.low + start.high) / 2.0).tolist()[:2]
            got = f"{start.name} at x {x:.2f}, y {y:.2f} m overlaps {other.name}"
            raise NaoGaitError("robots", got, "robots that start apart from all others")


def _start_of(robot: SimulatedRobot) -> Place:
    return _at(robot, robot.start)


def _at(robot: SimulatedRobot, start: StartState) -> Place:
    low, high = robot.body.bounds(rotation_matrix(start.torso_rotation), start.joint_position)
    return Place(robot.name, low + start.torso_position, high + start.torso_position)


def _now(robot: SimulatedRobot) -> Place:
    truth = robot.truth()
    low, high = robot.body.bounds(rotation_matrix(truth.torso_quaternion), truth.joint_position)
    return Place(robot.name, low + truth.torso_position, high + truth.torso_position)


def _places_of(surroundings: Surroundings) -> Iterator[Place]:
    for fixture in surroundings.fixtures:
        shape = fixture.shape
        half = np.array([half_height(shape, axis) for axis in shape.rotation])
        yield Place(fixture.name, shape.position - half, shape.position + half)
    if surroundings.ball is not None:
        yield _ball_at(surroundings.ball.start, surroundings.ball.radius)


def _ball_at(centre: FloatArray, radius: float) -> Place:
    return Place("the ball", centre - radius, centre + radius)
