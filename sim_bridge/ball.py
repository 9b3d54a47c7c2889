"""A ball on the floor, for kicks."""

import math
from dataclasses import dataclass

import numpy as np

from robot_core.schema import Number
from robot_core.types import FloatArray
from sim_bridge.body import Sole
from sim_bridge.shapes import Color, Shape
from sim_bridge.terrain import Prism, ground_height

SHOE_HEIGHT = 0.0292
"""[m] height over the sole of the shell of a foot, which meets the ball. The plate that meets the
other leg is lower."""
ROLLING_SLOWDOWN = 0.3
"""[m/s^2] deceleration of a rolling ball; chosen, for a short carpet."""
CONTACT_TIME = 0.01
"""[s] duration of the contact of a bouncing ball; chosen."""
CONTACT_DAMPING_RATIO = 0.16
"""Damping ratio of the contact; chosen: the ball bounces back at about 0.6 of its speed."""
RIM_POINTS = 16
"""Number of points around the centre of a ball at which the height of the ground is evaluated."""
FARTHEST = 1e3
"""[m] from the middle of the world to a ball."""
FRICTION = 0.6
"""Coulomb coefficient of the ball with the floor and with a foot; chosen."""


@dataclass(frozen=True, slots=True)
class Ball:
    """A RoboCup SPL foam ball.

    Attributes:
        x: [m] in the world at the start.
        y: [m] in the world at the start.
        radius: [m].
        mass: [kg].
        color: Red, green, blue; for pictures.
    """

    x: float = 0.5
    y: float = 0.0
    radius: float = 0.05
    mass: float = 0.044
    color: Color = (0.95, 0.95, 0.95)

    @property
    def start(self) -> FloatArray:
        """(3,) [m] of its centre at the start, on a level floor."""
        return np.array((self.x, self.y, self.radius))

    @property
    def inertia(self) -> float:
        """[kg m^2] about any axis through the centre, of a solid sphere."""
        return 0.4 * self.mass * self.radius**2

    @property
    def stiffness(self) -> float:
        """[N/m] of its contacts: half the period of mass and spring is the contact time."""
        return self.mass * (math.pi / CONTACT_TIME) ** 2

    @property
    def damping(self) -> float:
        """[N s/m] of its contacts."""
        return 2.0 * CONTACT_DAMPING_RATIO * math.sqrt(self.stiffness * self.mass)

    def rolling_resistance(self, gravity: float) -> float:
        """[m] distance delta of the floor's force ahead of the centre: a = delta g / (1.4 r)."""
        return ROLLING_SLOWDOWN * 1.4 * self.radius / gravity if gravity > 0.0 else 0.0


@dataclass(frozen=True, slots=True)
class BallState:
    """Exact state of the ball.

    Attributes:
        position: (3,) [m] of the centre in the world.
        velocity: (3,) [m/s] of the centre in the world.
    """

    position: FloatArray
    velocity: FloatArray


def shoe(sole: Sole) -> Shape:
    """The box in the foot link that meets the ball.

    It is as long and wide as the foot's plate and as high as the foot's shell.
    """
    length, width, height = sole.plate.size
    up = sole.rotation[:, 2]
    middle = sole.plate.position + 0.5 * (SHOE_HEIGHT - height) * up
    return Shape("box", (length, width, SHOE_HEIGHT), middle, sole.plate.rotation)


def ball_position(
    x: float, y: float, radius: float, ground: tuple[Prism, ...] = ()
) -> FloatArray:
    """Centre of a ball that lies on the highest point of the ground under it.

    Args:
        x: [m] in the world.
        y: [m] in the world.
        radius: Of the ball [m].
        ground: Prisms that rise above the floor.

    Returns:
        (3,) [m] in the world.

    Raises:
        NaoGaitError: x or y is not finite, or farther than 1 km.
    """
    place = Number(-FARTHEST, FARTHEST, "m")
    x, y = place.check("ball x", x), place.check("ball y", y)
    rim = np.linspace(0.0, 2.0 * math.pi, RIM_POINTS, endpoint=False)
    places = [(x, y), *((x + radius * math.cos(a), y + radius * math.sin(a)) for a in rim)]
    height = max(ground_height(ground, *place) for place in places)
    return np.array((x, y, height + radius))
