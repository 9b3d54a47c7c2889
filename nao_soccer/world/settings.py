"""Settings of the world model: what is on the field, and how the filters are tuned."""

import attrs

from nao_soccer.vision.settings import VisionSettings
from robot_core import schema
from robot_core.field import Field, Goals, Pole
from robot_core.schema import Settings, group, number

SIGHT = 3.5
"""[m] How far away a NAO's vision recognises most landmarks."""
BALL_DECELERATION = 0.3
"""[m/s^2] of a rolling ball; chosen, as the carpet of the simulation."""


@attrs.frozen
class WorldSettings(Settings):
    """What the world model needs to know besides its percepts."""

    field: Field = group(Field, Field(), "The field.")
    goals: Goals | None = schema.field(schema.Group(Goals), None, "The goals; null = none.")
    poles: tuple[Pole, ...] = schema.field(
        schema.Sequence(schema.Group(Pole)), (), "Landmarks beside the field."
    )
    particles: int = number(200, 20, 5000, "", "Number of particles.", whole=True)
    seed: int = number(0, 0, 2**31 - 1, "", "Seed of the particle filter.", whole=True)
    way_noise: float = number(
        0.02, 0.0, 1.0, "m/m^0.5", "Deviation of the odometry's place by the way."
    )
    heading_noise: float = number(
        0.06, 0.0, 1.0, "rad/m^0.5", "Deviation of the odometry's heading by the way."
    )
    unseen: float = number(
        10.0, 1.0, 300.0, "s", "Longest time without a landmark, for which the own pose is valid."
    )
    sight: float = number(SIGHT, 0.5, 50.0, "m", "Furthest landmark that is worth a look.")
    deviation: float = number(
        0.25, 0.05, 5.0, "m", "Largest standard deviation of a valid pose's place."
    )
    slowdown: float = number(
        BALL_DECELERATION, 0.0, 5.0, "m/s^2", "Deceleration of a rolling ball."
    )

    @classmethod
    def on(cls, scene: VisionSettings, seed: int) -> "WorldSettings":
        """On the field of a scene."""
        return cls(field=scene.field, goals=scene.goals, poles=scene.poles, seed=seed)
