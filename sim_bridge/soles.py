"""Contact points of the soles and their stiffness.

Beside the robot's own soles there are the second paper's two designs for rough ground (its Fig. 7):
leaf springs along the sides of the foot, which touch at their tips, and a long narrow foot on a
sponge. The paper does not give their stiffness; it is chosen here.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from robot_core.errors import NaoGaitError
from robot_core.robot import RobotDescription
from robot_core.types import Point2
from sim_bridge.individual import Individual
from sim_bridge.plant import Plant
from sim_bridge.terrain import is_uneven

SPONGE_LENGTH, SPONGE_WIDTH = 0.206, 0.050
"""[m] as published."""
STIFFNESS: Mapping[str, float | None] = {"own": None, "spring": 3e3, "sponge": 3e3}
"""[N/m] of a sole at one corner, in series with the floor; chosen: 1.3 mm under Bruno."""
ROWS = (0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0)
"""Contact points of a flat sole on uneven ground along its length, as shares of it."""
COLUMNS = (0.0, 0.5, 1.0)
"""Contact points of a flat sole on uneven ground across its width, as shares of it."""


@dataclass(frozen=True, slots=True)
class SolePoints:
    """The left sole in its frame; the right one is its mirror image.

    Attributes:
        corners: x, y [m]: front-inner, front-outer, rear-outer, rear-inner.
        points: x, y [m] of the contact points.
    """

    corners: tuple[Point2, ...]
    points: tuple[Point2, ...]


def corner_points(robot: RobotDescription) -> SolePoints:
    """The robot's own soles on a level floor, which touch at the corners."""
    return SolePoints(robot.sole_corners, robot.sole_corners)


def sole_points(plant: Plant, robot: RobotDescription) -> SolePoints:
    """The soles of this plant; on uneven ground a flat sole also touches between its corners.

    Raises:
        NaoGaitError: A soft sole or a carpet on a rigid floor.
    """
    if plant.contact.rigid and _soft(plant):
        raise NaoGaitError(
            f"{plant.name}: contact.rigid", True, "false on a carpet and with soft soles"
        )
    own = robot.sole_corners
    corners = _sponge(own) if plant.sole.kind == "sponge" else own
    if not is_uneven(plant.terrain) or plant.sole.kind == "spring":
        return SolePoints(corners, corners)
    front_inner, front_outer, rear_outer, rear_inner = corners
    points = tuple(
        _between(
            _between(front_inner, front_outer, across),
            _between(rear_inner, rear_outer, across),
            back,
        )
        for back in ROWS for across in COLUMNS
    )  # fmt: skip
    return SolePoints(corners, points)


def contact_of(
    plant: Plant, individual: Individual, count: int, mass: float
) -> tuple[float, float]:
    """Stiffness [N/m] and damping [N s/m] of one of the `count` points of a sole.

    Floor, carpet and sole are springs in series. All points of a sole together are as stiff and
    damped as the four corners for which the plant gives the values, and the floor is stiffer under
    a robot of more `mass` [kg] than these values are for.
    """
    contact = plant.contact
    weight = max(1.0, mass / contact.mass)
    stiffness = weight * contact.stiffness * individual.stiffness_scale
    for spring in _soft(plant):
        stiffness = stiffness * spring / (stiffness + spring)
    share = 4.0 / count
    return share * stiffness, share * weight * contact.damping


def _soft(plant: Plant) -> list[float]:
    """[N/m] of sole and carpet at one corner, as far as they are soft."""
    sole = plant.sole.stiffness or STIFFNESS[plant.sole.kind]
    carpet = plant.terrain.carpet_stiffness if plant.terrain.kind == "carpet" else None
    return [spring for spring in (sole, carpet) if spring is not None]


def _sponge(corners: tuple[Point2, ...]) -> tuple[Point2, ...]:
    """Corners of the sponge: from the same heel forward, on the same centre line."""
    rear = min(x for x, _ in corners)
    middle = 0.5 * (min(y for _, y in corners) + max(y for _, y in corners))
    front, inner, outer = rear + SPONGE_LENGTH, middle - SPONGE_WIDTH / 2, middle + SPONGE_WIDTH / 2
    return (front, inner), (front, outer), (rear, outer), (rear, inner)


def _between(a: Point2, b: Point2, share: float) -> Point2:
    return a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])
